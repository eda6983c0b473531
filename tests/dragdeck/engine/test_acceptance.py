"""What tells a whole output file from one that was cut short."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import pytest
from made_run import Raw, made_case, output_of_run

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.dumps.grammar import whole_frames
from dragdeck.engine.acceptance import check_run
from dragdeck.records.run import (
    CaseFile,
    CountOfRun,
    RanksOfRun,
    RunPart,
    SettlingCriterion,
    SteadyCriterion,
)

PRINT = output_of_run("force", "print", ["step", "force_n"], 1, 0, None)
LOCAL = output_of_run("contacts", "local", ["a_id", "force_n"], 1, 0, None)
TWO = b"".join(Raw.text(step, [[1, 2], [3, 4]], LOCAL.columns, "local") for step in (5, 9))


@pytest.mark.parametrize(
    ("output", "content", "step"),
    [
        (PRINT, b"step force_n\n10 1.5\n20 1.6\n", 20),
        *((PRINT, b"step force_n\n" + rows, None) for rows in (b"", b"10 1.5\n20 1", b"9 1\n10\n")),
        *((LOCAL, TWO, 9), (LOCAL, TWO[:-4], None), (LOCAL, TWO[:-5], None), (LOCAL, b"", None)),
    ],
)
def test_the_last_frame_counts_only_if_whole(
    tmp_path: Path, output: OutputOfRun, content: bytes, step: int | None
) -> None:
    """Of binary dumps, too, as the reader has it: test_completeness."""
    file = tmp_path / "output"
    file.write_bytes(content)
    frames = whole_frames(file, output)
    assert (frames.steps[-1] if frames.steps and not frames.problem else None) == step


INPUTS = CaseFile(
    study_name="any", title="", scene="process", run="a", timestep_s=1e-6, rayleigh_time_s=1e-5,
    versions={}, fidelity=RanksOfRun(ranks=1), media=CountOfRun(count=2), files={},
)  # fmt: skip
HEAD = "step time_s n_particles kinetic_energy_j rotational_energy_j fastest_particle_m_s\n"
THERMO = output_of_run("thermo", "print", HEAD.split(), 10, 10, 20, pattern="thermo.{part}.txt")
GRID = "  1 by 1 by 1 MPI processor grid\n"
GOOD = HEAD + "10 0.1 2 1e-9 0 0.1\n20 0.2 2 1e-9 0 0.1\n"


def failed(
    folder: Path, inputs: CaseFile, status: int = 0, begins: Sequence[int] = (0,),
    thermo: OutputOfRun = THERMO,
) -> set[str]:  # fmt: skip
    """Codes of the checks that did not pass, of parts that begin at some steps."""
    parts = [RunPart(part=k + 1, checkpoint=None, from_step=step) for k, step in enumerate(begins)]
    checks = check_run(folder, inputs, {"thermo": thermo}, status, parts, ranks=1)
    return {check.code for check in checks if not check.passed}


@pytest.mark.parametrize(
    ("screen", "thermo", "status", "fails"),
    [
        ("DRAGDECK END\n", GOOD, 0, set()),
        ("DRAGDECK END\n", GOOD, 1, {"ended"}),
        ("", GOOD, 0, {"ended"}),
        ("ERROR: Bad\nDRAGDECK END\n", GOOD, 0, {"no_engine_error"}),
        ("Dangerous builds = 3\nDRAGDECK END\n", GOOD, 0, set()),
        ("DRAGDECK END\n", GOOD.replace(" 2 ", " 1 "), 0, {"particles_kept"}),
        ("DRAGDECK END\n", GOOD.replace("1e-9", "nan"), 0, {"finite_numbers"}),
        ("DRAGDECK END\n", GOOD.replace("20 0.2", "15 0.2"), 0, {"output_complete"}),
        ("DRAGDECK END\n", HEAD, 0, {"particles_kept", "finite_numbers", "output_complete"}),
    ],
)
def test_each_check_sees_its_own_fault(
    tmp_path: Path, screen: str, thermo: str, status: int, fails: set[str]
) -> None:
    (tmp_path / "screen.1.txt").write_text(GRID + screen)
    (tmp_path / "thermo.1.txt").write_text(thermo)
    assert failed(tmp_path, INPUTS, status) == fails


@pytest.mark.parametrize(("last", "fails"), [(1.08, set()), (1.25, {"steady_bed"})])
def test_a_bed_whose_motion_changes_fails(tmp_path: Path, last: float, fails: set[str]) -> None:
    """Mean energies 1, 1, 1 and then `last` three times; what is before is not counted."""
    levels = [5.0, 1.0, 1.0, 1.0, last, last, last]
    rows = [f"{10 * k} 0.1 2 {level * 1e-9} 0 0.1\n" for k, level in enumerate(levels, 1)]
    (tmp_path / "screen.1.txt").write_text(GRID + "DRAGDECK END\n")
    (tmp_path / "thermo.1.txt").write_text(HEAD + "".join(rows))
    steady = SteadyCriterion(from_step=10, energy_drift=0.1)
    thermo = THERMO.model_copy(update={"last_step": 70})
    assert failed(tmp_path, INPUTS.model_copy(update={"steady": steady}), thermo=thermo) == fails


SPEEDS = "step time_s force_x_n fastest_particle_m_s\n"


@pytest.mark.parametrize(
    ("speeds", "seen"),
    [
        ((0.2, 2.4, 0.3), None),
        ((0.2, 0.3, 2.6), "a particle at 2.6 m/s at step 30"),
        ((0.2, math.nan, 0.3), "a particle at nan m/s at step 20"),
        ((), None),
    ],
)
def test_a_thrown_particle_fails(
    tmp_path: Path, speeds: tuple[float, ...], seen: str | None
) -> None:
    """In whichever part and at whichever sample it was fast."""
    force = output_of_run(
        "workpiece_force", "print", SPEEDS.split(), 10, 10, 30, pattern="force.{part}.txt"
    )
    rows = [f"{10 * number} 0.1 1.5 {speed}\n" for number, speed in enumerate(speeds, 1)]
    for part, some in enumerate((rows[:2], rows[2:]), 1):
        (tmp_path / f"force.{part}.txt").write_text(SPEEDS + "".join(some) + "40 0.1")
        (tmp_path / f"screen.{part}.txt").write_text(GRID + "DRAGDECK END\n")
    inputs = INPUTS.model_copy(update={"thrown_m_s": 2.5})
    parts = [RunPart(part=part, checkpoint=None, from_step=0) for part in (1, 2)]
    checks = check_run(tmp_path, inputs, {"workpiece_force": force}, 0, parts, ranks=1)
    (check,) = (check for check in checks if check.code == "none_thrown")
    assert check.passed is (seen is None)
    assert seen is None or check.seen == seen
    old = check_run(tmp_path, INPUTS, {"workpiece_force": force}, 0, parts, ranks=1)
    assert "none_thrown" not in {check.code for check in old}  # a run that did not sample it


SETTLED = SettlingCriterion(energy_ratio=1e-6, highest_m=0.05)


@pytest.mark.parametrize(("z_m", "fails"), [(0.0479, set()), (0.0481, {"packing_in_bowl"})])
def test_a_packing_above_the_rim_fails(tmp_path: Path, z_m: float, fails: set[str]) -> None:
    columns = ["a_id", "x_m", "y_m", "z_m", "radius_m"]
    particles = output_of_run("particles", "custom", columns, 1, 0, None, binary=True)
    rest = [2, 0, 0, 0.01, 0.002]
    frames = [[[1, 0, 0, 0.2, 0.002], rest], [[1, 0, 0, z_m, 0.002], rest]]
    content = [Raw.binary(step, rows, 5) for step, rows in enumerate(frames)]
    (tmp_path / "particles.1").write_bytes(b"".join(content))
    (tmp_path / "screen.1.txt").write_text(GRID + "DRAGDECK SETTLED: after\nDRAGDECK END\n")
    (tmp_path / "case.json").write_text(json.dumps(made_case("filling", "a")))
    filling = INPUTS.model_copy(update={"settled": SETTLED, "scene": "other"})
    parts = [RunPart(part=1, checkpoint=None, from_step=0)]
    checks = check_run(tmp_path, filling, {"particles": particles}, 0, parts, ranks=1)
    rejected = {check.code: check.seen for check in checks if not check.passed}
    assert rejected.keys() - {"packing_whole"} == fails
    assert all("0.0501 m" in rejected[code] for code in fails)


def test_a_bed_that_did_not_settle_fails(tmp_path: Path) -> None:
    (tmp_path / "screen.1.txt").write_text(GRID + "DRAGDECK NOT SETTLED: energy ratio 0.1\n")
    (tmp_path / "thermo.1.txt").write_text(GOOD)
    filling = INPUTS.model_copy(update={"settled": SETTLED})
    assert failed(tmp_path, filling) == {"ended", "at_rest", "packing_whole"}


def test_a_row_that_the_interruption_cut_short_does_not_fail_a_resumed_run(tmp_path: Path) -> None:
    (tmp_path / "screen.1.txt").write_text(GRID)
    (tmp_path / "thermo.1.txt").write_text(HEAD + "10 0.1 2 1e-9 0 0.1\n11 0.11 2 1e-")
    (tmp_path / "screen.2.txt").write_text(GRID + "DRAGDECK END\n")
    (tmp_path / "thermo.2.txt").write_text(GOOD)
    assert failed(tmp_path, INPUTS, begins=(0, 10)) == set()


@pytest.mark.parametrize(("last", "fails"), [("20 0.2", set()), ("15 0.2", {"output_complete"})])
def test_a_part_from_a_checkpoint_at_the_end_need_not_write_again(
    tmp_path: Path, last: str, fails: set[str]
) -> None:
    (tmp_path / "screen.1.txt").write_text(GRID)
    (tmp_path / "thermo.1.txt").write_text(GOOD.replace("20 0.2", last))
    (tmp_path / "screen.2.txt").write_text(GRID + "DRAGDECK END\n")
    assert failed(tmp_path, INPUTS, begins=(0, 20)) == fails


def test_a_lost_particle_has_its_own_reason(tmp_path: Path) -> None:
    for words, reason in (("Lost atoms: 299 of 300", "lost_particles"), ("Bad", "other")):
        (tmp_path / "screen.1.txt").write_text(f"ERROR: {words}\n")
        part = RunPart(part=1, checkpoint=None, from_step=0)
        checks = check_run(tmp_path, INPUTS, {}, 1, [part], ranks=1)
        assert [check.reason for check in checks if check.code == "no_engine_error"] == [reason]
