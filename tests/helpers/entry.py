"""A copy of the project's entry, with an environment that it takes for its own."""

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from paths import ROOT

_PARTS = ("run.sh", "usage.txt", "usage_of_clone.txt")
_PINS = ("pyproject.toml", "constraints.txt")


def write_entry(folder: Path, extras: Sequence[str] = ()) -> Path:
    """Copy the script ``run`` and what it was set up from; return the folder for its programs."""
    (folder / "workflow").mkdir(exist_ok=True)
    for name in ("run", *(f"workflow/{name}" for name in _PARTS), *_PINS):
        if not (folder / name).exists():
            shutil.copy2(ROOT / name, folder / name)
    pins = b"".join((ROOT / name).read_bytes() for name in _PINS)
    checksum = subprocess.run(["cksum"], input=pins, capture_output=True, check=True).stdout
    stamp = [str(folder.resolve()), checksum.decode().strip(), *extras, ""]
    programs = folder / ".venv/bin"
    programs.mkdir(parents=True)
    (folder / ".venv/dragdeck-stamp").write_text("\n".join(stamp))
    return programs
