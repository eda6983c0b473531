"""A place in a dump: bytes and lines from there on, and what is wrong there."""

import gzip
import io
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn, Self, cast

import numpy as np

from dragdeck.dumps.frame import Layout
from dragdeck.errors import DumpError, TruncatedDumpError

BUFFER_BYTES = 1 << 18
_PIECE_BYTES = 1 << 24
_LONGEST_LINE = 1 << 20
_MOST_DIGITS = 18
"""Digits of a count or a step that fits into 64 bits, whatever they are."""


class Cursor:
    """An open output file, and the frame or row that begins at a place in it.

    Parameters
    ----------
    file : Path
        An ending ``.gz`` marks a compressed one.
    layout : Layout
        What it holds.
    offset : int
        Where the first frame to be read begins.

    Attributes
    ----------
    size : int
        Length of the content in bytes.
    width : int
        Numbers in a row.
    frame, offset : int
        Number of the frame (of the data row in a ``fix print`` file), and where it begins.
    """

    def __init__(self, file: Path, layout: Layout, offset: int = 0) -> None:
        self.file, self.layout, self.frame, self.offset = file, layout, 0, offset
        self.width = len(layout.columns)
        opened = gzip.GzipFile if file.suffix == ".gz" else io.FileIO
        self._stream = io.BufferedReader(cast(io.RawIOBase, opened(file)), BUFFER_BYTES)
        try:
            self.size = self._stream.seek(0, io.SEEK_END)
        except (OSError, EOFError, zlib.error) as error:
            raise DumpError(
                file, f"this is not a whole gzip file: {error}", remedy="compress it again"
            ) from error
        self._stream.seek(offset)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    @property
    def place(self) -> int:
        """Bytes of the content up to what comes next."""
        return self._stream.tell()

    @property
    def left(self) -> int:
        """Bytes that come next."""
        return self.size - self.place

    def frames(self) -> Iterator[int]:
        """Number of each frame that begins where the one before it ended."""
        while self.next_bytes():
            self.offset = self.place
            yield self.frame
            self.frame += 1
        self.offset = self.place

    def next_bytes(self) -> bytes:
        """Some of the bytes that come next; none at the end."""
        return self._stream.peek(1)

    def take(self, count: int, what: str) -> bytes:
        """The next bytes; what a damaged file claims to hold is never allocated at once."""
        data = bytearray()
        while piece := self._stream.read(min(count - len(data), _PIECE_BYTES)):
            data += piece
        if len(data) < count:
            self.cut_short(what)
        return bytes(data)

    def skip(self, count: int, what: str) -> None:
        """Go on after the next bytes."""
        if count > self.left:
            self.cut_short(what)
        self._stream.seek(self.place + count)

    def lines(self, count: int) -> Iterator[bytes]:
        """The next lines in pieces of whole ones; the last line may be cut at the end."""
        while count and (held := self.next_bytes()):
            whole_lines = held.count(b"\n")
            if whole_lines > count:
                ends = np.flatnonzero(np.frombuffer(held, np.uint8) == ord("\n"))
                piece = self._stream.read(int(ends[count - 1]) + 1)
            elif whole_lines:
                piece = self._stream.read(held.rindex(b"\n") + 1)
            else:
                piece = self._stream.readline(_LONGEST_LINE)
            yield piece
            if not piece.endswith(b"\n"):
                return
            count -= piece.count(b"\n")

    def line(self, what: str) -> str:
        """The next line."""
        data = self._stream.readline(_LONGEST_LINE)
        if not data.endswith(b"\n") and len(data) < _LONGEST_LINE:
            self.cut_short(what)
        if not data.isascii():
            self.fail(f"found bytes that are not text: {data[:40]!r}", what)
        return data.decode().rstrip()

    def item(self, what: str, *before: str) -> str:
        """The next line, which must begin so; other items before it, of a line, are passed over."""
        line = self.line(f"ITEM: {what}")
        while line in [f"ITEM: {name}" for name in before]:
            self.line("a line")
            line = self.line(f"ITEM: {what}")
        if not line.startswith(f"ITEM: {what}"):
            self.fail(f"found {line[:60]!r}", f"a line that begins with 'ITEM: {what}'")
        return line

    def whole_number(self, what: str) -> int:
        """The next line, which must be a count."""
        line = self.line(what)
        if not line.isdigit() or len(line) > _MOST_DIGITS:
            self.fail(f"found {line[:60]!r}", what)
        return int(line)

    def fail(self, problem: str, expected: str) -> NoReturn:
        """Say what is wrong with this frame or row."""
        raise DumpError(
            self.file,
            problem,
            frame=self.frame,
            offset=self.offset,
            expected=expected,
            kept=self._kept,
            remedy="check that the file is complete; otherwise write it again: repeat the run",
        )

    def cut_short(self, expected: str) -> NoReturn:
        """Say that the file ends within this frame or row."""
        thing = "row" if self.layout.kind == "print" else "frame"
        raise TruncatedDumpError(
            self.file,
            f"the file ends after {self.size} bytes, inside this {thing};"
            f" the {thing}s before it are intact",
            frame=self.frame,
            offset=self.offset,
            expected=expected,
            kept=self._kept,
            remedy="use the frames before it, or write the file again"
            if self.layout.foreign
            else "resume the run from its last checkpoint, or repeat it",
        )

    @property
    def _kept(self) -> str | None:
        """Which frames have been read; the rows of a ``fix print`` file come in blocks."""
        if self.layout.kind == "print":
            return None
        return f"the {self.frame} frames before it" if self.frame else "no frame stands before it"
