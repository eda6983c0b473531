import math
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import openpyxl
import pandas as pd
import pytest

from dragchain.report.spreadsheet import definitions, summary_workbook, workbook
from dragchain.run.case import Assumption

FORMULAE = ["=1+1", "+1", "-1", "@SUM(A1)", "{=1}", "https://example.org", "=cmd|' /C calc'!A0"]


def read(content: bytes) -> openpyxl.Workbook:
    return openpyxl.load_workbook(BytesIO(content))


@pytest.mark.parametrize("text", FORMULAE)
def test_no_text_becomes_a_formula_or_a_link(text: str) -> None:
    content = workbook({"Sheet": pd.DataFrame({text: [text]})})
    head, cell = (row[0] for row in read(content)["Sheet"].iter_rows())
    assert (head.value, cell.value) == (text, text)
    assert head.data_type == cell.data_type == "s"
    with ZipFile(BytesIO(content)) as files:
        sheet = files.read("xl/worksheets/sheet1.xml").decode()
    assert "<f" not in sheet and "hyperlink" not in sheet


def test_cells_keep_their_values_and_types() -> None:
    values = [1.5, math.nan, -math.inf, None]
    table = pd.DataFrame(
        {"x": values, "n": np.arange(4), "flag": [True, False] * 2, "text": ["a", "", None, "1"]},
    )
    found = list(read(workbook({"Sheet": table}))["Sheet"].iter_rows(min_row=2, values_only=True))
    assert found == [
        (1.5, 0, True, "a"), (None, 1, False, ""), (None, 2, True, None), (None, 3, False, "1")
    ]  # fmt: skip
    assert isinstance(found[0][2], bool)


def test_headings_are_words_with_units() -> None:
    columns = ["drag_ci95_low_n", "input_materials_steel_youngs_modulus_pa", "peak_count"]
    assert definitions(columns)["heading"].tolist() == [
        "Drag 95 % CI lower end (N)", "Input materials steel Young's modulus (Pa)", "Peak count"
    ]  # fmt: skip


def test_units_and_meanings_are_those_of_the_columns() -> None:
    found = definitions(["drag_mean_n", "input_seed", "drag_reliable", "x"]).set_index("column")
    assert found["unit"].tolist() == ["N", "", "", ""]
    assert found.loc["drag_mean_n", "meaning"] == "mean of the drag force"
    assert "study file" in found.loc["input_seed", "meaning"]
    assert found.loc["x", "meaning"] == ""


def test_the_three_sheets_say_what_there_is(tmp_path: Path) -> None:
    table = pd.DataFrame({"case": ["=a", "b"], "drag_mean_n": [-2.5, math.nan]})
    assumed = {"run-1": [Assumption(field="bowl.radius_m", value=0.04, why="+plausible")]}
    book = read(summary_workbook(table, assumed))
    assert book.sheetnames == ["Summary", "Definitions", "Assumptions"]
    rows = [list(sheet.iter_rows(values_only=True)) for sheet in book]
    assert rows[0] == [("Case", "Drag mean (N)"), ("=a", -2.5), ("b", None)]
    assert [row[:3] for row in rows[1][1:]] == [
        ("Case", "case", ""), ("Drag mean (N)", "drag_mean_n", "N")
    ]  # fmt: skip
    assert rows[2] == [
        ("run", "field", "value", "reason"), ("run-1", "bowl.radius_m", "0.04", "+plausible")
    ]  # fmt: skip
