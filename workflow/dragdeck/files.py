"""Files that are either whole or not there."""

import csv
import errno
import fcntl
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

FULL_DISK = {errno.ENOSPC, errno.EDQUOT}
"""Numbers of the errors of a full disk, and of a user who may not write more."""


def file_checksum(file: Path) -> str:
    """SHA-256 of a file's bytes, as hex digits."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


def text_of(content: bytes) -> str:
    """The text of a file, whatever program wrote it, with plain line ends."""
    coding = next((name for mark, name in _MARKS.items() if content.startswith(mark)), "utf-8")
    try:
        text = content.decode(coding)
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def table_rows(file: Path) -> list[dict[str, str]]:
    """The rows of a CSV file of the packages, by the names in its first line."""
    with file.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@contextmanager
def draft_of(file: Path) -> Iterator[Path]:
    """A path to write to; what was written takes the file's place when the block ends.

    If the block ends in an exception, nothing is left behind, and an older file of that name
    stays as it was.

    Raises
    ------
    OSError
        It cannot be written; the error names the file.
    """
    draft = file.with_name(f".{file.name}.{os.getpid()}")
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        yield draft
        draft.replace(file)
    except OSError as error:
        if error.errno is not None and error.filename in (None, str(draft)):
            error.filename = str(file)  # a full disk says so of a stream, which has no name
        raise
    finally:
        draft.unlink(missing_ok=True)


def write_text(file: Path, text: str) -> None:
    """Write a text file in one step: readers see the old version or the new one."""
    write_bytes(file, text.encode())


def write_bytes(file: Path, content: bytes) -> None:
    """Write a file in one step: readers see the old version or the new one."""
    with draft_of(file) as draft:
        draft.write_bytes(content)


def write_vtp(file: Path, mesh: Any, *, compressed: bool = True) -> None:
    """Write a PyVista mesh as a VTP file that appears under its name only once it is whole.

    On a full disk, VTK itself truncates a file without raising an error: it writes to memory.
    """
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter()
    writer.SetInputData(mesh)
    writer.SetDataModeToBinary()
    if not compressed:
        writer.SetCompressorTypeToNone()
    writer.WriteToOutputStringOn()
    writer.Write()
    write_text(file, writer.GetOutputString())


_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP}


def lock(stream: IO[str], how: int) -> bool:
    """Lock an open file as `fcntl.flock` does; whether its file system has locks.

    Some mounts of Lustre and NFS have none.

    Raises
    ------
    BlockingIOError
        Another process holds it, and `how` does not wait.
    """
    try:
        fcntl.flock(stream, how)
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        return False
    return True
