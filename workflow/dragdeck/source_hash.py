"""A hash of the code behind a module, so that Snakemake notices an edit.

Snakemake tracks files and parameters, not imported modules. A rule that gives
this hash as a parameter runs again when any module that its command imports, or a
record that one of them names, was edited, and only then.
"""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

_PACKAGES = ("dragdeck", "dragchain")
"""The packages that others of this project may import."""


def source_hash(*modules: str) -> str:
    """Hash of the given modules, all they import from this project, and the data they read.

    These are the tables beside them, and the files that they name of the package's ``data/``.

    Parameters
    ----------
    *modules : str
        Dotted names, for example ``dragchain.tables``.

    Returns
    -------
    str
        12 hex digits.
    """
    total, data, files = hashlib.sha256(), set[Path](), source_files(*modules)
    for name, file in sorted(files.items()):
        code = file.read_bytes()
        total.update(name.encode() + code)
        data |= _tables(file.parent)
        data |= {known for known in _records(name) if f'{known.name}"'.encode() in code}
    for read in sorted(data):
        total.update(read.read_bytes())
    return total.hexdigest()[:12]


def source_files(*modules: str) -> dict[str, Path]:
    """The files of the given modules and of all they import from this project."""
    source_files: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        file = _file(name)
        if name in source_files or file is None:
            continue
        source_files[name] = file
        waiting.extend(_imports(file, name.partition(".")[0]))
    return source_files


@cache
def _file(name: str) -> Path | None:
    """The file of a module, found without importing what it stands in; None for another name."""
    package, *inner = name.split(".")
    folder = _folder(package)
    if folder is None:
        return None
    place = folder.joinpath(*inner)
    files = (place / "__init__.py", place.with_suffix(".py"))
    return next((file for file in files if file.is_file()), None)


@cache
def _folder(package: str) -> Path | None:
    top = find_spec(package)
    return None if top is None or top.origin is None else Path(top.origin).parent


@cache
def _tables(folder: Path) -> frozenset[Path]:
    return frozenset(folder.glob("*.csv"))


@cache
def _records(module: str) -> tuple[Path, ...]:
    """The files in the folder ``data/`` of a module's package."""
    folder = _folder(module.partition(".")[0])
    return tuple(folder.glob("data/*.*")) if folder else ()


@cache
def _imports(file: Path, package: str) -> tuple[str, ...]:
    packages = {package, *_PACKAGES}
    return tuple(name for name in _imported(file) if name.partition(".")[0] in packages)


_BLOCKS = ("body", "orelse", "handlers", "finalbody", "cases")
"""Where a statement has others inside; no expression imports anything."""


def _imported(file: Path) -> Iterator[str]:
    statements: list[ast.AST] = [ast.parse(file.read_bytes())]
    for node in statements:
        statements += (child for block in _BLOCKS for child in getattr(node, block, ()))
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
