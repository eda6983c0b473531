"""Files that are replaced in one step."""

import errno
import hashlib
import os
from pathlib import Path

FULL_DISK = {errno.ENOSPC, errno.EDQUOT}
"""Numbers of the errors of a full disk, and of a user who may not write more."""


def file_checksum(file: Path) -> str:
    """SHA-256 of a file's bytes, as hex digits."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def replace_text(file: Path, text: str) -> None:
    """Write a text file in one step: readers see the old version or the new one."""
    replace_bytes(file, text.encode())


def replace_bytes(file: Path, content: bytes) -> None:
    """Write a file in one step: readers see the old version or the new one.

    Raises
    ------
    OSError
        It cannot be written; the error names the file.
    """
    waiting = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        waiting.write_bytes(content)
        waiting.replace(file)
    except OSError as error:
        if error.errno is not None:
            error.filename = str(file)  # a full disk says so of a stream, which has no name
        raise
    finally:
        waiting.unlink(missing_ok=True)
