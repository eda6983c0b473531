"""What other programs' readers find in an export is what the tables hold."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import pyvista as pv
from finished_runs import write_finished_run
from made_run import with_motion
from networks import random_frame
from tiny_run_files import LAST, TIMESTEP_S, workpiece_x_m

from dragchain.cli import main
from dragchain.errors import ExportError, TableError
from dragchain.export.frames import Membership, chain_membership
from dragchain.export.write import fresh_folder, write_export
from dragchain.network.chains import WidestPath, dominant_path, peters_rows, widest_paths
from dragchain.network.frame import WORKPIECE, NetworkFrame
from dragchain.network.write import chain_table
from dragchain.run.workpiece import read_surface
from dragdeck.records.case import load_case

STEPS = range(0, LAST + 1, 20)
COUNTED = range(40, LAST + 1, 20)
PLACE = ["x_m", "y_m", "z_m"]
SPEED = ["vx_m_s", "vy_m_s", "vz_m_s"]
SPIN = ["wx_rad_s", "wy_rad_s", "wz_rad_s"]
FORCE = ["force_x_n", "force_y_n", "force_z_n"]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny run with all its tables; not to be changed."""
    return write_finished_run(tmp_path_factory.mktemp("made") / "tiny")


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    """A copy of that run."""
    return Path(shutil.copytree(made, tmp_path / "tiny"))


def table(run_dir: Path, name: str) -> pd.DataFrame:
    return pd.read_parquet(run_dir / "tables" / f"{name}.parquet")


def exported(run_dir: Path, *options: Any, **named: Any) -> Path:
    """The file to open of an export."""
    return Path(write_export(run_dir, *options, **named).partition(": ")[2])


def series(file: Path) -> dict[float, Any]:
    """Read every time of a PVD file."""
    reader = pv.PVDReader(file)
    found = {}
    for time_s in reader.time_values:
        reader.set_active_time_value(time_s)
        (found[time_s],) = reader.read()
    return found


# --- ParaView --------------------------------------------------------------------------------


def test_paraview_reads_what_the_tables_hold(run: Path) -> None:
    file = exported(run)
    assert file == run / "export/paraview/run.pvd"
    particles, contacts = table(run, "particles"), table(run, "contacts")
    found = series(file)
    assert list(found) == sorted(set(particles["time_s"])) == [s * TIMESTEP_S for s in STEPS]
    for time_s, blocks in found.items():
        assert blocks.keys() == ["particles", "contacts", "workpiece"]
        of_particles = particles[particles["time_s"] == time_s].sort_values("particle_id")
        points = blocks["particles"]
        np.testing.assert_array_equal(points.points, of_particles[PLACE])
        np.testing.assert_array_equal(points["id"], of_particles["particle_id"])
        np.testing.assert_array_equal(points["radius"], of_particles["radius_m"])
        np.testing.assert_array_equal(points["v"], of_particles[SPEED])
        np.testing.assert_array_equal(points["omega"], of_particles[SPIN])
        of_contacts = contacts[contacts["time_s"] == time_s]
        lines = blocks["contacts"]
        assert lines.n_lines == lines.n_cells == len(of_contacts)
        np.testing.assert_array_equal(lines["id1"], of_contacts["a_id"])
        np.testing.assert_array_equal(lines["id2"], of_contacts["b_id"])
        np.testing.assert_array_equal(lines["force_n"], of_contacts[FORCE])
        for name in ("normal_force_n", "tangential_force_n", "overlap_m"):
            np.testing.assert_array_equal(lines[name], of_contacts[name])
        for number, force in zip(points["id"], points["max_normal_force_n"], strict=True):
            own = of_contacts[(of_contacts[["a_id", "b_id"]] == number).any(axis=1)]
            assert force == own["normal_force_n"].max() if len(own) else force == 0


def test_lines_go_from_centre_to_centre_or_to_the_contact_point(run: Path) -> None:
    last = list(series(exported(run)).values())[-1]
    lines, particles = last["contacts"], last["particles"]
    contacts = table(run, "contacts")
    point = contacts[contacts["step"] == LAST][["point_x_m", "point_y_m", "point_z_m"]].to_numpy()
    centre = dict(zip(particles["id"].tolist(), particles.points, strict=True))
    kinds = [f"particle-{body}" for body in ("particle", "workpiece", "floor", "side")]
    assert contacts[contacts["step"] == LAST]["kind"].tolist() == [kinds[k] for k in lines["kind"]]
    ends = lines.points[lines.lines.reshape(-1, 3)[:, 1:]]
    for row, (start, end) in enumerate(ends):
        other = int(lines["id2"][row])
        np.testing.assert_array_equal(start, centre[int(lines["id1"][row])])
        np.testing.assert_array_equal(end, centre[other] if other > 0 else point[row])


@pytest.mark.parametrize("missing", [None, 3])
def test_the_load_map_is_on_the_right_facets(run: Path, missing: int | None) -> None:
    """Only a table of this mesh is: one with fewer facets is not taken."""
    surface = read_surface(run, load_case(run))
    loads = 10.0 * np.arange(len(surface.corners))[missing:]
    names = ("mean_pressure_pa", "friction_work_pa", "peak_normal_force_n")
    pd.DataFrame(dict.fromkeys(names, loads)).to_parquet(run / "tables/facets.parquet")
    mesh = series(exported(run))[LAST * TIMESTEP_S]["workpiece"]
    if missing:
        assert mesh.array_names == []
        return
    centres = mesh.cell_centers().points - [workpiece_x_m(LAST), 0, 0.02]
    near = np.linalg.norm(centres[:, None] - surface.centres, axis=2).argmin(axis=1)
    np.testing.assert_array_equal(mesh["mean_pressure_pa"], 10.0 * near)
    assert len(set(near)) == mesh.n_cells


def test_chains_mark_particles_and_contacts_where_they_were_searched(run: Path) -> None:
    """The chain from the workpiece over particles 1 and 2 to the side is the only, dominant
    path."""
    found = series(exported(run))
    for step, blocks in zip(STEPS, found.values(), strict=True):
        particles, lines = blocks["particles"], blocks["contacts"]
        on_path = np.isin(particles["id"], [1, 2])
        in_path = np.isin(lines["id1"], [1, 2])
        assert in_path.sum() == (3 if step >= 20 else 0)
        for name in ("widest_paths", "dominant"):
            if step in COUNTED:
                np.testing.assert_array_equal(particles[name], on_path)
                np.testing.assert_array_equal(lines[name], in_path)
            else:
                assert (particles[name] == -1).all() and (lines[name] == -1).all()
        assert set(particles["peters_chain"]) == {
            0 if step in COUNTED else -1
        }  # three particles at least


def test_the_workpiece_turns_with_its_path(run: Path, edit_json) -> None:
    def circle(case: dict[str, Any]) -> None:
        path = {"kind": "circle", "radius_m": 0.02}
        case.update(with_motion(case, path, 1e-4, orientation="follow_path"))

    edit_json(run / "case.json", circle)
    force = table(run, "workpiece_force").assign(direction_rad=np.pi / 2)
    force.to_parquet(run / "tables/workpiece_force.parquet")
    workpiece = series(exported(run))[LAST * TIMESTEP_S]["workpiece"]
    x, y, z = pv.read(run / "workpiece.stl").points.T
    moved = np.column_stack([workpiece_x_m(LAST) - y, x, z + 0.02])
    np.testing.assert_allclose(workpiece.points, moved, atol=1e-8)


def test_a_frame_without_contacts_has_none(run: Path) -> None:
    contacts = table(run, "contacts")
    contacts[contacts["step"] != 60].to_parquet(run / "tables/contacts.parquet")
    (run / "tables/chains.parquet").unlink()
    folder = exported(run).parent
    lines = series(folder / "contacts.pvd")
    assert [mesh.n_cells for mesh in lines.values()] == [2, 5, 5, 0, 5, 5]
    particles = series(folder / "particles.pvd")[60 * TIMESTEP_S]
    assert set(particles["coordination_number"]) == {0}
    for mesh in (particles, lines[0.0]):
        assert not {"peters_chain", "widest_paths", "dominant"} & set(mesh.array_names)


def test_a_filling_has_particles_only(run: Path, edit_json) -> None:
    bare = {"scene": "filling", "workpiece": None, "motion": None}
    edit_json(run / "case.json", lambda case: case.update(bare))
    edit_json(run / "columns.json", lambda content: content["outputs"].pop("contacts"))
    found = series(exported(run))
    assert {tuple(blocks.keys()) for blocks in found.values()} == {("particles",)}
    assert not (run / "export/paraview/contacts.pvd").exists()


# --- chain membership ------------------------------------------------------------------------


def doubled(seed: int) -> NetworkFrame:
    """A random network whose particles on the workpiece touch it twice, with other forces."""
    frame = random_frame(seed)
    again = np.append(np.arange(frame.a.size), np.flatnonzero(frame.other == WORKPIECE))
    scale = np.where(np.arange(again.size) < frame.a.size, 1.0, 0.8)
    parts = {name: getattr(frame, name)[again] for name in ("a", "b", "other", "point")}
    force = scale[:, None] * frame.force[again]
    return replace(frame, **parts, force=force, normal_force=scale * frame.normal_force[again])


def test_membership_from_the_table_is_that_of_the_search() -> None:
    doubles = ends = 0
    for frame in map(doubled, range(40)):
        found = chain_membership(frame, chain_table(frame))
        paths = widest_paths(frame)
        check_membership(frame, found, paths)
        doubles += len(paths) - len({path.particles[0] for path in paths})
        ends += sum(path.end is not None for path in paths)
    assert doubles > 10 and ends > 100  # of one particle with two contacts on the workpiece; in all


def check_membership(frame: NetworkFrame, found: Membership, paths: list[WidestPath]) -> None:
    whole = [path for path in paths if path.end is not None]
    particles = np.zeros(frame.particle_id.size, dtype=int)
    contacts = np.zeros(frame.a.size, dtype=int)
    for path in whole:
        particles[list(path.particles)] += 1
        contacts[list(path.contacts)] += 1
    np.testing.assert_array_equal(found.particles["widest_paths"], particles)
    np.testing.assert_array_equal(found.contacts["widest_paths"], contacts)
    best = dominant_path(frame, paths)
    contacts_of, particles_of = (best.contacts, best.particles) if best else ((), ())
    assert set(np.flatnonzero(found.contacts["dominant"])) == set(contacts_of)
    assert set(np.flatnonzero(found.particles["dominant"])) == set(particles_of)
    for number, chain in enumerate(peters_rows(frame).particle_lists(), start=1):
        assert set(np.flatnonzero(found.particles["peters_chain"] == number)) == set(chain)
        assert (found.contacts["peters_chain"] == number).sum() == len(chain) - 1


@pytest.mark.parametrize("other", [77, 4])
def test_a_chain_that_the_frame_does_not_have_is_an_error(run: Path, other: int) -> None:
    chains = table(run, "chains")
    chains["particle_ids"] = [[1, other] for _ in range(len(chains))]
    chains.to_parquet(run / "tables/chains.parquet")
    with pytest.raises(TableError, match="a chain of step 40 has a particle or"):
        write_export(run)


# --- which frames ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("first_s", "last_s", "every", "steps"),
    [
        (0.04, None, 1, [40, 60, 80, 100]),
        (0.0401, 0.0801, 1, [40, 60, 80]),
        (0.02, None, 3, [20, 80]),
    ],
)
def test_frames_are_those_asked_for(
    run: Path, first_s: float, last_s: float | None, every: int, steps: list[int]
) -> None:
    frames = series(exported(run, None, first_s, last_s, every))
    assert list(frames) == [step * TIMESTEP_S for step in steps]


def test_row_groups_and_batches_may_cut_a_frame(run: Path, monkeypatch) -> None:
    whole = exported(run, run / "whole").parent
    for name in ("particles", "contacts", "workpiece_force", "chains"):
        table(run, name).to_parquet(run / f"tables/{name}.parquet", row_group_size=3)
    monkeypatch.setattr("dragchain.tables.by_step.PIECE_ROWS", 2)
    cut = exported(run, run / "cut").parent
    files = sorted(file.relative_to(whole) for file in whole.rglob("*.vt*"))
    assert len(files) == 6 * 4
    assert all((whole / file).read_bytes() == (cut / file).read_bytes() for file in files)


# --- errors ----------------------------------------------------------------------------------


def test_an_interval_without_frames_says_where_they_are(run: Path) -> None:
    with pytest.raises(ExportError, match=r"(?s)no frame.* of 0 to 0.1 s\n"):
        write_export(run, None, 0.5, 0.7)
    with pytest.raises(ExportError, match="--every"):
        write_export(run, every=0)


# --- the folder ------------------------------------------------------------------------------


def test_replacing_takes_the_files_of_the_export_and_no_others(run: Path) -> None:
    folder = exported(run).parent
    (folder / "mine.pvsm").write_text("a state of ParaView")
    exported(run, None, 0.1, replace=True)
    assert len(series(folder / "run.pvd")) == 1
    assert (folder / "mine.pvsm").read_text() == "a state of ParaView"
    assert sorted(file.name for file in (folder / "frames").iterdir()) == ["100", "100.vtm"]


def test_a_folder_with_other_files_is_left_alone(run: Path, tmp_path: Path) -> None:
    (tmp_path / "data.txt").write_text("mine")
    for target, problem in ((tmp_path, "not an export"), (tmp_path / "data.txt", "not a folder")):
        with pytest.raises(ExportError, match=problem):
            write_export(run, target, replace=True)
    assert (tmp_path / "data.txt").read_text() == "mine"


def test_nothing_is_left_of_an_export_that_ends_early(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), fresh_folder(tmp_path / "a/b", replace=False) as folder:
        (folder / "half").write_text("written")
        raise KeyboardInterrupt
    assert not any((tmp_path / "a").iterdir())


# --- the command -----------------------------------------------------------------------------


def test_the_command_replaces_only_when_asked(run: Path, tmp_path: Path, capsys) -> None:
    arguments = ["export", str(run), "--out", str(tmp_path / "out"), "--every", "2"]
    assert main([*arguments, "--from-time", "0.04", "--to-time", "0.08"]) == 0
    assert f"2 frames: {tmp_path / 'out/run.pvd'}" in capsys.readouterr().out
    assert main(arguments) == 1
    assert "already contains an export" in capsys.readouterr().err
    assert main([*arguments, "--replace"]) == 0
