"""The frames of any dump of LIGGGHTS, without a run folder and its ``columns.json``."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from dragchain.dumps.decompress import CODECS, Content
from dragchain.dumps.fast_reader import read_frames
from dragchain.dumps.frame import Frame
from dragchain.errors import DumpError

_HEAD_BYTES = 1 << 16
_KINDS = {b"ENTRIES": "local", b"ATOMS": "custom"}


def read_dump(source: Path | str, columns: Sequence[str] | None = None) -> Iterator[Frame]:
    """Read the frames of a ``dump custom`` or ``dump local``, text or binary.

    Parameters
    ----------
    source : Path or str
        The file; or, for a dump with one file per frame, its pattern with ``*`` for the step.
        The ending ``.bin`` marks a binary dump; an additional ``.gz``, ``.zst``, ``.bz2`` or
        ``.lz4`` marks a compressed one.
    columns : sequence of str, optional
        Names of the columns: required for a binary dump, in the order of its dump command; a text
        dump must contain all of them, in any order. By default those in its header.

    Yields
    ------
    Frame
        In the order of the file, or of the steps in the names of the files. Columns
        named ``id``, ``type`` or ``..._id`` are int64, all others float64. At most one frame is in
        memory.

    Raises
    ------
    TruncatedDumpError
        If a file ends inside a frame.
    DumpError
        If there is no such file, it is not such a dump, or a number is not finite. Both errors
        name file, frame and byte; the frames before it have been yielded by then.
    """
    files = dump_files(source)
    yield from read_frames(files, layout_of(files[0], columns))


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


@dataclass(frozen=True)
class DumpLayout:
    """What a single dump says of itself; see `dragchain.dumps.frame.Layout`."""

    kind: str
    columns: tuple[str, ...]
    binary: bool = False

    @property
    def header(self) -> tuple[str, ...]:
        """The columns, which have the names that LIGGGHTS gives them."""
        return self.columns


def layout_of(file: Path, columns: Sequence[str] | None) -> DumpLayout:
    """Layout of a dump file, from its name and first lines.

    Raises
    ------
    DumpError
        If it is no dump, or columns of a binary one are not given, or one comes twice.
    """
    name = file.with_suffix("") if file.suffix in CODECS else file
    kind, names = ("custom", []) if name.suffix == ".bin" else _header(file)
    wanted = tuple(columns or names)
    if not wanted:
        raise DumpError(
            file,
            "a binary dump does not contain the names of its columns",
            remedy="give their names in the order of the dump command in the input script",
        )
    if len(set(wanted)) < len(wanted):
        raise DumpError(file, f"a column is given twice: {' '.join(wanted)}")
    return DumpLayout(kind, wanted, binary=name.suffix == ".bin")


def _header(file: Path) -> tuple[str, list[str]]:
    """Kind of a text dump, and the names of its columns."""
    with Content(file) as content:
        head = bytearray(_HEAD_BYTES)
        lines = bytes(head[: content.fill(memoryview(head))]).split(b"\n", 9)
    words = lines[8].split() if len(lines) > 9 else []
    if len(words) < 3 or words[0] != b"ITEM:" or words[1] not in _KINDS:
        raise DumpError(
            file,
            f"found {lines[0][:60]!r}, but no names of columns",
            frame=0,
            offset=0,
            expected="the header of a text dump of LIGGGHTS",
            remedy="give a file of dump custom or dump local; the name of a binary file "
            "must end with .bin",
        )
    return _KINDS[words[1]], [word.decode("ascii", "replace") for word in words[2:]]
