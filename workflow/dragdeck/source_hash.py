"""A hash of the code behind a module, so that Snakemake notices an edit.

Snakemake tracks files and parameters, not imported modules. A rule that gives
this hash as a parameter runs again when any module that its command imports
was edited, and only then.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path


def source_hash(*modules: str) -> str:
    """Hash of the given modules and all they import from their own packages.

    Parameters
    ----------
    *modules : str
        Dotted names, for example ``dragchain.tables``.

    Returns
    -------
    str
        12 hex digits.
    """
    total = hashlib.sha256()
    for name, file in sorted(source_files(*modules).items()):
        total.update(name.encode() + file.read_bytes())
    return total.hexdigest()[:12]


def source_files(*modules: str) -> dict[str, Path]:
    """The files of the given modules and of all they import from their own packages."""
    found: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        file = _file(name)
        if name in found or file is None:
            continue
        found[name] = file
        waiting.extend(_imports(file, name.partition(".")[0]))
    return found


def _file(name: str) -> Path | None:
    try:
        spec = find_spec(name)
    except ModuleNotFoundError:  # `from package import function`: not a module
        return None
    return Path(spec.origin) if spec is not None and spec.origin is not None else None


def _imports(file: Path, package: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        else:
            continue
        yield from (name for name in names if name.partition(".")[0] == package)
