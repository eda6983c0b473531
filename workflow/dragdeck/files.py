"""Files that are replaced in one step."""

import hashlib
import os
from pathlib import Path


def file_checksum(file: Path) -> str:
    """SHA-256 of a file's bytes, as hex digits."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def replace_text(file: Path, text: str) -> None:
    """Write a text file in one step: readers see the old version or the new one."""
    replace_bytes(file, text.encode())


def replace_bytes(file: Path, content: bytes) -> None:
    """Write a file in one step: readers see the old version or the new one."""
    waiting = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        waiting.write_bytes(content)
        waiting.replace(file)
    finally:
        waiting.unlink(missing_ok=True)
