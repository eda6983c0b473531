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


@pytest.fixture(params=[1, 5000], ids="before {} rows".format)
def after(request: pytest.FixtureRequest) -> int:
    """Rows that follow: short texts and long ones are read in two ways."""
    count: int = request.param
    return count


doubles = st.integers(0, 2**64 - 1).map(lambda n: struct.unpack("<d", struct.pack("<Q", n))[0])
formats = st.sampled_from(["%.9g", "%.6g", "%.15g", "%.16g", "%.17g", "%.0f", "%.3f", "%.12e"])


@given(st.lists(doubles.filter(math.isfinite), min_size=1, max_size=40), formats)
@settings(max_examples=60)
@example([5e-324, 1.7976931348623157e308, 2.2250738585072014e-308, -0.0], "%.17g")
def test_reads_any_printed_double_as_python_does(values: list[float], form: str) -> None:
    words = [form % value for value in values]
    for rows in (1, 9000 // len(words)):
        found = cells_of_text(text_of([words] * rows), len(words))
        assert bits(found[:, -1]) == bits([float(word) for word in words])


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


def test_reads_what_lies_near_half_way_between_two_doubles() -> None:
    rng = random.Random(5)
    words = []
    for _ in range(4000):
        value = 10 ** rng.uniform(-300, 300)
        half = (Fraction(value) + Fraction(math.nextafter(value, math.inf))) / 2
        power = math.floor(math.log10(value)) - rng.randint(16, 18)
        words.append(f"{round(half / Fraction(10) ** power) + rng.randint(-1, 1)}e{power}")
    found = cells_of_text(text_of([[word] for word in words]), 1)[0]
    assert bits(found) == bits([float(word) for word in words])


@pytest.mark.parametrize(
    "line",
    ["1 2.5 3", "1  2.5 3 ", "\t1 2.5\t3", "1 +2.5 3", "1.0 2.5 3  ", "1 2.5E0 3\r", "1 25e-1 3."],
)
def test_reads_what_is_written_in_another_way(line: str, after: int) -> None:
    text = f"{line}\n{line}\n" + "7 8 9 \n" * after
    found = cells_of_text(text.encode(), 3).T.tolist()
    assert found == [[1, 2.5, 3]] * 2 + [[7, 8, 9]] * after


@pytest.mark.parametrize(
    "line",
    ["", "-", ".", "e5", "1e", "1e+", "1.5.2", "0x10", "1,5", "1_0", "1 2", "1\r2", '"1"', "\xa01",
     "\ufeff1", "\u0661", "1\x00", "1d5", "NA"],
)  # fmt: skip
@pytest.mark.parametrize("row", [0, 1])
def test_names_the_row_that_is_no_number(line: str, row: int, after: int) -> None:
    text = "4 \n" * row + f"{line}\n" + "7 \n" * after
    with pytest.raises(WrongRow, match="found b") as caught:
        cells_of_text(text.encode(), 1)
    assert (caught.value.row, caught.value.expected) == (row, "1 numbers")


def test_rows_of_unequal_lengths_are_no_table(after: int) -> None:
    with pytest.raises(WrongRow) as caught:
        cells_of_text(b"1 2 3 4 \n5 6 \n" + b"7 8 9 \n" * after, 3)
    assert caught.value.row == 0


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
