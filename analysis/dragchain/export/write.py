"""Export of a run: frame by frame, into a folder of its own."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dragchain.errors import ExportError
from dragchain.export.frames import FrameSeries
from dragchain.export.paraview import FILES, MAIN, write_paraview
from dragchain.tables.run_folder import Run


@contextmanager
def fresh_folder(target: Path, *, replace: bool) -> Iterator[Path]:
    """Give an empty folder whose files go to `target` once the block is over.

    After an exception nothing is left of it, and `target` is as it was.

    Parameters
    ----------
    target : Path
        The folder.
    replace : bool
        Whether `FILES` of an earlier export in `target` may go; others stay.

    Raises
    ------
    ExportError
        If `target` holds anything else than an export.
    """
    target = target.resolve()
    remedy = "remedy: name another folder with --out, or move this one away"
    if target.exists() and not target.is_dir():
        raise ExportError(f"{target} is a file, not a folder\n  {remedy}")
    old = [target / name for name in FILES if (target / name).exists()]
    if target.is_dir() and any(target.iterdir()) and not old:
        raise ExportError(
            f"{target} contains files that are not an export of dragchain\n  {remedy}"
        )
    if old and not replace:
        raise ExportError(f"{target} already contains an export\n  {remedy}, or use --replace")
    draft = target.with_name(f".{target.name}.{os.getpid()}.part")
    draft.mkdir(parents=True)
    try:
        yield draft
        for path in old:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        target.mkdir(exist_ok=True)
        for path in draft.iterdir():
            os.replace(path, target / path.name)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def write_export(
    run_dir: Path,
    out: Path | None = None,
    from_time: float | None = None,
    to_time: float | None = None,
    every: int = 1,
    replace: bool = False,
) -> str:
    """Write the frames of a run for ParaView, of which at most one is in memory.

    Parameters
    ----------
    run_dir : Path
        Folder of a filling or process run with its tables.
    out : Path, optional
        Folder for the export, new or empty; ``export/paraview`` in the run's folder if None.
    from_time, to_time, every
        The frames; see `FrameSeries.of`.
    replace : bool
        Whether an earlier export in `out` may be replaced.

    Returns
    -------
    str
        The number of frames, and the file to open.

    Raises
    ------
    DocumentError, TableError
        If the run folder or a table cannot be used.
    ExportError
        If there is nothing to export, or something in its place.
    """
    run = Run.open(run_dir)
    series = FrameSeries.of(run, from_time, to_time, every)
    target = run.folder / "export" / "paraview" if out is None else out
    with fresh_folder(target, replace=replace) as folder:
        write_paraview(folder, series)
    return f"{len(series)} frames: {target / MAIN}"
