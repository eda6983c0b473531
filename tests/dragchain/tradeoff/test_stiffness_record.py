"""The record of reduced stiffness, and what it makes of a run: known effects in made-up scenes."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paths import ROOT
from tradeoff_files import measures, write

from dragchain.errors import TableError
from dragchain.tradeoff import stiffness_record
from dragchain.tradeoff.load_maps import compare_load_maps
from dragchain.tradeoff.measures import Measures
from dragchain.tradeoff.promises import PromisesFile, check_promises, write_promises
from dragchain.tradeoff.quantities import QUANTITIES
from dragchain.tradeoff.stable_step import damping_ratio, fit_stable_step
from dragchain.tradeoff.stiffness_check import check_laws
from dragchain.tradeoff.stiffness_document import StiffnessRecord
from dragchain.tradeoff.stiffness_law import reduction
from dragchain.tradeoff.tradeoff_document import TradeoffRecord

TRADEOFF = ROOT / "workflow/dragdeck/data/tradeoff.json"
RATE, AMPLITUDE = 0.25, 0.6
SCALES = (1.0, 1e-2, 1e-3)


def factor(stiffness: float, scale: float) -> float:
    """What a modulus scale multiplies the contacts with."""
    return float(np.exp(AMPLITUDE * reduction(stiffness, np.log(scale ** (-2 / 3)), RATE)))


def run(number: int, scale: float, seed: int, rng: np.random.Generator, **more: Any) -> Any:
    """A run of a designed scene, of which only the contacts depend on the modulus."""
    stiffness = 3e4 * 1.2**number
    inputs = {
        "media.radius_mean_m": 0.004, "media.radius_std_m": 0.0001 * (number % 4),
        "motion.immersion_depth_m": 0.01 * (number + 1),
        "media.material": "ceramic", "pairs.ceramic-ceramic.restitution": 0.5 + 0.05 * number,
    }  # fmt: skip
    content = measures(
        (scale, 0.5, 1.0), seed, rng, inputs=inputs, noise=0.02,
        effects={"workpiece_contacts": factor(stiffness, scale)},
    )  # fmt: skip
    inertial = 0.02 + 0.03 * (number % 5)
    numbers = {
        "stiffness_number": stiffness, "inertial_number": inertial, "particles": 1422,
        "particle_friction": 0.1 + 0.2 * (number % 3),
    }  # fmt: skip
    reach = 0.5 * (stiffness * scale ** (2 / 3)) ** -0.25
    damping = float(damping_ratio(np.array(inputs["pairs.ceramic-ceramic.restitution"])))
    of_mean = np.sqrt(70.0 * reach**2 + 45.0 * damping * reach)
    stability = float(of_mean * np.exp(-1.3 * 0.025 * (number % 4)))
    return {**content, "numbers": numbers, "stability_number": stability, **more}


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes")
    rng = np.random.default_rng(3)
    runs = [
        run(number, scale, seed, rng) for number in range(8) for scale in SCALES for seed in (1, 2)
    ]
    few = ("drag_mean", "lateral_mean", "workpiece_contacts")
    with pytest.MonkeyPatch.context() as patch:  # a law for each of all would take half a minute
        patch.setattr(stiffness_record, "QUANTITIES", [q for q in QUANTITIES if q.name in few])
        said = stiffness_record.stiffness_command(
            folder / "stiffness.json",
            write(folder, runs),
            ROOT / "workflow/dragdeck/data/tradeoff.json",
        )
    assert "workpiece_contacts from {'0.001': 1}" in said
    return folder / "stiffness.json"


def test_the_correction_removes_a_known_effect_in_scenes_left_out(record: Path) -> None:
    known = StiffnessRecord.read(record)
    rows = [row for row in known.left_out if row.quantity == "workpiece_contacts"]
    assert len(rows) == 3
    for row in rows:
        assert row.scenes == 8
        assert row.root_mean_square < 0.02 < 0.1 < row.raw_root_mean_square
        assert row.inside >= 7
    assert known.laws["workpiece_contacts"].law.rate == pytest.approx(RATE, abs=0.1)


def test_a_quantity_that_changes_its_sign_has_no_law(record: Path) -> None:
    known = StiffnessRecord.read(record)
    assert "lateral_mean" not in known.laws and "lateral_mean" in known.without_law


def test_a_promise_about_an_extrapolated_value_is_kept_where_the_raw_one_is_broken(
    record: Path, tmp_path: Path
) -> None:
    rng = np.random.default_rng(4)
    asked = {"tolerance": 0.1, "quantity": "workpiece_contacts", "extrapolated": True}
    full = [run(9, 1.0, seed, rng, asked=None) for seed in range(1, 7)]
    soft = [run(9, 1e-3, seed, rng, asked=asked) for seed in range(1, 7)]
    files = write(tmp_path, [*full, *soft])
    (kept,) = write_promises(tmp_path / "out", files, record)
    assert kept.verdict == "confirmed"
    errors = PromisesFile.read(tmp_path / "out" / "promises.json").extrapolations
    (row,) = [row for row in errors if row.quantity == "workpiece_contacts"]
    assert (dict(row.runs), row.scenes, row.inside) == ({"0.001": 1}, 1, 1)
    assert row.largest < 0.1 < row.raw_root_mean_square
    plain = [Measures.read(file) for file in files]
    raw = [
        one.model_copy(update={"asked": one.asked and one.asked.model_copy(update={
            "extrapolated": False})})
        for one in plain
    ]  # fmt: skip
    (broken,) = check_promises(raw)
    assert broken.verdict == "contradicted"


def test_the_law_of_the_stability_number_is_found(record: Path) -> None:
    law = StiffnessRecord.read(record).stable_step
    assert (law.stiffness, law.damping) == (pytest.approx(70.0), pytest.approx(45.0))
    assert law.spread == pytest.approx(-1.3)
    assert law.scatter < 1e-5 > law.largest and law.runs == 48


def test_load_maps_are_compared_as_shares(tmp_path: Path) -> None:
    """The load doubles, and a tenth of it moves from one bin to another."""
    rng = np.random.default_rng(5)
    full = [run(0, 1.0, seed, rng, load_map=[6.0, 3.0, 1.0]) for seed in (1, 2)]
    soft = [run(0, 1e-3, seed, rng, load_map=[10.0, 8.0, 2.0]) for seed in (1, 2)]
    runs = [Measures.read(file) for file in write(tmp_path, [*full, *soft])]
    (entry,) = compare_load_maps([runs])
    assert (entry.scale, entry.scenes, entry.by_chance) == (1e-3, 1, 0.0)
    assert entry.distance == entry.of_means == pytest.approx(0.2)


def test_laws_are_checked_with_a_trade_off(record: Path) -> None:
    """With the law as the trade-off's truth every check passes; with another rate some do not."""
    known = StiffnessRecord.read(record)
    entry = known.laws["workpiece_contacts"]
    tradeoff = TradeoffRecord.read(TRADEOFF)
    rows = {row.scale: row for row in check_laws({"workpiece_contacts": entry}, tradeoff)}
    assert set(rows) == {0.1, 0.01, 0.001, 0.0001}
    assert rows[1e-4].predicted > rows[1e-3].predicted > rows[0.1].predicted > 0
    assert all(row.ci95_low < row.measured < row.ci95_high for row in rows.values())
    alpha, *others = entry.law.amplitude
    law = replace(entry.law, amplitude=(-alpha, *others))
    wrong = entry.model_copy(update={"law": law})
    assert not any(row.inside for row in check_laws({"workpiece_contacts": wrong}, tradeoff))


def test_the_range_of_the_laws_is_that_of_the_runs_in_their_fit(record: Path) -> None:
    scenes = StiffnessRecord.read(record).scenes
    assert len(scenes) == 8 and all(len(one.runs) == 3 for one in scenes)
    assert max(one.numbers["stiffness_number"] for one in scenes) == pytest.approx(
        3e4 * 1.2**7, rel=1e-5
    )


@pytest.mark.parametrize("value", [None, "0.7"])
def test_a_run_without_a_restitution_is_refused(tmp_path: Path, value: object) -> None:
    rng = np.random.default_rng(6)
    content = run(0, 1.0, 1, rng)
    content["inputs"] = {**content["inputs"], "pairs.ceramic-ceramic.restitution": value}
    runs = [Measures.read(file) for file in write(tmp_path, [content])]
    with pytest.raises(TableError, match=r"pairs\.ceramic-ceramic\.restitution"):
        fit_stable_step(runs)
