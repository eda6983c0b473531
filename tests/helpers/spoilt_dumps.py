"""Dumps of three columns, and every way in which a frame of them can be spoilt."""

import math
import struct

from made_run import Raw

NAMES = ("id", "x", "c_f[1]")
ROWS = {
    0: [[3, 0.5, -1e-30], [1, 1 / 3, 2e8], [2, -0.25, 5e-324]],
    7: [],
    14: [[1, 0.125, 4.0]],
    21: [[2, 1e22, 1e23], [1, -7.25, 0.1]],
}


def text(steps=ROWS, names=NAMES, kind="custom") -> bytes:
    places = [NAMES.index(name) for name in names]
    turned = {step: [[row[place] for place in places] for row in ROWS[step]] for step in steps}
    return b"".join(Raw.text(step, rows, names, kind) for step, rows in turned.items())


def binary(steps=ROWS) -> bytes:
    return b"".join(Raw.binary(step, ROWS[step], len(NAMES)) for step in steps)


def _spoilt() -> dict[str, tuple[str, bytes, str]]:
    """File name, content after two good frames, and what is said about it."""
    good = text([14])
    whole = Raw.binary(14, ROWS[14], 3, 1)
    return {
        "cut in a number": ("a.dump", good[:-4], "the file ends after"),
        "cut between rows": ("a.dump", text([0]).rsplit(b"\n", 2)[0] + b"\n", "the file ends"),
        "cut in the header": ("a.dump", good[:40], "the file ends after"),
        "count too large": ("a.dump", good.replace(b"ATOMS\n1\n", b"ATOMS\n2\n", 1), "ends|row 1"),
        "count too small": (
            "a.dump",
            text([0]).replace(b"ATOMS\n3\n", b"ATOMS\n2\n", 1),
            "2 rows are not all",
        ),
        "nan": ("a.dump", good.replace(b" 4 ", b" nan "), "is nan"),
        "-nan": ("a.dump", good.replace(b" 4 ", b" -nan "), "row 0"),
        "inf": ("a.dump", good.replace(b" 4 ", b" inf "), "is inf"),
        "overflow": ("a.dump", good.replace(b" 4 ", b" 1e999 "), "is inf"),
        "a word": ("a.dump", good.replace(b" 4 ", b" 4x "), "row 0"),
        "a number less": ("a.dump", good.replace(b" 4 ", b" "), "row 0"),
        "a number more": ("a.dump", good.replace(b" 4 ", b" 4 4 "), "row 0"),
        "an id that is not whole": ("a.dump", good.replace(b"\n1 0.1", b"\n1.5 0.1"), "id is 1.5"),
        "another program": ("a.dump", b"# VTK DataFile\n1 2 3\n", "found '# VTK"),
        "bytes": ("a.dump", b"\xff\xfe\xfd\n", "not text"),
        "binary: cut in rows": ("a.bin", whole[:-1], "the file ends after"),
        "binary: cut in header": ("a.bin", whole[:30], "the file ends after"),
        "binary: nan": ("a.bin", whole[:-8] + struct.pack("<d", math.nan), "is nan"),
        "binary: inf": ("a.bin", whole[:-8] + struct.pack("<d", -math.inf), "is -inf"),
        "binary: wrong count": ("a.bin", whole[:8] + b"\2" + whole[9:], "ends|wrote 1 rows"),
        "binary: other width": ("a.bin", Raw.binary(14, [[1, 2]], 2, 1), "2 columns"),
        "binary: no columns": ("a.bin", whole[:92] + bytes(4) + whole[96:], "0 columns"),
        "binary: no ranks": ("a.bin", whole[:96] + bytes(4) + whole[100:], "from 0 ranks"),
        "binary: another program": ("a.bin", b"\x89HDF\r\n" + b"\xff" * 200, "not the header"),
    }


SPOILT = _spoilt()
