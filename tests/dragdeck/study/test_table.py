"""Tables of users: what is read, and what is refused instead of being cut, shifted or guessed."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dragdeck.errors import InputError
from dragdeck.study import rows, table
from dragdeck.study.force_record import in_words, read_samples
from dragdeck.study.reference import Signal
from dragdeck.study.table import user_table

TIME, FORCE = [0.0, 0.005, 0.01, 0.015], [-0.06, 0.42, -1234.5, 2.0]


@pytest.fixture(params=["one piece", "a piece per line"])
def in_pieces(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows are the same wherever a piece of their file ends."""

    def lines(text: str, *_: object) -> Iterator[tuple[int, str]]:
        return enumerate(text.splitlines(keepends=True), 1)

    if request.param != "one piece":
        monkeypatch.setattr(rows, "pieces", lines)


def written(folder: Path, content: str | bytes) -> Path:
    file = folder / "table.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


@pytest.mark.parametrize(
    "content",
    [
        "time_s,fx_n\n0.000,-0.060\n0.005,.42\n0.01,-1234.50\n15e-3,+2\n",
        "time_s;fx_n\r\n0,000;-0,060\r\n0,005;,42\r\n0,010;-1234,5\r\n0,015;2\r\n",
        "\ufeff# exported\n\ntime_s\tfx_n\n0,000\t-0,060\n0,005\t0,42\n0,01\t-1,2345E3\n0,015\t2\n",
        'n,time_s,fx_n,note\n1,0,-0.06,"a, b"\n2,.005,"0.42",\n3,0.01,-1234.5,\n4,0.015,2,1,2\n'
        .replace(",1,2\n", ',"1,2"\n'),
        "time_s;fx_n;;\n0;-0.06;;\n0.005;0.42;;\n0.01;-1234.5;;\n0.015;002.0;;\n",
        "time_s,fx_n\n0,-0.06\n# a comment\n0.005,0.42\n\n0.01,-1234.5\n0.015,2",
    ],
)  # fmt: skip
@pytest.mark.usefixtures("in_pieces")
def test_what_is_unambiguous_is_read(content: str, tmp_path: Path) -> None:
    time, force, _ = read_samples(written(tmp_path, content), "fx_n")
    np.testing.assert_array_equal(time, TIME)
    np.testing.assert_array_equal(force, FORCE)


ROWS = "0.000\t-0.060\n0.005\t0.42\n0.01\t-1234.5\n0.015\t2\n"
EXPORTS: dict[str, tuple[str | bytes, str]] = {
    "LabVIEW": (
        "LabVIEW Measurement\t\nSeparator\tTab\nDate\t2026/11/28\n***End_of_Header***\t\n\n"
        "Channels\t1\nSamples\t4\nDelta_X\t0.005\n***End_of_Header***\nX_Value\tfx_n\tComment\n"
        + ROWS,
        "fx_n",
    ),
    "names and units": ("Kraftmessung\nKanal\t1\nZeit\tFx\tFy\ns\tN\tN\n"
                        + ROWS.replace("\n", "\t1\n"), "Fx [N]"),
    "units in brackets": ("Time (s)\tFx [N]\tU (V)\n" + ROWS.replace("\n", "\t1\n"), "Fx (N)"),
    "Excel": ("sep=;\r\ntime_s;fx_n\r\n" + ROWS.replace("\t", ";").replace("\n", "\r\n"), "fx_n"),
    "Excel, decimal commas": (
        "sep=;\ntime_s;fx_n;;\n"
        + ROWS.replace(".", ",").replace("\t", ";").replace("\n", ";;\n"), "fx_n",
    ),
    "commas alone": ("time_s,fx_n\n0,000,-0,06\n0,005,0,42\n0,010,-1234,5\n0,015,2,0\n", "fx_n"),
    "LabVIEW, decimal commas, units in its head": (
        "LabVIEW Measurement\t\nDecimal_Separator\t,\n***End_of_Header***\t\n\t\nChannels\t1\t\n"
        "Y_Unit_Label\tN\t\nDelta_X\t0,005\n***End_of_Header***\t\t\nX_Value\tFx\tComment\n"
        + ROWS.replace(".", ","), "Fx [N]",
    ),
    "DynoWare": (
        "Kistler DynoWare\n3\n200\n\nTime\tFx\tFy\n[s]\t[N]\t[N]\n"
        + ROWS.replace("\n", "\t1\n"), "Fx / N",
    ),
    "DIAdem": (
        "DIADEMHEADER\nTitel;Versuch 3\nKanäle;3\nZeit;Fx;Fy\ns;N;N\n"
        + ROWS.replace(".", ",").replace("\t", ";").replace("\n", ";1,0\n"), "Fx in N",
    ),
    "catman": (
        "Catman\nChannels\t3\n\nZeit / s\tFx / N\n" + ROWS.replace(".", ","), "fx_n",
    ),
    "separators behind all rows": (
        "time_s;fx_n\n" + ROWS.replace("\t", ";").replace("\n", ";;\n"), "fx_n",
    ),
    "signs of typesetters": ("time_s\tfx_n\n" + ROWS.replace("-", "\u2212"), "fx_n"),
    "milliseconds": ("t [ms],Fx [kN]\n0,-6e-5\n5,4.2e-4\n10,-1.2345\n15,2e-3\n", "fx_kn"),
    "six components": (
        "Dynamometer\nTime;Fx;Fy;Fz;Mx;My;Mz\ns;N;N;N;Nm;Nm;Nm\n"
        + ROWS.replace(".", ",").replace("\t", ";").replace("\n", ";1,0;2;3;4,5;6\n"), "fx_n",
    ),
    "LabVIEW, a comment in its first row": (
        "LabVIEW Measurement\t\n***End_of_Header***\t\nX_Value\tFx [N]\tComment\n"
        + ROWS.replace("\n", "\tbegin\n", 1), "fx_n",
    ),
    "quotes": ('"Zeit [s]";"Fx [N]"\n' + "".join(
        f'"{time}";"{force}"\n'.replace(".", ",") for time, force in zip(TIME, FORCE, strict=True)
    ), "fx_n"),
    "padded, with signs": (
        "time_s ;fx_n\n" + ROWS.replace("\t", " ; ").replace("0.42", "+0.42"), "fx_n"),
    "numpy.savetxt": ("# run 3\n# time_s fx_n\n" + ROWS.replace("\t", " "), "fx_n"),
    "aligned": (
        "Rig 3 7\n\n  Time [s]     Fx [N]\n  "
        + ROWS.replace("\t", "     ").replace("\n", "\n  ").rstrip(" "), "Fx",
    ),
    "aligned, decimal commas, units below": (
        "t Fx\n[s] [N]\n" + ROWS.replace(".", ",").replace("\t", "  "), "Fx",
    ),
    "names in a comment": ("# time_s,fx_n\n" + ROWS.replace("\t", ","), "fx_n"),
    "no unit asked for": (
        "Time;Fx;Fy\ns;N;N\n" + ROWS.replace("\t", ";").replace("\n", ";1\n"), "Fx",
    ),
    "LibreOffice, decimal commas in quotes": ("time_s,fx_n\n" + "".join(
        f'"{time}","{force}"\n'.replace(".", ",") for time, force in zip(TIME, FORCE, strict=True)
    ), "fx_n"),
    "pandas": (",time_s,fx_n\n" + "".join(
        f"{row},{time},{force}\n" for row, (time, force) in enumerate(zip(TIME, FORCE, strict=True))
    ), "fx_n"),
    "MTS": ("Axial test\nTime\tAxial Force\tStrain\nSec\tN\tmm/mm\n"
            + ROWS.replace("\n", "\t1\n"), "Axial Force"),
    "words for units": ("Time (seconds)\tForce x (Newton)\n" + ROWS, "Force x"),
    "other units": (
        "Time;Fx;M;U\ns;N;N.m;Volt\n" + ROWS.replace("\t", ";").replace("\n", ";1;2\n"), "Fx"),
    "units at the end of names": ("Zeit_s\tKraft_N\n" + ROWS, "Kraft"),
    "UTF-16": (("time_s\tfx_n\n" + ROWS).encode("utf-16"), "fx_n"),
    "Latin-1": (("Prüfstand 3\ntime_s\tfx_n\n" + ROWS).encode("latin-1"), "fx_n"),
    "old line ends": (("time_s\tfx_n\n" + ROWS).replace("\n", "\r"), "fx_n"),
}  # fmt: skip


@pytest.mark.usefixtures("in_pieces")
@pytest.mark.parametrize("program", EXPORTS)
def test_exports_of_programs_give_the_same_numbers(program: str, tmp_path: Path) -> None:
    content, column = EXPORTS[program]
    time, force, lines = read_samples(written(tmp_path, content), column)
    np.testing.assert_allclose(time, TIME, rtol=1e-12, atol=0)
    np.testing.assert_allclose(force, FORCE, rtol=1e-12, atol=0)
    text = (
        content.decode("utf-16" if program == "UTF-16" else "latin-1")
        if isinstance(content, bytes)
        else content
    )
    assert [*lines] == [*range(lines[0], len(text.splitlines()) + 1)]


def test_lines_of_separators_alone_are_blank(tmp_path: Path) -> None:
    content = "time_s;fx_n\n" + ROWS.replace("\t", ";") + ";\n;;\n"
    _, force, lines = read_samples(written(tmp_path, content), "fx_n")
    assert (force.tolist(), [*lines]) == (FORCE, [2, 3, 4, 5])


def test_a_file_of_labview_without_times_needs_the_rate(tmp_path: Path) -> None:
    rows = "".join(f"\t{force}\n" for force in FORCE)
    head = "LabVIEW Measurement\nX_Columns\tNo\nY_Unit_Label\tN\n***End_of_Header***\n"
    file = written(tmp_path, f"{head}X_Value\tFx\tComment\n{rows}")
    time, force, _ = read_samples(file, "fx_n", 200)
    assert (time.tolist(), force.tolist()) == (TIME, FORCE)
    with pytest.raises(InputError, match="no column"):
        read_samples(file, "fx_n")


def test_the_reading_is_told_with_its_first_and_last_row(tmp_path: Path) -> None:
    content, column = EXPORTS["names and units"]
    signal = Signal(file="table.csv", column=column, low_pass_hz=1)
    assert in_words(written(tmp_path, content), signal) == (
        "table.csv read as fx_n: 4 rows at 200 Hz, 0 s, -0.06 N (line 5) to 0.015 s, 2 N (line 8)"
    )


@given(
    values=st.lists(st.floats(-9, 9).filter(lambda value: abs(value) > 1e-3), min_size=1),
    comma=st.booleans(),
    separator=st.sampled_from([";", "\t", ","]),
    digits=st.integers(0, 5),
)
def test_no_digit_is_ever_lost(
    values: list[float], comma: bool, separator: str, digits: int, tmp_path_factory: Any
) -> None:
    """Whatever the marks: the numbers that were meant, or a refusal."""
    cells = [f"{value:.{digits}f}" for value in values]
    rows = [f"{n}{separator}{cell}" for n, cell in enumerate(cells)]
    text = "\n".join([f"n{separator}fx_n", *rows])
    text = text.replace(".", ",") if comma else text
    file = written(tmp_path_factory.mktemp("table"), text)
    try:
        _, (got,) = user_table(file).numbers(["fx_n"])
    except InputError as error:
        assert comma and digits
        assert "decimal comma" in str(error)
        assert separator == "," or digits == 3
        return
    assert got.tolist() == [float(cell) for cell in cells]


HEAD = "time_s,fx_n\n"
REFUSED: dict[str, tuple[str | bytes, dict[str, Any], int | None, str]] = {
    "thousands in quotes": (HEAD + '0,"1,234"\n', {}, 2, "thousands"),
    "both marks in quotes": (HEAD + '0.5,"1,5"\n', {}, 2, "line 2 has a decimal point"),
    "a nameless column": ("fx_n,\n-0,060\n", {"rate_hz": 200}, 2, "decimal comma"),
    "one number or two": ("fx_n\n-1,5\n0,42\n", {"rate_hz": 200}, 2, "decimal comma"),
    "two units": ("time_s;fx_n\nms;N\n0;1\n1;2\n", {}, 1, "has two units"),
    "two units in brackets": ("time_s,fx_n [kN]\n0,1\n", {}, 1, "has two units"),
    "UTF-16 without its mark": ("time_s\tfx_\u0144\n".encode("utf-16-le"), {}, 1, "UTF-8"),
    "commas of thousands": ("time_s;fx_n\n0;1,234\n1;5,678\n", {}, 2, "thousands"),
    "both marks": ("time_s;fx_n\n0,005;1.234,5\n", {}, 2, "line 2 has a decimal point"),
    "a longer row": (HEAD + "0,1\n0.005,2,3\n", {}, 3, "3 values, but the header has 2 names"),
    "a shorter row": (HEAD + "0,1\n0.005\n", {}, 3, "1 values, but the header has 2 names"),
    "a missing value": (HEAD + "0,1\n0.005,\n", {}, 3, "fx_n: the value is missing"),
    "blanks of thousands": ("fx_n\n1 000\n2 000\n", {"rate_hz": 200}, 2, "is several numbers"),
    "not finite": (HEAD + "0,inf\n", {}, 2, "'inf' is text"),
    "too large": (HEAD + "0,1e999\n", {}, 2, "a finite number"),
    "underscore": (HEAD + "0,1_000\n", {}, 2, "'1_000' is text"),
    "a blank line": ("fx_n\n1\n2\n\n4\n", {"rate_hz": 200}, 4, "series without times"),
    "an open quotation": ('time_s,fx_n,note\n0,1,"a\n0.005,2,b"\n', {}, 2, "not a CSV file"),
    "a comment": ("fx_n\n1\n# 2\n3\n", {"rate_hz": 200}, 3, "series without times"),
    "a first comment": ("fx_n\n# 1\n2\n3\n", {"rate_hz": 200}, 2, "series without times"),
    "another rate": (HEAD + "0,1\n0.005,2\n0.01,3\n", {"rate_hz": 100}, None, "contradicts the"),
    "a slow drift": (
        HEAD + "".join(f"{n / 200:.4f},1\n" for n in range(300)), {"rate_hz": 200.4},
        None, "200 Hz, the mean rate",
    ),
    "no header": ("0,1\n0.005,2\n", {}, 1, "no column(s) with a recognised name"),
    "several records": (
        "LabVIEW Measurement\n***End_of_Header***\nX_Value\tfx_n\tComment\n" + ROWS
        + "\nChannels\t1\t\n***End_of_Header***\t\t\nX_Value\tfx_n\tComment\n" + ROWS,
        {}, 9, "a second header"),
    "names again": ("Time [s];fx_n\n0;1\n1;2\nTime [s];fx_n\n2;3\n", {}, 4, "a second header"),
    "a time of the day": (HEAD + "10:00:00.005,1\n", {}, 2, "export seconds"),
    "a date": (HEAD + "2026-11-28 10:00:00,1\n", {}, 2, "export seconds"),
    "the column twice": ("time_s,fx_n,fx_n\n0,1,2\n", {}, 1, "2 column(s)"),
    "a header of LabVIEW": ("LabVIEW Measurement\t\nSeparator\tTab\n", {}, 1, "no column(s)"),
    "a huge cell": (HEAD + '0,"' + "1" * 200_000, {}, 2, "not a CSV file"),
    "empty": ("\n", {}, None, "the file is empty"),
    "comments alone": ("\n# nothing\n", {}, None, "nothing but comments within 2 lines"),
}  # fmt: skip


@pytest.mark.usefixtures("in_pieces")
@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_is_refused_with_its_line(name: str, tmp_path: Path) -> None:
    content, fields, line, words = REFUSED[name]
    file = written(tmp_path, content)
    with pytest.raises(InputError) as caught:
        read_samples(file, "fx_n", **fields)
    assert words in str(caught.value)
    assert (caught.value.file, caught.value.line) == (file, line)


def test_times_and_a_rate_that_agree_are_read(tmp_path: Path) -> None:
    file = written(tmp_path, HEAD + "3.000,1\n3.005,2\n3.0101,3\n")
    assert read_samples(file, "fx_n", 200)[0].tolist() == [3.0, 3.005, 3.0101]


def test_errors_are_named_together_up_to_five(tmp_path: Path) -> None:
    """Those of a table with a bad value in each row; the others are counted."""
    rows = "".join(f"x,{n}\n" for n in range(25))
    with pytest.raises(InputError, match="20 more such lines") as caught:
        read_samples(written(tmp_path, HEAD + rows), "fx_n")
    assert [error.line for error in (caught.value, *caught.value.more)] == [*range(2, 7), None]


def test_of_a_long_table_the_first_bad_piece_is_told(tmp_path: Path) -> None:
    file = written(tmp_path, HEAD + "0.005,-2.5\n" * 100_000 + "0.005,x\n" * 100_000)
    with pytest.raises(InputError, match="'x' is text") as caught:
        read_samples(file, "fx_n")
    (*_, more) = caught.value.more
    count, last = re.findall(r"[\d]+", more.problem)
    assert (caught.value.line, int(last) - int(count)) == (100_002, 100_006)
    assert int(last) < 200_001


def test_a_series_below_its_unit_needs_no_times(tmp_path: Path) -> None:
    file = written(tmp_path, "Messung 3\nFx\nN\n" + "".join(f"{force}\n" for force in FORCE))
    assert read_samples(file, "fx_n", 200)[1].tolist() == FORCE


def test_a_huge_file_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table, "_MOST_BYTES", 10)
    with pytest.raises(InputError, match="too large"):
        user_table(written(tmp_path, HEAD + "0,1\n"))
    with pytest.raises(InputError, match="cannot be read: No such file"):
        user_table(tmp_path / "none.csv")
