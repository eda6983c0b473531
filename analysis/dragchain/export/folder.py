"""The folder of an export: whole or not there, and nobody's file is lost."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath

from pydantic import field_validator

from dragchain.errors import ExportError
from dragdeck.documents import Document
from dragdeck.errors import DocumentError

LIST = "export.json"

_ELSEWHERE = "name another folder with --out, or move this one away"


class ExportFile(Document):
    """What an export is of, and all the files that it wrote: ``export.json``."""

    remedy = "make it with: dragchain export"

    format: str
    study: str
    scene: str
    run: str
    frames: int
    first_time_s: float
    last_time_s: float
    bytes: int
    files: tuple[str, ...]

    @field_validator("files")
    @classmethod
    def _below_its_folder(cls, files: tuple[str, ...]) -> tuple[str, ...]:
        paths = [PurePath(name) for name in files]
        assert not any(path.is_absolute() or ".." in path.parts for path in paths), (
            "it names files of other folders"
        )
        return files


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


def files_in(folder: Path) -> list[Path]:
    """All files of a folder and its folders, relative to it, in the order of their names."""
    files = (file.relative_to(folder) for file in folder.rglob("*") if file.is_file())
    return sorted(files, key=str)


def _old_files(target: Path, replace: bool) -> set[str]:
    """What an earlier export wrote into `target`."""
    if target.exists() and not target.is_dir():
        raise ExportError(f"{target} is a file, not a folder\n  remedy: {_ELSEWHERE}")
    if not target.is_dir() or not any(target.iterdir()):
        return set()
    listed = target / LIST
    if not listed.is_file():
        raise ExportError(
            f"{target} contains files that are not an export of dragchain\n  remedy: {_ELSEWHERE}"
        )
    if not replace:
        raise ExportError(
            f"{target} already contains an export\n  remedy: {_ELSEWHERE}, or replace it with"
            " --replace"
        )
    try:
        return {LIST, *ExportFile.read(listed).files}
    except DocumentError as error:
        raise ExportError(f"{error}\n  or:     {_ELSEWHERE}") from None


def _move(draft: Path, target: Path, old: set[str]) -> None:
    """Put new files in the place of old ones."""
    new = files_in(draft)
    for file in new:
        if str(file) not in old and (target / file).exists():
            raise ExportError(
                f"{target / file} already exists and does not belong to an earlier export\n"
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
