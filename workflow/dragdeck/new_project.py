"""A project folder for an installed dragdeck: `dragdeck init`."""

import shutil
from pathlib import Path

from dragdeck.errors import InputError
from dragdeck.shipped import SHIPPED

_PARTS = {
    "workflow/project": "",
    "profiles": "profiles",
    "studies/quickstart": "studies/quickstart",
}
"""What a project starts with: folders of `SHIPPED`, and where they go."""


def init(folder: Path) -> str:
    """Write the files of a project into a folder, and return what to do next.

    Raises
    ------
    InputError
        One of the files is there already; nothing is written.
    """
    copies = {
        folder / place / file.relative_to(SHIPPED / part): file
        for part, place in _PARTS.items()
        for file in sorted((SHIPPED / part).rglob("*"))
        if file.is_file()
    }
    existing = [file for file in copies if file.exists()]
    if existing:
        raise InputError(
            "nothing is overwritten",
            file=folder,
            value=", ".join(str(file.relative_to(folder)) for file in existing),
            remedy="name a new folder, or remove these files",
        )
    for file, original in copies.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(original, file)
    return f"{folder}: change into it, then run: ./run all --config study=quickstart"
