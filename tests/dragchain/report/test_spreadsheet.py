import math
from io import BytesIO
from zipfile import ZipFile

import numpy as np
import openpyxl
import pandas as pd
import pytest

from dragchain.report.spreadsheet import definitions, workbook

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
        {"x": values, "n": np.arange(4), "flag": [True, False] * 2, "text": ["a", "", None, "1"]}
    )
    found = list(read(workbook({"Sheet": table}))["Sheet"].iter_rows(min_row=2, values_only=True))
    assert found == [
        (1.5, 0, True, "a"), (None, 1, False, None), (None, 2, True, None), (None, 3, False, "1")
    ]  # fmt: skip
    assert isinstance(found[0][2], bool)


def test_definitions_have_units_and_meanings() -> None:
    units = {
        "drag_mean_ci95_low_n": "N", "input_gravity_m_s2": "m/s2",
        "force_slide_n_m_per_m": "N m/m", "coordination_number": "1",
    }  # fmt: skip
    found = definitions(pd.DataFrame(columns=[*units], dtype=float)).set_index("column")
    assert found["unit"].to_dict() == units and found["meaning"].all()
