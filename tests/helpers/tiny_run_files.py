"""The files of a run small enough to check by hand."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from made_run import Raw, line, made_case, output, phases, touching, write_documents

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

VECTOR = ("x", "y", "z")
FORCE = [f"force_{axis}_n" for axis in VECTOR]
COLUMNS: dict[str, list[str]] = {
    "thermo": ["step", "time_s", "n_particles", "kinetic_energy_j", "rotational_energy_j"],
    "workpiece_force": [
        *("step", "time_s", *FORCE),
        *(f"torque_{axis}_n_m" for axis in VECTOR),
        *(f"ref_{axis}_m" for axis in VECTOR),
    ],
    "workpiece_particles": [
        *("particle_id", "x_m", "y_m", "z_m", *(f"v{axis}_m_s" for axis in VECTOR)),
        *(f"w{axis}_rad_s" for axis in VECTOR),
        *("radius_m", *FORCE),
    ],
    "workpiece_contacts": [
        *(f"point_{axis}_m" for axis in VECTOR),
        *("facet_id", "particle_id", *FORCE, "overlap_m"),
    ],
    "contacts": ["particle1_id", "particle2_id", *FORCE, "overlap_m"],
    "particles": [
        *("particle_id", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s"),
        *("wx_rad_s", "wy_rad_s", "wz_rad_s", "radius_m"),
        *(f"floor_force_{axis}_n" for axis in VECTOR),
        *(f"side_force_{axis}_n" for axis in VECTOR),
    ],
}
KINDS = {
    "thermo": ("print", False, "txt", 20, 20),
    "workpiece_force": ("print", False, "txt", 2, 2),
    "workpiece_particles": ("custom", True, "bin", 10, 0),
    "workpiece_contacts": ("local", False, "dump", 10, 0),
    "contacts": ("local", False, "dump", 20, 0),
    "particles": ("custom", True, "bin", 20, 0),
}


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


def _workpiece_force(step: int) -> list[float]:
    force = [-chain_n(step), 0.0, -WEIGHT_N if step >= 10 else 0.0]
    return [step, step * TIMESTEP_S, *force, 0, 0, 0, workpiece_x_m(step), 0.0, 0.02]


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


def outputs() -> dict[str, Any]:
    """The outputs in ``columns.json``."""
    return {
        name: output(kind, COLUMNS[name], period, first, LAST, f"{name}.{{part}}.{ending}",
                     binary=binary, engine_columns=_engine_columns(name))
        for name, (kind, binary, ending, period, first) in KINDS.items()
    }  # fmt: skip


def _engine_columns(name: str) -> list[str] | None:
    local = KINDS[name][0] == "local"
    return [f"c_x[{i}]" for i in range(len(COLUMNS[name]))] if local else None


def case_json(**values: Any) -> dict[str, Any]:
    """Content of ``case.json``."""
    tiny = {
        "study_name": "tiny", "case": "tiny", "timestep_s": TIMESTEP_S, "surface_m": SURFACE_M,
        "upstream": {"filling": "filling-00000000", "drop_test": "drop-00000000"},
        "fidelity": {"ranks": 2}, "media": {"radius_mean_m": RADIUS_M},
        "contact_moduli": touching(FRICTION), "bowl": {"radius_m": BOWL_RADIUS_M},
        "workpiece": {"immersion_depth_m": 0.03},
        "motion": line(SPEED_M_S), "phases": phases(DRAG_START, LAST),
        "statistics": {"transient_s": 0.02},
        "assumptions": [{"field": "bowl.radius_m", "value": BOWL_RADIUS_M, "why": "by hand"}],
    }  # fmt: skip
    return made_case("process", "tiny-00000000", **tiny | values)


def raw_files() -> Mapping[str, bytes]:
    """Names and contents of the raw outputs."""
    steps = {name: range(first, LAST + 1, period) for name, (*_, period, first) in KINDS.items()}
    thermo = [[step, step * TIMESTEP_S, 4, 0, 0] for step in steps["thermo"]]
    workpiece_force = [_workpiece_force(step) for step in steps["workpiece_force"]]
    binary = {"workpiece_particles": workpiece_particles, "particles": _particles}
    text = {"workpiece_contacts": _workpiece_contacts, "contacts": _contacts}
    return {
        "thermo.1.txt": Raw.prints(thermo, COLUMNS["thermo"]),
        "workpiece_force.1.txt": Raw.prints(workpiece_force, COLUMNS["workpiece_force"]),
        **{
            f"{name}.1.bin": b"".join(
                Raw.binary(step, rows(step), len(COLUMNS[name])) for step in steps[name]
            )
            for name, rows in binary.items()
        },
        **{
            f"{name}.1.dump": b"".join(
                Raw.text(step, rows(step), _engine_columns(name), "local") for step in steps[name]
            )
            for name, rows in text.items()
        },
    }


def write_tiny_run(folder: Path) -> Path:
    """Write the run into a new folder, without its tables."""
    folder.mkdir()
    write_documents(folder, case_json(), outputs())
    (folder / "tables").rmdir()
    for name, content in raw_files().items():
        (folder / name).write_bytes(content)
    return folder
