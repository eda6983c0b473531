"""Meshes against what geometry says they must be, and against the engine itself."""

import math
import subprocess
from pathlib import Path

import meshio
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from trimesh import Trimesh

from dragdeck.engine.process import find_engine
from dragdeck.errors import InputError
from dragdeck.mesh import checks, files, shapes
from dragdeck.mesh import surface as surfaces

MESHES = Path(__file__).parents[3] / "meshes"
SCENE = checks.Surroundings(bowl_radius_m=0.04, particle_radius_m=0.00202)

TETRAHEDRON = surfaces.surface(
    points=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.01,
    triangles=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)


def needle(tip_deg: float) -> Trimesh:
    """A closed body with a facet whose sharpest angle is the given one."""
    half = 0.02 * math.tan(math.radians(tip_deg) / 2)
    points = [[0, 0, 0], [0.02, -half, 0], [0.02, half, 0], [0.01, 0, 0.01]]
    return surfaces.surface(np.array(points), TETRAHEDRON.faces)


def with_facets(*facets: list[int]) -> Trimesh:
    return surfaces.surface(TETRAHEDRON.vertices, np.array(facets))


def lengths(mesh: Trimesh) -> np.ndarray:
    """(M, 3) array: the edges of every facet, in metres."""
    return np.asarray(mesh.edges_unique_length[mesh.faces_unique_edges])


def problems(mesh: Trimesh, **options: object) -> list[str]:
    return [finding.problem for finding in checks.findings(mesh, **options)]  # type: ignore[arg-type]


# --- the properties of a mesh -------------------------------------------------


def test_bounds_ignore_nodes_that_no_facet_uses():
    points = np.vstack([TETRAHEDRON.vertices, [9.0, 9.0, 9.0]])
    assert surfaces.surface(points, TETRAHEDRON.faces).bounds.max() == 0.01


def test_a_facet_cannot_name_a_node_that_is_not_there():
    with pytest.raises(ValueError, match=r"0 \.\.\. 3"):
        with_facets([0, 1, 4])


# --- made meshes ---------------------------------------------------------------


@pytest.mark.parametrize("facet_size_m", [0.0005, 0.001, 0.0025, 0.005])
def test_cylinder_against_the_formulas(facet_size_m: float):
    radius, length = 0.005, 0.08
    workpiece = shapes.cylinder(radius, length, facet_size_m)
    sides = shapes.polygon_sides(radius, facet_size_m)
    corner = shapes.polygon_radius(radius, sides)
    section = sides / 2 * corner**2 * math.sin(math.tau / sides)
    assert workpiece.is_watertight
    assert workpiece.volume == pytest.approx(section * length, rel=1e-12)
    on_side = np.abs(workpiece.face_normals[:, 2]) < 0.5
    assert workpiece.area_faces[on_side].sum() == pytest.approx(
        math.tau * radius * length, rel=1e-12
    )
    assert workpiece.area_faces[~on_side].sum() == pytest.approx(2 * section, rel=1e-12)
    assert workpiece.bounds[:, 2].tolist() == [0.0, length]
    assert surfaces.place(workpiece).vertices == pytest.approx(workpiece.vertices, abs=1e-15)
    outermost = np.hypot(*workpiece.vertices[:, :2].T).max()
    assert outermost == pytest.approx(corner)
    assert shapes.cylinder_radius(radius, length, facet_size_m) == outermost
    assert checks.findings(workpiece, surroundings=SCENE) == []


@settings(max_examples=40)
@given(
    radius=st.floats(1e-4, 0.05), slenderness=st.floats(0.3, 20), refinement=st.floats(1.0, 12.0)
)
def test_every_cylinder_is_a_body_of_shapely_facets(
    radius: float, slenderness: float, refinement: float
):
    length, facet = radius * slenderness, radius / refinement
    workpiece = shapes.cylinder(radius, length, facet)
    assert workpiece.is_watertight
    assert workpiece.is_winding_consistent
    assert workpiece.volume > 0
    assert checks.findings(workpiece) == []
    assert math.degrees(workpiece.face_angles.min()) > 15
    on_side = np.abs(workpiece.face_normals[:, 2]) < 0.5
    legs = np.sort(lengths(workpiece)[on_side], axis=1)[:, :2]
    sides = shapes.polygon_sides(radius, facet)
    assert legs.max() <= max(facet, math.tau * radius / sides) * (1 + 1e-9)


@settings(deadline=None)
@given(radius=st.floats(1e-3, 1.0), sides=st.integers(8, 400), heading=st.floats(0, math.tau))
def test_the_polygon_is_on_average_as_wide_as_the_circle(radius: float, sides: int, heading: float):
    corner = shapes.polygon_radius(radius, sides)
    angles = math.tau * np.arange(sides) / sides
    turns = heading + np.linspace(0, math.tau / sides, 2001)[:-1]
    across = corner * np.cos(angles[:, None] - turns)
    width = across.max(axis=0) - across.min(axis=0)
    assert width.mean() == pytest.approx(2 * radius, rel=1e-5)


def test_bowl_holds_the_round_bowl_and_opens_upwards():
    bowl = shapes.bowl(0.04, 0.08, 0.005)
    assert not bowl.is_watertight
    assert bowl.is_winding_consistent
    assert problems(bowl, workpiece=False) == []
    on_side = np.abs(bowl.face_normals[:, 2]) < 0.5
    middle = bowl.triangles.mean(axis=1)
    to_axis = np.einsum("mc,mc->m", bowl.face_normals[on_side], middle[on_side])
    assert to_axis == pytest.approx(-0.04)
    assert bowl.face_normals[~on_side, 2] == pytest.approx(1.0, abs=1e-15)
    assert middle[~on_side, 2] == pytest.approx(0.0)


# --- placing and welding --------------------------------------------------------


@given(st.tuples(*[st.floats(-1, 1)] * 3))
def test_place_undoes_any_shift(shift: tuple[float, float, float]):
    moved = surfaces.place(surfaces.surface(TETRAHEDRON.vertices + shift, TETRAHEDRON.faces))
    assert moved.bounds == pytest.approx(
        np.array([[-0.005, -0.005, 0], [0.005, 0.005, 0.01]]), abs=1e-12
    )


@pytest.mark.parametrize("axis", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_upright_turns_an_axis_up_and_mirrors_nothing(axis: str):
    up = np.zeros(3)
    up["xyz".index(axis[1])] = 1.0 if axis[0] == "+" else -1.0
    skew = surfaces.surface(TETRAHEDRON.vertices * [1, 2, 3], TETRAHEDRON.faces)
    stood = surfaces.upright(skew, axis)
    assert stood.vertices[:, 2].tolist() == (skew.vertices @ up).tolist()
    assert stood.volume == pytest.approx(skew.volume)
    assert np.sort(stood.edges_unique_length) == pytest.approx(np.sort(skew.edges_unique_length))


def test_an_upright_mesh_is_left_to_the_last_bit():
    rod = shapes.cylinder(0.005, 0.02, 0.0025)
    assert (surfaces.upright(rod, "+z").vertices == rod.vertices).all()


def test_place_puts_the_clamping_axis_in_the_origin():
    low = surfaces.place(TETRAHEDRON, (0.002, -0.003)).bounds[0]
    assert low == pytest.approx([-0.002, 0.003, 0.0])
    assert surfaces.place(TETRAHEDRON, (0.0, 0.0)).bounds[0] == pytest.approx([0, 0, 0])


def test_nodes_that_are_there_twice_are_merged_with_a_word(tmp_path: Path):
    loose = meshio.Mesh(TETRAHEDRON.triangles.reshape(-1, 3), [("triangle", [[0, 1, 2]])])
    loose.cells[0].data = np.arange(12).reshape(4, 3)
    for name, said in (("body.obj", 1), ("body.ply", 1), ("body.vtk", 1), ("body.stl", 0)):
        loose.write(tmp_path / name)
        found = checks.check(files.read(tmp_path / name, "m"))
        assert [one.problem for one in found] == said * ["nodes are duplicated"]
        assert not said or found[0].value.startswith("8 merged, 4 remain")


def test_weld_joins_nodes_within_the_precision_only():
    loose = surfaces.surface(TETRAHEDRON.triangles.reshape(-1, 3), np.arange(12))
    noise = np.random.default_rng(1).uniform(-2e-9, 2e-9, (12, 3))
    rough = surfaces.surface(loose.vertices + noise, loose.faces)
    assert not loose.is_watertight
    assert len(surfaces.weld(rough).vertices) == 4
    assert surfaces.weld(rough).is_watertight
    assert not surfaces.weld(
        surfaces.surface(loose.vertices + 100 * noise, loose.faces)
    ).is_watertight


# --- checks -----------------------------------------------------------------------


def test_empty_mesh():
    assert problems(surfaces.surface(np.empty((0, 3)), np.empty((0, 3)))) == ["the mesh is empty"]


@pytest.mark.parametrize("value", ["nan", "-inf", "-1e160"])
@pytest.mark.filterwarnings("error")
def test_coordinate_that_is_no_length(value: str, tmp_path: Path):
    (tmp_path / "a.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 {value} 0\nf 1 2 3\n")
    with pytest.raises(InputError, match=r"not a length\n.*node 3 of 3: 0.0 "):
        files.read(tmp_path / "a.obj", "m")


def test_degenerate_facets():
    assert "a facet has no area" in problems(with_facets([0, 1, 1]), workpiece=False)
    flat = surfaces.surface(np.array([[0, 0, 0], [0.01, 0, 0], [0.02, 1e-9, 0]]), [[0, 1, 2]])
    assert "a facet has no area" in problems(flat, workpiece=False)


def test_duplicate_facet_whichever_way_it_runs():
    for again in ([0, 2, 1], [1, 2, 0]):
        found = problems(with_facets(*TETRAHEDRON.faces.tolist(), again))
        assert found[0] == "a facet is duplicated"


def test_open_box():
    with pytest.raises(InputError, match="not closed") as caught:
        checks.check(
            with_facets([0, 2, 1], [0, 1, 3], [1, 2, 3]), file="box.stl", field="workpiece.mesh"
        )
    assert str(caught.value).startswith("box.stl: workpiece.mesh: ")
    assert str(caught.value.value).startswith("3 of 6 edges")


def turned(mesh: Trimesh, which: list[int]) -> Trimesh:
    """The same surface with the corners of some facets in the other order."""
    faces = mesh.faces.copy()
    faces[which] = faces[which, ::-1]
    return surfaces.surface(mesh.vertices, faces)


@pytest.mark.parametrize("which", [[0], [0, 2], [0, 1, 2, 3]])
def test_turned_normals_are_said_and_turned_outwards(which: list[int]):
    body = turned(TETRAHEDRON, which)
    (finding,) = checks.check(body)
    assert (finding.severity, finding.problem[:11]) == ("warning", "the normals")
    repaired = surfaces.facing_out(body)
    assert repaired is not None
    assert problems(repaired) == []
    assert repaired.volume == pytest.approx(TETRAHEDRON.volume)


@settings(max_examples=20)
@given(st.sets(st.integers(0, 203)))
def test_whichever_facets_are_turned_the_same_body_comes_back(which: set[int]):
    bar = shapes.prism(6, 0.005, 0.08, 0.005, 0.005)
    repaired = surfaces.facing_out(turned(bar, sorted(which)))
    assert repaired is not None
    assert repaired.face_normals == pytest.approx(bar.face_normals)


def test_a_body_whose_normals_are_right_is_left_as_it_is():
    assert surfaces.facing_out(TETRAHEDRON) is TETRAHEDRON


def klein_bottle(rows: int = 8) -> Trimesh:
    """A closed surface with one side: in four dimensions, of which three are kept."""
    u, v = (math.tau * np.arange(rows) / rows for _ in range(2))
    u, v = np.meshgrid(u, v, indexing="ij")
    ring = 2.0 + np.cos(v)
    points = [ring * np.cos(u), ring * np.sin(u), np.sin(v) * (np.cos(u / 2) + 0.3)]
    node = np.arange(rows * rows).reshape(rows, rows)
    mirrored = node[0, (-np.arange(rows)) % rows]
    node = np.vstack([node, mirrored])
    a, b, c, d = node[:-1], node[1:], np.roll(node[1:], -1, 1), np.roll(node[:-1], -1, 1)
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return surfaces.surface(0.01 * np.stack(points, -1).reshape(-1, 3), faces)


def test_a_surface_with_one_side_is_refused():
    assert surfaces.facing_out(klein_bottle()) is None
    assert "the surface has one side only" in problems(klein_bottle())


def both(one: Trimesh, other: Trimesh) -> Trimesh:
    """Two bodies in one mesh."""
    return surfaces.surface(
        np.vstack([one.vertices, other.vertices]),
        np.vstack([one.faces, other.faces + len(one.vertices)]),
    )


def test_several_bodies_are_refused():
    beside = surfaces.surface(TETRAHEDRON.vertices + np.array([0.02, 0, 0]), TETRAHEDRON.faces)
    with pytest.raises(InputError, match="several bodies") as caught:
        checks.check(both(TETRAHEDRON, beside))
    assert str(caught.value.value).startswith("2 bodies; the largest has 4 of 8 facets")


def test_an_open_body_does_not_hide_that_there_are_several():
    beside = surfaces.surface(TETRAHEDRON.vertices + np.array([0.02, 0, 0]), TETRAHEDRON.faces[1:])
    found = problems(both(TETRAHEDRON, beside))
    assert found == ["the mesh is not closed", "the mesh contains several bodies"]


def test_a_hollow_body_is_refused():
    void = surfaces.surface(0.1 * TETRAHEDRON.vertices + 0.001, TETRAHEDRON.faces[:, ::-1])
    assert problems(both(TETRAHEDRON, void)) == ["the mesh contains several bodies"]


def test_sharp_angles():
    assert problems(needle(0.6)) == []
    (doubt,) = checks.findings(needle(0.3))
    assert doubt.severity == "warning"
    assert doubt.value.startswith("0.3 degrees at (13.33, 0, 0) mm, clamp upwards; 2 of 4 facets")
    assert "the angle of a facet is too sharp for LIGGGHTS" in problems(needle(0.2))


def fan(blades: int) -> Trimesh:
    angle = math.tau * np.arange(blades) / blades
    tips = np.column_stack([np.cos(angle), np.sin(angle), np.full(blades, 0.5)])
    points = np.vstack([[0, 0, 0], [0, 0, 1], tips]) * 0.01
    return surfaces.surface(points, [[0, 1, 2 + blade] for blade in range(blades)])


def test_neighbours_at_one_edge():
    crowded = "too many facets meet at the edges of one"
    assert crowded not in problems(fan(5), workpiece=False)
    assert crowded in problems(fan(7), workpiece=False)


def folded() -> Trimesh:
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.6, 0.5, 0]]) * 0.01
    return surfaces.surface(points, [[0, 1, 2], [0, 1, 3]])


def test_coplanar_facets_on_top_of_each_other():
    assert problems(folded(), workpiece=False) == [
        "two facets of one plane lie on top of each other"
    ]
    flat = surfaces.surface(folded().vertices * [1, -1, 1], [[1, 0, 2]])
    assert problems(flat, workpiece=False) == []


@pytest.mark.parametrize(
    ("factor", "remedy"),
    [
        (1e3, "in millimetres, but declared in metres?"),
        (1e-3, "in metres, but declared in millimetres?"),
    ],
)
def test_wrong_unit_is_named(factor: float, remedy: str):
    workpiece = shapes.cylinder(0.005, 0.08, 0.005)
    wrong = surfaces.surface(workpiece.vertices * factor, workpiece.faces)
    with pytest.raises(InputError) as caught:
        checks.check(wrong, surroundings=SCENE)
    assert remedy in str(caught.value.remedy)


def test_only_what_is_in_the_bed_must_be_narrower_than_the_bowl():
    bar = shapes.cylinder(0.005, 0.08, 0.005)
    high = bar.vertices[:, 2:] > 0.05
    flared = surfaces.surface(bar.vertices * np.where(high, [12, 12, 1], 1), bar.faces)
    for depth, told in (
        (0.02, []),
        (0.07, ["the size of the workpiece is not plausible in this bowl"]),
    ):
        scene = checks.Surroundings(SCENE.bowl_radius_m, SCENE.particle_radius_m, depth)
        assert problems(flared, surroundings=scene) == told


# --- files ------------------------------------------------------------------------


def test_a_missing_file_and_what_cannot_be_a_length_are_refused(tmp_path: Path):
    with pytest.raises(InputError, match="no such mesh file"):
        files.read(tmp_path / "none.stl", "mm")
    with pytest.raises(InputError, match="unknown length unit") as caught:
        files.read(tmp_path / "none.stl", "furlong")
    assert "mm" in str(caught.value.limit)
    for facet_size_m in (0.006, 1e-6):  # too coarse, and too many
        with pytest.raises(InputError) as caught:
            shapes.cylinder(0.005, 0.08, facet_size_m)
        assert caught.value.field == "workpiece.shape.facet_size_m"
        assert caught.value.remedy


def test_quadrilaterals_are_cut_along_the_shorter_diagonal(tmp_path: Path):
    path = tmp_path / "kite.obj"
    path.write_text("v 0 -1 0\nv 3 0 0\nv 0 1 0\nv -3 0 0\nf 1 2 3 4\nf 2 3 4 1\n")
    kite = files.read(path, "m")
    longest = lengths(kite).max()
    assert len(kite.faces) == 4
    assert longest == pytest.approx(math.sqrt(10))


def test_a_hub_of_many_facets_lists_no_pairs(tmp_path: Path):
    """A hub of 60,000 facets at one node took minutes: all pairs of its copies were listed."""
    fan = 60_000
    angle = math.tau * np.arange(fan) / fan
    rim = 0.01 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(fan)])
    points, ring = np.vstack([rim, [[0, 0, 0], [0, 0, 0.01]]]), np.arange(fan)
    beside = np.roll(ring, -1)
    faces = [np.column_stack(rows) for rows in (
        (beside, ring, np.full(fan, fan)), (ring, beside, np.full(fan, fan + 1))
    )]  # fmt: skip
    (tmp_path / "fan.stl").write_text(files.stl_text(surfaces.surface(points, np.vstack(faces))))
    read = files.read(tmp_path / "fan.stl", "m")
    assert len(read.vertices) == fan + 2
    assert "the angle of a facet is too sharp for LIGGGHTS" in problems(read)


def test_the_text_of_a_mesh_is_exact_and_always_the_same(tmp_path: Path):
    path = tmp_path / "workpiece.stl"
    workpiece, other = (shapes.cylinder(0.005, 0.08, 0.0025) for _ in range(2))
    text = files.stl_text(workpiece)
    assert files.stl_text(other) == text
    assert text.startswith("solid mesh\nfacet normal ") and "-0 " not in text
    path.write_text(text)
    again = files.read(path, "m")
    assert again.is_watertight
    assert again.triangles == pytest.approx(workpiece.triangles, abs=1e-10)


# --- the meshes that come with the project ------------------------------------------


def manifest() -> dict[str, dict[str, object]]:
    listed: dict[str, dict[str, object]] = yaml.safe_load((MESHES / "manifest.yaml").read_text())[
        "meshes"
    ]
    return listed


def test_every_mesh_is_in_the_manifest():
    names = {file.name for file in MESHES.iterdir() if file.suffix not in {".yaml", ".py"}}
    assert names - {"__pycache__"} == set(manifest())


@pytest.mark.parametrize("name", sorted(manifest()))
def test_the_manifest_is_true(name: str):
    entry = manifest()[name]
    unit = str(entry["unit"])
    if name.endswith(".step"):
        pytest.importorskip("gmsh", reason="gmsh is not made for every machine")
    sizes = [entry.get(field) for field in ("facet_size_m", "edge_facet_size_m")]
    body = files.read(MESHES / name, unit, *sizes)  # type: ignore[arg-type]
    assert body.is_watertight is entry["closed"]
    facets = entry["facets"]  # of STEP: with the version of gmsh in constraints.txt
    assert len(body.faces) == (facets if sizes[0] is None else pytest.approx(facets, rel=0.1))
    abs_tol = 1e-6 if sizes[0] is None else 0.02
    assert body.bounds / files.UNITS[unit] == pytest.approx(np.array(entry["bounds"]), abs=abs_tol)
    stood = surfaces.upright(body, str(entry.get("axis", "+z")))
    assert checks.findings(stood, workpiece=bool(entry["closed"]), surroundings=SCENE) == []


# --- the engine's own opinion ---------------------------------------------------------

DECK = """\
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
region box block -0.06 0.06 -0.06 0.06 -0.02 0.15 units box
create_box 2 box
neighbor 0.001 bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 77e7 210e7
fix m2 all property/global poissonsRatio peratomtype 0.19 0.30
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.86 0.68 0.68 0.68
fix m4 all property/global coefficientFriction peratomtypepair 2 0.34 0.28 0.28 0.28
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
fix workpiece all mesh/surface/stress file workpiece.stl type 2
fix wall all wall/gran model hertz tangential history mesh n_meshes 1 meshes workpiece
fix move all nve/sphere
create_atoms 1 single 0.05 0.05 0.1 units box
set group all diameter 0.004 density 2500
run 0
"""


def engine_reads(mesh: Trimesh, folder: Path) -> tuple[bool, str]:
    (folder / "workpiece.stl").write_text(files.stl_text(mesh))
    (folder / "in.liggghts").write_text(DECK)
    words = [find_engine().path, "-in", "in.liggghts"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, errors="replace")
    return done.returncode == 0, done.stdout + done.stderr


def part(name: str) -> Trimesh:
    pytest.importorskip("gmsh", reason="gmsh is not made for every machine")
    return surfaces.place(files.read(MESHES / name, "mm", 0.0015, 0.0007))


@pytest.mark.engine
@pytest.mark.parametrize("made", [0.0005, 0.005, "shaft.step", "cutter.step"])
def test_engine_reads_cylinders_and_parts_without_a_warning(tmp_path: Path, made: float | str):
    body = part(made) if isinstance(made, str) else shapes.cylinder(0.005, 0.08, made)
    read, output = engine_reads(body, tmp_path)
    assert read, output
    assert f"containing {len(body.faces)} triangle(s) successful" in output
    assert "WARNING" not in output


@pytest.mark.engine
@pytest.mark.parametrize(
    ("mesh", "reads"),
    [
        (needle(0.3), True),
        (needle(0.2), False),
        (fan(6), True),
        (fan(7), False),
        (with_facets(*TETRAHEDRON.faces.tolist(), [0, 2, 1]), False),
        (shapes.bowl(0.04, 0.08, 0.005), True),
    ],
    ids=["blunt", "sharp", "five neighbours", "six neighbours", "duplicate", "bowl"],
)
def test_engine_agrees_with_the_checks(tmp_path: Path, mesh: Trimesh, reads: bool):
    read, output = engine_reads(mesh, tmp_path)
    errors = [
        found for found in checks.findings(mesh, workpiece=False) if found.severity == "error"
    ]
    assert read is reads, output
    assert bool(errors) is not reads
