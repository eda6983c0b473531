"""Spelling, and the terms of the glossary, in everything that a user reads."""

import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest
from doc_pages import FENCE, PAGES, name_of
from paths import ROOT

TERMS = ROOT / "docs/words.txt"
"""Words that the glossary replaces, in the form of codespell's dictionaries."""

QUOTED = {"docs_explanation_process.md": {"balls", "submersion"}}
"""Words of the paper, in a table of its symbols."""


def words_of(file: Path) -> str:
    """The text of a page without code and targets of links, of a template without tags."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".md":
        for code in (FENCE, r"(?s)<!--.*?-->", r"``[^`]*``|`[^`\n]*`|\bhttps?://\S+"):
            text = re.sub(code, " ", text)
        return re.sub(r"\]\([^)]*\)", "]", text)
    text = re.sub(r"(?s){[{%#].*?[}%#]}|<style.*?</style>|<script.*?</script>", " ", text)
    if file.name.endswith(".in.j2"):  # a script of LIGGGHTS: its comments
        return "\n".join(re.findall("^ *#(.*)", text, re.M))
    return re.sub(r"<[^>]*>", " ", text)


@pytest.fixture(scope="module")
def texts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The texts of pages and templates; not those that quote titles or replaced words."""
    folder = tmp_path_factory.mktemp("texts")
    pages = [page for page in PAGES if page.name not in ("bibliography.md", "glossary.md")]
    templates = [file for name in ("templates", "analysis", "evidence", "workflow")
                 for file in (ROOT / name).rglob("*.j2")]  # fmt: skip
    for file in (*pages, *templates):
        (folder / name_of(file).replace("/", "_")).write_text(words_of(file))
    (folder / "check").write_text("The knob of recieve and center.")
    return folder


@pytest.fixture(scope="module")
def british(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dictionary that takes American spelling for a mistake, but not forms of ``analyse``."""
    pairs = (files("codespell_lib") / "data/dictionary_en-GB_to_en-US.txt").read_text()
    lines = [
        f"{american.strip(', ')}->{other}"
        for other, _, american in (line.partition("->") for line in pairs.splitlines())
        if american and "," not in american.strip(", ") and not other.startswith("analys")
    ]
    file = tmp_path_factory.mktemp("words") / "british.txt"
    file.write_text("\n".join(lines) + "\n")
    return file


def test_spelling_is_british_and_terms_are_those_of_the_glossary(
    texts: Path, british: Path
) -> None:
    words = [sys.executable, "-m", "codespell_lib", "--quiet-level", "3", "--ignore-words"]
    words += [str(ROOT / "docs/words_allowed.txt")]
    for dictionary in ("-", str(british), str(TERMS)):
        words += ["--dictionary", dictionary]
    ran = subprocess.run([*words, "."], cwd=texts, capture_output=True, text=True)
    listed = [line.removeprefix("./") for line in ran.stdout.splitlines()]
    checked = [line for line in listed if line.startswith("check:")]
    assert len(checked) == 3, ran.stderr  # the check finds what it is for
    quoted = [line for line in listed for page, words in QUOTED.items()
              if line.startswith(page) and line.split()[1] in words]  # fmt: skip
    assert sorted(set(listed) - set(checked) - set(quoted)) == []
