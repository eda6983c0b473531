"""The frame, the style and the pieces that all pages share."""

import base64
import io
from pathlib import Path

import jinja2
import numpy as np
import pytest
from pages import stands_alone
from PIL import Image

import dragchain
import evidence
from dragchain.report.page import (
    LARGE_PICTURE,
    data_uri,
    file_uri,
    page_environment,
    sections,
    slug,
)
from dragchain.tradeoff.report import FILTERS

FOLDERS = [Path(package.__path__[0]) for package in (dragchain, evidence)]
TEMPLATES = {
    file.relative_to(folder).as_posix(): file
    for folder in FOLDERS
    for file in sorted(folder.rglob("*.html.j2"))
}
PAGES = [
    "calibration/calibration.html.j2", "report/report.html.j2", "stability/stability.html.j2",
    "tradeoff/tradeoff.html.j2",
    "validation/validation.html.j2", "verification/verification.html.j2",
]  # fmt: skip
PAGE = """{% extends "report/page.html.j2" %}
{% from "report/macros.html.j2" import box, estimate, figure, section, table, verdict %}
{% block title %}Drag & drop{% endblock %}
{% block lead %}of {{ count }} particles{% endblock %}
{% block says %}<p>It drags.</p>{% endblock %}
{% block body %}
{{ section("Force on the workpiece") }}
{{ section("Case 1", "run-1") }}
{% call table("tight") %}
<tr><th>drag</th><td>{{ estimate(drag) }}</td>{{ verdict("confirmed") }}</tr>
{% endcall %}
{% call box("assumed") %}
<p>The <b>radius</b>: 5 %.</p>
{% endcall %}
{{ figure(picture, "A <caption>.") }}
{{ figure(none, "No picture, no caption.") }}
{% endblock %}
"""


def page(text: str = PAGE) -> str:
    drag = {"value": -2.5, "ci95_low": -2.6, "ci95_high": -2.4}
    content = {"count": 3, "drag": drag, "picture": data_uri(b"x")}
    return page_environment().from_string(text).render(content)


def test_a_page_is_whole_and_needs_nothing_else() -> None:
    read = stands_alone(page())
    assert read.title == "Drag & drop"
    assert "of 3 particles" in read.words and "It drags." in read.words
    assert "\N{MINUS SIGN}2.50 (\N{MINUS SIGN}2.60 to \N{MINUS SIGN}2.40)" in read.words
    assert "A <caption>." in read.words and "No picture" not in read.words
    assert len(read.images) == 1


def test_the_head_of_a_page_points_to_its_sections() -> None:
    read = stands_alone(page())
    links = [link for link in read.references if link.startswith("#")]
    assert links == ["#force-on-the-workpiece", "#run-1"]
    assert read.words.count("Force on the workpiece") == 2


def test_what_is_not_given_is_an_error() -> None:
    with pytest.raises(jinja2.UndefinedError, match="nothing"):
        page(PAGE.replace("{{ count }}", "{{ nothing }}"))


@pytest.mark.parametrize("block", ["title", "lead", "says", "body"])
def test_a_page_that_leaves_out_a_block_is_refused(block: str) -> None:
    with pytest.raises(jinja2.TemplateRuntimeError, match=block):
        page(PAGE.replace(f"block {block} ", "block other "))


@pytest.mark.parametrize("name", PAGES)
def test_every_page_packings_the_frame(name: str) -> None:
    environment = page_environment({**FILTERS, "quantity": str, "setting": str}, "evidence")
    template = environment.get_template(name)
    assert {"title", "lead", "says", "body"} <= set(template.blocks)
    source = TEMPLATES[name].read_text(encoding="utf-8")
    assert source.startswith('{% extends "report/page.html.j2" %}')


FRAMES = ("report/page.html.j2", "network_page/network.html.j2")
"""The frame of all pages, and the page that is an application of its own."""


@pytest.mark.parametrize("name", [name for name in TEMPLATES if name not in FRAMES])
def test_one_style_sheet_is_enough(name: str) -> None:
    source = TEMPLATES[name].read_text(encoding="utf-8")
    for word in ("<style", "<script", "<link", "<html", "http://", "https://"):
        assert word not in source


def test_names_of_sections() -> None:
    assert slug("Do chains explain the peaks?") == "do-chains-explain-the-peaks"
    body = '<h2 id="a">Load &amp; wear</h2><h2>no name</h2>\n<h2 id="b">B</h2>'
    assert sections(body) == [("a", "Load &amp; wear"), ("b", "B")]


def test_a_file_that_is_not_there_is_no_picture(tmp_path: Path) -> None:
    assert file_uri(tmp_path / "film.gif") is None
    (tmp_path / "film.gif").write_bytes(b"film")
    uri = file_uri(tmp_path / "film.gif")
    assert uri == "data:image/gif;base64," + base64.b64encode(b"film").decode()


def test_a_large_picture_is_made_smaller_but_not_another() -> None:
    noise = np.random.default_rng(1).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    drawn = Image.fromarray(noise).resize((800, 600), Image.Resampling.BICUBIC)
    large = io.BytesIO()
    drawn.save(large, format="png")
    uri = data_uri(large.getvalue())
    assert uri.startswith("data:image/webp;base64,")
    small = base64.b64decode(uri.split(",")[1])
    assert len(large.getvalue()) > LARGE_PICTURE > len(small)
    with Image.open(io.BytesIO(small)) as shown:
        change = np.abs(np.asarray(shown.convert("L"), int) - np.asarray(drawn.convert("L"), int))
    assert change.mean() < 4
