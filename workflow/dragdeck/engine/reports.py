"""What is said while a run is on its way."""

import sys
from collections.abc import Callable

Report = Callable[[str], None]


def say(line: str) -> None:
    """Tell the user something on the way."""
    print(line, file=sys.stderr, flush=True)


def silent(line: str) -> None:
    """Report nothing: runs of a second or two."""


def shown_bytes(size: float) -> str:
    """A size in bytes, for a reader."""
    for unit in ("B", "kB", "MB"):
        if size < 999.5:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:,.1f} GB"
