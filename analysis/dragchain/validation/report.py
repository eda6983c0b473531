"""Tables, figures and page of a validation."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import pandas as pd
from matplotlib.figure import Figure

from dragchain.figures.style import STYLE, png
from dragchain.files import write_json
from dragchain.report.page import file_uri, render_page
from dragchain.scaling.document import ScalingFile
from dragchain.scaling.figures import draw_scalings
from dragchain.scaling.fit import read_scalings
from dragchain.tables.parquet import write_parquet
from dragchain.validation import around_workpiece as statements
from dragchain.validation import figures, force
from dragchain.validation import loading_over_packings as load
from dragchain.validation.claims import claims
from dragchain.validation.peaks.report import report_peaks
from dragchain.validation.runs_by_bed import Point, Points, read_points

SCHEMA = 2


def write_validation(out_dir: Path, run_dirs: Sequence[Path], command: str) -> None:
    """Write tables, figures and page of the runs of a validation.

    Parameters
    ----------
    out_dir : Path
        Gets ``validation.json``, ``*.parquet``, ``*.csv``, ``figures/*`` and ``report.html``.
    run_dirs : sequence of Path
        Folders of measured runs; the first is at the reference's settings.
    command : str
        What made them, for the page.

    Raises
    ------
    TableError
        A run has no measures, or fewer than two fills are complete.
    SeriesError
        There are too few runs to compare settings.
    """
    points = read_points(run_dirs)
    found = find(points, command)
    effects = force.effects(points)
    out_dir.mkdir(parents=True, exist_ok=True)
    for name, table in tables(points, found, effects).items():
        write_parquet(table, out_dir / f"{name}.parquet")
        table.to_csv(out_dir / f"{name}.csv", index=False, lineterminator="\n")
    folder = out_dir / "figures"
    folder.mkdir(exist_ok=True)
    for name, picture in draw(points, found, effects).items():
        (folder / f"{name}.png").write_bytes(picture)
    shutil.copyfile(
        points.packings[0].folder / "figures" / "workpiece.png", folder / "workpiece.png"
    )
    scalings = [one.model_dump(mode="json", by_alias=True) for one in found["scalings"]]
    document = {**found, "scalings": scalings, "effects": _records(effects)}
    write_json(out_dir / "validation.json", document)
    peaks = report_peaks([point.folder for point in points.packings])
    peaks.write(out_dir)
    page = render(points, found, effects, json.loads(peaks.findings.as_text()), folder)
    (out_dir / "report.html").write_text(page, encoding="utf-8")


def find(points: Points, command: str) -> dict[str, Any]:
    """All numbers of the page but those of other settings."""
    found_force = force.of_packings(points)
    together = found_force["together"]["drag_n"]
    case = points.packings[0].case
    found_statements = statements.of_packings(points.packings)
    return {
        "schema": SCHEMA,
        "study": case.study,
        "command": command,
        "measured": max(str(point.measures.started) for point in points.all)[:10],
        "versions": dict(points.packings[0].measures.versions),
        "engine_hours": sum(_cpu_s(point) for point in points.all) / 3600.0,
        "force": found_force,
        "comparison": force.compare(together["mean"], together["std"], case),
        "load": load.of_packings(points.packings),
        "statements": found_statements,
        "scalings": scalings_of(points.packings[0].measures.numbers),
        "claims": [{**vars(claim), "verdict": claim.verdict} for claim in claims(found_statements)],
    }


SAME_SCENE = ("bowl_to_particle", "particle_friction", "lowest_restitution", "particles")
"""Numbers that a scene shares with the sweeps that are shown beside it."""


def scalings_of(numbers: Mapping[str, float]) -> list[ScalingFile]:
    """The packaged sweeps that were made in a scene with these numbers."""
    return [
        found
        for found in read_scalings()
        if all(math.isclose(found.scene[k], numbers[k], rel_tol=0.01) for k in SAME_SCENE)
    ]


def _cpu_s(point: Point) -> float:
    return float(point.measures.cost.cpu_time_s)


def tables(
    points: Points, found: Mapping[str, Any], effects: pd.DataFrame
) -> dict[str, pd.DataFrame]:
    """The numbers of the page as tables, by name."""
    network = found["statements"]["network"]
    edges = network["edges_diameters"]
    profile = {
        f"{side}_{name}_n": network[f"{side}_n"][name]
        for side in ("ahead", "behind")
        for name in ("value", "ci95_low", "ci95_high")
    }
    density = found["force"]["spectrum"]["density"]
    estimates = [
        {**{k: v for k, v in claim.items() if k != "estimate"}, **claim["estimate"]}
        for claim in found["claims"]
    ]
    return {
        "packings": pd.json_normalize(found["force"]["packings"], sep="_"),
        "effects": effects,
        "load": pd.DataFrame(found["load"]["rows"]),
        "facets": load.facets(points.packings),
        "comparison": pd.json_normalize(found["comparison"], sep="_"),
        "statements": pd.DataFrame(estimates),
        "corridor": pd.DataFrame(
            {"from_diameters": edges[:-1], "to_diameters": edges[1:], **profile}
        ),
        "around": _profile(found["statements"]["azimuth"], "rad"),
        "depth": _profile(found["statements"]["depth"], "m"),
        "spectrum": pd.DataFrame(
            {"waves_per_diameter": found["force"]["spectrum"]["waves_per_diameter"], **density}
        ),
    }


def _profile(columns: Mapping[str, Any], unit: str) -> pd.DataFrame:
    edges = columns["edges"]
    values = {name: columns[name] for name in ("value", "ci95_low", "ci95_high")}
    return pd.DataFrame({f"from_{unit}": edges[:-1], f"to_{unit}": edges[1:], **values})


def draw(points: Points, found: Mapping[str, Any], effects: pd.DataFrame) -> dict[str, bytes]:
    """The figures of the page as PNG, by name."""
    with matplotlib.rc_context(STYLE):
        drawn: dict[str, Figure] = {
            "comparison": figures.comparison(found["force"], found["comparison"], effects),
            "traces": figures.traces(points.packings, found["comparison"]),
            "spectrum": figures.spectrum(found["force"]["spectrum"]),
            "around": figures.around(found["statements"]),
            "corridor": figures.corridor(found["statements"]["network"]),
        }
        if (effects["field"] != "").any():
            drawn["assumed"] = figures.assumed(effects)
        if found["scalings"]:
            drawn["scaling"] = draw_scalings(found["scalings"])
        return {name: png(figure) for name, figure in drawn.items()}


def render(
    points: Points,
    found: Mapping[str, Any],
    effects: pd.DataFrame,
    peaks: Mapping[str, Any],
    folder: Path,
) -> str:
    """The page: HTML that needs no other file and no network; its figures are in `folder`."""
    assumptions = points.packings[0].case.assumptions
    return render_page(
        "validation/validation.html.j2",
        {"setting": figures.setting_name},
        found=found,
        effects=_records(effects),
        assumptions=assumptions,
        varied=set(effects["field"]),
        points=points,
        peaks=peaks,
        picture=lambda name: file_uri(folder / name),
    )


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows of a table, None where there is no number."""
    known = table.astype(object).where(table.notna(), None)
    return [{str(name): value for name, value in row.items()} for row in known.to_dict("records")]
