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


def sources() -> list[Path]:
    own = [WEB / name for name in ("build.mjs", "package.json", "package-lock.json")]
    return sorted([*own, *(WEB / "src").iterdir()], key=lambda file: str(file.relative_to(WEB)))


def test_the_bundle_is_made_from_these_sources() -> None:
    total = hashlib.sha256()
    for file in sources():
        total.update(f"{file.relative_to(WEB)}\n".encode() + file.read_bytes())
    recorded = re.match(r"/\*! sources: (\w+)\n", BUNDLE.read_text())
    assert recorded is not None
    assert recorded[1] == total.hexdigest(), "web/ was edited: call ./run web"


def test_the_bundle_is_what_npm_builds_here(tmp_path: Path) -> None:
    if not shutil.which("node") or not (WEB / "node_modules").is_dir():
        pytest.skip("node, or what `./run web` installs, is not here")
    built = tmp_path / "network.js"
    subprocess.run(["node", WEB / "build.mjs", built], check=True, capture_output=True)
    assert built.read_bytes() == BUNDLE.read_bytes()


def test_the_bundle_can_stand_in_a_script_element() -> None:
    assert not re.search(r"</script|<!--", BUNDLE.read_text(), re.IGNORECASE)


def test_the_licence_of_three_js_stays_with_it() -> None:
    head = BUNDLE.read_text()[:3000]
    assert "The MIT License" in head and "three.js authors" in head
    assert "The above copyright notice and this permission notice shall be included" in head


def test_packages_are_pinned_and_name_no_registry() -> None:
    wanted = json.loads((WEB / "package.json").read_text())["devDependencies"]
    lock = json.loads((WEB / "package-lock.json").read_text())
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in wanted.values())
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    for name, version in wanted.items():
        assert packages[f"node_modules/{name}"]["version"] == version
    assert all("integrity" in entry and "resolved" not in entry for entry in packages.values())
    assert "://" not in (WEB / "package-lock.json").read_text()
