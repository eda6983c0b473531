"""The reference is that of the code: nothing is missing, and nothing is made up."""

import re
from pathlib import Path
from typing import get_args

import nbformat
import pytest
import reference
import yaml
from doc_pages import PAGES
from paths import ROOT, SNAKEFILES
from pybtex.database import parse_file

import dragchain
from dragchain.report.page import MINUS
from dragchain.scaling.document import ScalingFile, read_scalings
from dragchain.scaling.fit import said
from dragdeck.errors import CautionCode
from dragdeck.project import Project
from dragdeck.records.run import CheckCode
from dragdeck.scenes.drop_test import DropDeck
from dragdeck.scenes.filling import FillingDeck
from dragdeck.scenes.process import PROCESS
from dragdeck.scenes.process_deck import ProcessDeck

DOCS = ROOT / "docs"
NOTEBOOKS = sorted((ROOT / "docs/examples").glob("*.ipynb"))


def text_of(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


def first_cells(text: str) -> set[str]:
    """What stands as code in the first column of tables."""
    cells = re.findall(r"^\| ([^|]*) \|", text, re.MULTILINE)
    return {name for cell in cells for name in re.findall(r"`([^`]+)`", cell)}


@pytest.mark.parametrize("name", ["fields_", "columns", "dragdeck", "dragchain"])
def test_every_field_column_and_option_has_a_meaning(name: str) -> None:
    text = "\n".join(make() for key, make in reference.TEXTS.items() if key.startswith(name))
    rows = re.findall(r"^\| `(.*?)` (?:\|.*)?\| ?(.*?) \|$", text, re.M)
    assert len(rows) > 20
    assert [field for field, meaning in rows if not meaning.strip()] == []


def test_every_block_of_the_study_file_is_on_a_page() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    blocks = [name for name in reference.TEXTS if name.startswith("fields_")]
    assert [name for name in blocks if f"<!--begin {name}-->" not in text] == []


def section(page: str, start: str, end: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8").partition(start)[2].partition(end)[0]


def test_every_target_is_on_the_page_and_in_the_usage() -> None:
    usage = "".join(file.read_text() for file in (ROOT / "workflow").glob("[ur]*.*"))
    rules = "".join(file.read_text() for file in SNAKEFILES)
    targets = set(re.findall(r"^rule (\w+):", rules, re.M))
    assert first_cells(section("docs/reference/snakemake.md", "## Targets", "\n## ")) == targets
    assert all(re.search(rf"\b{target}\b", usage) for target in targets)


def test_every_key_of_the_configuration_is_in_its_file_and_on_the_page() -> None:
    config = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())
    keys = set(config["properties"])
    assert set(yaml.safe_load((ROOT / "config/config.yaml").read_text())) == keys
    page = "docs/reference/snakemake.md"
    assert first_cells(section(page, "| key | default |", "\n\n")) == keys


def test_every_check_and_warning_is_on_the_page() -> None:
    checks, _, rest = text_of("reference/checks.md").partition("## Warnings")
    codes = set(get_args(CheckCode)) - {"neighbour_builds"}  # of runs of version 0.2
    cautions = set(get_args(CautionCode))
    assert first_cells(checks.partition("`within_limits` is also")[0]) == codes
    named = {name for name in first_cells(rest) if re.fullmatch("[a-z_]+", name)}
    assert cautions <= named <= cautions | codes


def test_every_value_and_block_of_the_templates_is_on_the_page() -> None:
    named = set(re.findall(r"[`.](\w+)`", text_of("reference/templates.md")))
    for deck in (DropDeck, FillingDeck, ProcessDeck):
        assert set(deck.__dataclass_fields__) - {"materials"} <= named
    for template in (ROOT / "templates").glob("*.in.j2"):
        assert set(re.findall(r"{% block (\w+) %}", template.read_text())) <= named, template


def test_every_public_name_of_dragchain_is_on_the_page() -> None:
    text = text_of("reference/python.md")
    assert [name for name in dragchain.__all__ if name not in text] == []


def test_every_source_is_cited_and_every_cited_one_known() -> None:
    entries = parse_file(str(DOCS / "references.bib")).entries
    pages = "".join(page.read_text() for page in PAGES if page.name != "bibliography.md")
    assert set(re.findall(r"bibliography\.md#(\w+)", pages)) <= set(entries)
    folders = ("analysis", "workflow", "evidence", "benchmarks", "studies", "tests")
    code = (file for name in folders for file in (ROOT / name).rglob("*.*"))
    texts = [file.read_text() for file in code if file.suffix in (".py", ".yaml", ".csv", ".j2")]
    text = "".join([pages, *texts])
    authors = {key: entry.persons["author"][0].last_names[-1] for key, entry in entries.items()}
    assert [key for key, name in authors.items() if str(name).strip("{}") not in text] == []


@pytest.mark.parametrize("law", read_scalings(), ids=lambda law: law.study)
def test_the_scalings_are_those_of_the_studies_and_on_the_page(law: ScalingFile) -> None:
    exponent, rest = said(law).removeprefix(f"{law.field}: ").replace(MINUS, "-").split("; ")
    expected, _ = rest.rsplit(": ", 1)
    lines = text_of("evidence/scaling.md").splitlines()
    (line,) = (line for line in lines if f"{law.verdict}: {exponent}, " in line)
    assert expected in line
    cases = Project(ROOT).cases(law.study)
    scaling = cases[0].study.scaling
    assert scaling is not None and scaling.fit_range is None
    assert (scaling.field, scaling.expected_exponent, scaling.source) == (
        *(law.field, law.expected.exponent, law.expected.source),
    )
    assert {run.run for run in law.runs} == {PROCESS.run_id(case) for case in cases}


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_names_its_study_first_and_is_stored_with_its_output(file: Path) -> None:
    notebook = nbformat.read(file, as_version=4)
    first, *cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    study = re.fullmatch(r'study_name = "([\w-]+)"', first.source)
    assert study is not None and Project(ROOT).cases(study[1])
    assert not any(study[1] in cell.source or not cell.outputs for cell in cells)
    texts = [output.get("text", "") + output.get("data", {}).get("text/plain", "")
             for cell in cells for output in cell.outputs]  # fmt: skip
    assert not re.search(r"(^|[\s'\"(])/\w+/", "\n".join(texts))
    assert not any("execution" in cell.metadata for cell in cells)
    links = re.findall(r"\]\(([^)#:]+)", file.read_text())
    assert all((file.parent / link).exists() for link in links)
    assert f"examples/{file.name}" in text_of("howto/results.md")
