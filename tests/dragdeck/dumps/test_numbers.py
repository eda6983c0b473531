"""Numbers of text as Python's ``float`` reads them, to the last bit, or no numbers at all."""

import math
import random
import struct
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dragdeck.dumps.numbers import WrongRow, cells_of_text, named_columns


def bits(values) -> bytes:
    return np.array(values, dtype=np.float64).tobytes()


def text_of(rows) -> bytes:
    return "".join(f"{' '.join(row)} \n" for row in rows).encode()


doubles = st.integers(0, 2**64 - 1).map(lambda n: struct.unpack("<d", struct.pack("<Q", n))[0])
formats = st.sampled_from(["%.9g", "%.6g", "%.15g", "%.16g", "%.17g", "%.0f", "%.3f", "%.12e"])


@given(st.lists(doubles.filter(math.isfinite), min_size=1, max_size=40), formats)
@settings(max_examples=100)
@example([5e-324, 1.7976931348623157e308, 2.2250738585072014e-308, -0.0], "%.17g")
def test_reads_any_printed_double_as_python_does(values: list[float], form: str) -> None:
    words = [form % value for value in values]
    assert bits(cells_of_text(text_of([words, words]), len(words)).T[1]) == bits(
        [float(word) for word in words]
    )


def test_reads_any_decimal_as_python_does() -> None:
    """Of any number of digits, with a point and an exponent or without."""
    rng = random.Random(4)

    def digits() -> str:
        return str(rng.randrange(10 ** rng.randint(1, 21)))

    words = ["0.0e-400", "9007199254740993", "9007199254740993e22", "1e23", "8.5e-23", "1e999"]
    words += ["18446744073709551616", "00000000000000000000000000000001", "1e-999"]
    for _ in range(40_000):
        point = rng.choice(["", ".", f".{digits()}"])
        power = rng.choice(["", f"e{rng.randint(-400, 400)}", f"e+{rng.randint(0, 40)}"])
        words.append(f"{rng.choice(['', '-'])}{digits()}{point}{power}")
    found = cells_of_text(text_of([[word] for word in words]), 1)[0]
    assert bits(found) == bits([float(word) for word in words])


@given(st.lists(st.tuples(st.floats(1e-300, 1e300), st.integers(-1, 1), st.integers(17, 19)),
                min_size=1, max_size=20))  # fmt: skip
@settings(max_examples=100)
def test_reads_what_lies_near_half_way_between_two_doubles(values) -> None:
    words = []
    for value, off, count in values:
        half = (Fraction(value) + Fraction(math.nextafter(value, math.inf))) / 2
        power = math.floor(math.log10(value)) - count + 1
        words.append(f"{round(half / Fraction(10) ** power) + off}e{power}")
    assert bits(cells_of_text(text_of([[word] for word in words]), 1)[0]) == bits(
        [float(word) for word in words]
    )


@pytest.mark.parametrize(
    "line",
    ["1 2.5 3", "1  2.5 3 ", "\t1 2.5\t3", "1 +2.5 3", "1.0 2.5 3  ", "1 2.5E0 3\r", "1 25e-1 3."],
)
def test_reads_what_is_written_in_another_way(line: str) -> None:
    text = f"4 5 6 \n{line}\n7 8 9 \n".encode()
    assert cells_of_text(text, 3).T.tolist() == [[4, 5, 6], [1, 2.5, 3], [7, 8, 9]]


@pytest.mark.parametrize(
    "line",
    ["", "-", ".", "e5", "1e", "1e+", "1.5.2", "0x10", "1,5", "1_0", "1 2", "1\r2", '"1"', "\xa01",
     "\ufeff1", "\u0661", "1\x00", "1d5", "NA"],
)  # fmt: skip
def test_names_the_row_that_is_no_number(line: str) -> None:
    with pytest.raises(WrongRow, match="found b") as caught:
        cells_of_text(f"4 \n{line}\n7 \n".encode(), 1)
    assert (caught.value.row, caught.value.expected) == (1, "1 numbers")


def test_rows_of_unequal_lengths_are_no_table() -> None:
    with pytest.raises(WrongRow) as caught:
        cells_of_text(b"1 2 3 4 \n5 6 \n", 3)
    assert caught.value.row == 0


def test_a_large_text_is_read_bit_for_bit() -> None:
    values = np.random.default_rng(3).integers(0, 2**64, 300_000, np.uint64).view(np.float64)
    values = values[np.isfinite(values)][:240_000].reshape(-1, 3)
    words = [(f"{one!r}", f"{two:.17g}", f"{three:.9g}") for one, two, three in values.tolist()]
    wanted = np.array([[float(word) for word in row] for row in words])
    assert bits(cells_of_text(text_of(words), 3)) == bits(wanted.T)


@pytest.mark.parametrize(
    ("cells", "problem"),
    [
        ([[1, 2, 3], [1, math.nan, math.inf]], "x is nan"),
        ([[1, 2, 3], [1, -math.inf, 0]], "x is -inf"),
        ([[1, 2.5, 3], [1, 2, 3]], "id is 2.5"),
        ([[1, 1e30, 3], [1, 2, 3]], r"id is 1e\+30"),
    ],
)
def test_columns_are_finite_and_ids_are_whole(cells, problem: str) -> None:
    with pytest.raises(WrongRow, match=problem) as caught:
        named_columns(np.array(cells), ["id", "x"])
    assert caught.value.row == 1
