"""Runs that no law of reduced moduli covers."""

import json
from pathlib import Path

import pytest
from figure_files import case_json
from paths import ROOT

from dragchain.errors import TableError
from dragchain.report.extrapolated import FILE, Extrapolated
from dragchain.tradeoff import extrapolate
from dragchain.tradeoff.extrapolate import extrapolate_run
from dragchain.tradeoff.measures import PathQuantities

RECORD = ROOT / "workflow/dragdeck/data/stiffness.json"


def test_a_faster_workpiece_is_not_extrapolated(tmp_path: Path) -> None:
    case = case_json("process")
    case["fidelity"]["speed_factor"] = 5.0
    (tmp_path / "case.json").write_text(json.dumps(case))
    with pytest.raises(TableError, match="5 times as fast"):
        extrapolate_run(tmp_path, RECORD)


@pytest.mark.parametrize(("friction", "known"), [(0.34, ["workpiece_contacts"]), (0.0, [])])
def test_a_frictionless_bed_is_not_extrapolated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, friction: float, known: list[str]
) -> None:
    numbers = {"stiffness_number": 2e5, "inertial_number": 0.02, "particle_friction": friction}
    (tmp_path / "case.json").write_text(json.dumps(case_json("process") | {"numbers": numbers}))
    along = PathQuantities(arc_m=0.1, block_m=0.01, blocks={"workpiece_contacts": (30.0,) * 10})
    monkeypatch.setattr(extrapolate, "quantities_along", lambda *_: along)
    extrapolate_run(tmp_path, RECORD)
    found = Extrapolated.read(tmp_path / FILE)
    assert [one.name for one in found.quantities] == known
    assert any("particle_friction" in text for text in found.outside) == (not known)


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
    assert found.quantities == ()
    assert "pair_style gran model hooke" in found.outside[0]
