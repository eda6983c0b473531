"""A square plate as a mesh, and one particle on it, for tests of what LIGGGHTS does there."""

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from loading_files import case_json
from paths import ROOT

from dragdeck.decks.outputs import ColumnsFile, Output
from dragdeck.decks.templates import environment
from dragdeck.engine.process import command, find_engine
from dragdeck.study.drive import Drive
from dragdeck.study.superposed.motion import SuperposedMotion

PLATE = """solid plate
facet normal 0 0 1
outer loop
vertex -0.02 -0.02 0
vertex 0.02 -0.02 0
vertex 0.02 0.02 0
endloop
endfacet
facet normal 0 0 1
outer loop
vertex -0.02 -0.02 0
vertex 0.02 0.02 0
vertex -0.02 0.02 0
endloop
endfacet
endsolid plate
"""

RADIUS, DENSITY, MODULUS, FRICTION, GRAVITY = 3e-3, 2500.0, 1e7, 0.3, 9.81
PLACE = (-0.008, 0.006)
DECK = """units si
soft_particles yes
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
read_data particle.data
neighbor 0.001 bin
neigh_modify delay 0
fix youngs all property/global youngsModulus peratomtype {{ modulus }}
fix poisson all property/global poissonsRatio peratomtype 0.3
fix restitution all property/global coefficientRestitution peratomtypepair 1 {{ restitution }}
fix friction all property/global coefficientFriction peratomtypepair 1 {{ friction }}
pair_style gran model {{ law }}
pair_coeff * *
timestep {{ timestep }}
fix gravity all gravity {{ gravity }} vector 0 0 -1
fix workpiece all mesh/surface/stress file workpiece.stl type 1 reference_point 0. 0. 0.
fix workpiece_wall all wall/gran model {{ law }} mesh n_meshes 1 meshes workpiece store_force yes
compute workpiece_contacts all wall/gran/local pos id force delta
fix integrate all nve/sphere
variable speed_of_particle atom sqrt(vx*vx+vy*vy+vz*vz)
compute fastest_particle all reduce max v_speed_of_particle
variable part index 1
variable reference_x equal f_workpiece[7]
variable reference_y equal f_workpiece[8]
variable reference_z equal f_workpiece[9]
fix drag all move/mesh mesh workpiece linear {{ speed }} 0. 0.
{% for name, formula in superposed.variables | items %}
variable {{ name }} equal {{ formula }}
{% endfor %}
{% if superposed %}
fix superposed all move/mesh mesh workpiece {{ superposed.movers[""] }}
{% endif %}
velocity all set {{ velocity | join(" ") }} units box
{% from "outputs.j2" import write %}
{% for output in outputs %}
{{ write(output) }}
{% endfor %}
run {{ steps }}
"""


def engine(folder: Path, *, ranks: int = 1, part: int = 1, source: Path | None = None) -> None:
    """Run the input script of a folder as it stands, or go on from a checkpoint."""
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    words = command(find_engine(), "in.liggghts", ranks, part, source)
    environs = {**os.environ, **allowed}
    done = subprocess.run(words, cwd=folder, env=environs, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr


def static_overlap(mass: float) -> float:
    """The overlap at which Hertz' force on a plate of the same material carries a particle."""
    stiffness = 4 / 3 * MODULUS / (2 * (1 - 0.3**2)) * np.sqrt(RADIUS)
    return float((mass * GRAVITY / stiffness) ** (2 / 3))


MASS = DENSITY * 4 / 3 * np.pi * RADIUS**3


def write_plate(
    folder: Path, motion: SuperposedMotion | None, drag: Drive, written: Sequence[Output], *,
    restitution: float = 0.5, friction: float = FRICTION, height_m: float | None = None,
    velocity: Sequence[float] = (0, 0, 0), gravity: float = GRAVITY,
) -> dict[str, Any]:  # fmt: skip
    """Input script, columns, plate and a particle; content of ``case.json`` without the motion.

    The particle rests on the plate, unless its lowest point is at a height.
    """
    deck = environment(ROOT / "templates").from_string(DECK)
    text = deck.render(
        superposed=motion.on_engine(drag, 0.0) if motion else {}, outputs=written, steps=drag.end,
        timestep=drag.timestep_s, modulus=MODULUS, friction=friction, gravity=gravity,
        speed=drag.length_m / drag.end / drag.timestep_s, law="hertz tangential history",
        restitution=restitution, velocity=velocity,
    )  # fmt: skip
    (folder / "in.liggghts").write_text(text)
    (folder / "workpiece.stl").write_text(PLATE)
    lowest = -static_overlap(MASS) if height_m is None else height_m
    place = f"{PLACE[0]} {PLACE[1]} {RADIUS + lowest}"
    (folder / "particle.data").write_text(
        "one particle\n\n1 atoms\n\n1 atom types\n\n-0.05 0.05 xlo xhi\n-0.05 0.05 ylo yhi\n"
        f"-0.01 0.05 zlo zhi\n\nAtoms\n\n1 1 {2 * RADIUS} {DENSITY} {place}\n"
    )
    columns = ColumnsFile(outputs={each.name: each.as_part() for each in written})
    columns.write(folder / "columns.json")
    made = case_json() | {
        "timestep_s": drag.timestep_s,
        "phases": [{"name": "drag", "start_step": 0, "end_step": drag.end}],
    }
    made["contact_moduli"]["workpiece"]["friction"] = friction
    return made
