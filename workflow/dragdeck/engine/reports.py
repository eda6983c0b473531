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


def shown_time(seconds: float) -> str:
    """A duration, for a reader."""
    whole = round(seconds)
    for unit, name, part, of_it in (
        (86400, "d", 3600, "h"),
        (3600, "h", 60, "min"),
        (60, "min", 1, "s"),
    ):
        if whole >= unit:
            return f"{whole // unit} {name} {whole % unit // part:02d} {of_it}"
    return f"{seconds:.2g} s" if seconds < 10 else f"{whole} s"


def printable(text: str) -> str:
    """A text without control characters, apart from tabs and ends of lines."""
    return "".join(char for char in text if char.isprintable() or char in "\n\t")
