"""The pages become a site; links, anchors and figures exist."""

import re
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import pytest
from doc_pages import PAGES, name_of
from figures import FIGURES, IMAGES, svg
from mathml import mathml
from paths import ROOT
from PIL import Image
from worked_examples import EXAMPLES, few_colours

PICTURES = ROOT / "docs/examples/images"
LINK = re.compile(r"(?<!\\)\]\(([^)\s]+)\)")


@pytest.mark.slow
def test_sphinx_builds_the_site_without_a_warning(tmp_path: Path) -> None:
    words = ["sphinx-build", "--quiet", "--fail-on-warning", "--keep-going", "docs", tmp_path]
    ran = subprocess.run(
        [sys.executable, "-m", "sphinx", *map(str, words[1:])],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, ran.stderr[-3000:]
    pages = {page.name: page.read_text() for page in tmp_path.rglob("*.html")}
    assert "index.html" in pages
    assert [name for name, text in pages.items() if re.search(r"[\s>(]\u2013[a-z]", text)] == []


def anchors(page: Path) -> set[str]:
    """Anchors of the headings of a page, as code hosting sites and Sphinx make them."""
    slugs: set[str] = set()
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    for heading in re.findall(r"^#+ (.*)$", text, re.M):
        heading = re.sub(r"<!--.*?-->", "", heading)
        words = re.sub(r"[^\w\- ]", "", re.sub(r"\]\([^)]*\)", "", heading).lower())
        slug, count = words.strip().replace(" ", "-"), 0
        while (name := f"{slug}-{count}" if count else slug) in slugs:
            count += 1
        slugs.add(name)
    return slugs


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_link_leads_somewhere(page: Path) -> None:
    missing = []
    for link in LINK.findall(re.sub(r"```.*?```", "", page.read_text(), flags=re.S)):
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        known = ":" in path or target.exists()
        if not known or (anchor and target.suffix == ".md" and anchor not in anchors(target)):
            missing.append(link)
    assert missing == []


def test_no_line_of_a_page_is_taken_for_a_comment() -> None:
    """A line that begins with a percent sign is one for Sphinx, and is left out."""
    assert [name_of(page) for page in PAGES if re.search("^%", page.read_text(), re.M)] == []


def test_every_image_is_shown_and_every_figure_is_drawn() -> None:
    text = "".join(page.read_text() for page in PAGES)
    pictures = {f"{study}_{name}.png" for study, places in EXAMPLES.items() for name in places}
    drawn = {"geometry.svg", *(f"{name}.svg" for name in FIGURES)}  # the first by hand
    for folder, made in ((IMAGES, drawn), (PICTURES, pictures)):
        assert {file.name for file in folder.iterdir()} == made
        assert {name for name in made if f"images/{name}" not in text} == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_can_be_drawn_from_the_records(name: str) -> None:
    drawn = svg(name)
    assert drawn.startswith("<?xml") and len(drawn) > 5000


def test_a_picture_is_kept_in_few_colours() -> None:
    file = PICTURES / "carousel_preview.png"
    with Image.open(BytesIO(few_colours(file))) as drawn, Image.open(file) as kept:
        assert drawn.mode == "P" and drawn.size == kept.size


@pytest.mark.parametrize(
    ("latex", "bold"), [(r"s = |\mathbf s|", "\U0001d42c"), (r"\boldsymbol\xi", "\U0001d743")]
)
def test_vectors_are_bold_letters(latex: str, bold: str) -> None:
    assert f"<mi>{bold}</mi>" in mathml(latex) and 'mathvariant="bold' not in mathml(latex)
