"""A process run with a contact network over time, made by hand: tables, chains and loads."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyvista as pv
from figure_files import DRAG_START, LAST, PERIOD, STEP_S, case_json
from made_run import output, particles_kept, run_json, save, write_documents
from networks import RADIUS_M, random_frame

from dragchain.network.frame import BODY_NAMES, PARTICLE
from dragchain.network.write import write_chains

PEAKS_S = (0.150, 0.305, 0.262)
"""Process times of the highest, second and third peak of the drag force."""

PEAK_N = (6.0, 5.0, 4.0)
KIND = {body: f"particle-{name}" for body, name in BODY_NAMES.items()}


def write_network_run(folder: Path, kind: str = "cylinder", **changes: Any) -> Path:
    """Write a run of 216 particles; `changes` are of its ``case.json``.

    The forces of each network frame are those of one random network times a factor, and the
    particles move by as much as 0.2 radii. The drag has three peaks.
    """
    case = case_json("process", **changes)
    case["workpiece"]["kind"] = kind
    names = ("contacts", "particles", "workpiece_contacts", "workpiece_particles")
    network = output("local", ["step"], PERIOD, DRAG_START, LAST)
    write_documents(folder, case, dict.fromkeys(names, network))
    frames = [_frame(step) for step in range(DRAG_START, LAST + 1, PERIOD)]
    for number, name in enumerate(("contacts", "particles")):
        save(pd.concat([frame[number] for frame in frames], ignore_index=True), folder, name)
    save(_force(case["motion"]["direction_rad"]), folder, "workpiece_force")
    write_chains(folder)
    _workpiece(folder)
    return folder


def accept(folder: Path, **changes: Any) -> None:
    """Write a ``run.json`` that passed its checks, unless it is changed."""
    check = particles_kept(1422) | {"seen": "216", "limit": "216"} | changes
    record = run_json(checks=[check], ranks=1)
    (folder / "run.json").write_text(json.dumps(record))


def _frame(step: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Contacts and particles of a step."""
    frame, rng = random_frame(7), np.random.default_rng(step)
    centre = frame.centre + [0.0, 0.0, 0.02] + 0.2 * RADIUS_M * rng.random(frame.centre.shape)
    factor = rng.uniform(0.2, 1.0)
    b_id = np.where(frame.b >= 0, frame.particle_id[frame.b], frame.other)
    contacts = pd.DataFrame(
        {
            "step": step, "time_s": step * STEP_S,
            "kind": [KIND[PARTICLE if b > 0 else b] for b in b_id.tolist()],
            "a_id": frame.particle_id[frame.a], "b_id": b_id,
            **{f"point_{axis}_m": frame.point[:, k] for k, axis in enumerate("xyz")},
            **{f"force_{axis}_n": factor * frame.force[:, k] for k, axis in enumerate("xyz")},
            "normal_force_n": factor * frame.normal_force * rng.random(frame.a.size),
            "tangential_force_n": 0.1 * factor * rng.random(frame.a.size),
            "overlap_m": 1e-6,
        }
    )  # fmt: skip
    particles = pd.DataFrame({"step": step, "time_s": step * STEP_S, "radius_m": RADIUS_M,
                              "particle_id": frame.particle_id})  # fmt: skip
    particles[["x_m", "y_m", "z_m"]] = centre
    for name in ("vx_m_s", "vy_m_s", "vz_m_s", "wx_rad_s", "wy_rad_s", "wz_rad_s"):
        particles[name] = 0.01 * rng.normal(size=len(centre))
    return contacts, particles


def _force(direction_rad: float) -> pd.DataFrame:
    """The force on a workpiece that moves straight on, with three peaks on a level of 1 N."""
    step = np.arange(0, LAST + 1)
    since = (step - DRAG_START) * STEP_S
    bumps = [
        (height - 1.0) * np.exp(-(((since - at) / 0.008) ** 2))
        for at, height in zip(PEAKS_S, PEAK_N, strict=True)
    ]
    drag = -1.0 - np.sum(bumps, axis=0)
    table = pd.DataFrame({"step": step, "time_s": step * STEP_S, "drag_n": drag})
    table["phase"] = np.where(step > DRAG_START, "drag", "plunge")
    table["in_statistics"] = since >= 0.1 - 1e-9
    table["ref_x_m"] = -0.01 + 0.02 * since * np.cos(direction_rad)
    table["ref_y_m"] = 0.02 * since * np.sin(direction_rad)
    table["ref_z_m"] = 0.01
    table["direction_rad"] = direction_rad
    return table


def _workpiece(folder: Path) -> None:
    """The mesh of the workpiece and a load on each of its facets."""
    mesh = pv.Cylinder(
        center=(0, 0, 0.02), direction=(0, 0, 1), radius=0.002, height=0.04, resolution=12
    ).triangulate()
    mesh.save(folder / "workpiece.stl")
    loads = np.random.default_rng(3).random((3, mesh.n_cells)) * [[2000.0], [15000.0], [800.0]]
    names = ("force_slide_pa", "mean_pressure_pa", "friction_work_pa")
    facets = pd.DataFrame(dict(zip(names, loads, strict=True)))
    area = mesh.compute_cell_sizes()["Area"]
    save(facets.assign(facet_id=np.arange(mesh.n_cells), area_m2=area), folder, "facets")
