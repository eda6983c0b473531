"""The files on a run's loading: tables, JSON, mesh and picture."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from dragchain.errors import TableError
from dragchain.files import write_json
from dragchain.loading.contact_events import Thresholds, event_types, find_events
from dragchain.loading.facets import check_facets, facet_table, write_vtp
from dragchain.loading.samples import DRAWN, sample
from dragchain.loading.summary import findings
from dragchain.run.case import load_case
from dragchain.run.workpiece import read_surface
from dragchain.tables.parquet import write_parquet

FILE = Path("tables") / "loading.json"
WRITTEN = ("facets.parquet", "contact_events.parquet", "loading.json", "workpiece.vtp")


def write_loading(run_dir: Path, limits: Thresholds | None = None) -> list[Path]:
    """Write load, sliding and friction work of a process run's workpiece, and their picture.

    Parameters
    ----------
    run_dir : Path
        The folder of a process run, with ``workpiece_force.parquet`` and
        ``workpiece_contacts.parquet`` made.
    limits : Thresholds, optional
        Limits between the types of contact.

    Returns
    -------
    list of Path
        `WRITTEN` in ``tables/``, and ``figures/workpiece.png``.

    Raises
    ------
    TableError
        If it is no process run, or a table is missing, holds no velocities or does
        not fit the mesh.
    SeriesError
        If the run is too short for its statistics.
    """
    from dragchain.loading.figure import draw_workpiece

    limits = limits or Thresholds()
    case = load_case(run_dir)
    if case.scene != "process":
        raise TableError(
            f"{run_dir}: its scene is {case.scene}; only a process run has a workpiece"
        )
    sampled = sample(run_dir, case, limits)
    surface = read_surface(run_dir, case)
    off = check_facets(sampled, surface, case)
    events, event = find_events(sampled.rows, sampled.frames, sampled.interval_s)
    events["type"] = event_types(events, case, sampled.interval_s, limits)
    facets = facet_table(sampled, surface, events)
    found = findings(sampled, facets, events, event, case, limits)
    found["closure"]["point_off_facet_max_m"] = off
    files = [run_dir / "tables" / name for name in WRITTEN]
    write_parquet(facets, files[0])
    write_parquet(events.drop(columns="frame"), files[1])
    write_json(files[2], found)
    write_vtp(surface, facets, files[3])
    sampled = replace(sampled, rows=sampled.rows[DRAWN].copy())
    del event
    return [*files, draw_workpiece(run_dir, case, sampled, surface, facets, found)]


def read_loading(run_dir: Path) -> dict[str, Any]:
    """Read the ``loading.json`` that `write_loading` wrote.

    Raises
    ------
    TableError
        If it is not there.
    """
    file = run_dir / FILE
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `dragchain loading {run_dir}` first")
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found
