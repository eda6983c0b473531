"""The frame, the style and the pieces that all pages share."""

import jinja2
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pages import stands_alone

from dragchain.report.page import (
    DASH,
    MINUS,
    data_uri,
    measured,
    number,
    page_environment,
    with_interval,
)
from dragchain.statistics.estimate import Estimate

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


def test_a_listing_writes_each_column_in_its_form() -> None:
    drag = {"value": 1.5, "ci95_low": 1.0, "ci95_high": 2.0}
    rows = [("a & b", {"mean": 0.25, "said": "confirmed", **drag}), ("a & b", {"mean": None})]
    text = """{% from "report/macros.html.j2" import listing %}
{{ listing(rows, [("case", "0", {"a & b": "both"}), ("drag (N)", "1.mean", "measured:3")]) }}
{{ listing(rows[:1], [("case", "0", ""), ("said", "1.said", "verdict"),
                       ("", "1", "estimate:2")]) }}"""
    listed = page_environment().from_string(text).render(rows=rows).replace("\n", "")
    assert '<th>case</th><th class="n">drag (N)</th>' in listed
    assert '<td>both</td><td class="n">0.250</td>' in listed
    assert f'<td>both</td><td class="n">{DASH}</td>' in listed
    assert '<td>a &amp; b</td><td class="line good">confirmed</td>' in listed
    assert '<td class="n">1.5 <span class="interval">(1.0 to 2.0)</span></td>' in listed


def test_what_is_not_given_is_an_error() -> None:
    with pytest.raises(jinja2.UndefinedError, match="nothing"):
        page(PAGE.replace("{{ count }}", "{{ nothing }}"))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-2.626, "\N{MINUS SIGN}2.63"), (0.0, "0"), (1234.5, "1234"),
        (160000, "160\N{NARROW NO-BREAK SPACE}000"),
        (2727567.0, "2\N{NARROW NO-BREAK SPACE}727\N{NARROW NO-BREAK SPACE}567"),
        (1.66e-5, "1.66 \N{MULTIPLICATION SIGN} 10⁻⁵"), (None, "\N{EN DASH}"),
        (float("nan"), "\N{EN DASH}"),
        (float("inf"), "\N{EN DASH}"), ("draft", "draft"), (True, "True"),
    ],
)  # fmt: skip
def test_numbers_read_well(value: object, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.7, "0.700"), (18.0, "18.0"), (-2.5, "\N{MINUS SIGN}2.50"), (345.6, "346"),
        (4321.0, "4321"), (0.0, "0"), (4, "4"), (None, "\N{EN DASH}"),
    ],
)  # fmt: skip
def test_measured_numbers_keep_their_zeros(value: object, text: str) -> None:
    assert measured(value) == text


@pytest.mark.parametrize(
    ("ends", "text"),
    [
        ((-2.641, -2.784, -2.502), f"{MINUS}2.64 N ({MINUS}2.78 to {MINUS}2.50)"),
        ((23.31, 18.5, 29.36), "23.3 N (18.5 to 29.4)"),
        ((0.0231234, 0.0231233, 0.0231235), "0.02312 N (0.02312 to 0.02312)"),
        ((1.713e-5, 1.288e-5, 2.279e-5), "1.71 (1.29 to 2.28) \N{MULTIPLICATION SIGN} 10⁻⁵ N"),
        ((38094.5, 33627.0, 42455.0), "38\u202f094 N (33\u202f627 to 42\u202f455)"),
        ((0.7, float("nan"), float("nan")), "0.700 N"), ((4.0, 4.0, 4.0), "4.00 N"),
    ],
)  # fmt: skip
def test_a_value_has_the_decimals_of_its_interval(
    ends: tuple[float, float, float], text: str
) -> None:
    assert with_interval(Estimate(*ends), "N") == text


@given(st.floats(1e-4, 9.9e6), st.integers(1, 5))
def test_no_usual_number_is_shown_with_a_power_of_ten(value: float, digits: int) -> None:
    """Not beside others of its kind: 52 to 100 %, not 52 to 1.0 x 10^2 %."""
    shown = measured(value, digits).replace("\N{NARROW NO-BREAK SPACE}", "")
    assert float(shown) == pytest.approx(value, rel=0.51 * 10 ** (1 - digits))


def test_a_number_that_rounds_up_to_more_digits() -> None:
    assert [measured(value, 2) for value in (52.0, 99.4, 99.6, 99.96)] == ["52", "99", "100", "100"]
