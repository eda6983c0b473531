"""What a run says of its quantities: bands of the drag, blocks, a run by hand."""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from finished_runs import TRANSIENT_S, write_finished_run
from loading_files import made_contacts, write_run
from made_run import particles_kept, run_json, with_motion, write_documents
from tiny_run_files import SPEED_M_S, case_json

from dragchain.errors import TableError
from dragchain.loading.contact_events import find_events
from dragchain.loading.samples import sample
from dragchain.quantities import along
from dragchain.quantities.along import CountedPath, _begins, band_pass
from dragchain.quantities.document import MEASURED_FILE, RunQuantities
from dragchain.quantities.measure import estimates_along, write_quantities
from dragchain.quantities.registry import MEASURED
from dragchain.run.case import upstream_folders
from dragdeck.records.case import load_case
from dragdeck.records.packing import Packing

SPACING, COUNT = 0.1, 600
BED = Packing(
    bed_height_m=0.07, top_m=0.08, solid_fraction=0.6, n_particles=4, radius_mean_m=0.003,
    radius_std_m=0.0, kinetic_energy_ratio=0.0,
)  # fmt: skip


def series() -> np.ndarray:
    noise = np.random.default_rng(2).normal(size=COUNT)
    return noise - noise.mean()


def wave(length: float) -> np.ndarray:
    return np.sin(2.0 * np.pi * SPACING * np.arange(COUNT) / length)


@pytest.mark.parametrize("count", [COUNT, COUNT - 1])
def test_bands_add_up_and_so_do_their_squares(count: int) -> None:
    whole = series()[:count] - series()[:count].mean()
    limits = [0.0, 0.7, 3.0, math.inf]
    bands = [band_pass(whole, SPACING, a, b) for a, b in pairwise(limits)]
    assert np.sum(bands, axis=0) == pytest.approx(whole, abs=1e-12)
    assert sum(np.sum(one**2) for one in bands) == pytest.approx(np.sum(whole**2))
    assert min(np.sum(one**2) for one in bands) > 0.0


def test_a_wave_is_in_the_band_of_its_length() -> None:
    both = wave(5.0) + 0.5 * wave(0.5)
    assert band_pass(both, SPACING, 2.0, math.inf) == pytest.approx(wave(5.0), abs=1e-12)
    assert band_pass(both, SPACING, 0.0, 1.0) == pytest.approx(0.5 * wave(0.5), abs=1e-12)
    assert band_pass(both, SPACING, 1.0, 2.0) == pytest.approx(0.0, abs=1e-12)


def test_a_wave_at_a_limit_is_in_the_longer_band() -> None:
    # 5.0 is the exact inverse of a frequency of the series
    assert band_pass(wave(5.0), SPACING, 5.0, math.inf) == pytest.approx(wave(5.0), abs=1e-12)
    assert band_pass(wave(5.0), SPACING, 0.0, 5.0) == pytest.approx(0.0, abs=1e-12)


def test_a_mean_belongs_to_the_longest_waves() -> None:
    assert band_pass(wave(5.0) + 3.0, SPACING, 2.0, math.inf) == pytest.approx(wave(5.0) + 3.0)
    assert band_pass(wave(5.0) + 3.0, SPACING, 0.0, 2.0) == pytest.approx(0.0, abs=1e-12)


PATH = CountedPath(
    first_step=100, last_step=500, begin_m=0.0, length_m=0.04, diameter_m=0.01, blocks=4
)


def test_a_step_belongs_to_the_block_that_it_ends_in() -> None:
    steps = np.array([50, 100, 101, 200, 201, 300, 301, 500, 501])
    assert PATH.block(steps).tolist() == [0, 0, 0, 0, 1, 1, 2, 3, 3]


STEPS, VALUES = np.array([110, 150, 200, 210, 500]), np.array([1.0, 2.0, 6.0, 5.0, 7.0])


def test_means_of_blocks() -> None:
    blocks = PATH.mean(STEPS, VALUES)
    assert blocks.values == pytest.approx([3.0, 5.0, np.nan, 7.0], nan_ok=True)
    assert blocks.weights.tolist() == [3, 1, 0, 1]
    assert blocks.mean == pytest.approx(VALUES.mean())


@pytest.mark.parametrize("cuts", [[], [1], [3], [1, 2, 3, 4]])
def test_a_block_is_whole_wherever_the_table_is_cut(cuts: list[int]) -> None:
    pieces = zip(np.split(STEPS, cuts), np.split(VALUES, cuts), strict=True)
    found = {number: values.tolist() for number, values in PATH.parts(pieces)}
    assert found == {0: [1.0, 2.0, 6.0], 1: [5.0], 3: [7.0]}


def measured(folder: Path, **outcome: object) -> RunQuantities:
    """The quantities of the tiny run as they are read from their file."""
    (folder.parent / "process").mkdir()
    folder = folder.rename(folder.parent / "process" / "run")
    (folder / "outcome.json").write_text(
        json.dumps(run_json(steps=50, wall_time_s=2.0, checks=[]) | outcome)
    )
    packing = upstream_folders(folder, load_case(folder))["filling"] / "tables" / "packing.json"
    packing.parent.mkdir(parents=True)
    packing.write_text(BED.as_text())
    quantities = write_quantities(folder)
    assert RunQuantities.read(folder / MEASURED_FILE).as_text() == quantities.as_text()
    return quantities


def test_a_run_by_hand(tiny_run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One contact of (4 N + 1e5 N/m workpiece_x) / 3, seven frames and 31 samples of the force."""
    monkeypatch.setattr(along, "FEWEST", 1)
    found = measured(tiny_run)
    blocks = {name: values[0] for name, values in found.blocks.items()}
    names = {quantity.name for quantity in MEASURED}
    assert names - set(blocks) - set(found.single) == {
        *("torque_mean", "drag_std_long")  # no spin, a short path
    }
    assert found.arc_m == pytest.approx(6.2e-6) and found.block_m == found.arc_m
    assert blocks["drag_mean"] == pytest.approx(-1.5)
    assert blocks["drag_std"] == pytest.approx((31**2 - 1) / 12 / 150**2 * 31 / 30)
    assert blocks["drag_std_middle"] is not None and blocks["drag_std_short"] is not None
    assert blocks["workpiece_contacts"] == 1.0
    assert blocks["contact_force_mean"] == pytest.approx(1.5)
    assert blocks["contact_force_p50"] == pytest.approx(1.5)
    assert blocks["contact_force_p90"] == pytest.approx(1.58)
    assert blocks["normal_load"] == pytest.approx(1.5)
    assert sum(found.load_map) == pytest.approx(1.5)
    assert blocks["chain_count"] == 0.0 and blocks["chain_length"] is None
    assert found.single == {"bed_height": 0.07, "solid_fraction": 0.6}


def test_a_failed_run_says_only_how_it_failed(tiny_run: Path) -> None:
    kept = particles_kept(3)
    fast = kept | {"code": "within_limits", "name": "speed within limits", "seen": "3 m/s"}
    passed = kept | {"code": "finite_numbers", "passed": True}
    checks = [kept, passed, fast]
    found = measured(tiny_run, state="failed", checks=checks)
    assert not found.complete and not found.blocks
    assert [check.code for check in found.failure] == ["particles_kept", "within_limits"]
    assert found.why_failed == "no particle lost: 3; speed within limits: 3 m/s"
    assert found.cost.cpu_time_s == 4.0
    assert found.cost.steps_per_m == pytest.approx(1.0 / (1e-4 * 1e-3))


def test_a_run_without_a_record_is_refused(tiny_run: Path) -> None:
    with pytest.raises(TableError, match="dragdeck run"):
        write_quantities(tiny_run)


def test_contact_events_begin_where_those_of_the_loading_do(tmp_path: Path) -> None:
    """Particles that stay, leave and come back, and change their facet: five events."""
    run = write_run(tmp_path / "run", made_contacts())
    case = load_case(run)
    sampled = sample(run, case)
    events, _ = find_events(sampled.rows, sampled.frames, sampled.interval_s)
    assert len(events) == 5
    assert sorted(_begins(sampled)) == sorted(events["frame"])


def test_the_torque_is_about_the_axis_of_a_workpiece_that_spins(tmp_path: Path) -> None:
    folder = write_finished_run(tmp_path / "process" / "run-1")
    file = folder / "tables/workpiece_force.parquet"
    force = pd.read_parquet(file).assign(torque_x_n_m=1.0, torque_y_n_m=2.0)
    force.assign(torque_z_n_m=force["step"] % 4 + 2.0).to_parquet(file)
    path = {"kind": "line", "start_m": [0.0, 0.0]}
    upright, inclined = {"spin": {"rpm": 60}}, {"spin": {"rpm": 60}, "tilt_deg": 30}
    for motion, axis in (({}, None), (upright, (0, 0, 1)), (inclined, (0.5, 0, math.cos(0.5236)))):
        case = case_json(statistics={"transient_s": TRANSIENT_S})
        write_documents(folder, with_motion(case, path, SPEED_M_S, **motion))
        torque = estimates_along(folder, load_case(folder)).get("torque_mean")
        assert (torque is None) == (axis is None)
        if torque:
            assert torque.value == pytest.approx(np.dot(axis, (1, 2, 3)), rel=0.03)
