"""Columns of numbers as bytes, which the scripts of the page unpack."""

import base64
import zlib
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats

NumberKind = Literal["u8", "u16", "u32", "f24"]
"""Whole numbers of 1, 2 or 4 bytes, or the first 3 bytes of a single-precision number."""

_BYTES = {"u8": 1, "u16": 2, "u32": 4, "f24": 3}

ROUNDING = 2.0**-16
"""Largest relative error of a number of kind ``f24``: it keeps 16 significant bits."""


def short_floats(values: Floats) -> NDArray[np.uint32]:
    """Numbers in single precision, rounded to their first 3 bytes, (N,)."""
    bits = np.ascontiguousarray(values, dtype=np.float32).view(np.uint32)
    return (bits + np.uint32(0x80)) >> np.uint32(8)


@dataclass
class PackedColumns:
    """Columns in the order in which they were added.

    Attributes
    ----------
    entries : list of dict
        ``name``, ``kind`` and ``length`` of each, for the page.
    """

    entries: list[dict[str, str | int]] = field(default_factory=list)
    _parts: list[bytes] = field(default_factory=list)

    def add(self, name: str, kind: NumberKind, values: NDArray[Any]) -> None:
        """Add a column; values are (N,) or are taken row by row."""
        flat = np.ravel(values)
        whole = short_floats(flat) if kind == "f24" else flat
        planes = whole.astype(">u4").view(np.uint8).reshape(-1, 4)[:, 4 - _BYTES[kind] :]
        self.entries.append({"name": name, "kind": kind, "length": flat.size})
        self._parts.append(np.ascontiguousarray(planes.T).tobytes())

    def text(self) -> str:
        """All columns, one after another, compressed (zlib) and in base64."""
        return base64.b64encode(zlib.compress(b"".join(self._parts))).decode("ascii")
