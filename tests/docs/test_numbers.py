"""Numbers in the pages come from records."""

import math

import pytest
from doc_pages import PAGES, name_of
from page_parts import PageError, Parts, stale_files, table_recipes, values
from paths import ROOT
from records import change, record_table, shown_value

from dragdeck.cases.bed import bed_rayleigh_time, bed_timestep, full_stiffness_number
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.project import Project
from dragdeck.records.stability import stable_step_law
from dragdeck.study.fidelity import BUILT_IN_FIDELITIES
from evidence.verification.law import limited_restitution

TEXT = "".join(page.read_text(encoding="utf-8") for page in PAGES)


def test_values_and_pages_are_up_to_date() -> None:
    """`./run docs` renews them."""
    assert [name_of(file) for file, _ in stale_files()] == []


def test_every_name_is_short_and_on_a_page() -> None:
    names = [*values()["name"], *table_recipes()]
    assert len(set(names)) == len(names)
    assert [name for name in names if len(f"<!--{name}-->") > 25] == []
    assert [name for name in names if f"<!--{name}-->" not in TEXT] == []


def test_the_numbers_of_the_papers_study_are_those_of_the_code() -> None:
    study, law = Project(ROOT).cases("uhlmann2015")[0].study, stable_step_law()
    media, motion, spread = study.media, study.motion, study.media.radius_std_m
    particle, own = study.materials[str(media.material)], study.pair(*[str(media.material)] * 2)
    computed = []
    for name, fidelity in BUILT_IN_FIDELITIES.items():
        scaled = study.model_copy(update={"fidelity": fidelity})
        step, scale = bed_timestep(scaled, "timestep_fraction"), fidelity.youngs_modulus_scale
        stiffness = full_stiffness_number(scaled) * scale ** (2 / 3)
        unstable = law.largest_fraction(stiffness, own.restitution, spread / media.radius_mean_m)
        steps = motion.path_length_m / motion.nominal_speed_m_s / step
        times = 1e6 * bed_rayleigh_time(scaled), 1e6 * step, steps / 1e6
        computed.append([name, scale, fidelity.timestep_fraction, *times, unstable])
    known = record_table("paper/presets")
    assert computed == [[row[0], *map(pytest.approx, row[1:])] for row in known.to_numpy().tolist()]
    for _, pair, dashpot, stiffness in record_table("paper/contacts").itertuples():
        partner = study.materials[pair.split("-")[1]]
        shear = mechanics.effective_shear(particle, partner)
        both = [mechanics.shear_modulus(material) for material in (particle, partner)]
        ratio = (particle.poissons_ratio + partner.poissons_ratio) / 2
        assert dashpot == pytest.approx(
            math.sqrt(4 * shear / mechanics.effective_modulus(particle, partner))
        )
        assert stiffness == pytest.approx(sum(both) / (2 - ratio) / (4 * shear))


# --- what the tool does -------------------------------------------------------------------

PARTS = Parts(
    old={"drag": "-2.5 N", "load": "5"},
    new={"drag": "-2.6 N (95 % CI -2.7 to -2.5)", "load": "5"},
    table=lambda name: f"| {name} |",
    text=lambda name: f"```text\n{name}\n```",
)


@pytest.mark.parametrize(
    ("page", "wanted"),
    [
        ("a drag of -2.5\nN<!--drag-->.", "a drag of -2.6 N (95 % CI -2.7 to -2.5)<!--drag-->."),
        ("(<!--drag-->)", "(-2.6 N (95 % CI -2.7 to -2.5)<!--drag-->)"),
        ("`4.5` or 5<!--load-->", "`4.5` or 5<!--load-->"),
        ("<!--spin-->\n| old |\n\nend", "<!--spin-->\n| spin |\n\nend"),
        (
            "<!--begin help-->\n```sh\nold\n```\n<!--end-->",
            "<!--begin help-->\n```text\nhelp\n```\n<!--end-->",
        ),
        ("```markdown\n7<!--load-->\n```", "```markdown\n7<!--load-->\n```"),
    ],
)
def test_the_parts_of_a_page_are_renewed(page: str, wanted: str) -> None:
    assert PARTS.renewed(page) == wanted
    assert PARTS.renewed(wanted) == wanted


@pytest.mark.parametrize("page", ["-2.7 N<!--drag-->", "15<!--load-->", "5<!--unknown-->"])
def test_a_value_that_was_typed_is_refused(page: str) -> None:
    with pytest.raises(PageError):
        PARTS.renewed(page)


def test_numbers_are_shown_as_the_pages_do() -> None:
    assert shown_value(0.1234, ".1%") == "12.3 %" and shown_value(-0.001, "+.0%") == "0 %"
    assert shown_value(math.nan, ".2f") == "" and shown_value(True, "on|off") == "on"
    assert change(0.12, 0.05, 0.2) == "+12 (+5.0 to +20)"
    assert change(0.12, -0.05, 0.2, ".1f") == "n.s. (-5.0 to +20.0)"
    assert change(18.0, 17.0, 19.0) == "19-fold"


def test_the_effective_restitution_is_that_of_the_closed_form() -> None:
    for row in record_table("verification/effective_restitution").itertuples():
        assert row.effective == pytest.approx(limited_restitution(row.entered), rel=1e-4)
