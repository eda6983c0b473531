"""The folder of an export: whole or not there, and nobody's file is lost."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from dragchain.errors import ExportError
from dragchain.files import write_json

LIST = "export.json"
"""What an export is of, and all the files that it wrote."""

_ELSEWHERE = "name another folder with --out, or move this one away"


@contextmanager
def fresh_folder(target: Path, *, replace: bool) -> Iterator[Path]:
    """Give an empty folder whose files go to `target` once the block is over.

    After an exception nothing is left of it, and `target` is as it was.

    Parameters
    ----------
    target : Path
        The folder.
    replace : bool
        Whether an earlier export in `target` may go: the files that its list names,
        and no others.

    Raises
    ------
    ExportError
        If `target` holds anything else, or a file under the name of a new one.
    """
    target = target.resolve()
    old = _old_files(target, replace)
    draft = target.with_name(f".{target.name}.{os.getpid()}.part")
    draft.mkdir(parents=True)
    try:
        yield draft
        _move(draft, target, old)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def write_list(folder: Path, content: Mapping[str, object]) -> None:
    """Write what an export is of, with all files of its folder."""
    files = sorted(str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file())
    write_json(folder / LIST, {"schema": 2, **content, "files": files})


def _old_files(target: Path, replace: bool) -> set[str]:
    """What an earlier export wrote into `target`."""
    if target.exists() and not target.is_dir():
        raise ExportError(f"{target} is a file, not a folder\n  remedy: {_ELSEWHERE}")
    if not target.is_dir() or not any(target.iterdir()):
        return set()
    listed = target / LIST
    if not listed.is_file():
        raise ExportError(
            f"{target} holds files that are no export of dragchain\n  remedy: {_ELSEWHERE}"
        )
    if not replace:
        raise ExportError(
            f"{target} holds an export already\n  remedy: {_ELSEWHERE}, or replace it with"
            " --replace"
        )
    return {LIST, *_listed(listed)}


def _listed(file: Path) -> set[str]:
    """Read the names of an earlier export's files, all of them below its folder."""
    try:
        names = set(json.loads(file.read_text(encoding="utf-8"))["files"])
        paths = [Path(name) for name in names]
    except (ValueError, KeyError, TypeError) as error:
        raise ExportError(f"{file} does not list an export\n  remedy: {_ELSEWHERE}") from error
    if any(path.is_absolute() or ".." in path.parts for path in paths):
        raise ExportError(f"{file} names files of other folders\n  remedy: {_ELSEWHERE}")
    return names


def _move(draft: Path, target: Path, old: set[str]) -> None:
    """Put new files in the place of old ones."""
    new = sorted(file.relative_to(draft) for file in draft.rglob("*") if file.is_file())
    for file in new:
        if str(file) not in old and (target / file).exists():
            raise ExportError(
                f"{target / file} is in the way, and no earlier export wrote it\n"
                f"  remedy: {_ELSEWHERE}"
            )
    for name in old:
        (target / name).unlink(missing_ok=True)
    for folder in sorted((target / name).parent for name in old)[::-1]:
        if folder != target and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
    for file in new:
        (target / file).parent.mkdir(parents=True, exist_ok=True)
        os.replace(draft / file, target / file)
