"""A process run with one peak of the drag, and its tables."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyvista as pv
from made_run import line, made_case, output, phases, save, write_documents
from report_files import write_measured

from dragchain.network.write import write_chains
from dragchain.statistics.estimate import Estimate

R = 0.003
STEP_S = 1e-3
DRAG_START = 100
LAST = 500
PERIOD = 20


def case_json(scene: str, **values: Any) -> dict[str, Any]:
    """Content of ``case.json`` of a run of three particles."""
    own = {
        "timestep_s": STEP_S, "gravity_m_s2": 10.0,
        "media": {"count": 3, "radius_mean_m": R},
        "workpiece": {"radius_m": 0.002, "length_m": 0.05},
        "motion": line(0.1, start_m=[-0.01, 0.0]), "phases": phases(DRAG_START, LAST),
        "restitution": 0.7,
        "study": {"reference": {"source": "a paper", "experiment": {"drag_mean_n": -4.0}}},
    }  # fmt: skip
    return made_case(scene, f"made-{scene}", **own | values)


def resistance(steps: Any) -> Any:
    """Return 2 N with a bump of 3 N around step 330."""
    return 2.0 + 3.0 * np.exp(-(((np.asarray(steps) - 330) / 30.0) ** 2))


def workpiece_x(steps: Any) -> Any:
    return -0.01 + 5e-5 * np.clip(np.asarray(steps) - DRAG_START, 0, None)


def workpiece_force_table() -> pd.DataFrame:
    steps = np.arange(2, LAST + 1, 2)
    plunge = np.clip(steps, 0, DRAG_START) / DRAG_START
    return pd.DataFrame(
        {
            "step": steps, "time_s": steps * STEP_S,
            "phase": np.where(steps <= DRAG_START, "plunge", "drag"),
            "ref_x_m": workpiece_x(steps), "ref_y_m": 0.0, "ref_z_m": 0.04 - 0.03 * plunge,
            "direction_rad": 0.0, "drag_n": -resistance(steps),
            "lateral_n": 0.1 * np.sin(steps), "vertical_n": 0.2 * np.cos(steps),
            "in_statistics": steps >= 200,
        }
    )  # fmt: skip


def network_tables() -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return contacts and particles: a chain of two particles from the workpiece to the side, and
    a third."""
    contacts, particles = [], []
    for step in range(0, LAST + 1, PERIOD):
        force = float(resistance(step))
        time_s = step * STEP_S
        for particle, (x, y) in {1: (0.011, 0.0), 2: (0.017, 0.0), 3: (0.0, -0.016)}.items():
            particles.append([step, time_s, particle, x, y, 0.015, R])
        for a, b, x, y, pull in [
            (1, 0, 0.008, 0.0, force), (1, 2, 0.014, 0.0, -force), (2, -2, 0.02, 0.0, -force),
            (3, -1, 0.0, -0.016, 0.01),
        ]:  # fmt: skip
            row = [step, time_s, a, b, x, y, 0.015 if b != -1 else 0.012, pull, 0.0, 0.0]
            contacts.append([*row, abs(pull)])
    axes = ("x", "y", "z")
    head = ["step", "time_s"]
    columns = [*head, "a_id", "b_id", *(f"point_{i}_m" for i in axes)]
    columns += [*(f"force_{i}_n" for i in axes), "normal_force_n"]
    bodies = {0: "particle-workpiece", 2: "particle-particle", -1: "particle-floor"}
    table = pd.DataFrame(contacts, columns=columns)
    return (
        table.assign(kind=table["b_id"].map(bodies).fillna("particle-side")),
        pd.DataFrame(particles, columns=[*head, "particle_id", "x_m", "y_m", "z_m", "radius_m"]),
    )


def workpiece_contacts_table() -> pd.DataFrame:
    steps = np.arange(0, LAST + 1, 10)
    ahead = pd.DataFrame(
        {"step": steps, "azimuth_rad": 0.0, "depth_m": 0.015, "normal_force_n": 3.0}
    )
    behind = ahead.assign(azimuth_rad=3.0, depth_m=0.005, normal_force_n=1.0)
    table = pd.concat([ahead, behind], ignore_index=True)
    return table.assign(in_statistics=table["step"] >= 200)


def write_process_run(run_dir: Path) -> Path:
    """Write a process run with one peak, its tables and its chains into a folder that is there."""
    outputs = {"workpiece_contacts": output("print", ["step"], 10, 0, LAST)}
    write_documents(run_dir, case_json("process"), outputs)
    contacts, particles = network_tables()
    save(workpiece_force_table(), run_dir, "workpiece_force")
    save(contacts, run_dir, "contacts")
    save(particles, run_dir, "particles")
    save(workpiece_contacts_table(), run_dir, "workpiece_contacts")
    workpiece = pv.Cylinder(center=(0, 0, 0.025), direction=(0, 0, 1), radius=0.002, height=0.05)
    workpiece.triangulate().save(run_dir / "workpiece.stl")
    write_chains(run_dir)
    drag = Estimate(-2.5, -2.7, -2.3)
    write_measured(run_dir, drag_mean=drag, drag_std=drag.over(-5), ahead_behind=drag.over(-1))
    return run_dir
