"""What a file holds, compressed or not, as a stream of bytes."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

CODECS = {".gz": "gzip", ".zst": "zstd", ".bz2": "bz2", ".lz4": "lz4"}
"""Codec by the last suffix of a file's name."""

_CHUNK_BYTES = 4096
"""What is read at once of a compressed file: at most this much before damage is lost."""


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
        codec = CODECS.get(file.suffix)
        self.size = file.stat().st_size if codec is None else None
        self.damage: str | None = None
        self._position = 0
        self._chunk = None if codec is None else _CHUNK_BYTES
        self._stream: Any = open(file, "rb", buffering=0)  # noqa: SIM115
        if codec is not None:
            import pyarrow as pa

            self._stream = pa.CompressedInputStream(pa.PythonFile(self._stream, "r"), codec)

    def readable(self) -> bool:
        """Tell that it can be read."""
        return True

    def tell(self) -> int:
        """Bytes of the content that have been read."""
        return self._position

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer, or as much of it as one read gives; 0 at the end."""
        try:
            count = int(self._stream.readinto(memoryview(buffer)[: self._chunk]))
        except OSError as error:
            if self._chunk is None:
                raise
            self.damage, count = str(error), 0
        self._position += count
        return count

    def fill(self, buffer: memoryview) -> int:
        """Fill a buffer; less only where the content ends."""
        filled = 0
        while filled < len(buffer) and (count := self.readinto(buffer[filled:])):
            filled += count
        return filled

    def skip(self, count: int) -> None:
        """Leave out the next `count` bytes."""
        if self._chunk is None:
            self._position = self._stream.seek(self._position + count)
            return
        end, rest = self._position + count, memoryview(bytearray(_CHUNK_BYTES))
        while self._position < end and self.readinto(rest[: end - self._position]):
            pass

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
        super().close()
