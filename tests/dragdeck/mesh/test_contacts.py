"""Contacts that LIGGGHTS overlooks: the model of its rules against LIGGGHTS, and what mends it."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from blades import knife, twisted_blade
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plate import engine
from trimesh import Trimesh
from trimesh.convex import convex_hull

from dragdeck.decks import outputs
from dragdeck.decks.deck import Body, data_file
from dragdeck.decks.outputs import WORKPIECE_FORCE
from dragdeck.engine.acceptance import check_run
from dragdeck.errors import InputError
from dragdeck.mesh import files, shapes
from dragdeck.mesh import surface as surfaces
from dragdeck.mesh.contacts import EngineMesh, report, turned_mesh
from dragdeck.physics.run_limits import thrown_speed
from dragdeck.records.run import CaseFile, CountOfRun, RanksOfRun, RunPart

Floats = NDArray[np.float64]
RADIUS = 0.004


def written(text: str) -> tuple[Floats, Floats]:
    """Normals, (M, 3), and corners, (M, 3, 3), in the text of an STL file."""
    rows = [line.split() for line in text.splitlines()]
    normals = [row[2:] for row in rows if row[0] == "facet"]
    corners = [row[1:] for row in rows if row[0] == "vertex"]
    return np.array(normals, float), np.array(corners, float).reshape(-1, 3, 3)


def as_given(mesh: Trimesh) -> str:
    """STL text with the corners of each facet in the order of the mesh."""
    rows = []
    for facet in mesh.triangles.tolist():
        corners = "".join("vertex {:.12g} {:.12g} {:.12g}\n".format(*corner) for corner in facet)
        rows.append(f"facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n")
    return f"solid mesh\n{''.join(rows)}endsolid mesh\n"


def obtuse(corners: Floats) -> NDArray[np.bool_]:
    """(M, 3): which corners of facets are obtuse as LIGGGHTS sees it."""
    edges = np.roll(corners, -1, axis=1) - corners
    return np.asarray((edges * np.roll(edges, 1, axis=1)).sum(axis=2) > 0)


def hull(seed: int, facets_start_anywhere: bool = True) -> Trimesh:
    """A convex body of random proportions, the first corners of its facets at random."""
    random = np.random.default_rng(seed)
    size = 0.02 * random.uniform(0.05, 1, 3)
    body = convex_hull(size * random.normal(size=(random.integers(4, 40), 3)))
    first = random.integers(0, 3, len(body.faces)) * facets_start_anywhere
    faces = np.take_along_axis(body.faces, (first[:, None] + np.arange(3)) % 3, axis=1)
    return surfaces.surface(body.vertices, faces)


def turned_in_space(mesh: Trimesh, seed: int) -> Trimesh:
    matrix, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    matrix *= np.linalg.det(matrix)
    return surfaces.surface(mesh.vertices @ matrix.T, mesh.faces)


# --- what is written -----------------------------------------------------------------------------


def assert_turned_only(mesh: Trimesh) -> None:
    """The text has the facets of the mesh in their order, no obtuse corner first or second."""
    normals, corners = written(files.stl_text(mesh))
    given = np.array([[float(f"{x:.9g}") for x in corner] for corner in mesh.vertices])[mesh.faces]
    assert not obtuse(corners)[:, :2].any()
    assert normals == pytest.approx(mesh.face_normals, abs=1e-9)
    turns = [np.roll(given, -turn, axis=1) for turn in range(3)]
    same = np.array([(corners == turn).all(axis=(1, 2)) for turn in turns])
    assert same.any(axis=0).all()
    assert same[0][~obtuse(given)[:, :2].any(axis=1)].all()  # all others stay as they were


SHAPES = {
    "rod": shapes.cylinder(0.005, 0.08, 0.0015),
    "bowl": shapes.bowl(0.04, 0.08, 0.005),
    "tube": shapes.tube(0.03, 0.1, 0.005),
    "blade": twisted_blade(),
    "knife": knife(),
}


@pytest.mark.parametrize("name", SHAPES)
def test_an_obtuse_corner_is_written_third(name: str):
    """Also of a turned mesh: rounding to nine digits makes a right angle obtuse or acute."""
    assert_turned_only(SHAPES[name])
    for seed in range(3):
        assert_turned_only(turned_in_space(SHAPES[name], seed))
        assert_turned_only(surfaces.tilted(SHAPES[name], 7.3 * (seed + 1)))


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.floats(1e-3, 1e3), st.floats(-1, 1))
def test_an_obtuse_corner_of_any_body_is_written_third(seed: int, scale: float, shift: float):
    body = hull(seed)
    assert_turned_only(surfaces.surface(scale * body.vertices + shift, body.faces))


@given(st.floats(-1e-7, 1e-7), st.floats(1e-6, 1e-2), st.integers(0, 2))
def test_nearly_degenerate_and_nearly_right_facets(lean: float, height: float, first: int):
    """Right angles that lean by less than the last digit, and needles."""
    points = [[0.02, 0.02, 0], [0.03, 0.02, 0], [0.02 + lean, 0.02 + height, 0]]
    facet = np.roll([[0, 1, 2]], first, axis=1)
    assert_turned_only(surfaces.surface(points, facet))
    points[2][0] += 0.005
    assert_turned_only(surfaces.surface(points, facet))


def test_facets_without_an_obtuse_corner_keep_their_bytes():
    """Rods, bars and tubes, and with them the hashes of their runs."""
    bar = files.read(Path(__file__).parents[3] / "meshes/hex_bar.stl", "mm")
    for mesh in (SHAPES["rod"], SHAPES["tube"], bar):
        corners = mesh.triangles + 0.0
        normals = np.round(mesh.face_normals, 9) + 0.0
        facets = [
            "facet normal {:.9g} {:.9g} {:.9g}\nouter loop\n".format(*normal)
            + "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in facet)
            + "endloop\nendfacet\n"
            for normal, facet in zip(normals.tolist(), corners.tolist(), strict=True)
        ]
        assert files.stl_text(mesh) == "solid mesh\n" + "".join(facets) + "endsolid mesh\n"


# --- on LIGGGHTS ---------------------------------------------------------------------------------

HEAD = """\
units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
read_data spheres.data
neighbor 0.001 bin
neigh_modify delay 0 exclude type 1 1 one 20000 page 400000
fix m1 all property/global youngsModulus peratomtype 1e8
fix m2 all property/global poissonsRatio peratomtype 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.7
fix m4 all property/global coefficientFriction peratomtypepair 1 0.3
pair_style gran model hertz tangential history limitForce on
pair_coeff * *
fix part all mesh/surface/stress file mesh.stl type 1
fix wall all wall/gran model hertz tangential history mesh n_meshes 1 meshes part store_force yes limitForce on
fix integrate all nve/sphere
"""  # noqa: E501


CLUMP = """\
region place block {low[0]} {high[0]} {low[1]} {high[1]} {low[2]} {high[2]} volume_limit 1e-20 units box
fix template all particletemplate/multisphere 15485863 atom_type 1 density constant 2500 nspheres 2 ntry 100000 spheres {half} 0 0 {radius} -{half} 0 0 {radius} type 1
fix clumps all particledistribution/discrete 15485867 1 template 1.0
fix insert all insert/pack seed 32452843 distributiontemplate clumps maxattempt 100 insert_every once overlapcheck no orientation template vel constant 0. 0. 0. region place particles_in_region 1
"""  # noqa: E501


def clumped(head: str, centre: Floats) -> str:
    """With a body of two spheres that overlap by half, the first one with this centre."""
    middle, half = centre - (RADIUS / 2, 0, 0), RADIUS / 2
    clump = CLUMP.format(low=middle - 1e-6, high=middle + 1e-6, half=half, radius=RADIUS)
    box = "region box block -0.1 0.1 -0.1 0.1 -0.1 0.1 units box\ncreate_box 1 box"
    head = head.replace("read_data spheres.data", box)
    return head.replace("nve/sphere", "multisphere") + clump


def run(
    folder: Path, commands: str, stl: str, centres: Floats, *, ranks: int = 1, clump: bool = False
) -> None:
    """Run spheres that do not see each other, and a mesh, on LIGGGHTS; or one body of spheres."""
    reach = float(np.abs(centres).max()) + 0.1
    bodies = [Body(1, RADIUS, 2500, tuple(centre)) for centre in centres.tolist()]
    (folder / "spheres.data").write_text(data_file("spheres", 1, ((-reach, reach),) * 3, bodies))
    (folder / "mesh.stl").write_text(stl)
    head = clumped(HEAD, centres[0]) if clump else HEAD
    (folder / "in.liggghts").write_text(f"processors {ranks} 1 1\n{head}{commands}")
    engine(folder, ranks=ranks)


def forces(folder: Path, stl: str, centres: Floats) -> Floats:
    """(N,): force on each sphere, alone with the mesh at rest, in one step, N."""
    columns = " ".join(f"f_force_wall[{axis}]" for axis in (1, 2, 3))
    formats = "%d %.9g %.9g %.9g"
    run(
        folder,
        f"timestep 1e-9\ndump all all custom 1 forces.txt id {columns}\n"
        f'dump_modify all format "{formats}"\nrun 0\n',
        stl,
        centres,
    )
    rows = np.loadtxt(folder / "forces.txt", skiprows=9, ndmin=2)
    return np.asarray(np.linalg.norm(rows[np.argsort(rows[:, 0]), 1:], axis=1))


def around(mesh: Trimesh, count: int, seed: int) -> Floats:
    """Random centres within a radius of the box around a mesh."""
    low, high = mesh.bounds
    return np.random.default_rng(seed).uniform(low - RADIUS, high + RADIUS, (count, 3))


@pytest.mark.engine
@pytest.mark.parametrize(
    ("mesh", "some_lost"),
    [
        (twisted_blade(), True),
        (turned_mesh(twisted_blade()), False),
        (knife(), True),
        (turned_mesh(knife()), False),
        (hull(34), True),
        (turned_mesh(hull(11)), True),  # beside a corner whose edges LIGGGHTS takes for one line
        (turned_in_space(shapes.cylinder(0.005, 0.03, 0.0025), 3), False),
    ],
    ids=["blade", "turned blade", "knife", "turned knife", "hull", "turned hull", "rod"],
)
def test_the_model_agrees_with_liggghts(tmp_path: Path, mesh: Trimesh, some_lost: bool):
    """Thousands of spheres round it: a force where the model sees a contact, and no other."""
    centres = around(mesh, 2000, seed=5)
    all_turned = EngineMesh.of(turned_mesh(mesh))
    every = np.ones_like(all_turned.edge_active)
    whole = EngineMesh(all_turned.corners, every, every)
    touches = np.isfinite(whole.nearest(centres, RADIUS))
    seen = np.isfinite(EngineMesh.of(mesh).nearest(centres, RADIUS))
    force = forces(tmp_path, as_given(mesh), centres)
    assert (force > 0).tolist() == seen.tolist()
    assert touches.sum() > 300
    assert bool((touches & ~seen).any()) is some_lost


KNIFE_MOVES = {
    # onto the edge, 1.5 mm above a node of an obtuse corner; 8 mm above it, nothing is overlooked
    "straight": ((-5e-3, 0.4e-3, 1.5e-3), "linear -0.1 0. 0."),
    "clear": ((-5e-3, 0.4e-3, 8e-3), "linear -0.1 0. 0."),
    # on a circle about an axis 20 mm behind the edge, which sweeps past the sphere
    "spin": ((-0.263e-3, -8.567e-3, 0.8e-3), "rotate origin 0.02 0. 0. axis 0. 0. 1. period 1.26"),
}


def largest_force(folder: Path, stl: str, case: str) -> float:
    """On a free sphere in 2,500 steps of 40 us, while the knife comes with 0.1 m/s, N."""
    centre, move = KNIFE_MOVES[case]
    path = "$(f_part[1]) $(f_part[2]) $(f_part[3])"
    run(
        folder,
        f"timestep 4e-5\nfix move all move/mesh mesh part {move}\n"
        f'fix out all print 1 "{path}" file forces.txt screen no\nrun 2500\n',
        stl,
        np.array([centre]),
    )
    rows = np.loadtxt(folder / "forces.txt", skiprows=1)
    return float(np.linalg.norm(rows, axis=1).max())


@pytest.mark.engine
@pytest.mark.parametrize("clump", [False, True], ids=["sphere", "clump"])
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("name", ["raw", "written"])
def test_a_run_with_a_thrown_particle_is_refused(
    tmp_path: Path, name: str, ranks: int, clump: bool
):
    """The knife throws the sphere with 34 m/s, which a fall and the knife cannot give.

    Two ranks meet at the edge. A body of two spheres is thrown with 21.8 m/s.
    """
    centre, move = KNIFE_MOVES["straight"]
    output = outputs.workpiece_force(50, 2500, "part")
    columns = " ".join(f"$({one.engine})" for one in output.columns)
    titles = " ".join(one.name for one in output.columns)
    run(
        tmp_path,
        "variable speed atom sqrt(vx*vx+vy*vy+vz*vz)\n"
        "compute fastest_particle all reduce max v_speed\n"
        f"timestep 4e-5\nfix move all move/mesh mesh part {move}\n"
        f'fix out all print 50 "{columns}" file {output.name}.1.txt screen no title "{titles}"\n'
        "run 2500\n",
        as_given(knife()) if name == "raw" else files.stl_text(knife()),
        np.array([centre]),
        ranks=ranks,
        clump=clump,
    )
    raw = output.as_part()
    limit = thrown_speed(9.81, 0.2, 0.1)
    inputs = CaseFile(
        study_name="any", title="", scene="process", run="a", timestep_s=4e-5, rayleigh_time_s=1e-4,
        versions={}, fidelity=RanksOfRun(ranks=1), media=CountOfRun(count=1), thrown_m_s=limit,
    )  # fmt: skip
    part = RunPart(part=1, checkpoint=None, from_step=0)
    checks = check_run(tmp_path, inputs, {WORKPIECE_FORCE: raw}, 0, [part], ranks=1)
    (check,) = (check for check in checks if check.code == "none_thrown")
    assert check.passed is (name == "written")
    thrown = 21.8 if clump else 34
    assert check.number == pytest.approx(thrown if name == "raw" else 0.172, rel=0.02)


@pytest.mark.engine
@pytest.mark.parametrize(
    ("case", "as_written", "turned"),
    [("straight", 569, 0.357), ("clear", 0.357, 0.357), ("spin", 0, 0.313)],
)
def test_a_sphere_and_a_knife(tmp_path: Path, case: str, as_written: float, turned: float):
    """As written: thrown with hundreds of newtons, or the knife passes through the sphere."""
    for name, text, expected in (
        ("raw", as_given(knife()), as_written),
        ("written", files.stl_text(knife()), turned),
    ):
        folder = tmp_path / name
        folder.mkdir()
        assert largest_force(folder, text, case) == pytest.approx(expected, rel=2e-3)


# --- dragdeck mesh -------------------------------------------------------------------------------


def percents(text: str, name: str) -> list[float]:
    """A fraction and its confidence interval, from the line of this name."""
    found = re.search(rf"{name}: +(\S+) % \(95 % CI (\S+) to (\S+) %\)", text)
    assert found
    return [float(word) for word in found.groups()]


def test_the_command_counts_and_mends(tmp_path: Path):
    """In any unit: what a file loses, and that the file that it writes loses nothing."""
    blade, mm = twisted_blade(), 1e3
    file, out = tmp_path / "blade.stl", tmp_path / "turned.stl"
    file.write_text(as_given(surfaces.surface(mm * blade.vertices, blade.faces)))
    said = report(file, "mm", RADIUS, None, out)
    share, low, high = percents(said, "as written")
    assert 20 < low < share < high < 35
    assert percents(said, "turned")[0] == 0
    assert percents(report(out, "mm", RADIUS, None, None), "as written")[0] == 0
    assert_turned_only(files.read(file, "m"))
    _, corners = written(out.read_text())
    assert np.sort(corners, axis=1) == pytest.approx(np.sort(mm * blade.triangles, axis=1))


def test_a_mesh_without_convex_edges_loses_nothing(tmp_path: Path):
    (tmp_path / "bowl.stl").write_text(as_given(shapes.bowl(0.04, 0.08, 0.01)))
    assert "no convex edges" in report(tmp_path / "bowl.stl", "m", RADIUS, None, None)


@pytest.mark.parametrize(
    ("name", "radius_m", "size_m", "out", "words"),
    [
        ("blade.stl", 0.0, None, None, "--radius: not a length"),
        ("blade.stl", math.nan, None, None, "--radius: not a length"),
        ("blade.step", RADIUS, None, None, "add the facet_size_m of the study"),
        ("blade.step", RADIUS, -1.0, None, "--facet-size: not a length"),
        ("blade.stl", RADIUS, None, "blade.stl", "the file would be replaced"),
        ("none.stl", RADIUS, None, None, "there is no such mesh file"),
        ("needle.stl", RADIUS, None, None, "too sharp for LIGGGHTS"),
    ],
)
def test_what_the_command_refuses(
    tmp_path: Path, name: str, radius_m: float, size_m: float | None, out: str | None, words: str
):
    (tmp_path / "blade.stl").write_text(as_given(twisted_blade()))
    needle = [[0, 0, 0], [0.02, 0, 0], [0.01, 0.00002, 0]]
    (tmp_path / "needle.stl").write_text(as_given(surfaces.surface(needle, [[0, 1, 2]])))
    before = (tmp_path / "blade.stl").read_bytes()
    with pytest.raises(InputError, match=words):
        report(tmp_path / name, "m", radius_m, size_m, out and tmp_path / out)
    assert (tmp_path / "blade.stl").read_bytes() == before
