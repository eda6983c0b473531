"""The pages say what is true."""

import json
import re

import pytest
from paths import ROOT

from dragchain.report.notation import MINUS
from dragchain.scaling.document import ScalingFile
from dragchain.scaling.fit import read_scalings, said
from dragchain.tables.meanings import columns_of
from dragdeck.project import Project
from dragdeck.scenes.drop_test import DropDeck
from dragdeck.scenes.filling import FillingDeck
from dragdeck.scenes.process import PROCESS, ProcessDeck
from dragdeck.study.field_page import page

NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])


def test_the_study_page_is_made_from_the_model() -> None:
    shown = (ROOT / "docs/study.md").read_text()
    assert shown == page(), "run: dragdeck step fields > docs/study.md"


def test_every_field_has_a_meaning() -> None:
    rows = [row.split("|") for row in page().splitlines() if row.startswith("| `")]
    assert len(rows) > 50
    missing = [row[1].strip() for row in rows if len(row) == 6 and not row[4].strip()]
    assert not missing or missing == ["`draft`"]


@pytest.mark.parametrize("deck", [DropDeck, FillingDeck, ProcessDeck])
def test_every_value_of_a_deck_is_on_the_page(deck: type) -> None:
    text = (ROOT / "docs/templates.md").read_text()
    names = set(re.findall(r"[`.](\w+)`", text))
    assert set(deck.__dataclass_fields__) - {"materials"} <= names


@pytest.mark.parametrize("file", PAGES, ids=lambda file: file.name)
def test_every_link_leads_somewhere(file) -> None:
    links = re.findall(r"\]\(([^)#:]+)\)", file.read_text())
    missing = [link for link in links if not (file.parent / link).exists()]
    assert not missing


@pytest.mark.parametrize("found", read_scalings(), ids=lambda found: found.study)
def test_the_scalings_are_those_of_the_studies_and_on_the_page(found: ScalingFile) -> None:
    text = (ROOT / "docs/scaling.md").read_text()
    statement = said(found).splitlines()[0].removeprefix(f"{found.field}: ").replace(MINUS, "-")
    assert statement in text
    cases = Project(ROOT).cases(found.study)
    scaling = cases[0].study.scaling
    assert scaling is not None and scaling.fit_range is None
    assert (scaling.field, scaling.expected_exponent, scaling.source) == (
        *(found.field, found.expected.exponent, found.expected.source),
    )
    assert {run.run for run in found.runs} == {PROCESS.run_id(case) for case in cases}


def test_every_block_is_on_the_page() -> None:
    text = (ROOT / "docs/templates.md").read_text()
    for template in (ROOT / "templates").glob("*.in.j2"):
        for block in re.findall(r"{% block (\w+) %}", template.read_text()):
            assert f"`{block}`" in text, f"{template.name}: block {block}"


def test_the_columns_of_the_tables_are_those_on_the_page() -> None:
    text = (ROOT / "docs/outputs.md").read_text()
    tables = dict(re.findall(r"^\| `(\w+)\.parquet` \|[^|]*\| `([^`]*)`", text, re.MULTILINE))
    tables |= re.findall(r"^\| `(thermo)` \|[^|]*\| `([^`]*)`", text, re.MULTILINE)
    described = [table for table in tables if columns_of(table)]
    assert len(described) == 11
    for table in described:
        of_spin = {name for name in columns_of(table) if name.startswith(("body_", "turn_"))}
        assert set(tables[table].split()) == set(columns_of(table)) - of_spin, table


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_is_kept_without_outputs_and_names_its_study_first(file) -> None:
    notebook = json.loads(file.read_text())
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)
    study = re.fullmatch(r'study_name = "([\w-]+)"', "".join(code[0]["source"]))
    assert study is not None and Project(ROOT).cases(study[1])
    assert not any(study[1] in "".join(cell["source"]) for cell in code[1:])
    links = re.findall(r"\]\(([^)#:]+)", file.read_text())
    assert all((file.parent / link).exists() for link in links)


def test_the_notebooks_are_on_the_page() -> None:
    text = (ROOT / "docs/python.md").read_text()
    assert NOTEBOOKS and all(f"examples/{file.name}" in text for file in NOTEBOOKS)
