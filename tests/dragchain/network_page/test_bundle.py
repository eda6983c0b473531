"""The script of network.html is what web/ builds."""

import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from paths import ROOT

WEB = ROOT / "web"
BUNDLE = ROOT / "analysis/dragchain/network_page/network.js"


def test_the_bundle_is_made_from_these_sources() -> None:
    own = [
        "../workflow/dragdeck/data/colours.json",
        "build.mjs",
        "package.json",
        "package-lock.json",
    ]
    total = hashlib.sha256()
    for name in sorted([*own, *(f"src/{file.name}" for file in (WEB / "src").iterdir())]):
        total.update(f"{name}\n".encode() + (WEB / name).read_bytes())
    recorded = re.match(r"/\*! sources: (\w+)\n", BUNDLE.read_text())
    assert recorded is not None
    assert recorded[1] == total.hexdigest(), "web/ was edited: call ./run web"


def test_the_bundle_is_what_npm_builds_here(tmp_path: Path) -> None:
    if not shutil.which("node") or not (WEB / "node_modules").is_dir():
        pytest.skip("node, or what `./run web` installs, is not here")
    built = tmp_path / "network.js"
    subprocess.run(["node", WEB / "build.mjs", built], check=True, capture_output=True)
    assert built.read_bytes() == BUNDLE.read_bytes()


def test_the_licences_of_its_libraries_stay_with_it() -> None:
    head = BUNDLE.read_text()[:3000]
    assert "three.js authors" in head and "Leon Sorokin" in head
    assert head.count("The MIT License") == 2
    assert (
        head.count("The above copyright notice and this permission notice shall be included") == 2
    )


def test_packages_are_pinned_and_name_no_registry() -> None:
    wanted = json.loads((WEB / "package.json").read_text())["devDependencies"]
    lock = json.loads((WEB / "package-lock.json").read_text())
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in wanted.values())
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    for name, version in wanted.items():
        assert packages[f"node_modules/{name}"]["version"] == version
    assert all("integrity" in entry and "resolved" not in entry for entry in packages.values())
    assert "://" not in (WEB / "package-lock.json").read_text()
