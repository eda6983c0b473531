"""Own small scripts for the audit: a sound one, and what a line changes in it."""

import re
import subprocess
from pathlib import Path

from dragdeck.engine.process import find_engine, plain_command

LAW = "hertz tangential history"
SIDES = ("xplane 0.0", "xplane 0.04", "yplane 0.0", "yplane 0.04", "zplane 0.0")

DECK = f"""# a hundred spheres fall into a box
units si
atom_style granular
boundary f f f
newton off
communicate single vel yes
region box block -0.01 0.05 -0.01 0.05 -0.01 0.05 units box
create_box 2 box
neighbor 0.001 bin
neigh_modify delay 0
fix young all property/global youngsModulus peratomtype 5e6 5e6
fix poisson all property/global poissonsRatio peratomtype 0.3 0.3
fix rebound all property/global coefficientRestitution peratomtypepair 2 0.3 0.3 0.3 0.3
fix friction all property/global coefficientFriction peratomtypepair 2 0.5 0.5 0.5 0.5
pair_style gran model {LAW}
pair_coeff * *
timestep 5e-5
fix gravity all gravity 9.81 vector 0 0 -1
{
    "".join(
        f"fix wall{n} all wall/gran model {LAW} primitive type 2 {side}" + chr(10)
        for n, side in enumerate(SIDES)
    )
}
fix sphere all particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant &
    0.002
fix mix all particledistribution/discrete 15485867 1 sphere 1.0
region fill block 0 0.04 0 0.04 0 0.04 units box
fix insert all insert/pack seed 32452843 distributiontemplate mix insert_every once &
    overlapcheck yes all_in yes vel constant 0 0 0 region fill particles_in_region 100
fix integrate all nve/sphere
# dragdeck: ignore DK111 the bed is at rest
compute pairs all pair/gran/local id force
thermo_style custom step atoms ke
thermo 500
thermo_modify lost ignore norm no
run 1
dump spheres all custom 200 post/spheres_*.dump id type x y z vx vy vz fx fy fz omegax omegay &
    omegaz radius
dump pairs all local 1000 post/pairs_*.dump c_pairs[1] c_pairs[2] c_pairs[4] c_pairs[5] c_pairs[6]
run 8000
"""

PLATE = "solid plate\n" + "".join(
    "facet normal 0 0 -1\nouter loop\n"
    + "".join(f"vertex {x} {y} 0.039\n" for x, y in corners)
    + "endloop\nendfacet\n"
    for corners in (((0, 0), (0.04, 0.04), (0.04, 0)), ((0, 0), (0, 0.04), (0.04, 0.04)))
) + "endsolid plate\n"  # fmt: skip

PRESS = f"""fix plate all mesh/surface file plate.stl type 2
fix press all wall/gran model {LAW} mesh n_meshes 1 meshes plate
"""
SQUEEZED = DECK.replace("fix integrate", f"{PRESS}fix integrate").replace(
    "run 8000\n", "run 4000\nfix down all move/mesh mesh plate linear 0 0 -0.2\nrun 3675\n"
)
"""A plate presses the spheres to two thirds of their height."""

SPINNING = """units si
atom_style granular
boundary f f f
newton off
communicate single vel yes
region box block 0 0.02 0 0.02 -0.01 0.02 units box
create_box 1 box
neighbor 0.001 bin
fix young all property/global youngsModulus peratomtype 5e6
fix poisson all property/global poissonsRatio peratomtype 0.3
fix rebound all property/global coefficientRestitution peratomtypepair 1 0.3
fix friction all property/global coefficientFriction peratomtypepair 1 0.5
fix rolling all property/global coefficientRollingFriction peratomtypepair 1 0.1
pair_style gran model hertz tangential history rolling_friction epsd2 SETTINGS
pair_coeff * *
timestep 5e-5
fix gravity all gravity 9.81 vector 0 0 -1
fix floor all wall/gran model hertz tangential history rolling_friction epsd2 primitive type 1 &
    zplane 0.0 SETTINGS
create_atoms 1 single 0.01 0.01 0.00199 units box
set group all diameter 0.004 density 2500 omegaz 200
fix integrate all nve/sphere
dump spheres all custom 1000 post/spheres_*.dump id type x y z vx vy vz omegax omegay omegaz radius
run 20000
"""


def write(folder: Path, text: str = DECK) -> Path:
    """Write a script, and the mesh that it may read."""
    (folder / "post").mkdir(parents=True, exist_ok=True)
    (folder / "plate.stl").write_text(PLATE)
    file = folder / "in.deck"
    file.write_text(text)
    return file


def run(folder: Path, text: str = DECK) -> Path:
    """Write a script and run it; what it prints is in ``log``."""
    file = write(folder, text)
    words = plain_command(find_engine(), file.name)
    with (folder / "log").open("w") as screen:
        subprocess.run(words, cwd=folder, stdout=screen, stderr=screen, check=False, timeout=300)
    return file


def without(text: str, pattern: str) -> str:
    """A script without the lines that contain a pattern."""
    return "".join(line for line in text.splitlines(True) if not re.search(pattern, line))
