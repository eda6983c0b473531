"""Dumps read fast: blocks of whole frames, parsed on all cores while the caller works.

Files are read a few megabytes at a time and cut between frames; compiled loops
(`parse_kernels`) turn each block into columns. They take frames of the plain form that
LIGGGHTS writes. From the first other frame on the rest of that file goes through
`careful_reader.read_carefully`, which reads whatever can be read, and says what cannot.
"""

import os
import struct
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Ints
from dragchain.dumps import parse_kernels as kernels
from dragchain.dumps.careful_reader import MAX_RANKS, read_carefully
from dragchain.dumps.decompress import Content
from dragchain.dumps.frame import Columns, Frame, Layout, is_integer_column

_BLOCK_BYTES = 1 << 19
"""What is read at once; a block grows until it holds a whole frame."""

HELD_BYTES = 1 << 26
"""Blocks are read ahead of the caller as long as they are smaller than this together."""

_PADDING = 64
_FIRST_LINE = b"ITEM: TIMESTEP\n"
_BOX_LINE = b"ITEM: BOX BOUNDS"
_HEAD_BYTES = 4096
_WIDEST_NUMBER = 32
_SMALLEST_FRAME = 64
_MOST_ROW_BYTES = 1 << 30

Bytes = NDArray[np.uint8]
Cells = NDArray[np.uint64]


@dataclass(frozen=True)
class Batch:
    """F consecutive frames of one file, R rows in all.

    Attributes
    ----------
    first : int
        Number of the first of the frames in its file, from 0.
    steps, counts : (F,) ndarray of int64
        Step and number of rows of each frame.
    columns : dict of str to (R,) ndarray
        The rows of all frames; see `Frame`.
    """

    first: int
    steps: Ints
    counts: Ints
    columns: Columns

    @classmethod
    def of(cls, frame: Frame, number: int) -> "Batch":
        """A batch of one frame."""
        return cls(number, np.array([frame.step]), np.array([frame.rows]), frame.columns)

    def frames(self) -> Iterator[Frame]:
        """The frames one by one; their columns are views of the batch's."""
        begin = 0
        spans = zip(self.steps.tolist(), self.counts.tolist(), strict=True)
        for number, (step, rows) in enumerate(spans, self.first):
            here = slice(begin, begin + rows)
            columns: Columns = {name: values[here] for name, values in self.columns.items()}
            yield Frame(step, columns, number == 0)
            begin += rows

    def steps_of_rows(self) -> Ints:
        """Step of each row, (R,)."""
        return np.repeat(self.steps, self.counts)


def read_frames(files: Iterable[Path], output: Layout) -> Iterator[Frame]:
    """Frames of files of one output; parameters and errors are those of `read_batches`."""
    for batch in read_batches(files, output):
        yield from batch.frames()


def read_batches(
    files: Iterable[Path], output: Layout, *, block_bytes: int = _BLOCK_BYTES
) -> Iterator[Batch]:
    """Frames of files of one output, in batches.

    Parameters
    ----------
    files : iterable of Path
        The files, one after the other.
    output : Layout
        What they hold.
    block_bytes : int
        Bytes to read at once.

    Yields
    ------
    Batch
        At least one frame each. Memory is bounded by `HELD_BYTES` and by the largest
        frame, not by the files.

    Raises
    ------
    TruncatedDumpError, DumpError
        As in `careful_reader.read_carefully`; the frames before have come by then.
    """
    blocks = (block for file in files for block in file_blocks(file, output, block_bytes))
    left: Path | None = None
    frame = 0
    for block, parsed in _parsed(blocks):
        if block.file == left:
            continue
        frame = frame if block.offset else 0
        if len(parsed.frames):
            yield parsed.batch(block, frame, output)
            frame += len(parsed.frames)
        if parsed.size < block.size or block.stuck:
            left = block.file
            start = block.offset + parsed.size
            for one in read_carefully(block.file, output, frame=frame, offset=start):
                yield Batch.of(one, frame)
                frame += 1


@dataclass(frozen=True)
class _Parsed:
    """What became of a block: the frames (F, 2), their cells (M, R), the bytes they take."""

    frames: Ints
    cells: Cells
    size: int

    def batch(self, block: "Block", first: int, output: Layout) -> Batch:
        assert block.form is not None
        steps, counts = self.frames.T
        rows = int(counts.sum())
        columns: Columns = {}
        for name, place in zip(output.columns, block.form.order, strict=True):
            cells = self.cells[place, :rows]
            whole = is_integer_column(name)
            columns[name] = cells.view(np.int64) if whole else cells.view(np.float64)
        return Batch(first, steps, counts, columns)


class _Form(ABC):
    """How frames of one file look.

    Parameters
    ----------
    output : Layout
        What the file holds.
    order : sequence of int
        Where in a row its columns stand.
    least_bytes : int
        Fewest bytes of a number.
    """

    def __init__(self, output: Layout, order: list[int], least_bytes: int) -> None:
        self.order = order
        self.whole = np.zeros(len(order), dtype=np.bool_)
        self.whole[order] = [is_integer_column(name) for name in output.columns]
        self._row_bytes = least_bytes * len(order)

    def room(self, size: int) -> tuple[Cells, Ints]:
        """Room for the cells and frames in so many bytes."""
        cells = np.empty((len(self.order), size // self._row_bytes), dtype=np.uint64)
        return cells, np.empty((size // _SMALLEST_FRAME + 1, 2), dtype=np.int64)

    @abstractmethod
    def whole_frames(self, buffer: Bytes, size: int) -> int:
        """How many of the bytes read are whole frames for sure."""

    @abstractmethod
    def possible(self, buffer: Bytes, size: int, rest: int | None) -> bool:
        """Whether the frame that begins here may become whole as `rest` more bytes come."""

    @abstractmethod
    def parse(self, buffer: Bytes, size: int, cells: Cells, frames: Ints) -> tuple[int, int]:
        """Read frames: how many, and how many bytes they take."""


class _Text(_Form):
    """A text dump whose frames all have the header of the first one."""

    def __init__(self, output: Layout, count_line: bytes, names_line: bytes) -> None:
        names = names_line.decode("ascii", "replace").split()[2:]
        super().__init__(output, [names.index(name) for name in output.header], 2)
        self._lines = tuple(
            np.frombuffer(line, dtype=np.uint8)
            for line in (_FIRST_LINE, count_line, _BOX_LINE, names_line)
        )

    @classmethod
    def of(cls, output: Layout, buffer: Bytes) -> "_Text | None":
        """Form of a file that begins like this; None if it is not this output."""
        lines = buffer[:_HEAD_BYTES].tobytes().split(b"\n", 9)
        noun = b"ENTRIES" if output.kind == "local" else b"ATOMS"
        if len(lines) < 10 or not lines[8].startswith(b"ITEM: " + noun + b" "):
            return None
        if sorted(lines[8].decode("ascii", "replace").split()[2:]) != sorted(output.header):
            return None
        return cls(output, lines[2] + b"\n", lines[8] + b"\n")

    def whole_frames(self, buffer: Bytes, size: int) -> int:
        return int(kernels.last_frame(_address(buffer), size, self._lines[0]))

    def possible(self, buffer: Bytes, size: int, rest: int | None) -> bool:
        rows = buffer[:_HEAD_BYTES].tobytes().split(b"\n", 4)[3]
        if not rows.isdigit():
            return False
        return size <= _HEAD_BYTES + int(rows) * len(self.order) * _WIDEST_NUMBER

    def parse(self, buffer: Bytes, size: int, cells: Cells, frames: Ints) -> tuple[int, int]:
        lines = self._lines
        done, end = kernels.text_frames(_address(buffer), size, lines, self.whole, cells, frames)
        return int(done), int(end)


class _Binary(_Form):
    """A binary dump."""

    def __init__(self, output: Layout) -> None:
        super().__init__(output, list(range(len(output.columns))), 8)

    def whole_frames(self, buffer: Bytes, size: int) -> int:
        return int(kernels.whole_binary_frames(_address(buffer), size, len(self.order)))

    def possible(self, buffer: Bytes, size: int, rest: int | None) -> bool:
        step, rows, tilted = struct.unpack_from("<qqi", buffer.data)
        width, ranks = struct.unpack_from("<ii", buffer.data, 92 + 24 * (tilted == 1))
        plain = step >= 0 and rows >= 0 and tilted in (0, 1) and 1 <= ranks <= MAX_RANKS
        if not plain or width != len(self.order):
            return False
        missing = 8 * rows * width - size
        most = _MOST_ROW_BYTES if rest is None else rest
        return bool(-_HEAD_BYTES - 4 * ranks < missing <= most)

    def parse(self, buffer: Bytes, size: int, cells: Cells, frames: Ints) -> tuple[int, int]:
        done, end = kernels.binary_frames(_address(buffer), size, self.whole, cells, frames)
        return int(done), int(end)


def _address(buffer: Bytes) -> np.uint64:
    return np.uint64(buffer.ctypes.data)


@dataclass(frozen=True)
class Block:
    """Bytes of a file that begin with a frame.

    Attributes
    ----------
    file : Path
        The file.
    offset : int
        Where in its content the block begins.
    buffer : (L,) ndarray of uint8
        The bytes, with some of the next block and `_PADDING` zeros after them.
    size : int
        How many of them are the block's.
    form : _Form
        How the file's frames look; None if not as this output's do.
    stuck : bool
        Whether only `read_carefully` can tell what comes after this block.
    """

    file: Path
    offset: int
    buffer: Bytes
    size: int
    form: _Form | None
    stuck: bool

    def room(self) -> tuple[Cells, Ints]:
        """Room for the block's cells and frames."""
        if self.form is None:
            return np.empty((0, 0), dtype=np.uint64), np.empty((0, 2), dtype=np.int64)
        return self.form.room(self.size)

    def parse(self, cells: Cells, frames: Ints) -> _Parsed:
        """Read the block's frames."""
        if self.form is None:
            return _Parsed(frames, cells, 0)
        done, size = self.form.parse(self.buffer, self.size, cells, frames)
        return _Parsed(frames[:done], cells, size)


def file_blocks(file: Path, output: Layout, block_bytes: int = _BLOCK_BYTES) -> Iterator[Block]:
    """The blocks of a file; each but the last is cut before a frame."""
    held, offset, more = np.empty(0, dtype=np.uint8), 0, block_bytes
    form: _Form | None = _Binary(output) if output.binary else None
    with Content(file) as content:
        while True:
            room = len(held) + more
            buffer = np.empty(room + _PADDING, dtype=np.uint8)
            buffer[: len(held)] = held
            size = len(held) + content.fill(buffer.data[len(held) : room])
            buffer[size : size + _PADDING] = 0
            form = form or _Text.of(output, buffer[:size])
            if form is None:
                broken = size > 0 or content.damage is not None
                yield Block(file, offset, buffer, 0, form, stuck=broken)
                return
            if size < room:
                yield Block(file, offset, buffer, size, form, stuck=content.damage is not None)
                return
            cut = form.whole_frames(buffer, size)
            rest = None if content.size is None else content.size - offset - size
            stuck = cut == 0 and not form.possible(buffer, size, rest)
            if cut or stuck:
                yield Block(file, offset, buffer, cut, form, stuck)
            if stuck:
                return
            held, offset = buffer[cut:size], offset + cut
            more = block_bytes if cut else size


def _parsed(blocks: Iterator[Block]) -> Iterator[tuple[Block, _Parsed]]:
    """The blocks with what is in them, parsed in other threads while the caller works."""
    waiting: deque[tuple[Block, Future[_Parsed]]] = deque()
    cores = len(os.sched_getaffinity(0))
    pool = ThreadPoolExecutor(cores)
    try:
        for block in blocks:
            waiting.append((block, pool.submit(block.parse, *block.room())))
            while len(waiting) > 1 and _is_enough(waiting, cores):
                first, parsed = waiting.popleft()
                yield first, parsed.result()
        for last, parsed in waiting:
            yield last, parsed.result()
    finally:
        pool.shutdown(cancel_futures=True)


def _is_enough(waiting: deque[tuple[Block, Future[_Parsed]]], cores: int) -> bool:
    held = sum(len(block.buffer) for block, _ in waiting)
    return held > HELD_BYTES or len(waiting) > 2 * cores
