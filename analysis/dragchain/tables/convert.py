"""Any dump of LIGGGHTS as a Parquet table."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dragchain.tables.parquet import table_writer
from dragdeck.dumps.reader import dump_files, layout_of, read_frames
from dragdeck.errors import DumpError


def dump_to_parquet(
    source: Path | str, target: Path | str, columns: Sequence[str] | None = None
) -> int:
    """Convert a dump to one Parquet table, frame by frame.

    Parameters
    ----------
    source : Path or str
        As in `read_dump`.
    target : Path or str
        Parquet file to write, with the column ``step`` and those of the dump.

    Returns
    -------
    int
        The number of frames.

    Raises
    ------
    TruncatedDumpError, DumpError
        As in `read_dump`. The table then contains the frames before the error.
    """
    files = dump_files(source)
    output = layout_of(files[0], columns)
    frames, broken = 0, None
    with table_writer(Path(target), ("step", *output.columns)) as table:
        try:
            for frame in read_frames(files, output):
                table.write({"step": np.full(frame.rows, frame.step), **frame.columns})
                frames += 1
        except DumpError as error:
            broken = error
    if broken is not None:
        broken.kept = f"{frames} frames, which are in {target}"
        raise broken
    return frames
