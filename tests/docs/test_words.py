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

PHRASES = re.compile(
    r"\ba (row|frame|line|file|contact|case|core) an? (case|run|file|ball|particle|frame|step)\b"
    r"|\b(gates?|intervals?|checks?) (holds?|held)\b|\bby the clock\b|\bto the last bit\b"
    r"|\bgoes on from\b|\bprocessor time\b|\brun-in\b|\b(soft|full) balls?\b|\bmetre of way\b"
    r"|(?i:\b(the|a|this|same|what|time)? ?shares? of (the|a|all|its)\b)"
)
"""Patterns of words that read like a translation."""

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
    (folder / "check").write_text("The knob of recieve and center. One row a case, a row a case.")
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
    found = [line.removeprefix("./") for line in ran.stdout.splitlines()]
    checked = [line for line in found if line.startswith("check:")]
    assert len(checked) == 3, ran.stderr  # the check finds what it is for
    quoted = [line for line in found for page, words in QUOTED.items()
              if line.startswith(page) and line.split()[1] in words]  # fmt: skip
    assert sorted(set(found) - set(checked) - set(quoted)) == []


def test_no_phrase_reads_like_a_translation(texts: Path) -> None:
    found = {
        file.name: [phrase[0] for phrase in PHRASES.finditer(file.read_text())]
        for file in texts.iterdir()
    }
    assert found.pop("check") == ["a row a case"]
    assert {name: phrases for name, phrases in found.items() if phrases} == {}
