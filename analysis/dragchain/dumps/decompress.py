"""What a file holds, compressed or not, as a stream of bytes."""

import bz2
import gzip
import io
import zlib
from pathlib import Path
from typing import Any

CODECS = (".gz", ".bz2", ".zst", ".lz4")
"""Last suffixes of the names of compressed files."""

_CHUNK_BYTES = 1 << 16


class Content(io.RawIOBase):
    """The content of a file, uncompressed if its name says that it is compressed.

    Where a compressed file is damaged or cut short its content ends, and `damage` says so.

    Parameters
    ----------
    file : Path
        The file.

    Attributes
    ----------
    size : int or None
        Length of the content in bytes; None if only reading it tells.
    damage : str or None
        What the decompressor says, once the content has ended too early.
    """

    def __init__(self, file: Path) -> None:
        self.size = None if file.suffix in CODECS else file.stat().st_size
        self.damage: str | None = None
        self._position = 0
        self._stream = _open(file)

    def readable(self) -> bool:
        """Tell that it can be read."""
        return True

    def tell(self) -> int:
        """Bytes of the content that have been read."""
        return self._position

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer, or as much of it as one read gives; 0 at the end."""
        count = self._stream.readinto(buffer) if self.size is not None else self._unpack(buffer)
        self._position += count
        return int(count)

    def _unpack(self, buffer: Any) -> int:
        """Read from a compressed file; a damaged one ends after what is good of it."""
        try:
            data = self._stream.read1(min(len(buffer), _CHUNK_BYTES))
        except (OSError, EOFError, zlib.error) as error:
            self.damage = str(error)
            return 0
        buffer[: len(data)] = data
        return len(data)

    def fill(self, buffer: memoryview) -> int:
        """Fill a buffer; less only where the content ends."""
        filled = 0
        while filled < len(buffer) and (count := self.readinto(buffer[filled:])):
            filled += count
        return filled

    def skip(self, count: int) -> None:
        """Leave out the next `count` bytes."""
        end, rest = self._position + count, memoryview(bytearray(_CHUNK_BYTES))
        if self.size is not None:
            self._position = self._stream.seek(end)
        while self._position < end and self.readinto(rest[: end - self._position]):
            pass

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
        super().close()


def _open(file: Path) -> Any:
    """Open a file; of a compressed one ``read1`` gives the content."""
    if file.suffix == ".gz":
        return gzip.open(file)
    if file.suffix == ".bz2":
        return bz2.open(file)
    if file.suffix in CODECS:
        import pyarrow as pa

        return pa.input_stream(str(file), compression="detect")
    return file.open("rb", buffering=0)
