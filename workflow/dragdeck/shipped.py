"""What dragdeck brings along: templates, plans, meshes, example studies and the workflow.

A wheel has them inside the package (``setup.py``), a clone at its root. A project needs none of
them: what it lacks is taken from here.
"""

from pathlib import Path

_INSIDE = Path(__file__).parent / "share"

SHIPPED = _INSIDE if _INSIDE.is_dir() else Path(__file__).parents[2]
"""The folder with ``templates/``, ``studies/``, ``meshes/``, ``config/`` and ``workflow/``."""


def own_or_shipped(root: Path, name: str) -> Path:
    """A file or folder of a project by its path from the root, or else that of dragdeck."""
    file = root / name
    return file if file.exists() else SHIPPED / name


def files() -> str:
    """The folder that `dragdeck files` prints."""
    return str(SHIPPED)
