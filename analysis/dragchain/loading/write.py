"""The files on a run's loading: tables, JSON, mesh and picture."""

from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from dragchain.errors import TableError
from dragchain.figures.narrow import save
from dragchain.figures.style import drawing
from dragchain.loading.contact_events import event_types, find_events
from dragchain.loading.document import Loading
from dragchain.loading.figure import workpiece_figure
from dragchain.loading.samples import DRAWN, Sampled, as_polydata, check_facets, facet_table, sample
from dragchain.loading.summary import summarise_loading
from dragchain.loading.wear import WEAR_FILE, Wear, compute_wear, touch_maps
from dragchain.run.workpiece import Surface, read_surface
from dragchain.tables.parquet import write_parquet
from dragdeck.files import write_vtp
from dragdeck.records.case import CaseOfRun, load_case


@dataclass(frozen=True)
class WorkpieceLoading:
    """What is computed of a run's loading.

    Attributes
    ----------
    case : CaseOfRun
    surface : Surface
        The workpiece.
    sampled : Sampled
        All contacts with what the picture shows of them.
    facets, events : DataFrame
        Content of ``facets.parquet`` and ``contact_events.parquet``.
    summary : Loading
        Content of ``loading.json``.
    wear, touch_events : Wear and DataFrame, or None
        Content of ``wear.json`` and ``touch_events.parquet``, where the run has them.
    """

    case: CaseOfRun
    surface: Surface
    sampled: Sampled
    facets: pd.DataFrame
    events: pd.DataFrame
    summary: Loading
    wear: Wear | None = None
    touch_events: pd.DataFrame | None = None


def write_loading(run_dir: Path) -> list[Path]:
    """Write load, sliding and friction work of a process run's workpiece, and their picture.

    Parameters
    ----------
    run_dir : Path
        The folder of a process run, with ``workpiece_force.parquet`` and
        ``workpiece_contacts.parquet`` made.

    Returns
    -------
    list of Path
        Four files in ``tables/``, and ``figures/workpiece.png``. Of a run with a law of removal or
        first touches also ``wear.json``, with first touches ``touch_events.parquet``.

    Raises
    ------
    TableError
        If it is no process run, or a table is missing, holds no velocities or does
        not fit the mesh.
    SeriesError
        If the run is too short for its statistics.
    """
    loading = compute_loading(run_dir)
    tables = run_dir / "tables"
    names = ("facets.parquet", "contact_events.parquet", "loading.json", "workpiece.vtp")
    facets, events, summary, vtp = files = [tables / name for name in names]
    write_parquet(loading.facets, facets)
    write_parquet(loading.events, events)
    loading.summary.write(summary)
    if loading.wear is not None:
        loading.wear.write(run_dir / WEAR_FILE)
    if loading.touch_events is not None:
        write_parquet(loading.touch_events, tables / "touch_events.parquet")
    mesh = as_polydata(loading.surface)
    for name in loading.facets:
        mesh.cell_data[name] = loading.facets[name].to_numpy()
    write_vtp(vtp, mesh)
    with drawing():
        return [*files, save(figure_of(loading), run_dir / "figures" / "workpiece.png")]


def figure_of(loading: WorkpieceLoading) -> Figure:
    """The figure of the workpiece; see `workpiece_figure`."""
    return workpiece_figure(
        loading.case, loading.sampled, loading.surface, loading.facets, loading.summary
    )


def compute_loading(run_dir: Path) -> WorkpieceLoading:
    """Compute what `write_loading` writes; it raises the same errors."""
    case = load_case(run_dir)
    if case.scene != "process":
        raise TableError(
            f"{run_dir}: its scene is {case.scene}; only a process run has a workpiece"
        )
    sampled = sample(run_dir, case)
    surface = read_surface(run_dir, case)
    off_m = check_facets(sampled, surface, case)
    events, event = find_events(sampled.rows, sampled.frames, sampled.interval_s)
    events["type"] = event_types(events, case, sampled.interval_s)
    facets = facet_table(sampled, surface, events)
    summary = summarise_loading(sampled, facets, events, event, case, off_m)
    wear, touched = compute_wear(run_dir, case, sampled, surface, summary)
    if wear is not None and wear.touches is not None and touched is not None:
        facets = facets.assign(**touch_maps(touched, surface, wear.touches.time_s))
    drawn = replace(sampled, rows=sampled.rows[DRAWN].copy())
    events = events.drop(columns=["frame", "slid_m"])
    return WorkpieceLoading(case, surface, drawn, facets, events, summary, wear, touched)
