"""Files that are either whole or not there."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def draft_of(file: Path) -> Iterator[Path]:
    """A path to write to; what was written takes the file's place when the block ends.

    If the block ends in an exception, nothing is left behind, and an older file of that name
    stays as it was.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    draft = file.with_name(f".{os.getpid()}.{file.name}")
    try:
        yield draft
        os.replace(draft, file)
    finally:
        draft.unlink(missing_ok=True)


def write_text(file: Path, text: str) -> None:
    """Write a text file that appears under its name only once it is whole."""
    with draft_of(file) as draft:
        draft.write_text(text, encoding="utf-8")


def write_bytes(file: Path, content: bytes) -> None:
    """Write a file that appears under its name only once it is whole."""
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
