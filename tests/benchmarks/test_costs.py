"""What things left out cost: statistics, the timed decks, two variants on the engine."""

import json
import math
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from paths import ROOT

from cost_decks import CostTemplates, Settled, TimedDecks, at_rest, with_own_blocks, workpiece_in
from cost_file import TimedVariant, Timing, cost, geometric
from cost_timing import BLOCK, blocks, time_variants
from cost_variants import BASES, Variant, bed_case, standard_case, variant_case, variants
from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.engine.reports import silent
from dragdeck.errors import InputError
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.scenes.drop_test import drop_scene
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import process_scene
from dragdeck.sweep.cases import load_cases

BED = Bed(surface_m=0.045, top_m=0.05)
STEPS = 1000
CONTACT_WIDTH = 41


@pytest.fixture
def base(case: Case) -> Case:
    return standard_case(case)


@pytest.fixture
def templates(project: Project) -> CostTemplates:
    return with_own_blocks(environment(project.templates))


@dataclass
class Timed:
    """The timed decks of a standard case."""

    base: Case
    templates: CostTemplates

    def scene(self, name: str, start: bool = False) -> AnyScene:
        known = {variant.name: variant for variant in [*BASES.values(), *variants(self.base)]}
        bed = None if known[name].scene == "drop_test" else Settled(BED, "packing.restart")
        return TimedDecks(self.base, self.templates, STEPS).scene(known[name], bed, start)

    def text(self, name: str, start: bool = False) -> str:
        return deck_text(self.scene(name, start), self.templates.environment)


@pytest.fixture
def timed(base: Case, templates: CostTemplates) -> Timed:
    return Timed(base, templates)


def variant_of(name: str, **own: Any) -> Variant:
    return Variant(name=name, scene="process", what="", **own)


def lines(text: str) -> list[str]:
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def test_the_interval_of_known_ratios() -> None:
    """Logarithms 0, 1, 2: mean 1, standard error 1 / sqrt(3), t of 2 degrees 4.30265."""
    found = geometric([1.0, math.e, math.e**2])
    half = 4.302652730 / math.sqrt(3)
    assert found.value == pytest.approx(math.e)
    assert (found.ci95_low, found.ci95_high) == (
        pytest.approx(math.exp(1 - half)),
        pytest.approx(math.exp(1 + half)),
    )


def row(number: int, cpu: float, base_cpu: float, name: str = "finer") -> TimedVariant:
    return TimedVariant(
        name=name, round=number, cpu_time_s=cpu, wall_time_s=0.5, steps=200, inputs="",
        measured="2026-11-22", load_average_before=0.0,
        base=Timing(cpu_time_s=base_cpu, wall_time_s=1.0, steps=100),
    )  # fmt: skip


def test_a_cost_counts_steps_or_seconds() -> None:
    """Twice the steps in 6 s and 1.5 s against 1 s: 3 and 0.75 a step, their mean is 1.5."""
    rows = [row(0, 6.0, 1.0), row(1, 1.5, 1.0), row(1, 9.0, 1.0, "another")]
    steps_s = {"standard": 1e-5, "finer": 0.5e-5}
    step = cost(variant_of("finer", unit="per_step"), rows, steps_s)
    second = cost(variant_of("finer"), rows, steps_s)
    assert step.ratio == step.per_step == second.per_step == pytest.approx(1.5)
    assert second.ratio == second.per_second == step.per_second == pytest.approx(3.0)
    assert step.wall_ratio == pytest.approx(0.25)
    assert second.wall_ratio == pytest.approx(0.5)
    alone = cost(variant_of("another"), rows, {**steps_s, "another": 1e-5})
    assert (alone.ratio, alone.ci95_low, alone.ci95_high) == (pytest.approx(4.5), None, None)
    assert step.ci95_low is not None and step.ci95_high is not None
    assert step.ci95_low < 0.75 and step.ci95_high > 3.0
    assert second.ci95_low == pytest.approx(2 * step.ci95_low)
    assert (step.rounds, step.steps) == (2, 200)


def test_every_round_times_every_variant_once_in_another_order(base: Case) -> None:
    chosen = variants(base)
    orders = [[v.name for block in blocks(chosen, number) for v in block] for number in range(3)]
    assert all(sorted(order) == sorted(v.name for v in chosen) for order in orders)
    assert len({tuple(order) for order in orders}) == 3
    for block in blocks(chosen, 1):
        assert len({variant.base for variant in block}) == 1 and len(block) <= BLOCK


def test_every_variant_differs_from_its_base(base: Case, timed: Timed) -> None:
    chosen = variants(base)
    assert len({variant.name for variant in chosen}) == len(chosen)
    for variant in chosen:
        deck, beside = (timed.scene(name) for name in (variant.name, variant.base))
        surfaces, surfaces_beside = (
            [text() for name, text in scene.files.items() if name.endswith(".stl")]
            for scene in (deck, beside)
        )
        whole = lines(timed.text(variant.name))
        case = variant_case(base, variant)
        differs = (
            surfaces != surfaces_beside,
            whole != lines(timed.text(variant.base)),
            case.study.media != base.study.media,
            case.ranks != base.ranks,
        )
        assert any(differs), variant.name
        assert whole != lines(timed.text(variant.name, start=True)), variant.name


def test_the_standard_drag_is_the_process_without_what_goes_before(
    base: Case, timed: Timed
) -> None:
    period, text = process_scene(base, BED).deck.thermo_steps, timed.text("standard")
    steps = int(re.findall(r"^if .* then \"run (\d+) upto\"", text, re.MULTILINE)[0])
    assert -0.05 <= (steps - STEPS) / period < 1
    assert steps % period == 0
    start = re.findall(r"reference_point (\S+) (\S+) (\S+)", text)[0]
    study = base.study
    height = BED.surface_m - study.motion.immersion_depth_m
    assert [float(value) for value in start] == pytest.approx(
        [study.motion.path.radius_m, 0.0, height], abs=1e-9
    )
    assert "move_plunge" not in text and "move_drag" in text


def test_the_standard_drag_continues_no_softer_run(
    small: dict[str, Any], write_study: Any, templates: CostTemplates
) -> None:
    start = {"youngs_modulus_scale": 0.001, "timestep_fraction": 0.3}
    small["fidelity"] = {"youngs_modulus_scale": 0.01, "soft_start": start}
    (soft,) = load_cases(write_study(small))
    assert process_scene(soft).deck.entry_step
    text = Timed(standard_case(soft), templates).text("standard")
    assert text.count("youngsModulus peratomtype") == 1 and "reset_timestep 0" in text


def test_the_plain_deck(base: Case, timed: Timed) -> None:
    plain, standard = (timed.scene(name) for name in ("plain", "standard"))
    fraction = base.study.chosen_fidelity().timestep_fraction
    assert plain.deck.timestep_s / standard.deck.timestep_s == pytest.approx(
        0.2 / fraction, rel=1e-3
    )
    text = timed.text("plain")
    assert "neighbor 0.001 bin" in text
    assert "bowl.stl" in text and "bowl.stl" in plain.files
    computes = [line for line in lines(timed.text("standard")) if line[:7] == "compute"]
    assert computes and all(line in text for line in computes)


def test_all_columns_are_asked_for_and_written(timed: Timed) -> None:
    text = timed.text("plain_columns")
    for output, compute in (
        ("contacts", "particle_contacts"),
        ("workpiece_contacts", "workpiece_contacts"),
    ):
        (dump,) = re.findall(rf"^dump write_{output} .*$", text, re.MULTILINE)
        assert dump.count(f"c_{compute}[") == CONTACT_WIDTH
        assert f"compute {compute} all" in text and "torque_tangential history" in text


def test_before_the_drag_only_forces_and_energies_are_written(timed: Timed) -> None:
    def written(name: str) -> list[str]:
        return re.findall(r"^(?:dump|fix) write_(\w+)", timed.text(name), re.MULTILINE)

    assert written("before_drag") == ["thermo", "workpiece_force"]
    assert "contacts" in written("network_before_drag")


def test_restart_points_are_written_with_every_frame(timed: Timed) -> None:
    period = timed.scene("standard").deck.thermo_steps
    assert f"\nrestart {period} checkpoint.*.restart\n" in timed.text("restart_points")


def test_every_step_of_a_drop_is_written_from_its_begin(timed: Timed) -> None:
    text = timed.text("drop_every_step")
    assert text.count("fix write_impacts") == 1 and "unfix write_impacts" not in text
    assert text.index("fix write_impacts") < text.index("run 0") < text.index("run ${flight}")
    assert "\nvariable flight equal 1\n" in timed.text("drop_every_step", start=True)


def test_beds_keep_particles_but_no_workpiece(base: Case, templates: CostTemplates) -> None:
    meshed = variant_case(base, variant_of("", fields={"bowl.facet_size_m": 0.005}))
    settled = Settled(BED, "packing.restart")
    for scene in (workpiece_in(base, settled, templates), at_rest(meshed, settled, templates)):
        text = deck_text(scene, templates.environment)
        assert text.index("unfix workpiece\n") < text.index("write_restart bed.restart")
        assert ("unfix bowl" in text) == ("fix bowl" in text)
        assert "dump write_" not in text and "move_drag" not in text


def test_what_is_left_out_names_variants_that_there_are(base: Case) -> None:
    known = {variant.name for variant in variants(base)}
    scenes = (drop_scene(base), filling_scene(base), process_scene(base))
    named = {left.cost for scene in scenes for left in scene.leaves_out.values() if left.cost}
    assert len(named) >= 6 and named <= known


def test_expressions_of_a_variant_are_those_of_the_study(base: Case) -> None:
    known, study = {one.name: one for one in variants(base)}, base.study
    wide = study.workpiece.shape.facet_size_m
    assert known["workpiece_wide_facets"].fields == {"workpiece.shape.facet_size_m": 2 * wide}
    assert f"{2000 * wide:g} mm" in known["workpiece_wide_facets"].what
    assert known["fewer_particles"].fields["media.count"] == 3 * study.media.count // 4
    rest = known["rotating_bowl"].fields["motion.path"]
    speed = 2 * math.pi * rest["radius_m"] * rest["bowl_rpm"] / 60
    assert speed == pytest.approx(study.motion.axis_speed_m_s)


def test_a_variant_that_the_study_has_itself_is_not_timed(base: Case) -> None:
    spun = variant_case(base, variant_of("", fields={"fidelity.skin_m": 0.001}))
    left = {one.name for one in variants(base)} - {one.name for one in variants(spun)}
    assert left == {"skin_1mm"}


def test_a_variant_of_one_fidelity_parameter_says_which_and_its_level(base: Case) -> None:
    known = {one.name: (one.parameter, one.level) for one in variants(base)}
    assert known["modulus_0.1"] == ("youngs_modulus_scale", 0.1)
    assert known["step_0.2"] == ("timestep_fraction", 0.2)
    assert known["speed_5"] == ("speed_factor", 5.0)
    assert known["skin_0.2"] == known["bowl_facets"] == known["full"] == (None, None)


def test_a_filling_is_timed_over_whole_frames(timed: Timed) -> None:
    text = timed.text("filling_contacts")
    (period,) = re.findall(r"^dump write_contacts all local (\d+) ", text, re.MULTILINE)
    (steps,) = re.findall(r"^run (\d+)$", text, re.MULTILINE)
    assert int(steps) % int(period) == 0
    timestep_s = timed.scene("filling_contacts").deck.timestep_s
    assert 1 / (int(period) * timestep_s) == pytest.approx(20, rel=1e-3)
    start = timed.text("filling_contacts", start=True)
    assert re.findall(r"^run (\d+)$", start, re.MULTILINE) == ["1"]


def test_only_other_particles_need_another_bed(base: Case) -> None:
    owners = (bed_case(base, variant) for variant in variants(base))
    assert {case.study.media.count for case in owners} == {300, 225}


def test_a_measurement_is_not_overwritten(case: Case, project: Project) -> None:
    (project.root / "costs.json").write_text("kept")
    words = [sys.executable, ROOT / "benchmarks/costs", case.study_name, "--out", "costs.json"]
    done = subprocess.run(words, cwd=project.root, capture_output=True, text=True)
    assert done.returncode == 1 and "there already" in done.stderr
    assert "Traceback" not in done.stderr
    assert (project.root / "costs.json").read_text() == "kept"


@pytest.mark.parametrize(("option", "rounds", "seconds"), [("--rounds", 0, 1.0),
                                                           ("--seconds", 1, 0.0)])  # fmt: skip
def test_nothing_to_time_is_refused(
    option: str, rounds: int, seconds: float, case: Case, project: Project, tmp_path: Path
) -> None:
    out = tmp_path / "costs.json"
    with pytest.raises(InputError, match=f"{option}: nothing to time"):
        time_variants(case, project.templates, out, silent, rounds=rounds, seconds=seconds)


def test_an_unknown_variant_is_refused(case: Case, project: Project, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such variant"):
        time_variants(case, project.templates, tmp_path / "costs.json", silent, only=["unknown"])


@pytest.mark.engine
def test_two_variants_on_the_engine(
    small: dict[str, Any], write_study: Any, project: Project, tmp_path: Path
) -> None:
    small["media"]["count"] = 120
    small["bowl"]["radius_m"] = 0.02
    small["workpiece"]["shape"]["radius_m"] = 0.0035
    small["motion"]["path"]["radius_m"] = 0.008
    small["motion"]["immersion_depth_m"] = 0.01
    (case,) = load_cases(write_study(small))
    chosen = ("contact_columns", "step_0.2")
    said: list[str] = []

    def time_them(out: Path, rounds: int) -> dict[str, Any]:
        time_variants(
            case, project.templates, out, said.append, rounds=rounds, seconds=0.04, only=chosen
        )
        found: dict[str, Any] = json.loads(out.read_text())
        return found

    first = time_them(tmp_path / "costs.json", 1)
    beds = [line for line in said if "part 1" in line]
    kept = json.loads((tmp_path / "costs" / "rounds.json").read_text())["rows"]
    found = time_them(tmp_path / "again.json", 2)
    rows = json.loads((tmp_path / "costs" / "rounds.json").read_text())["rows"]
    assert len(kept) == 2 and len(rows) == 4 and rows[:2] == kept
    assert beds == [line for line in said if "part 1" in line] and beds
    assert found["versions"]["engine"].startswith("3.")
    columns, step = found["costs"]
    assert (columns["name"], step["name"]) == ("contact_columns", "step_0.2")
    assert columns["steps"] == found["bases"][0]["steps"]
    assert step["per_second"] == pytest.approx(
        step["per_step"] * found["bases"][0]["timestep_s"] / step["timestep_s"]
    )
    for entry in found["costs"]:
        assert entry["ci95_low"] < entry["ratio"] < entry["ci95_high"]
        assert entry["rounds"] == 2
    assert first["costs"][0]["ci95_low"] is None
