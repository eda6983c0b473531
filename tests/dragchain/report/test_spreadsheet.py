import math
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import openpyxl
import pandas as pd
import pytest

from dragchain.report.spreadsheet import (
    COLUMNS,
    definitions,
    summary_workbook,
    unit_of,
    workbook,
)
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


@pytest.mark.parametrize(
    ("column", "unit"),
    [
        ("drag_ci95_low_n", "N"), ("depth_slope_n_per_m", "N/m"), ("torque_n_m", "N m"),
        ("input_motion_speed_m_s", "m/s"), ("input_gravity_m_s2", "m/s2"), ("steps_per_s", "1/s"),
        ("input_media_density_kg_m3", "kg/m3"), ("drag_reliable", ""), ("coordination_number", ""),
        ("drag_against_experiment_percent", "%"), ("wall_time_s", "s"), ("impulse_n_s", "N s"),
    ],
)  # fmt: skip
def test_the_unit_is_the_end_of_the_name(column: str, unit: str) -> None:
    assert unit_of(column) == unit


def test_headings_are_words_with_units() -> None:
    columns = ["drag_ci95_low_n", "input_materials_steel_youngs_modulus_pa", "peak_count"]
    assert definitions(columns)["heading"].tolist() == [
        "Drag 95 % CI lower end (N)", "Input materials steel Young's modulus (Pa)", "Peak count"
    ]  # fmt: skip


def test_what_is_known_of_a_column_counts_before_its_name() -> None:
    known = {"sliding": ("m/m", "sliding distance per path length"), "drag_mean_n": ("N", "mean")}
    found = definitions(["drag_mean_n", "sliding", "drag_std_n"], known).set_index("column")
    assert found.loc["sliding"].tolist() == [
        "Sliding (m/m)", "m/m", "sliding distance per path length"
    ]  # fmt: skip
    assert found.loc["drag_mean_n"].tolist() == ["Drag mean (N)", "N", "mean"]
    assert found.loc["drag_std_n", "meaning"].startswith("force on the workpiece along")


def test_the_first_start_that_fits_is_never_hidden_by_a_shorter_one() -> None:
    starts = pd.read_csv(COLUMNS)["start"].tolist()
    for at, start in enumerate(starts):
        assert not any(start.startswith(earlier) for earlier in starts[:at])


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
