"""Spelling, and the terms of the glossary, in everything that a user reads."""

import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest
from doc_pages import FENCE, name_of
from doc_pages import PAGES as ALL_PAGES
from paths import ROOT

PAGES = [page for page in ALL_PAGES if page.name not in ("bibliography.md", "glossary.md")]
"""Others quote titles, or name the words that others replace."""

TERMS = ROOT / "docs/words.txt"
"""Words that the glossary replaces, in the form of codespell's dictionaries."""

AMERICAN = {"analyse", "analysed", "analyses", "analysing"}
"""British forms whose American ones are words of their own or names in the code."""

PHRASES = (
    r"\ba (row|frame|line|file|contact|case|core) an? (case|run|file|ball|particle|frame|step)\b",
    r"\b(gates?|intervals?|checks?) (holds?|held)\b",
    r"\bby the clock\b",
    r"\bto the last bit\b",
    r"\bgoes on from\b",
    r"(?i)\b(the|a|this|same|what|time)? ?shares? of (the|a|all|its)\b",
    r"\bprocessor time\b",
    r"\brun-in\b",
    r"\b(soft|full) balls?\b",
    r"\bmetre of way\b",
)
"""Patterns of words that read like a translation."""

QUOTED = {"explanation_process": {"balls", "submersion"}}
"""Words of the paper, in a table of its symbols."""

TEMPLATES = sorted(
    file
    for folder in ("templates", "analysis", "evidence", "workflow")
    for file in (ROOT / folder).rglob("*.j2")
)


def words_of(page: Path) -> str:
    """The text of a page, made parts included, without code and targets of links."""
    text = FENCE.sub("\n", page.read_text(encoding="utf-8"))
    text = re.sub(r"<!--.*?-->", " ", text, flags=re.S)
    text = re.sub(r"``[^`]*``|`[^`\n]*`", " ", text)
    text = re.sub(r"\bhttps?://\S+", " ", text)
    return re.sub(r"\]\([^)]*\)", "]", text)


def words_of_template(file: Path) -> str:
    """The text of a template, without tags and expressions."""
    code = r"{[{%#].*?[}%#]}|<style.*?</style>|<script.*?</script>"
    text = re.sub(code, " ", file.read_text(), flags=re.S)
    if file.name.endswith(".in.j2"):  # a script of LIGGGHTS: its comments
        return "\n".join(re.findall("^ *#(.*)", text, re.M))
    return re.sub(r"<[^>]*>", " ", text)


@pytest.fixture(scope="module")
def british(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dictionary that takes American spelling for a mistake."""
    pairs = (files("codespell_lib") / "data/dictionary_en-GB_to_en-US.txt").read_text()
    lines = [
        f"{american.strip(', ')}->{other}"
        for other, _, american in (line.partition("->") for line in pairs.splitlines())
        if american and "," not in american.strip(", ") and other not in AMERICAN
    ]
    file = tmp_path_factory.mktemp("words") / "british.txt"
    file.write_text("\n".join(lines) + "\n")
    return file


def misspelt(folder: Path, *dictionaries: str) -> list[str]:
    """What codespell finds in a folder."""
    words = [sys.executable, "-m", "codespell_lib", "--quiet-level", "3"]
    for dictionary in dictionaries:
        words += ["--dictionary", dictionary]
    ignored = ["--ignore-words", str(ROOT / "docs/words_allowed.txt")]
    ran = subprocess.run([*words, *ignored, "."], cwd=folder, capture_output=True, text=True)
    assert ran.returncode in (0, 65), ran.stderr
    return ran.stdout.splitlines()


@pytest.fixture(scope="module")
def texts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("texts")
    for file in (*PAGES, *TEMPLATES):
        text = words_of(file) if file.suffix == ".md" else words_of_template(file)
        (folder / name_of(file).replace("/", "_")).write_text(text)
    return folder


def test_the_spelling_is_british(texts: Path, british: Path) -> None:
    assert misspelt(texts, "-", str(british)) == []


def test_the_terms_are_those_of_the_glossary(texts: Path) -> None:
    strange = [
        line
        for line in misspelt(texts, str(TERMS))
        if not any(page in line and line.split()[1] in words for page, words in QUOTED.items())
    ]
    assert strange == []


@pytest.mark.parametrize("file", [*PAGES, *TEMPLATES], ids=name_of)
def test_no_phrase_reads_like_a_translation(file: Path) -> None:
    text = words_of(file) if file.suffix == ".md" else words_of_template(file)
    assert [found[0] for phrase in PHRASES for found in re.finditer(phrase, text)] == []


def test_the_check_finds_what_it_is_for(tmp_path: Path, british: Path) -> None:
    (tmp_path / "page.md").write_text(
        "The knob of recieve and center. One row a case, a row a case."
    )
    found = "\n".join(misspelt(tmp_path, "-", str(british), str(TERMS)))
    assert all(word in found for word in ("knob", "recieve", "center"))
    assert re.search(PHRASES[0], (tmp_path / "page.md").read_text())
