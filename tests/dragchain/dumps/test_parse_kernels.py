import math
import struct
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dragchain.dumps.parse_kernels import text_frames

LINES = tuple(
    np.frombuffer(line, dtype=np.uint8)
    for line in (
        b"ITEM: TIMESTEP\n",
        b"ITEM: NUMBER OF ENTRIES\n",
        b"ITEM: BOX BOUNDS",
        b"ITEM: ENTRIES a \n",
    )
)


def frame_of(word: str) -> bytes:
    head = "ITEM: TIMESTEP\n3\nITEM: NUMBER OF ENTRIES\n1\nITEM: BOX BOUNDS ff ff ff\n"
    head += "0 1\n0 1\n0 1\n"
    return f"{head}ITEM: ENTRIES a \n{word} \n".encode()


def read(word: str, *, whole: bool = False) -> int | None:
    """Bits that the kernel reads from a word, None if it leaves the frame alone."""
    content = frame_of(word)
    buffer = np.frombuffer(content + bytes(64), dtype=np.uint8)
    cells, frames = np.zeros((1, 2), dtype=np.uint64), np.zeros((3, 2), dtype=np.int64)
    address = np.uint64(buffer.ctypes.data)
    done, size = text_frames(address, len(content), LINES, np.array([whole]), cells, frames)
    if not done:
        assert size == 0
        return None
    assert (done, size, *frames[0]) == (1, len(content), 3, 1)
    return int(cells[0, 0])


def bits_of(value: float) -> int:
    return struct.unpack("<Q", struct.pack("<d", value))[0]


def is_plain(word: str) -> bool:
    """Whether the kernel must read a word itself: nothing but rare words may go the slow way."""
    mantissa = word.lstrip("+-").partition("e")[0].replace(".", "")
    value = abs(float(word))
    return len(mantissa) <= 19 and (value == 0.0 or 2.3e-308 < value < 8e307)


def double_of(bits: int) -> float:
    return struct.unpack("<d", struct.pack("<Q", bits))[0]


doubles = st.integers(0, 2**64 - 1).map(double_of).filter(math.isfinite)
formats = st.sampled_from(["%.9g", "%.6g", "%.15g", "%.16g", "%.17g", "%.0f", "%.3f", "%.12e"])


@given(doubles, formats)
@settings(max_examples=1000)
@example(5e-324, "%.17g")
@example(1.7976931348623157e308, "%.17g")
@example(2.2250738585072014e-308, "%.17g")
@example(-0.0, "%.9g")
def test_reads_any_printed_double_as_python_does(value: float, text: str) -> None:
    word = text % value
    found = read(word)
    assert found == bits_of(float(word)) or (found is None and not is_plain(word))


digits = st.tuples(st.integers(0, 10**21 - 1), st.integers(1, 21)).map(
    lambda pair: f"{pair[0]:0{pair[1]}d}"[: pair[1]]
)
signs = st.sampled_from(["", "-", "+"])
decimals = st.builds(
    "{}{}{}{}".format,
    signs,
    digits,
    st.sampled_from(["", "."]) | digits.map(".{}".format),
    st.just("") | st.builds("e{}{}".format, signs, st.integers(0, 9999)),
)


@given(decimals)
@settings(max_examples=1000)
@example("0.0e-400")
@example("9007199254740993")
@example("9007199254740993e22")
@example("1e23")
@example("8.5e-23")
@example("18446744073709551616")
@example("00000000000000000000000000000001")
def test_reads_any_decimal_as_python_does_or_leaves_it(word: str) -> None:
    found = read(word)
    assert found is None or found == bits_of(float(word))


@given(st.floats(1e-300, 1e300), st.integers(-1, 1), st.integers(17, 19))
@settings(max_examples=500)
def test_reads_what_lies_near_half_way_between_two_doubles(value, off, digits) -> None:
    half = (Fraction(value) + Fraction(math.nextafter(value, math.inf))) / 2
    power = math.floor(math.log10(value)) - digits + 1
    mantissa = round(half / Fraction(10) ** power) + off
    word = f"{mantissa}e{power}"
    found = read(word)
    assert found is None or found == bits_of(float(word))
    assert found is not None or not is_plain(word)


@pytest.mark.parametrize(
    "word",
    ["", "-", ".", "e5", "1e", "1e+", "1.5.2", "0x10", "nan", "inf", "-inf", "1e400", "1,5", "1_0"],
)
def test_leaves_what_is_no_finite_number(word: str) -> None:
    assert read(word) is None


@pytest.mark.parametrize(
    ("word", "value"), [("0", 0), ("-0", 0), ("17", 17), ("-17", -17), ("9007199254740992", 2**53)]
)
def test_reads_whole_numbers(word: str, value: int) -> None:
    assert np.uint64(read(word, whole=True)).astype(np.int64) == value


@pytest.mark.parametrize("word", ["1.0", "1.5", "1e3", "9007199254740993"])
def test_leaves_whole_numbers_that_are_not_plain(word: str) -> None:
    assert read(word, whole=True) is None
