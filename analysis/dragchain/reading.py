"""Any dump of the engine as frames or as a Parquet table, without a run folder.

`read_dump` gives the frames, `dump_to_parquet` writes them; both stream, and neither
needs a ``columns.json``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from dragchain.blocks import Batch, read_batches
from dragchain.case import Output, OutputKind
from dragchain.content import CODECS, Content
from dragchain.errors import DumpError
from dragchain.formats import Frame

_HEAD_BYTES = 1 << 16
_KINDS: dict[bytes, OutputKind] = {b"ENTRIES": "local", b"ATOMS": "custom"}


def read_dump(source: Path | str, columns: Sequence[str] | None = None) -> Iterator[Frame]:
    """Frames of a ``dump custom`` or ``dump local``, text or binary.

    Parameters
    ----------
    source : Path or str
        The file; or, of a dump of one frame a file, its pattern with ``*`` for the step.
        A name that ends in ``.bin`` is that of a binary dump; one that ends in ``.gz``,
        ``.zst``, ``.bz2`` or ``.lz4`` besides that of a compressed one.
    columns : sequence of str, optional
        Names of the columns. A binary dump does not hold them and needs them, in order;
        a text dump must have all of these, in any order. By default those of its header.

    Yields
    ------
    Frame
        In the order of the file, or of the steps in the names of the files. Columns
        named ``id``, ``type`` or ``..._id`` are int64, all others float64. Memory is
        bounded by the largest frame.

    Raises
    ------
    TruncatedDumpError
        If a file ends inside a frame.
    DumpError
        If there is no such file, it is not such a dump, or a number is not finite.
        Either error names file, frame and byte; the frames before have come by then.
    """
    files = dump_files(source)
    for batch in read_batches(files, _output(files[0], columns)):
        yield from batch.frames()


def dump_to_parquet(
    source: Path | str, target: Path | str, columns: Sequence[str] | None = None
) -> int:
    """Write the frames of a dump into one Parquet table, as they are read.

    Parameters
    ----------
    source, columns
        As in `read_dump`.
    target : Path or str
        The table: ``step``, then the dump's columns.

    Returns
    -------
    int
        The number of frames.

    Raises
    ------
    TruncatedDumpError, DumpError
        As in `read_dump`. The table then holds the frames before, as the error says.
    """
    from dragchain.parquet import TableWriter

    files = dump_files(source)
    output = _output(files[0], columns)
    frames, broken = 0, None
    with TableWriter(Path(target), ("step", *output.columns)) as table:
        try:
            for batch in read_batches(files, output):
                table.write({"step": _steps(batch), **batch.columns})
                frames += len(batch.steps)
        except DumpError as error:
            broken = error
    if broken is not None:
        broken.kept = f"{frames} frames, which are in {target}"
        raise broken
    return frames


def _steps(batch: Batch) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.repeat(batch.steps, batch.counts)


def dump_files(source: Path | str) -> list[Path]:
    """Files of a dump; those that ``*`` stands for in the order of their steps.

    Raises
    ------
    DumpError
        If there is none.
    """
    source = Path(source)
    before, star, after = source.name.partition("*")
    if not star:
        files = [source] if source.is_file() else []
    else:
        name = re.compile(re.escape(before) + r"([0-9]+)" + re.escape(after))
        found = [(name.fullmatch(file.name), file) for file in source.parent.glob(source.name)]
        files = [file for _, file in sorted((int(m.group(1)), file) for m, file in found if m)]
    if not files:
        raise DumpError(source, "there is no such file", remedy="check the name of the dump")
    return files


def _output(file: Path, columns: Sequence[str] | None) -> Output:
    """What a file holds, by its name and its first lines."""
    name = file.with_suffix("") if file.suffix in CODECS else file
    if name.suffix == ".bin":
        if columns is None:
            raise DumpError(
                file,
                "a binary dump does not say what its columns are",
                remedy="give their names in the order of the deck's dump command",
            )
        return Output(file.name, "custom", True, "", tuple(columns), None, 1, 0, None)
    kind, names = _header(file)
    return Output(file.name, kind, False, "", tuple(columns or names), None, 1, 0, None)


def _header(file: Path) -> tuple[OutputKind, list[str]]:
    """Kind of a text dump, and the names of its columns."""
    with Content(file) as content:
        head = bytearray(_HEAD_BYTES)
        lines = bytes(head[: content.fill(memoryview(head))]).split(b"\n", 9)
    words = lines[8].split() if len(lines) > 9 else []
    if len(words) < 3 or words[0] != b"ITEM:" or words[1] not in _KINDS:
        raise DumpError(
            file,
            f"found {lines[0][:60]!r}, and no names of columns",
            frame=0,
            offset=0,
            expected="the header of a text dump of LIGGGHTS",
            remedy="give a dump custom or a dump local; a binary one must be named .bin",
        )
    return _KINDS[words[1]], [word.decode("ascii", "replace") for word in words[2:]]
