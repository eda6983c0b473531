"""The files of a run small enough to check by hand."""

from pathlib import Path
from typing import Any

import numpy as np
from bowls import bowl_of_run
from made_run import Raw, line, made_case, phases, touching, write_documents

from dragdeck.decks import outputs

TIMESTEP_S = 1e-3
GRAVITY_M_S2 = 9.81
DENSITY_KG_M3 = 2500.0
RADIUS_M = 8.76e-3
WEIGHT_N = 4 / 3 * np.pi * RADIUS_M**3 * DENSITY_KG_M3 * GRAVITY_M_S2
STIFFNESS_N_M = 1e5
FRICTION = 0.3
WORKPIECE_RADIUS_M = 5e-3
BOWL_RADIUS_M = 40e-3
CHAIN_Z_M = 0.03
SURFACE_M = 0.05
SPEED_M_S = 1e-4
SPIN_RAD_S = 0.02
DRAG_START = 20
LAST = 100

OUTPUTS = {
    output.name: output
    for output in (
        *(outputs.thermo(20, LAST), outputs.workpiece_force(2, LAST, "workpiece")),
        *(outputs.workpiece_particles(10, 0, LAST), outputs.contacts(20, 0, LAST)),
        outputs.workpiece_contacts(10, 0, LAST, several=False),
        outputs.particles(20, 0, LAST, ("floor", "side")),
    )
}
COLUMNS = {name: [column.name for column in output.columns] for name, output in OUTPUTS.items()}


def workpiece_x_m(step: int) -> float:
    """Where the workpiece is: it moves along +x from the bowl's axis."""
    return SPEED_M_S * TIMESTEP_S * max(0, step - DRAG_START)


def overlap_m(step: int) -> float:
    """Overlap of each of the three contacts of the chain."""
    gap = BOWL_RADIUS_M - workpiece_x_m(step) - WORKPIECE_RADIUS_M - 4 * RADIUS_M
    return -gap / 3


def chain_n(step: int) -> float:
    """Force that the chain carries; the workpiece arrives with step 10."""
    return STIFFNESS_N_M * overlap_m(step) if step >= 10 else 0.0


def _thermo(step: int) -> list[list[float]]:
    return [[step, step * TIMESTEP_S, 4, 0, 0, 0]]


def _workpiece_force(step: int) -> list[list[float]]:
    force = [-chain_n(step), 0.0, -WEIGHT_N if step >= 10 else 0.0]
    return [[step, step * TIMESTEP_S, *force, 0, 0, 0, workpiece_x_m(step), 0.0, 0.02, 0.0]]


def _centre_1(step: int) -> float:
    return workpiece_x_m(step) + WORKPIECE_RADIUS_M + RADIUS_M - overlap_m(step)


def workpiece_particles(step: int) -> list[list[float]]:
    """Rows of workpiece_particles: particle 1, once the workpiece is there."""
    if step < 10:
        return []
    speed = 2 / 3 * SPEED_M_S if step > DRAG_START else 0.0
    motion = [speed, 0, 0, 0, SPIN_RAD_S, 0]
    return [[1, _centre_1(step), 0, CHAIN_Z_M, *motion, RADIUS_M, chain_n(step), 0, WEIGHT_N]]


def _workpiece_contacts(step: int) -> list[list[float]]:
    if step < 10:
        return []
    point = [workpiece_x_m(step) + WORKPIECE_RADIUS_M, 0, CHAIN_Z_M]
    return [[*point, 7, 1, 1.05 * chain_n(step), 0, 1.05 * WEIGHT_N, overlap_m(step)]]


def _contacts(step: int) -> list[list[float]]:
    pile = [4, 3, 0, 0, WEIGHT_N, WEIGHT_N / STIFFNESS_N_M]
    return [[2, 1, chain_n(step), 0, 0, overlap_m(step)], pile] if step >= 10 else [pile]


def _particles(step: int) -> list[list[float]]:
    press = WEIGHT_N / STIFFNESS_N_M
    side_x = BOWL_RADIUS_M - RADIUS_M + overlap_m(step)
    side = [-chain_n(step), 0, WEIGHT_N] if step >= 10 else [0, 0, 0]
    low, high = RADIUS_M - 2 * press, 3 * RADIUS_M - 3 * press
    still = [0.0] * 6
    return [
        [4, -0.01, 0.02, high, *still, RADIUS_M, 0, 0, 0, 0, 0, 0],
        [2, side_x, 0, CHAIN_Z_M, *still, RADIUS_M, 0, 0, 0, *side],
        [1, _centre_1(step), 0, CHAIN_Z_M, *still, RADIUS_M, 0, 0, 0, 0, 0, 0],
        [3, -0.01, 0.02, low, *still, RADIUS_M, 0, 0, 2 * WEIGHT_N, 0, 0, 0],
    ]


def case_json(**values: Any) -> dict[str, Any]:
    """Content of ``case.json``."""
    tiny = {
        "study_name": "tiny", "case": "tiny", "timestep_s": TIMESTEP_S, "surface_m": SURFACE_M,
        "upstream": {"filling": "filling-00000000", "drop_test": "drop-00000000"},
        "fidelity": {"ranks": 2}, "media": {"radius_mean_m": RADIUS_M},
        "contact_moduli": touching(FRICTION), "bowl": bowl_of_run(BOWL_RADIUS_M),
        "workpiece": {"immersion_depth_m": 0.03},
        "motion": line(SPEED_M_S), "phases": phases(DRAG_START, LAST),
        "statistics": {"transient_s": 0.02},
        "assumptions": [{"field": "bowl.radius_m", "value": BOWL_RADIUS_M, "why": "by hand"}],
    }  # fmt: skip
    return made_case("process", "tiny-00000000", **tiny | values)


ROWS = {
    "thermo": _thermo,
    "workpiece_force": _workpiece_force,
    "workpiece_particles": workpiece_particles,
    "workpiece_contacts": _workpiece_contacts,
    "contacts": _contacts,
    "particles": _particles,
}


def _content(output: outputs.Output) -> bytes:
    """What a raw output contains."""
    frames = {
        step: ROWS[output.name](step)
        for step in range(output.first_step, LAST + 1, output.period_steps)
    }
    part = output.as_part()
    if output.kind == "print":
        return Raw.prints([row for rows in frames.values() for row in rows], part.columns)
    if output.binary:
        width = len(part.columns)
        return b"".join(Raw.binary(step, rows, width) for step, rows in frames.items())
    return b"".join(Raw.text(step, rows, part.header, "local") for step, rows in frames.items())


def write_tiny_run(folder: Path) -> Path:
    """Write the run into a new folder, without its tables."""
    parts = {name: output.as_part().model_dump() for name, output in OUTPUTS.items()}
    write_documents(folder, case_json(), parts)
    (folder / "tables").rmdir()
    for output in OUTPUTS.values():
        (folder / output.pattern.format(part=1)).write_bytes(_content(output))
    return folder
