"""Small particles between large ones (docs/development/liggghts.md#small-and-large-particles).

    python benchmarks/size_ratio.py docs/data/liggghts

Writes plain input scripts, runs each once, and makes three records of them: ``groove.csv``, a
small particle that rolls down the groove between two large ones at rest; ``groove_wall.csv``, the
same between a large one and a wall; and ``mixed_beds.csv``, beds of two sizes that are filled,
tilted and left to rest. A run that is in ``results/size_ratio`` already is not repeated.
"""

import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from dragdeck.physics.contact_mechanics import effective_modulus, rayleigh_time, wedge_ratio
from dragdeck.physics.contact_network import touching
from dragdeck.physics.packing import pour
from dragdeck.physics.walls import round_container
from dragdeck.study.workpiece import Material

CERAMIC = Material(youngs_modulus_pa=77e9, poissons_ratio=0.19, density_kg_m3=2656)
LARGE_M, GRAVITY = 3.27e-3, 9.81
RESTITUTION = 0.86

RATIOS = (1.5, 2.0, 3.0, 4.0, 6.0)
GROOVE_RATIOS = (*RATIOS, 10.0, 20.0)
FRICTIONS = (0.2, 0.34, 0.5, 0.7, 1.0)
FRACTIONS = (0.16, 0.64)
"""Time steps over the Rayleigh time of the small particles."""

_ROLL_S = 0.4
"""Time in a groove, s: without friction's help a particle has left it after a third."""

_BOWL_M, _SMALL_SHARE, _MOST_SMALL = 0.018, 0.1, 700
"""Radius of the bowl, and volume of the small particles over that of all, and largest number of
small particles, of a bed."""

_TILTS = ((0, 0), (1, 0), (0, 1), (-1, 0), (0, -1), (0, 0))
"""Horizontal directions of gravity, one after the other."""

_HEAD = """units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
{hard}
read_data particles.data
neighbor {skin} bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype {modulus}
fix m2 all property/global poissonsRatio peratomtype 0.19
fix m3 all property/global coefficientRestitution peratomtypepair 1 {restitution}
fix m4 all property/global coefficientFriction peratomtypepair 1 {friction}
pair_style gran model hertz tangential history limitForce on
pair_coeff * *
timestep {dt}
"""
_WALL = (
    "fix {name} all wall/gran model hertz tangential history primitive type 1 {where} "
    "limitForce on\n"
)

_GROOVE = """group small id 1
group large subtract all small
fix gravity small gravity 9.81 vector 0 0 -1
fix integrate small nve/sphere
fix still large freeze
fix out all print {every} "$(step*dt) $(x[1]) $(y[1]) $(z[1])" file out.txt screen no title ""
thermo 100000000
thermo_modify lost ignore
run {steps}
"""

_BED = """fix integrate all nve/sphere
compute kinetic all ke
thermo {every}
thermo_style custom step c_kinetic
thermo_modify lost error norm no
{tilts}
dump last all custom 1 bed.txt id x y z radius
run 0
"""


def run_particles(
    folder: Path,
    script: str,
    particles: Sequence[Sequence[float]],
    box: Sequence[tuple[float, float]],
) -> Path:
    """Run a script once in a folder; particles are rows of diameter, x, y, z, a box of ends."""
    if (folder / "done").exists():
        return folder
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    rows = [
        f"{number} 1 {diameter:.12g} {CERAMIC.density_kg_m3:.12g} {x:.12g} {y:.12g} {z:.12g}"
        for number, (diameter, x, y, z) in enumerate(particles, 1)
    ]
    ends = zip("xyz", box, strict=True)
    sides = [f"{low} {high} {axis}lo {axis}hi" for axis, (low, high) in ends]
    head = ["particles", "", f"{len(rows)} atoms", "1 atom types", *sides, "", "Atoms", "", *rows]
    (folder / "particles.data").write_text("\n".join(head) + "\n", encoding="utf-8")
    (folder / "in.liggghts").write_text(script, encoding="utf-8")
    with (folder / "log").open("w", encoding="utf-8") as log:
        subprocess.run(
            ["liggghts", "-in", "in.liggghts"],
            cwd=folder, stdout=log, stderr=log, check=True,
        )  # fmt: skip
    (folder / "done").touch()
    return folder


def _script(small_m: float, scale: float, fraction: float, friction: float) -> tuple[str, float]:
    dt = float(f"{fraction * rayleigh_time(CERAMIC, small_m, scale):.4g}")
    modulus = scale * CERAMIC.youngs_modulus_pa
    return _HEAD.format(
        hard="hard_particles yes" if modulus > 1e9 else "",
        skin=0.1 * LARGE_M, modulus=modulus, restitution=RESTITUTION, friction=friction, dt=dt,
    ), dt  # fmt: skip


def groove(
    folder: Path, ratio: float, friction: float, fraction: float, scale: float, wall: bool
) -> dict[str, float]:
    """A small particle, one degree from the top, in the groove round two touching large ones.

    Or round a large one and a wall that touches it. It rolls down and, since its weight points
    away from the groove below the middle, must leave it. What it has come nearer to the axis of
    the groove by then has been squeezed into it.
    """
    large, small = LARGE_M, LARGE_M / ratio
    across = 2 * math.sqrt(large * small) if wall else math.sqrt((large + small) ** 2 - large**2)
    x, tilt = (small - large if wall else 0.0), math.radians(1.0)
    script, dt = _script(small, scale, fraction, friction)
    if wall:
        script += _WALL.format(name="wall", where=f"xplane {-large}")
    steps = round(_ROLL_S / dt)
    script += _GROOVE.format(every=max(1, steps // 1000), steps=steps)
    fixed = [0.0] if wall else [large, -large]
    bodies = [
        (2 * small, x, across * math.sin(tilt), across * math.cos(tilt)),
        *((2 * large, at, 0.0, 0.0) for at in fixed),
    ]
    run_particles(folder, script, bodies, 3 * [(-40 * large, 40 * large)])
    table = np.loadtxt(folder / "out.txt", skiprows=1)
    y, z = table[:, 2], table[:, 3]
    inwards = 1 - np.hypot(y, z) / across
    touching = inwards > -0.01
    angle = np.degrees(np.unwrap(np.arctan2(y, z)))
    left = int(np.argmin(touching)) if not touching.all() else len(touching)
    return {
        "ratio": ratio, "friction": friction, "timestep_fraction": fraction,
        "youngs_modulus_scale": scale,
        "wedged": int(ratio > wedge_ratio(friction, wall)), "left": int(left < len(touching)),
        "last_angle_deg": angle[max(left - 1, 0)],
        "inwards": inwards[:left].max(),
        "inwards_at_60_deg": np.interp(60, angle[:left], inwards[:left]),
    }  # fmt: skip


def bed(folder: Path, ratio: float, friction: float, fraction: float) -> dict[str, float]:
    """A bed of two sizes: filled, tilted by 45 degrees four times, and at rest.

    A small particle counts as trapped if a force on it exceeds the largest between two large
    particles, which carry the load of the bed.
    """
    large, small = LARGE_M, LARGE_M / ratio
    n_large = min(120, round(_MOST_SMALL * (1 - _SMALL_SHARE) / _SMALL_SHARE / ratio**3))
    n_small = max(1, round(n_large * ratio**3 * _SMALL_SHARE / (1 - _SMALL_SHARE)))
    particles = pour(
        [np.full(n_large, large), np.full(n_small, small)], round_container(_BOWL_M), seed=1
    )
    script, dt = _script(small, 1e-3, fraction, friction)
    script += _WALL.format(name="floor", where="zplane 0.0")
    script += _WALL.format(name="side", where=f"zcylinder {_BOWL_M} 0.0 0.0")
    tilts = []
    for (x, y), seconds in zip(_TILTS, (0.25, *4 * (0.08,), 0.35), strict=True):
        tilts.append(f"fix gravity all gravity 9.81 vector {x} {y} -1")
        tilts += [f"run {round(seconds / dt)}", "unfix gravity"]
    script += _BED.format(every=max(1, round(0.01 / dt)), tilts="\n".join(tilts))
    rows = np.column_stack([2 * particles.radii_m, particles.positions_m]).tolist()
    across = (-2 * _BOWL_M, 2 * _BOWL_M)  # no more: empty cells of the neighbour grid cost time
    run_particles(folder, script, rows, (across, across, (-_BOWL_M, 2 * particles.top_m)))
    last = np.loadtxt(folder / "bed.txt", skiprows=9)
    places, radii = last[:, 1:4], last[:, 4]
    pairs, _, overlap = touching(places, radii)
    modulus = effective_modulus(CERAMIC, CERAMIC, 1e-3)
    force = 4 / 3 * modulus * np.sqrt(1 / (1 / radii[pairs]).sum(axis=0)) * overlap**1.5
    of_large = (radii[pairs] > 0.99 * large).all(axis=0)
    strongest, deepest = np.zeros(len(radii)), np.zeros(len(radii))
    for bodies in pairs:
        np.maximum.at(strongest, bodies, force)
        np.maximum.at(deepest, bodies, overlap)
    loaded = (radii < 0.99 * large) & (strongest > 0)
    thermo = re.findall(
        r"^ *\d+ +([\d.e+-]+) *$", (folder / "log").read_text("utf-8"), re.MULTILINE
    )
    weight = CERAMIC.density_kg_m3 * 4 / 3 * math.pi * (radii**3).sum() * GRAVITY * 2 * small
    return {
        "ratio": ratio, "friction": friction, "timestep_fraction": fraction,
        "large": n_large, "small": n_small, "loaded": int(loaded.sum()),
        "trapped": int((strongest[loaded] > force[of_large].max()).sum()),
        "force_most": strongest[loaded].max() / force[of_large].max(),
        **{
            f"overlap_p{level}": np.percentile(deepest[loaded], level) / (2 * small)
            for level in (50, 99, 100)
        },
        "overlap_of_large_most": overlap[of_large].max() / (2 * large),
        "kinetic_energy_ratio": float(thermo[-1]) / weight,
    }  # fmt: skip


def grooves(folder: Path, wall: bool) -> Iterator[dict[str, float]]:
    """All grooves; between two particles also with a shorter step and at the physical modulus."""
    settings = (
        [(FRACTIONS[1], 1e-3)] if wall else [*product(FRACTIONS, (1e-3,)), (FRACTIONS[1], 1.0)]
    )
    for ratio, friction, (fraction, scale) in product(GROOVE_RATIOS, FRICTIONS, settings):
        if scale < 1 or (ratio == 6 and friction in (0.34, 1.0)):
            name = f"{'wall' if wall else 'pair'}-{ratio:g}-{friction:g}-{fraction:g}-{scale:g}"
            yield groove(folder / name, ratio, friction, fraction, scale, wall)


def beds(folder: Path) -> Iterator[dict[str, float]]:
    """Beds of all ratios at the long step."""
    for ratio, friction in product(RATIOS, (0.34, 1.0)):
        fraction = FRACTIONS[1]
        yield bed(folder / f"bed-{ratio:g}-{friction:g}-{fraction:g}", ratio, friction, fraction)


def main(out: Path, folder: Path = Path("results/size_ratio")) -> None:
    """Make the records."""
    for name, rows in (
        ("groove", grooves(folder, wall=False)),
        ("groove_wall", grooves(folder, wall=True)),
        ("mixed_beds", beds(folder)),
    ):
        pd.DataFrame(rows).to_csv(out / f"{name}.csv", index=False, float_format="%.4g")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
