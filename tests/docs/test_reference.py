"""The reference is that of the code: nothing is missing, and nothing is made up."""

import json
import re
from pathlib import Path
from typing import get_args

import nbformat
import pytest
import reference
import study_fields
import yaml
from doc_pages import PAGES, template_examples
from paths import ROOT
from pybtex.database import parse_file

import dragchain
from dragchain.report.page import MINUS
from dragchain.scaling.document import ScalingFile
from dragchain.scaling.fit import read_scalings, said
from dragdeck.cases.case import Case
from dragdeck.cli import main
from dragdeck.errors import CautionCode
from dragdeck.project import Project
from dragdeck.records.run import CheckCode
from dragdeck.scenes.drop_test import DropDeck
from dragdeck.scenes.filling import FillingDeck
from dragdeck.scenes.process import PROCESS, ProcessDeck

DOCS = ROOT / "docs"
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
CONFIG = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())["properties"]
INSIDE = {"pass_verdict", "render_verification"}
"""Rules without outputs of their own that are no targets."""


def text_of(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


def first_cells(text: str) -> set[str]:
    """What stands as code in the first column of tables."""
    cells = re.findall(r"^\| ([^|]*) \|", text, re.MULTILINE)
    return {name for cell in cells for name in re.findall(r"`([^`]+)`", cell)}


def test_every_field_has_a_meaning() -> None:
    rows = re.findall(r"^\| `(.*?)` \|(.*?)\|(.*?)\| (.*?) \|$", study_fields.fields(), re.M)
    assert len(rows) > 50
    assert [row[0] for row in rows if not row[3].strip()] == []


def test_every_command_and_option_says_what_it_does() -> None:
    for made in (reference.TEXTS["dragdeck_commands"](), reference.TEXTS["dragchain_commands"]()):
        rows = re.findall(r"^\| `(.*?)` \|(.*)\|$", made, re.M)
        assert rows and all(words.strip() for _, words in rows)


def test_every_target_is_on_the_page() -> None:
    snakefile = (ROOT / "Snakefile").read_text()
    targets = set(re.findall(r"^rule (\w+):", snakefile, re.M)) - INSIDE
    section = text_of("reference/snakemake.md").partition("## Targets")[2].partition("\n## ")[0]
    assert first_cells(section) == targets
    usage = (ROOT / "run").read_text()
    assert all(re.search(rf"\b{target}\b", usage) for target in targets)


@pytest.mark.parametrize("page", ["docs/reference/snakemake.md", "config/README.md"])
def test_every_key_of_the_configuration_is_on_the_page(page: str) -> None:
    section = (ROOT / page).read_text().partition("| key | default |")[2].partition("\n\n")[0]
    assert first_cells(section) == set(CONFIG)


def test_the_configuration_has_every_key_of_its_schema() -> None:
    assert set(yaml.safe_load((ROOT / "config/config.yaml").read_text())) == set(CONFIG)


def test_every_check_and_warning_is_on_the_page() -> None:
    text = text_of("reference/checks.md")
    checks, _, rest = text.partition("## Warnings")
    codes = {code for code in first_cells(checks.partition("`within_limits` is also")[0])}
    assert codes == set(get_args(CheckCode))
    assert first_cells(rest) >= set(get_args(CautionCode))
    known = {*get_args(CautionCode), *get_args(CheckCode)}
    assert {name for name in first_cells(rest) if re.fullmatch("[a-z_]+", name)} <= known


@pytest.mark.parametrize("deck", [DropDeck, FillingDeck, ProcessDeck])
def test_every_value_of_a_deck_is_on_the_page(deck: type) -> None:
    names = set(re.findall(r"[`.](\w+)`", text_of("reference/templates.md")))
    assert set(deck.__dataclass_fields__) - {"materials"} <= names


def test_every_block_of_the_templates_is_on_the_page() -> None:
    text = text_of("reference/templates.md")
    for template in (ROOT / "templates").glob("*.in.j2"):
        for block in re.findall(r"{% block (\w+) %}", template.read_text()):
            assert f"`{block}`" in text, f"{template.name}: block {block}"


@pytest.mark.engine
@pytest.mark.parametrize("name", template_examples())
def test_a_template_of_the_how_to_passes_the_check(
    name: str, case: Case, project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = case.file.parent / "templates" / name
    file.parent.mkdir()
    file.write_text(template_examples()[name])
    monkeypatch.chdir(project.root)
    assert main(["check", "small"]) == 0


def test_the_how_to_changes_law_damping_and_output() -> None:
    assert set(template_examples()) == {"base.in.j2", "filling.in.j2", "process.in.j2"}
    shallow = ROOT / "studies/shallow/templates/process.in.j2"
    assert template_examples()["process.in.j2"] == shallow.read_text()


def test_every_public_name_of_dragchain_is_on_the_page() -> None:
    text = text_of("reference/python.md")
    assert [name for name in dragchain.__all__ if name not in text] == []


def test_every_source_that_a_page_cites_is_known() -> None:
    keys = set(re.findall(r"^@\w+{(\w+),", text_of("references.bib"), re.M))
    cited = {
        key for page in PAGES for key in re.findall(r"bibliography\.md#(\w+)", page.read_text())
    }
    assert cited and cited <= keys


def test_every_source_is_named_in_a_page_or_in_the_code() -> None:
    folders = ("analysis", "workflow", "evidence", "benchmarks", "studies", "tests")
    code = [file for name in folders for file in (ROOT / name).rglob("*.*")]
    code = [file for file in code if file.suffix in (".py", ".yaml", ".csv", ".j2")]
    pages = [page for page in PAGES if page.name != "bibliography.md"]
    text = "".join(file.read_text(encoding="utf-8") for file in (*code, *pages))
    entries = parse_file(str(DOCS / "references.bib")).entries
    first = {
        key: str(entry.persons["author"][0].last_names[-1]).strip("{}")
        for key, entry in entries.items()
    }
    assert [key for key, name in first.items() if name not in text] == []


@pytest.mark.parametrize("found", read_scalings(), ids=lambda found: found.study)
def test_the_scalings_are_those_of_the_studies_and_on_the_page(found: ScalingFile) -> None:
    statement = said(found).splitlines()[0].removeprefix(f"{found.field}: ").replace(MINUS, "-")
    assert statement in text_of("evidence/scaling.md")
    cases = Project(ROOT).cases(found.study)
    scaling = cases[0].study.scaling
    assert scaling is not None and scaling.fit_range is None
    assert (scaling.field, scaling.expected_exponent, scaling.source) == (
        *(found.field, found.expected.exponent, found.expected.source),
    )
    assert {run.run for run in found.runs} == {PROCESS.run_id(case) for case in cases}


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_names_its_study_first(file) -> None:
    notebook = json.loads(file.read_text())
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    study = re.fullmatch(r'study_name = "([\w-]+)"', "".join(code[0]["source"]))
    assert study is not None and Project(ROOT).cases(study[1])
    assert not any(study[1] in "".join(cell["source"]) for cell in code[1:])
    links = re.findall(r"\]\(([^)#:]+)", file.read_text())
    assert all((file.parent / link).exists() for link in links)


def test_the_notebooks_are_on_a_page() -> None:
    text = text_of("howto/results.md")
    assert NOTEBOOKS and all(f"examples/{file.name}" in text for file in NOTEBOOKS)


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_is_stored_with_its_output_but_no_place_or_time(file: Path) -> None:
    notebook = nbformat.read(file, as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.source for cell in cells[1:] if not cell.outputs] == []
    texts = [one.get("text", "") + one.get("data", {}).get("text/plain", "")
             for cell in cells for one in cell.outputs]  # fmt: skip
    assert not re.search(r"(^|[\s'\"(])/\w+/", "\n".join(texts))
    assert not any("execution" in cell.metadata for cell in cells)
