import json
from math import pi
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_run import output, with_motion
from tiny_run_files import (
    COLUMNS,
    LAST,
    RADIUS_M,
    SPEED_M_S,
    SPIN_RAD_S,
    SURFACE_M,
    WEIGHT_N,
    chain_n,
    overlap_m,
    workpiece_particles,
    workpiece_x_m,
)

from dragchain import DumpError, RejectedRunError, TableError, load_outputs, write_tables
from dragchain.loading.write import write_loading
from dragchain.run.run_parts import iter_prints
from dragchain.tables.columns import FORCES, REFERENCE, SLIP
from dragchain.tables.write import WorkpieceSamples

TABLES = ("workpiece_force", "workpiece_contacts", "particles", "contacts", "thermo")


@pytest.fixture
def tables(tiny_run: Path) -> dict[str, pd.DataFrame]:
    write_tables(tiny_run)
    return {name: read(tiny_run, name) for name in TABLES}


def read(run: Path, name: str) -> pd.DataFrame:
    return pd.read_parquet(run / "tables" / f"{name}.parquet")


def closure(run: Path) -> dict:
    return json.loads((run / "tables" / "closure.json").read_text())


def test_it_says_what_it_made_and_leaves_nothing_else(tiny_run: Path) -> None:
    made = write_tables(tiny_run)
    assert sorted(path.name for path in (tiny_run / "tables").iterdir()) == sorted(
        [*(path.name for path in made), "closure.json"]
    )


def test_workpiece_force_is_turned_into_the_workpiece_frame(tables) -> None:
    force = tables["workpiece_force"]
    assert force["step"].tolist() == list(range(2, LAST + 1, 2))
    assert force["phase"].tolist() == ["plunge"] * 10 + ["drag"] * 40
    np.testing.assert_allclose(force["drag_n"], [-chain_n(step) for step in force["step"]])
    np.testing.assert_allclose(force["vertical_n"].iloc[4:], -WEIGHT_N)
    assert (force["lateral_n"] == 0).all()
    assert force.loc[force["in_statistics"], "step"].tolist() == list(range(40, LAST + 1, 2))


def test_workpiece_contacts_hold_the_applied_force_on_the_workpiece(tables) -> None:
    contacts = tables["workpiece_contacts"]
    steps = list(range(10, LAST + 1, 10))
    assert contacts["step"].tolist() == steps
    np.testing.assert_allclose(contacts["force_x_n"], [-chain_n(step) for step in steps])
    np.testing.assert_allclose(contacts["force_z_n"], -WEIGHT_N)
    np.testing.assert_allclose(contacts["normal_force_n"], [chain_n(step) for step in steps])
    np.testing.assert_allclose(contacts["tangential_force_n"], WEIGHT_N)
    np.testing.assert_allclose(contacts["depth_m"], SURFACE_M - 0.03)
    assert (contacts["azimuth_rad"] == 0).all()
    assert (contacts["facet_id"] == 7).all()
    assert contacts["in_statistics"].tolist() == [step >= 40 for step in steps]


def test_the_slip_is_that_of_the_particles_surface_against_the_workpiece(tables) -> None:
    """Particle 1 spins about y and falls behind the workpiece by a third of its speed."""
    contacts = tables["workpiece_contacts"]
    before, drag = contacts[contacts["phase"] == "plunge"], contacts[contacts["phase"] == "drag"]
    reach = RADIUS_M - np.array([overlap_m(step) for step in drag["step"]])
    exact = np.column_stack([0 * reach, 0 * reach, SPIN_RAD_S * reach])
    np.testing.assert_allclose(drag[list(SLIP)], exact, rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(drag["normal_velocity_m_s"], SPEED_M_S / 3, rtol=1e-6)
    assert before[[*SLIP, "normal_velocity_m_s"]].isna().all(axis=None)


def test_a_run_without_velocities_has_tables_but_no_slip(tiny_run: Path, edit_json, raw) -> None:
    old = ["particle_id", "x_m", "y_m", "z_m", "radius_m", *(f"force_{axis}_n" for axis in "xyz")]
    keep = [COLUMNS["workpiece_particles"].index(name) for name in old]
    frames = [
        raw.binary(step, [[row[i] for i in keep] for row in workpiece_particles(step)], len(old))
        for step in range(0, LAST + 1, 10)
    ]
    (tiny_run / "workpiece_particles.1.bin").write_bytes(b"".join(frames))
    edit_json(
        tiny_run / "columns.json", lambda c: c["outputs"]["workpiece_particles"].update(columns=old)
    )
    write_tables(tiny_run)
    contacts = read(tiny_run, "workpiece_contacts")
    assert contacts[[*SLIP, "normal_velocity_m_s"]].isna().all(axis=None)
    assert (contacts["normal_force_n"] > 0).all()
    with pytest.raises(TableError, match="contains no velocities"):
        write_loading(tiny_run)


def test_the_azimuth_is_measured_from_the_direction_of_motion(tiny_run: Path, edit_json) -> None:
    """The particle lies in +x; a workpiece that heads along +y has it on its right."""
    path = {"kind": "line", "start_m": [0.0, 0.0], "direction_deg": 90}
    edit_json(tiny_run / "case.json", lambda case: case.update(with_motion(case, path, SPEED_M_S)))
    write_tables(tiny_run)
    contacts = read(tiny_run, "workpiece_contacts")
    np.testing.assert_allclose(contacts["azimuth_rad"], -pi / 2)
    force = read(tiny_run, "workpiece_force")
    np.testing.assert_allclose(force["lateral_n"], -force["force_x_n"])


def test_the_contacts_of_a_frame_are_the_chain_and_the_pile(tables) -> None:
    frame = tables["contacts"].query("step == 60")
    found = frame[["kind", "a_id", "b_id"]].apply(tuple, axis=1).tolist()
    assert found == [
        *(("particle-particle", 2, 1), ("particle-particle", 4, 3)),
        *(("particle-workpiece", 1, 0), ("particle-floor", 3, -1), ("particle-side", 2, -2)),
    ]
    force = chain_n(60)
    exact = [force, WEIGHT_N, force, 2 * WEIGHT_N, force]
    np.testing.assert_allclose(frame["normal_force_n"], exact, rtol=1e-8)
    np.testing.assert_allclose(frame["overlap_m"], np.array(exact) / 1e5, rtol=1e-6)
    front, overlap = workpiece_x_m(60) + 0.005, force / 1e5
    points = [front + 2 * RADIUS_M - 1.5 * overlap, -0.01, front, -0.01, 0.04 + 0.5 * overlap]
    np.testing.assert_allclose(frame["point_x_m"], points, rtol=1e-6)


def test_forces_on_every_particle_of_a_frame_balance(tables) -> None:
    """Weight included only for the pile; the chain hangs on workpiece and side."""
    frame = tables["contacts"].query("step == 60")
    axes = ["force_x_n", "force_z_n"]
    on_a = frame.groupby("a_id")[axes].sum()
    on_b = frame[frame["b_id"] > 0].groupby("b_id")[axes].sum()
    net = on_a.sub(on_b, fill_value=0.0)
    np.testing.assert_allclose(net["force_x_n"], 0.0, atol=1e-8)
    np.testing.assert_allclose(net["force_z_n"], WEIGHT_N, rtol=1e-8)


def test_before_the_workpiece_arrives_only_the_pile_touches(tables) -> None:
    frame = tables["contacts"].query("step == 0")
    assert frame["kind"].tolist() == ["particle-particle", "particle-floor"]
    assert 0 not in tables["workpiece_contacts"]["step"].to_numpy()


def test_particles_are_sorted_by_id(tables) -> None:
    particles = tables["particles"]
    assert particles["particle_id"].tolist() == [1, 2, 3, 4] * 6
    assert particles["time_s"].unique().tolist() == [0.0, 0.02, 0.04, 0.06, 0.08, 0.1]


def test_closure_holds(tiny_run: Path) -> None:
    write_tables(tiny_run)
    found = closure(tiny_run)
    assert (found["verdict"], found["frames"], found["contacts"]) == ("pass", 10, 10)
    assert found["max_relative"] < 1e-12


def test_a_force_that_does_not_add_up_closes_the_check(tiny_run: Path, raw) -> None:
    outputs = load_outputs(tiny_run)
    (rows,) = iter_prints(tiny_run, outputs["workpiece_force"])
    rows["force_x_n"][24] *= 1.01
    table = np.column_stack(list(rows.values())).tolist()
    (tiny_run / "workpiece_force.1.txt").write_bytes(raw.prints(table, list(rows)))
    with pytest.raises(RejectedRunError, match="at step 50 the forces on the particles miss"):
        write_tables(tiny_run)
    assert closure(tiny_run)["verdict"] == "fail"
    assert not (tiny_run / "tables" / "workpiece_contacts.parquet").exists()


def resume(run: Path, raw, step: int, factor: float) -> None:
    """Add a second part to workpiece_particles whose first frame, at `step`, has other forces."""
    (particles,) = workpiece_particles(step)
    width = len(COLUMNS["workpiece_particles"])
    particles[COLUMNS["workpiece_particles"].index("force_x_n")] *= factor
    rest = [
        raw.binary(later, workpiece_particles(later), width)
        for later in range(step + 10, LAST + 1, 10)
    ]
    (run / "workpiece_particles.2.bin").write_bytes(
        raw.binary(step, [particles], width) + b"".join(rest)
    )


@pytest.mark.parametrize(("factor", "counts"), [(1.1, False), (1.0, True)])
def test_a_frame_evaluated_anew_after_a_resume_counts_only_if_it_repeats(
    tiny_run: Path, raw, factor: float, counts: bool
) -> None:
    resume(tiny_run, raw, 60, factor)
    write_tables(tiny_run)
    contacts = read(tiny_run, "workpiece_contacts")
    counted = contacts.loc[contacts["in_statistics"], "step"].tolist()
    assert counted == [step for step in range(40, LAST + 1, 10) if step != 60 or counts]
    found = closure(tiny_run)
    assert (found["verdict"], found["frames"], found["opening_frames"]) == ("pass", 9, 1)


def test_an_output_that_was_not_written_makes_no_table(tiny_run: Path, edit_json) -> None:
    edit_json(tiny_run / "columns.json", lambda c: c["outputs"].pop("workpiece_particles"))
    made = [path.name for path in write_tables(tiny_run)]
    assert made == ["thermo.parquet", "workpiece_force.parquet", "particles.parquet"]


def test_a_truncated_output_leaves_no_table_of_it(tiny_run: Path) -> None:
    file = tiny_run / "contacts.1.dump"
    file.write_bytes(file.read_bytes()[:-20])
    with pytest.raises(DumpError, match=r"contacts\.1\.dump, frame 5, byte"):
        write_tables(tiny_run)
    names = {path.name for path in (tiny_run / "tables").iterdir()}
    assert "workpiece_force.parquet" in names
    assert not {name for name in names if "contacts.parquet" in name and "workpiece" not in name}


def test_samples_are_found_in_blocks_and_gaps_are_not() -> None:
    names = (*FORCES, *REFERENCE)
    blocks = [
        {"step": np.array(steps), **{name: np.array(steps) + 0.5 for name in names}}
        for steps in ([2, 4], [6, 8])
    ]
    force, place = WorkpieceSamples(blocks).at(np.array([0, 4, 8]))
    assert np.isnan(force[0]).all() and (force[1:] == [[4.5], [8.5]]).all()
    assert (place == [[2.5], [4.5], [8.5]]).all()
    for step in (5, 10):
        with pytest.raises(TableError, match=f"has step {step}"):
            WorkpieceSamples(blocks).at(np.array([4, step]))
    with pytest.raises(TableError, match="no samples"):
        WorkpieceSamples([])


def to_scene(run: Path, edit_json, scene: str, outputs: dict) -> None:
    edit_json(run / "case.json", lambda case: case.update(scene=scene, restitution=0.68))
    edit_json(run / "columns.json", lambda columns: columns.update(outputs=outputs))


def test_a_drop_gives_impacts(tiny_run: Path, edit_json, raw) -> None:
    columns = ["step", "time_s", "z_m", "vz_m_s", "force_n"]
    to_scene(tiny_run, edit_json, "drop_test", {"impacts": output("print", columns, 1, 0, None)})
    parts = [
        raw.prints(
            [[step + k, (step + k) / 1e3, RADIUS_M, *row] for k, row in enumerate(rows)], columns
        )
        for step, rows in ((10, [[-4, 0], [0, 9], [3, 0]]), (30, [[-3, 0], [0, 5], [2, 0]]))
    ]
    (tiny_run / "x.1.txt").write_bytes(b"".join(parts))
    (made,) = write_tables(tiny_run)
    table = pd.read_parquet(made)
    np.testing.assert_allclose(table["restitution"], [0.75, 2 / 3])
    np.testing.assert_allclose(table["time_since_first_s"], [0, 0.02])


def test_a_filling_gives_the_bed_of_its_last_frame(tiny_run: Path, edit_json, raw) -> None:
    names = COLUMNS["particles"][:11]
    particles = output("custom", names, 1, 0, None, binary=True)
    to_scene(tiny_run, edit_json, "filling", {"particles": particles})
    frames = [raw.binary(step, [[1, 0, 0, z, *[0] * 6, 0.03]], 11)
              for step, z in ((5, 0.5), (700, 0.03))]  # fmt: skip
    (tiny_run / "x.1.txt").write_bytes(b"".join(frames))
    made = write_tables(tiny_run)
    assert [path.name for path in made] == ["particles.parquet", "packing.json"]
    bed = json.loads(made[1].read_text())
    assert (bed["bed_height_m"], bed["n_particles"]) == (pytest.approx(0.06), 1)


def test_contacts_with_an_added_force_are_refused(tiny_run: Path) -> None:
    """Friction is limited by the force without it, which no output contains."""
    file = tiny_run / "case.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"added_forces": ["cohesion sjkr2"]}))
    with pytest.raises(TableError, match="adds a force \\(cohesion sjkr2\\)"):
        write_tables(tiny_run)
    made = {table.name for table in (tiny_run / "tables").glob("*.parquet")}
    assert made == {"thermo.parquet", "workpiece_force.parquet", "particles.parquet"}
