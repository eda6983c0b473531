"""When LIGGGHTS sees a contact: its own list of contacts against the geometry of every step."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from plain_dumps import text_frames
from plate import PLATE, engine
from scipy.spatial import cKDTree

pytestmark = pytest.mark.engine

RADIUS, STEP = 1e-3, 2e-5
DECK = f"""units si
processors {{ranks}} 1 1
soft_particles yes
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
read_data spheres.data
neighbor {{skin}} bin
neigh_modify {{lists}}
fix youngs all property/global youngsModulus peratomtype 1e7
fix poisson all property/global poissonsRatio peratomtype 0.3
fix restitution all property/global coefficientRestitution peratomtypepair 1 0.9
fix friction all property/global coefficientFriction peratomtypepair 1 0.3
pair_style gran model hertz tangential history
pair_coeff * *
timestep {STEP}
fix plate all mesh/surface file plate.stl type 1
fix wall all wall/gran model hertz tangential history mesh n_meshes 1 meshes plate
fix move all move/mesh mesh plate linear 0. 0. {{speed}}
compute pairs all pair/gran/local id
compute touched all wall/gran/local id
{{integrate}}
thermo_style custom step atoms
dump spheres all custom 1 spheres.txt id x y z
dump_modify spheres format "%d %.12g %.12g %.12g"
dump pairs all local 1 pairs.txt c_pairs[1] c_pairs[2]
dump_modify pairs format "%.0f %.0f"
dump touched all local 1 touched.txt c_touched[3]
dump_modify touched format "%.0f"
run {{steps}}
"""


def contacts(
    folder: Path, *, skin: float, speed: float, move: bool, lists: str = "delay 0", ranks: int = 1
):
    """Overlaps that LIGGGHTS evaluates and that it overlooks, between spheres and at the plate.

    Of 216 spheres, which fly at random at three times the speed, or rest while the plate moves
    through them.
    """
    cells = itertools.product(range(6), repeat=3)
    places = 2.3 * RADIUS * (np.array(list(cells)) - 2.5) + (0, 0, 7.2 * RADIUS)
    chance = np.random.default_rng(1)
    places += chance.uniform(-0.1, 0.1, places.shape) * RADIUS
    flight = 3 * speed * chance.choice([-1.0, 1.0], places.shape) / np.sqrt(3)
    rows = [f"{n} 1 {2 * RADIUS} 2500 {x} {y} {z}" for n, (x, y, z) in enumerate(places, 1)]
    speeds = [f"{n} {u} {v} {w} 0 0 0" for n, (u, v, w) in enumerate(flight, 1)]
    box = "".join(f"-0.04 0.04 {axis}lo {axis}hi\n" for axis in "xyz")
    (folder / "spheres.data").write_text(
        "spheres\n\n216 atoms\n1 atom types\n\n" + box
        + "\n".join(["\nAtoms\n", *rows, "\nVelocities\n", *speeds, ""])
    )  # fmt: skip
    (folder / "plate.stl").write_text(PLATE)
    steps = 150 if move else int(0.014 / (speed * STEP))
    integrate = "fix integrate all nve/sphere" if move else ""
    (folder / "in.liggghts").write_text(
        DECK.format(
            ranks=ranks, skin=skin, lists=lists, speed=speed, integrate=integrate, steps=steps
        )
    )
    engine(folder, ranks=ranks)
    names = ("spheres", "pairs", "touched")
    spheres, pairs, touched = (text_frames((folder / f"{name}.txt").read_bytes()) for name in names)
    seen: dict[str, list[float]] = {"pair": [], "late pair": [], "plate": [], "late plate": []}
    for (step, at), (_, both), (_, one) in zip(spheres, pairs, touched, strict=True):
        centres, ids = np.array([at[axis] for axis in "xyz"]).T, np.array(at["id"])
        evaluated = {frozenset(pair) for pair in zip(*both.values(), strict=True)}
        for a, b in cKDTree(centres).query_pairs(2 * RADIUS):
            late = "" if frozenset((ids[a], ids[b])) in evaluated else "late "
            overlap = 2 * RADIUS - np.linalg.norm(centres[a] - centres[b])
            seen[f"{late}pair"] += [overlap] if overlap > 1e-9 else []
        on_plate = set(next(iter(one.values()))) if one else set()
        overlaps = RADIUS - abs(centres[:, 2] - speed * STEP * step)
        inner = np.abs(centres[:, :2]).max(axis=1) < 0.018
        for number in np.flatnonzero((overlaps > 1e-9) & inner):
            seen["plate" if ids[number] in on_plate else "late plate"].append(overlaps[number])
    return seen


@pytest.mark.parametrize(("skin", "ranks"), [(0.3, 1), (0.02, 1), (0.02, 2)])
def test_no_contact_of_particles_is_late_however_thin_the_skin(
    tmp_path: Path, skin: float, ranks: int
) -> None:
    """Even where LIGGGHTS calls nearly every build of its lists dangerous."""
    seen = contacts(tmp_path, skin=skin * RADIUS, speed=1.0, move=True, ranks=ranks)
    assert len(seen["pair"]) > 500 and not seen["late pair"]
    assert len(seen["plate"]) > 20 and not seen["late plate"]


def test_lists_that_wait_miss_contacts(tmp_path: Path) -> None:
    seen = contacts(tmp_path, skin=0.02 * RADIUS, lists="delay 20", speed=1.0, move=True)
    assert len(seen["late pair"]) > 20


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.long)])
@pytest.mark.parametrize("skins", [1.05, 0.5])
def test_a_mesh_that_moves_by_more_than_the_skin_touches_a_step_late(
    tmp_path: Path, skins: float, ranks: int
) -> None:
    """No particle moves, so that only the mesh asks for new lists: a step after it needs them."""
    speed = 4.0
    seen = contacts(tmp_path, skin=skins * speed * STEP, speed=speed, move=False, ranks=ranks)
    assert len(seen["plate"]) > 200
    late = seen["late plate"]
    assert (len(late) > 10) is (skins < 1)
    assert max(late, default=0.0) <= max(0.0, 1 - skins) * speed * STEP + 1e-9
