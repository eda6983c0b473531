"""Runs made by hand: one builder of their documents, and a writer of what the engine writes.

The modules `tiny_run_files`, `figure_files`, `loading_files`, `network_run_files` and
`report_files` make the content of such runs with it.
"""

import json
import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from bowls import bowl_of_run
from made_study import plain_study
from run_files import OF_EVERY_RUN

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.motion import Motion

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


_FIDELITY = {"name": "draft", "youngs_modulus_scale": 0.01, "timestep_fraction": 0.5,
             "speed_factor": 1.0, "skin_m": 0.001, "ranks": 1}  # fmt: skip
_BLOCKS = {
    "fidelity": _FIDELITY,
    "media": {"count": 4, "radius_mean_m": 3e-3, "radius_std_m": 0.0, "density_kg_m3": 2500.0},
    "bowl": bowl_of_run(0.02),
    "workpiece": {"kind": "cylinder", "radius_m": 5e-3, "length_m": 0.06, "mesh": "workpiece.stl",
                  "immersion_depth_m": 0.02},
}  # fmt: skip


def made_case(
    scene: str, run: str, study: Mapping[str, Any] | None = None, **values: Any
) -> dict[str, Any]:
    """Content of ``case.json``: a straight process, unless `values` say otherwise.

    It has the small study with the changes in `study`, by their dotted names. Of fidelity,
    media, bowl and workpiece only the entries that differ need to be given.
    """
    blocks = {name: known | values.pop(name, {}) for name, known in _BLOCKS.items()}
    motion = values.pop("motion", line(0.1))
    case = {
        "schema": 2, "study_name": "made", "scene": scene, "run": run, "case": "made case",
        "upstream": {}, "timestep_s": 1e-3, "rayleigh_time_s": 2e-3, "gravity_m_s2": 9.81,
        "surface_m": 0.03, "statistics": {"transient_s": 0.1},
        "assumptions": [], "versions": {"dragdeck": "0.1.0"},
        "study": plain_study(study or {}), "inputs": {},
        **OF_EVERY_RUN,
    } | blocks | values  # fmt: skip
    return with_motion(case, **motion)


def touching(friction: float, modulus_pa: float = 1e9) -> dict[str, Any]:
    """What a particle touches, with one friction for all."""
    constants = {
        "modulus_pa": modulus_pa,
        "shear_pa": 4e8,
        "restitution": 0.5,
        "friction": friction,
    }
    return dict.fromkeys(("particle", "bowl", "workpiece"), constants)


def line(speed_m_s: float, **path: Any) -> dict[str, Any]:
    """A motion along +x from the bowl's axis; fields of the path may be others."""
    return {"path": {"kind": "line", "start_m": [0.0, 0.0], **path}, "speed_m_s": speed_m_s}


def with_motion(
    case: Mapping[str, Any], path: Mapping[str, Any], speed_m_s: float | None = None, **motion: Any
) -> dict[str, Any]:
    """A case whose workpiece is driven along a path in the steps of its drag, if it has one.

    Parameters
    ----------
    case : mapping
        The content of its ``case.json``.
    path, motion : mapping
        Fields of the study; the length of a line or circle is that of the drag.
    speed_m_s : float, optional
        Speed that is driven; None for one that gives its own.
    """
    drag = next((phase for phase in case.get("phases", ()) if phase["name"] == "drag"), None)
    if drag is None:
        return dict(case)
    timestep, factor = case["timestep_s"], case["fidelity"]["speed_factor"]
    length = (speed_m_s or 0.0) * (drag["end_step"] - drag["start_step"]) * timestep
    lengths = {
        "line": {"length_m": length},
        "circle": {"revolutions": length / math.tau / path.get("radius_m", 1.0)},
    }
    made = Motion.model_validate(
        {
            "path": {**lengths.get(path["kind"], {}), **path},
            "speed_m_s": None if speed_m_s is None else speed_m_s / factor,
            "immersion_depth_m": case["workpiece"]["immersion_depth_m"],
            "transient_m": 0.0,
            "orientation": "fixed",
            **motion,
        }
    )
    driven = DrivenMotion.of(made, timestep, factor, drag["start_step"])
    return {
        **case,
        "study": {**case["study"], "motion": made.plain()},
        "motion": driven.path_entry().model_dump(),
        "superposed": [one.model_dump() for one in driven.superposed_entries()],
    }


def phases(drag_start: int, last: int) -> list[dict[str, Any]]:
    """A plunge from step 0 on, then the drag."""
    return [{"name": "plunge", "start_step": 0, "end_step": drag_start},
            {"name": "drag", "start_step": drag_start, "end_step": last}]  # fmt: skip


def output(kind: str, columns: Sequence[str], period: int, first: int, last: int | None,
           pattern: str = "x.{part}.txt", **more: Any) -> dict[str, Any]:  # fmt: skip
    """One of the outputs in ``columns.json``; kind is print, local or custom."""
    return {"kind": kind, "binary": False, "pattern": pattern, "columns": list(columns),
            "engine_columns": None, "period_steps": period, "first_step": first,
            "last_step": last} | more  # fmt: skip


def output_of_run(name: str, *entry: Any, **more: Any) -> OutputOfRun:
    """The same as it is read, in files of its name."""
    made = output(*entry, **{"pattern": f"{name}.{{part}}", **more})
    return OutputOfRun.model_validate({"name": name, **made})


def run_json(**more: Any) -> dict[str, Any]:
    """Content of ``run.json`` of an accepted run."""
    return {
        "schema": 2, "inputs": "0f", "state": "complete", "engine_version": "Engine 3.8",
        "ranks": 2,
        "steps": 160000, "steps_per_s": 2100.0, "wall_time_s": 76.0,
        "started": "2026-01-01T00:00:00", "parts": [{"part": 1, "from": None, "from_step": 0}],
        "checks": [particles_kept(1422)],
    } | more  # fmt: skip


def particles_kept(seen: int) -> dict[str, Any]:
    """The acceptance check of a run of 1422 particles that ended with so many."""
    remedy = None if seen == 1422 else "choose a smaller timestep_fraction"
    return {"code": "particles_kept", "name": "no particle lost", "passed": seen == 1422,
            "seen": str(seen), "limit": "1422", "remedy": remedy}  # fmt: skip


def write_documents(
    folder: Path, case: dict[str, Any], outputs: dict[str, Any] | None = None,
    record: dict[str, Any] | None = None,
) -> Path:  # fmt: skip
    """Write ``case.json``, ``columns.json`` and ``run.json`` of a run, and make its folder."""
    (folder / "tables").mkdir(parents=True, exist_ok=True)
    (folder / "case.json").write_text(json.dumps(case))
    if outputs is not None:
        columns = {"schema": 2, "outputs": outputs}
        (folder / "columns.json").write_text(json.dumps(columns))
    if record is not None:
        (folder / "run.json").write_text(json.dumps(record))
    return folder


def save(table: pd.DataFrame, folder: Path, name: str) -> None:
    """Write one of a run's tables."""
    (folder / "tables").mkdir(exist_ok=True)
    table.to_parquet(folder / "tables" / f"{name}.parquet", index=False)


def stl(facets: Iterable[Iterable[Sequence[float]]]) -> str:
    """An STL of triangles, given by their corners."""
    text = "solid plate\n"
    for corners in facets:
        rows = "".join(f"vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in corners)
        text += f"facet normal 0 0 0\nouter loop\n{rows}endloop\nendfacet\n"
    return text + "endsolid plate\n"
