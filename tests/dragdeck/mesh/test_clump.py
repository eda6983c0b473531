"""Clumps of spheres: mass properties against formulas, errors of the fit, what is refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_study import Made
from pydantic import TypeAdapter

from dragdeck.cases.bed import bed_classes, bed_rayleigh_time, bed_volume, body_sizes
from dragdeck.cases.case import Case
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.errors import InputError
from dragdeck.mesh.clump import SPHERE, body, fit_clump
from dragdeck.physics.packing import Bed
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import process_scene
from dragdeck.study.shapes import AnyShape

SHAPE: TypeAdapter[Any] = TypeAdapter(AnyShape)
ROD = {"kind": "cylinder", "aspect": 1.5, "spheres": 3}


def _radius(volume: float) -> float:
    return (3 * volume / (4 * math.pi)) ** (1 / 3)


def _cylinder(aspect: float) -> list[float]:
    """Moments over mass of a cylinder of diameter 1, in radii of the sphere of equal volume."""
    scale = _radius(math.pi / 4 * aspect) ** -2
    across = (3 / 4 + aspect**2) / 12
    return sorted([scale / 8, scale * across, scale * across])


ELLIPSOID = [(a**2 + b**2) / 5 for a, b in ((1, 1), (2, 1), (2, 1))]
MOMENTS = [
    (ROD, _cylinder(1.5)),
    (
        {"kind": "cone", "aspect": 1, "spheres": 4},
        [_radius(math.pi / 12) ** -2 * one for one in (3 / 40, 3 / 80 + 3 / 80, 3 / 80 + 3 / 80)],
    ),
    ({"kind": "tetrahedron", "spheres": 4}, [1 / 20 * _radius(1 / (6 * math.sqrt(2))) ** -2] * 3),
    (
        {"kind": "ellipsoid", "axes": [2, 1, 1], "spheres": 5},
        [one * 2 ** (-2 / 3) for one in ELLIPSOID],
    ),
]


@pytest.mark.parametrize(("shape", "moments"), MOMENTS, ids=[one["kind"] for one, _ in MOMENTS])
def test_inertia_is_that_of_the_body(shape: dict[str, Any], moments: list[float]) -> None:
    found = SHAPE.validate_python(shape)
    clump = fit_clump(found.corners(), found.spheres)
    assert sorted(clump.inertia) == pytest.approx(moments, rel=0.01)
    assert abs(clump.volume_error) < 0.005
    whole = body(found.corners())
    np.testing.assert_allclose(whole.center_mass, 0, atol=1e-9)
    np.testing.assert_allclose(
        whole.moment_inertia, np.diag(np.diag(whole.moment_inertia)), atol=1e-9
    )
    assert clump.reach < 1.3 * np.linalg.norm(body(found.corners()).vertices, axis=1).max()


def test_more_spheres_are_nearer_to_the_body() -> None:
    corners = SHAPE.validate_python(
        {"kind": "triangular_prism", "aspect": 1, "spheres": 2}
    ).corners()
    few, more = (fit_clump(corners, count) for count in (3, 12))
    assert more.surface_rms < 0.7 * few.surface_rms
    assert more.inertia_error < few.inertia_error


def test_time_step_of_a_clump() -> None:
    """A sphere at the end of a light rod meets less mass than a free one of its radius."""
    assert SPHERE.timestep_radius == 1.0
    x = np.array([[-2.0, 0, 0], [0, 0, 0], [2.0, 0, 0]])
    inertia = np.array([0.2, 1.5, 1.5])
    rod = type(SPHERE)(x, np.full(3, 0.8), inertia)
    mass = 1 / (1 + 4 / 1.5)  # of the body at an end, across the rod
    assert rod.timestep_radius == pytest.approx(0.8 * math.sqrt(mass / 0.8**3))
    stiff = type(SPHERE)(x / 10, np.full(3, 0.8), inertia)
    assert stiff.timestep_radius == 0.8


def test_sizes_and_ids(made: Made) -> None:
    classes = {
        "rods": {"material": "ceramic", "fraction": 0.5, "radius_mean_m": 3e-3, "shape": ROD,
                 "radius_std_m": 2e-4},
        "balls": {"material": "ceramic", "fraction": 0.5, "radius_mean_m": 2e-3},
    }  # fmt: skip
    case = made({"media": {"count": 60, "fractions_of": "number", "classes": classes,
                           "material": None, "radius_mean_m": None,
                           "radius_std_m": 0}})  # fmt: skip
    study = case.study
    sizes = body_sizes(study)
    rods, balls = sizes[:5], sizes[5:]
    assert [one.count for one in rods] == [6] * 5 and [one.count for one in balls] == [30]
    assert [one.first_id for one in sizes] == [1, 7, 13, 19, 25, 31]
    assert balls[0].first_sphere == 1 + 30 * 3
    assert study.sphere_count == 30 * 3 + 30 * 2
    # the volume of the asked distribution, whose mean of r^3 is m^3 + 3 m s^2
    wanted = 30 * (3e-3**3 + 3 * 3e-3 * 2e-4**2) + 30 * 2e-3**3
    assert bed_volume(study) == pytest.approx(4 / 3 * math.pi * wanted, rel=1e-4)
    assert sum(one.count * one.radius_m for one in rods) / 30 == pytest.approx(3e-3, rel=1e-3)
    seeds = filling_scene(case).deck.seeds  # type: ignore[attr-defined]
    assert len(set(seeds)) == len(seeds) >= 3 * len(sizes)


def test_spheres_of_a_clump_shorten_the_step(made: Made) -> None:
    plain = made()
    shaped = made({"media": {"shape": ROD}})
    clump = bed_classes(shaped.study)[0].clump
    ratio = bed_rayleigh_time(shaped.study) / bed_rayleigh_time(plain.study)
    smallest = bed_classes(shaped.study)[0].radii_m[0] / bed_classes(plain.study)[0].radii_m[0]
    assert ratio == pytest.approx(clump.timestep_radius * smallest)
    assert ratio < 1


STL = """solid part
{}endsolid part
"""


def _stl(corners: list[list[float]], faces: list[list[int]]) -> str:
    rows = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*corners[at]) for at in face)
        + "endloop\nendfacet\n"
        for face in faces
    )
    return STL.format(rows)


CORNERS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]


def test_a_body_from_a_file(made: Made, project: Any) -> None:
    file = project.studies / "small" / "corner.stl"
    file.parent.mkdir(exist_ok=True)
    file.write_text(_stl(CORNERS, FACES))
    shape = {"kind": "mesh", "points": "corner.stl", "spheres": 4}
    read = made({"media": {"shape": shape}}).study.media.shape
    assert read is not None
    assert sorted(map(list, read.corners().tolist())) == sorted(CORNERS)


BAD: list[tuple[dict[str, Any], str]] = [
    ({"shape": {**ROD, "spheres": 1}}, "2"),
    ({"shape": {**ROD, "spheres": 41}}, "40"),
    ({"shape": {**ROD, "aspect": 9}}, "5"),
    ({"shape": {**ROD, "kind": "cube"}}, "cylinder"),
    ({"shape": {"kind": "ellipsoid", "axes": [6, 1, 1], "spheres": 9}}, "more than 5"),
    ({"shape": {"kind": "ellipsoid", "axes": [5, 5, 1], "spheres": 2}}, "miss the body|overlap"),
    ({"shape": {"kind": "mesh", "points": [*CORNERS[:3], [1, 1, 0]], "spheres": 4}}, "in a plane"),
    ({"shape": ROD, "radius_mean_m": 0.0185, "count": 1}, "does not fit"),
    ({"shape": {"kind": "mesh", "points": "open.stl", "spheres": 4}}, "not closed"),
    ({"shape": {"kind": "mesh", "points": "gone.stl", "spheres": 4}}, "no such file"),
    ({"shape": {"kind": "mesh", "points": "dented.stl", "spheres": 4}}, "not convex"),
]


def _in_water(made: Made, level_m: float) -> Case:
    water = {"density_kg_m3": 1000, "level_m": level_m}
    return made({"media": {"shape": ROD}, "compound": water})


def test_submerged_clumps_weigh_less_by_gravity(made: Made, project: Any) -> None:
    """Filling and process; LIGGGHTS would lift every sphere of a clump."""
    case, bed = _in_water(made, 0.08), Bed(0.038, 0.045)
    for scene in (filling_scene(case), process_scene(case, bed)):
        assert scene.deck.gravity_m_s2 == pytest.approx(9.81 * (1 - 1000 / 2656))
        text = deck_text(scene, environment(project.templates))
        assert "wholly submerged" in text and "fix buoyancy all" not in text
        assert scene.case.gravity_m_s2 == 9.81
        assert "a smaller gravity" in scene.models["buoyancy of particles"]
    assert filling_scene(case).case.media.weight_kg_m3 == pytest.approx(1656)


def test_partly_submerged_clumps_are_refused(made: Made) -> None:
    """Before the filling by the expected bed, before the process by the settled one."""
    with pytest.raises(InputError, match=r"compound.level_m: .* not wholly submerged[\s\S]*0.03"):
        filling_scene(_in_water(made, 0.03))
    case = _in_water(made, 0.08)
    process_scene(case, Bed(0.06, 0.0799))
    with pytest.raises(InputError, match=r"not wholly submerged[\s\S]*at least 0.0801 m"):
        process_scene(case, Bed(0.06, 0.0801))


def test_clumps_of_two_densities_are_not_submerged(made: Made) -> None:
    rod = {"material": "ceramic", "radius_mean_m": 3e-3, "fraction": 0.5, "shape": ROD}
    classes = {"rods": rod, "balls": {**rod, "material": "steel", "shape": None}}
    media = {"count": 60, "fractions_of": "number", "classes": classes, "material": None,
             "radius_mean_m": None, "radius_std_m": 0}  # fmt: skip
    pair = {"restitution": 0.6, "friction": 0.3}
    mixed = {"media": media, "pairs.steel-steel": pair}
    made(mixed)
    with pytest.raises(InputError, match="the same for all of them"):
        made({**mixed, "compound": {"density_kg_m3": 1000, "level_m": 0.08}})


@pytest.mark.parametrize(("media", "problem"), BAD, ids=[problem for _, problem in BAD])
def test_refused(media: dict[str, Any], problem: str, made: Made, project: Any) -> None:
    folder: Path = project.studies / "small"
    folder.mkdir(exist_ok=True)
    (folder / "open.stl").write_text(_stl(CORNERS, FACES[1:]))
    dented = [*FACES[:2], [1, 2, 4], [2, 3, 4], [3, 1, 4], FACES[3]]
    (folder / "dented.stl").write_text(_stl([*CORNERS, [0.1, 0.1, 0.1]], dented))
    with pytest.raises(InputError, match=problem):
        filling_scene(made({"media": media, "bowl": {"radius_m": 0.024}}))


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e9])
@pytest.mark.parametrize("kind", ["ellipsoid", "mesh"])
def test_the_scale_of_a_body_is_of_no_importance(kind: str, size: float) -> None:
    """Over all sizes that a study accepts."""
    corners = [[3, 1, 1], [3, -1, -1], [-3, 1, -1], [-3, -1, 1]]
    shapes = {
        "ellipsoid": {"axes": [size, 2 * size, size]},
        "mesh": {"points": [[size * x for x in corner] for corner in corners]},
    }
    shape: Any = TypeAdapter(AnyShape).validate_python({"kind": kind, "spheres": 4, **shapes[kind]})
    mesh = body(shape.corners())
    assert mesh.volume == pytest.approx(4 / 3 * math.pi)
    lengths = {"ellipsoid": [1.587, 1.587, 3.175], "mesh": [1.612, 1.612, 4.836]}[kind]
    assert sorted(mesh.extents) == pytest.approx(lengths, rel=0.01)
