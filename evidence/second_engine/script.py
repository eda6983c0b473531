"""The LAMMPS script of a process.

Particles, walls, contact constants, time step and path are those of LIGGGHTS, contact models those
of LAMMPS.
"""

import math
from pathlib import Path

import pandas as pd

from dragdeck.decks.deck import Scene
from dragdeck.errors import InputError
from dragdeck.physics.contact_mechanics import ContactConstants
from dragdeck.records.case import ProcessCase
from dragdeck.scenes.process_deck import ProcessDeck
from dragdeck.study.paths.circle import CirclePath
from dragdeck.study.workpiece import CylinderShape

SCRIPT_FILE, PARTICLES_FILE = "in.lammps", "particles.data"

_SCRIPT = """\
# The process of {case} in LAMMPS. Units: SI.
units si
atom_style sphere
boundary f f f
newton off
comm_modify vel yes
read_data {particles}
neighbor {deck.skin_m!r} bin
neigh_modify delay 0
pair_style granular
pair_coeff * * {laws[particle]}
timestep {deck.timestep_s!r}
fix gravity all gravity {deck.gravity_m_s2!r} vector 0 0 -1
fix integrate all nve/sphere

# bowl: primitive walls, open at the top
{bowl}

# workpiece: steps that it has gone of each leg, its displacement and its turn with the path
{legs}
variable turn equal {turn!r}*v_steps_drag
variable to_x equal {to[0]}
variable to_y equal {to[1]}
variable to_z equal {to[2]}
region workpiece cylinder z {x!r} {y!r} {radius!r} {z!r} {top!r} side out &
    move v_to_x v_to_y v_to_z rotate v_turn {x!r} {y!r} 0 0 0 1
fix workpiece all wall/gran/region granular {laws[workpiece]} region workpiece contacts

thermo {network}
thermo_modify lost error
run {start}

# the drag: force on the particles, particles on the workpiece, contacts between particles
compute force all reduce sum f_workpiece[2] f_workpiece[3] f_workpiece[4]
fix force all print {force} &
    "$(step) ${{turn}} $(c_force[1]:%.9g) $(c_force[2]:%.9g) $(c_force[3]:%.9g)" &
    file force.txt screen no title "step turn_rad x y z"
dump workpiece all custom {contacts} workpiece.dump id f_workpiece[2] f_workpiece[3] f_workpiece[4]
dump_modify workpiece thresh f_workpiece[1] != 0
compute network all pair/local dist force p4 cutoff radius
dump network all local {network} network.dump index c_network[1] c_network[2] c_network[3]
run {steps}
"""


def script(scene: Scene[ProcessCase]) -> str:
    """The script of a process.

    Parameters
    ----------
    scene : Scene
        With analytical walls and a cylinder on a circle.

    Raises
    ------
    InputError
        The study has another path, workpiece, or bowl.
    """
    deck, case = scene.deck, scene.case
    assert isinstance(deck, ProcessDeck)
    path, shape = case.study.motion.path, case.study.workpiece.shape
    plain = not deck.bowl_facets and not case.study.motion.superposed()
    if not plain or not isinstance(path, CirclePath) or not isinstance(shape, CylinderShape):
        raise InputError("LAMMPS repeats a cylinder on a circle in an analytical bowl only")
    (workpiece,) = deck.workpieces
    drag, (x, y, z) = deck.legs[-1], workpiece.start_m
    sense = 1 if path.direction == "ccw" else -1
    start_rad = math.atan2(path.start_point[1], path.start_point[0])
    legs = deck.legs[:-1]
    around = [
        f"+{path.radius_m!r}*({of}({start_rad!r}+v_turn)-{of}({start_rad!r}))"
        for of in ("cos", "sin")
    ]
    to = [
        "+".join(f"{leg.velocity_m_s[axis] * deck.timestep_s!r}*v_steps_{leg.name}" for leg in legs)
        + turned
        for axis, turned in enumerate([*around, ""])
    ]
    laws = {name: _law(constants) for name, constants in case.contact_moduli.items()}
    drive, outputs = workpiece.driven.drive, {of.name: of.period_steps for of in deck.outputs}
    return _SCRIPT.format(
        case=case.run,
        particles=PARTICLES_FILE,
        deck=deck,
        laws=laws,
        bowl="\n".join(
            f"fix {wall.name} all wall/gran granular {laws['bowl']} "
            f"{wall.shape} {wall.at_m!r}{' NULL' if wall.shape == 'zplane' else ''}"
            for wall in deck.bowl.walls
        ),
        legs="\n".join(
            f"variable steps_{leg.name} equal (step>{leg.start_step})*((step<{leg.end_step})*step"
            f"+(step>={leg.end_step})*{leg.end_step}-{leg.start_step})"
            for leg in deck.legs
        ),
        turn=sense * drive.length_m / path.radius_m / drive.steps,
        to=to, x=x, y=y, z=z, radius=shape.radius_m, top=z + case.workpiece.length_m,
        start=drag.start_step, steps=drag.steps,
        force=outputs["workpiece_force"], contacts=outputs["workpiece_particles"],
        network=outputs["contacts"],
    )  # fmt: skip


def _law(constants: ContactConstants) -> str:
    """The contact law with these effective constants, as of two bodies of a like material.

    LAMMPS takes Young's modulus and Poisson's ratio of one material and computes the effective
    moduli of a pair, or of a wall, of it: E* = E / (2 (1 - nu^2)) and
    G* = E / (4 (2 - nu) (1 + nu)). The tangential dashpot is a multiple of the normal one; that of
    LIGGGHTS, sqrt(S_t / S_n), is 2 sqrt(G* / E*).
    """
    ratio = constants.shear_pa / constants.modulus_pa
    poisson = (1 - 4 * ratio) / (1 - 2 * ratio)
    young = 2 * constants.modulus_pa * (1 - poisson**2)
    return (
        f"hertz/material {young!r} {constants.restitution!r} {poisson!r} tangential mindlin "
        f"NULL {2 * math.sqrt(ratio)!r} {constants.friction!r} damping coeff_restitution "
        "limit_damping"
    )


def write_particles(folder: Path, bed: pd.DataFrame, density_kg_m3: float) -> None:
    """Write a settled bed as a data file of LAMMPS.

    Parameters
    ----------
    folder : Path
        Of the script.
    bed : DataFrame
        Last frame of ``particles.parquet`` of a filling.
    density_kg_m3 : float
    """
    reach = 2.0 * bed[["x_m", "y_m", "z_m"]].abs().to_numpy().max()
    bodies = bed.assign(type=1, diameter=2 * bed.radius_m, density=density_kg_m3)
    atoms = bodies[["particle_id", "type", "diameter", "density", "x_m", "y_m", "z_m"]]
    motion = [f"v{axis}_m_s" for axis in "xyz"] + [f"w{axis}_rad_s" for axis in "xyz"]
    rows = (
        table.to_csv(sep=" ", header=False, index=False)
        for table in (atoms, bed[["particle_id", *motion]])
    )
    size = "\n".join(f"{-reach} {reach} {axis}lo {axis}hi" for axis in "xyz")
    head = f"Settled bed\n\n{len(bed)} atoms\n1 atom types\n{size}\n"
    text = "{}\nAtoms # sphere\n\n{}\nVelocities\n\n{}".format(head, *rows)
    (folder / PARTICLES_FILE).write_text(text)
