"""What the engine writes, made by hand, and the files of a run small enough to check by hand."""

import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from run_files import OF_EVERY_RUN

BOX = "ITEM: BOX BOUNDS ff ff ff\n-0.05 0.05\n-0.05 0.05\n0 0.4\n"


class Raw:
    """Writes what the engine writes."""

    @staticmethod
    def binary(step: int, rows: Sequence[Sequence[float]], width: int, ranks: int = 2) -> bytes:
        """One frame of a binary ``dump custom``; the rows are dealt out to the ranks."""
        fractions = [rows[rank::ranks] for rank in range(ranks)]
        chunks = [
            struct.pack(f"<i{width * len(fraction)}d", width * len(fraction), *np.ravel(fraction))
            for fraction in fractions
        ]
        box = (-0.05, 0.05, -0.05, 0.05, 0.0, 0.4)
        head = struct.pack("<qqi6i6dii", step, len(rows), 0, *[1] * 6, *box, width, ranks)
        return head + b"".join(chunks)

    @staticmethod
    def text(step: int, rows: Iterable[Iterable[float]], names: Sequence[str], kind: str) -> bytes:
        """One frame of a text dump of kind ``custom`` or ``local``."""
        noun = {"custom": "ATOMS", "local": "ENTRIES"}[kind]
        lines = [" ".join(f"{value:.9g}" for value in row) + " \n" for row in rows]
        head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {noun}\n{len(lines)}\n{BOX}"
        return (head + f"ITEM: {noun} {' '.join(names)} \n" + "".join(lines)).encode()

    @staticmethod
    def prints(rows: Iterable[Iterable[float]], names: Sequence[str]) -> bytes:
        """A ``fix print`` file."""
        lines = [" ".join(f"{value:.15g}" for value in row) + "\n" for row in rows]
        return (" ".join(names) + "\n" + "".join(lines)).encode()


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


def outputs_json() -> dict[str, Any]:
    """Content of ``columns.json``."""
    outputs = {
        name: {
            "kind": kind,
            "binary": binary,
            "pattern": f"{name}.{{part}}.{ending}",
            "columns": COLUMNS[name],
            "engine_columns": [f"c_x[{i}]" for i in range(len(COLUMNS[name]))]
            if kind == "local"
            else None,
            "period_steps": period,
            "first_step": first,
            "last_step": LAST,
        }
        for name, (kind, binary, ending, period, first) in KINDS.items()
    }
    return {"schema": 2, "outputs": outputs}


def case_json() -> dict[str, Any]:
    """Content of ``case.json``."""
    return {
        **OF_EVERY_RUN,
        "schema": 2,
        "study": "tiny",
        "scene": "process",
        "run": "tiny-00000000",
        "case": "tiny",
        "upstream": {"filling": "filling-00000000", "drop_test": "drop-00000000"},
        "timestep_s": TIMESTEP_S,
        "rayleigh_time_s": 2e-3,
        "gravity_m_s2": GRAVITY_M_S2,
        "fidelity": {
            "name": "draft",
            "youngs_modulus_scale": 0.01,
            "timestep_fraction": 0.5,
            "speed_factor": 1.0,
            "skin_m": 0.001,
            "ranks": 2,
        },
        "inputs": {
            "media.count": 4,
            "motion.speed_m_s": SPEED_M_S,
            "media.material": "stone",
            **dict.fromkeys(("bowl.material", "workpiece.material"), "steel"),
            **dict.fromkeys(("pairs.stone-stone.friction", "pairs.steel-stone.friction"), FRICTION),
            **{f"materials.{m}.youngs_modulus_pa": 1e9 for m in ("stone", "steel")},
            **{f"materials.{m}.poissons_ratio": 0.3 for m in ("stone", "steel")},
        },
        "media": {
            "count": 4,
            "radius_mean_m": RADIUS_M,
            "radius_std_m": 0.0,
            "density_kg_m3": DENSITY_KG_M3,
        },
        "bowl": {"radius_m": BOWL_RADIUS_M, "walls": "primitive"},
        "workpiece": {
            "kind": "cylinder",
            "radius_m": WORKPIECE_RADIUS_M,
            "length_m": 0.06,
            "mesh": "workpiece.stl",
            "immersion_depth_m": 0.03,
        },
        "surface_m": SURFACE_M,
        "motion": {
            "kind": "line",
            "axis_speed_m_s": SPEED_M_S,
            "start_m": [0.0, 0.0],
            "direction_rad": 0.0,
            "start_direction_rad": 0.0,
            "orientation": "follow_path",
        },
        "phases": [
            {"name": "plunge", "start_step": 0, "end_step": DRAG_START},
            {"name": "drag", "start_step": DRAG_START, "end_step": LAST},
        ],
        "statistics": {"transient_s": 0.02},
        "assumptions": [{"field": "bowl.radius_m", "value": BOWL_RADIUS_M, "why": "by hand"}],
        "reference": None,
        "versions": {"dragdeck": "0.1.0"},
    }


def raw_files() -> Mapping[str, bytes]:
    """Names and contents of the raw outputs."""
    outputs = outputs_json()["outputs"]
    steps = {
        name: range(output["first_step"], LAST + 1, output["period_steps"])
        for name, output in outputs.items()
    }
    engine = {name: output["engine_columns"] for name, output in outputs.items()}
    thermo = [[step, step * TIMESTEP_S, 4, 0, 0] for step in steps["thermo"]]
    workpiece_force = [_workpiece_force(step) for step in steps["workpiece_force"]]
    return {
        "thermo.1.txt": Raw.prints(thermo, COLUMNS["thermo"]),
        "workpiece_force.1.txt": Raw.prints(workpiece_force, COLUMNS["workpiece_force"]),
        "workpiece_particles.1.bin": b"".join(
            Raw.binary(s, workpiece_particles(s), len(COLUMNS["workpiece_particles"]))
            for s in steps["workpiece_particles"]
        ),
        "particles.1.bin": b"".join(Raw.binary(s, _particles(s), 17) for s in steps["particles"]),
        "workpiece_contacts.1.dump": b"".join(
            Raw.text(s, _workpiece_contacts(s), engine["workpiece_contacts"], "local")
            for s in steps["workpiece_contacts"]
        ),
        "contacts.1.dump": b"".join(
            Raw.text(s, _contacts(s), engine["contacts"], "local") for s in steps["contacts"]
        ),
    }


def write_tiny_run(folder: Path) -> Path:
    """Write the run into a new folder, without its tables."""
    folder.mkdir()
    (folder / "case.json").write_text(json.dumps(case_json()))
    (folder / "columns.json").write_text(json.dumps(outputs_json()))
    for name, content in raw_files().items():
        (folder / name).write_bytes(content)
    return folder
