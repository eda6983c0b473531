"""A run with four particles on a plate, made by hand: one slides, one rolls, one hits, one
rests."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from bowls import bowl_of_run
from made_run import line, made_case, output, phases, stl, touching, write_documents
from matplotlib.figure import Figure

from dragchain.loading.write import write_loading

STEP_S = 1e-4
PERIOD = 10
DT = PERIOD * STEP_S
START, LAST = 100, 3100
FRAMES = 300
SPEED = 0.1
MU = 0.25
SURFACE = 0.03
SIZE = 0.02
SLIDE, ROLL, HIT, REST = 1, 2, 3, 4

_LEFT, _RIGHT = (0.0, -0.01, 0.0), (0.0, 0.01, 0.02)
PLATE = stl([(_LEFT, (0.0, 0.01, 0.0), _RIGHT), (_LEFT, _RIGHT, (0.0, -0.01, 0.02))])
"""A square of 20 mm that looks along +x; its diagonal runs up to the left."""


def case_json(study: Mapping[str, Any] | None = None, **motion: Any) -> dict[str, Any]:
    """Content of ``case.json``; `motion` changes that along a line, `study` other fields."""
    return made_case(
        "process", "made-process", study, timestep_s=STEP_S, rayleigh_time_s=2e-4,
        contact_moduli=touching(MU, 0.01 * 2e11 / (2 * (1 - 0.3**2))), bowl=bowl_of_run(0.1),
        surface_m=SURFACE, motion=line(SPEED) | motion,
        workpiece={"kind": "mesh", "radius_m": 0.01, "length_m": SIZE, "immersion_depth_m": SIZE},
        phases=phases(START, LAST), statistics={"transient_s": 0.0},
    )  # fmt: skip


def contact(
    frame: int, particle: int, place: tuple[float, float], force: tuple[float, float, float],
    slip: tuple[float, float] = (0.0, 0.0), approach: float = 0.0,
) -> dict[str, Any]:  # fmt: skip
    """A contact at (y, z) of the plate; `force` is that on the workpiece, `slip` along y and z."""
    step = START + PERIOD * (frame + 1)
    x = SPEED * STEP_S * (step - START)
    y, z = place
    return {
        "step": step, "time_s": step * STEP_S, "phase": "drag", "particle_id": particle,
        "facet_id": int(z > y + 0.01), "point_x_m": x, "point_y_m": y, "point_z_m": 0.01 + z,
        "force_x_n": force[0], "force_y_n": force[1], "force_z_n": force[2],
        "normal_force_n": -force[0], "tangential_force_n": float(np.hypot(*force[1:])),
        "overlap_m": 1e-6, "slip_x_m_s": 0.0, "slip_y_m_s": slip[0], "slip_z_m_s": slip[1],
        "normal_velocity_m_s": approach, "azimuth_rad": float(np.arctan2(y, 1e-3)),
        "depth_m": SURFACE - 0.01 - z, "in_statistics": True,
    }  # fmt: skip


def made_contacts() -> list[dict[str, Any]]:
    """Four particles on the plate.

    One slides upwards for 200 frames without turning, at 40 mm/s under 1 N. One rolls to the left
    for all 300 frames at 60 mm/s under 2 N, across the diagonal, its friction half mobilised. One
    hits in frames 50 and 60 with 3 N, seen once each time. One is carried along for 100 frames.
    """
    sliding = [
        contact(i, SLIDE, (0.005, 0.002 + 0.04 * DT * i), (-1.0, 0.0, MU), (0.0, 0.04))
        for i in range(50, 250)
    ]
    rolling = [
        contact(i, ROLL, (-0.009 + 0.06 * DT * i, 0.01), (-2.0, 0.5 * MU * 2.0, 0.0))
        for i in range(FRAMES)
    ]
    hits = [contact(i, HIT, (0.0, 0.005), (-3.0, 0.0, 0.0), approach=0.2) for i in (50, 60)]
    rest = [contact(i, REST, (-0.005, 0.015), (-0.5, 0.0, 0.01)) for i in range(100, 200)]
    return [*sliding, *rolling, *hits, *rest]


def write_run(folder: Path, rows: list[dict[str, Any]]) -> Path:
    """A run folder with its tables."""
    outputs = output("local", ["point_x_m"], PERIOD, START, LAST)
    write_documents(folder, case_json(), {"workpiece_contacts": outputs})
    (folder / "workpiece.stl").write_text(PLATE)
    contacts = pd.DataFrame(rows).sort_values(["step", "particle_id"])
    contacts.to_parquet(folder / "tables/workpiece_contacts.parquet")
    steps = np.arange(START + PERIOD, LAST + 1, PERIOD)
    sums = contacts.groupby("step")[["force_x_n", "force_y_n", "force_z_n"]].sum()
    sums = sums.reindex(steps, fill_value=0.0)
    workpiece = pd.DataFrame(
        {
            "step": steps, "direction_rad": 0.0, "ref_x_m": SPEED * STEP_S * (steps - START),
            "ref_y_m": 0.0, "ref_z_m": 0.01, "drag_n": sums["force_x_n"].to_numpy(),
            "lateral_n": sums["force_y_n"].to_numpy(), "vertical_n": sums["force_z_n"].to_numpy(),
            "in_statistics": True,
        }
    )  # fmt: skip
    workpiece.to_parquet(folder / "tables/workpiece_force.parquet")
    return folder


def write_without_picture(folder: Path) -> None:
    """Write the loading of a run; its picture, which takes seconds, is empty."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dragchain.loading.write.figure_of", lambda loading: Figure())
        write_loading(folder)
