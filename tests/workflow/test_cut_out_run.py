"""The cut-out of a bowl that turns, on LIGGGHTS: its bed is inclined as that of the bowl."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from bowl_runs import accepted, process_of
from paths import SMALL_STUDY

from dragchain import load_case, write_tables
from dragchain.run.kinematics import drag_phase
from dragchain.tables.by_step import read_table
from dragdeck.engine.reports import silent
from dragdeck.engine.run_folder import run

pytestmark = [pytest.mark.engine, pytest.mark.slow]

CUT: dict[str, Any] = {
    "bowl": {"kind": "annulus", "material": "steel", "radius_m": 0.065, "core_radius_m": 0.010,
             "height_m": 0.08},
    "reduction": {"cut_out": True, "counted_m": 0.035},
}  # fmt: skip
REST = {"kind": "rest", "radius_m": 0.037, "bowl_rpm": 155, "revolutions": 0.5}


@pytest.fixture(scope="module")
def process(tmp_path_factory: pytest.TempPathFactory) -> Path:
    study: dict[str, Any] = yaml.safe_load(SMALL_STUDY.read_text()) | CUT
    study["media"] |= {"count": None, "fill_height_m": 0.04}
    study["motion"] |= {"path": REST, "immersion_depth_m": 0.012, "plunge_speed_m_s": 0.3}
    del study["motion"]["speed_m_s"]
    study["fidelities"]["quick"]["filling_timestep_fraction"] = 0.5
    study["outputs"] = {"n_checkpoints": 2}
    folder = process_of(tmp_path_factory.mktemp("cut_out"), study)
    run(folder, silent)
    write_tables(folder)
    return folder


def test_the_run_is_accepted_and_says_what_it_stands_for(process: Path) -> None:
    accepted(process)
    case = load_case(process)
    assert {entry.field for entry in case.assumptions} == {"reduction.cut_out"}
    assert case.study is not None and case.study.reduction is not None
    assert drag_phase(case).end_step > drag_phase(case).start_step


def test_the_bed_is_inclined_outwards(process: Path) -> None:
    """The bowl turns counter-clockwise: seen along the line, its axis is on the right.

    By less than a liquid, whose surface would be at 45 degrees.
    """
    case = load_case(process)
    last = read_table(process / "tables/particles.parquet", ["step", "y_m", "z_m"])
    last = last[last["step"] == last["step"].max()]
    half = case.bowl.half_widths_m[1]
    edges = np.linspace(-half, half, 5)
    part = np.clip(np.digitize(last["y_m"], edges) - 1, 0, 3)
    tops = [float(last["z_m"][part == number].nlargest(20).mean()) for number in range(4)]
    slope = np.polyfit((edges[1:] + edges[:-1]) / 2, tops, 1)[0]
    assert 5 < np.degrees(np.arctan(slope)) < 45
