"""Export of a run: frame by frame, into a folder of its own."""

import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePath

from pydantic import field_validator

from dragchain.errors import ExportError
from dragchain.export import paraview, xyz
from dragchain.export.frames import FrameData, FrameSeries, Selection
from dragchain.tables.run_folder import Run
from dragdeck.documents import Document
from dragdeck.errors import DocumentError

LIST = "export.json"

_ELSEWHERE = "name another folder with --out, or move this one away"


class ExportFile(Document):
    """What an export is of, and all the files that it wrote: ``export.json``."""

    remedy = "make it with: ./run dragchain export"

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


def _files_in(folder: Path) -> list[Path]:
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
    new = _files_in(draft)
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


Report = Callable[[str], object]

_FORMATS: dict[str, tuple[str, Callable[[Path, FrameSeries, Iterable[FrameData]], None]]] = {
    "paraview": (paraview.MAIN, paraview.write_paraview),
    "xyz": (xyz.MAIN, xyz.write_xyz),
}
"""The file to open and the writer of each format; it takes one frame after another."""


@dataclass(frozen=True)
class Exported:
    """What was written: the file to open, frames, and bytes on disk."""

    file: Path
    frames: int
    size: int


def write_export(
    run_dir: Path | str,
    to: str,
    out: Path | None = None,
    selection: Selection | None = None,
    *,
    replace: bool = False,
    report: Report = lambda text: None,
) -> Exported:
    """Write the frames of a run for another program.

    At most one frame is in memory. Before the second frame, the expected total size is reported;
    an export that does not fit on the disk is refused.

    Parameters
    ----------
    run_dir : Path or str
        Folder of a filling or process run with its tables.
    to : str
        ``paraview`` or ``xyz``.
    out : Path, optional
        Folder for the export, new or empty; ``export/<to>`` in the run's folder if None.
    selection : Selection, optional
        The frames; all if None.
    replace : bool
        Whether an earlier export in `out` may be replaced.
    report : callable
        Receives messages for the user.

    Returns
    -------
    Exported
        What was written.

    Raises
    ------
    DocumentError, TableError
        If the run folder or a table cannot be used.
    ExportError
        If there is nothing to export, no room for it, or something in its place.
    """
    if to not in _FORMATS:
        raise ExportError(f"unknown format {to!r}; known: {', '.join(_FORMATS)}")
    main, write = _FORMATS[to]
    run = Run.open(run_dir)
    series = FrameSeries.of(run, Selection() if selection is None else selection)
    target = run.folder / "export" / to if out is None else out
    with fresh_folder(target, replace=replace) as folder:
        write(folder, series, _foreseen(series, folder, report))
        size = _size(folder)
        _list(folder, to, series, size).write(folder / LIST)
    return Exported(target / main, len(series), size)


def _foreseen(series: FrameSeries, folder: Path, report: Report) -> Iterator[FrameData]:
    """Yield the frames; tell the size from that of the first, for which there must be room."""
    for number, frame_data in enumerate(series):
        yield frame_data
        if number > 0:
            continue
        size, free = len(series) * _size(folder), shutil.disk_usage(folder).free
        report(f"{len(series)} frames, about {size / 1e6:.1f} MB")
        if size > free:
            raise ExportError(
                f"{folder.parent}: not enough free disk space for {len(series)} frames\n"
                f"  value:  about {size / 1e6:.0f} MB\n"
                f"  limit:  {free / 1e6:.0f} MB are free\n"
                "  remedy: export fewer with --every, --from-time and --to-time, or name a folder"
                " on another disk with --out"
            )


def _size(folder: Path) -> int:
    """The size of all files of a folder, in bytes."""
    return sum((folder / file).stat().st_size for file in _files_in(folder))


def _list(folder: Path, to: str, series: FrameSeries, size: int) -> ExportFile:
    case = series.run.case
    return ExportFile(
        format=to,
        study=case.study_name,
        scene=case.scene,
        run=case.run,
        frames=len(series),
        first_time_s=float(series.times_s[0]),
        last_time_s=float(series.times_s[-1]),
        bytes=size,
        files=tuple(map(str, _files_in(folder))),
    )


def export_command(
    run_dir: Path,
    to: str,
    out: Path | None,
    from_time: float | None,
    to_time: float | None,
    every: int,
    replace: bool,
) -> str:
    """Export frames as the command line asks for; what to say at the end."""
    selection = Selection(from_time, to_time, every)
    done = write_export(run_dir, to, out, selection, replace=replace, report=print)
    return f"{done.frames} frames, {done.size / 1e6:.1f} MB: {done.file}"
