"""Runs that no law of reduced moduli covers: their quantities are measured, none is corrected."""

import json
from pathlib import Path

import pytest
from figure_files import case_json
from paths import ROOT

from dragchain.report.extrapolated import FILE, Extrapolated
from dragchain.tradeoff.measures import PathQuantities
from dragchain.windows import extrapolate
from dragchain.windows.extrapolate import extrapolate_run

RECORD = ROOT / "workflow/dragdeck/data/stiffness.json"


@pytest.mark.parametrize(
    ("friction", "settings", "known"),
    [
        (0.34, {}, True), (0.0, {}, False), (0.34, {"speed_factor": 5.0}, False),
        (0.34, {"youngs_modulus_scale": 1.0}, False), (0.34, {"youngs_modulus_scale": 1e-4}, False),
    ],
)  # fmt: skip
def test_a_law_applies_to_a_bed_with_friction_at_the_speed_of_the_study(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    friction: float,
    settings: dict[str, float],
    known: bool,
) -> None:
    numbers = {"stiffness_number": 2e5, "inertial_number": 0.02, "particle_friction": friction}
    case = case_json("process") | {"numbers": numbers}
    case["fidelity"] |= settings
    (tmp_path / "case.json").write_text(json.dumps(case))
    along = PathQuantities(arc_m=0.1, block_m=0.01, blocks={"workpiece_contacts": (30.0,) * 10})
    monkeypatch.setattr(extrapolate, "quantities_along", lambda *_: along)
    extrapolate_run(tmp_path, RECORD)
    found = Extrapolated.read(tmp_path / FILE)
    (contacts,) = found.quantities
    assert (contacts.name, contacts.measured) == ("workpiece_contacts", 30.0)
    assert (contacts.estimate is not None) == known
    assert any("particle_friction" in text for text in found.outside) == (friction == 0.0)


def test_another_contact_law_is_not_extrapolated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    numbers = {"stiffness_number": 2e5, "inertial_number": 0.02, "particle_friction": 0.34}
    law = {"changed_law": ["pair_style gran model hooke tangential history"]}
    case = case_json("process") | {"numbers": numbers} | law
    (tmp_path / "case.json").write_text(json.dumps(case))
    along = PathQuantities(arc_m=0.1, block_m=0.01, blocks={"workpiece_contacts": (30.0,) * 10})
    monkeypatch.setattr(extrapolate, "quantities_along", lambda *_: along)
    extrapolate_run(tmp_path, RECORD)
    found = Extrapolated.read(tmp_path / FILE)
    assert [one.estimate for one in found.quantities] == [None]
    assert "pair_style gran model hooke" in found.outside[0]
