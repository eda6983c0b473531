"""Tables, figures and page of the stability map."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from dragchain.figures.style import STYLE, WIDTH_IN, png
from dragchain.files import write_json
from dragchain.report.page import data_uri, render_page
from dragchain.stability import classes as stability
from dragchain.stability.classes import (
    CLASSES,
    ENERGY,
    INACCURATE,
    LOST,
    OVERLAP,
    REFUSED,
    REGIMES,
    STABLE,
    conditions,
    error_table,
    regimes,
)
from dragchain.stability.runs import PointRun, point_table, read_points
from dragchain.tables.parquet import write_parquet

COLOURS = {
    STABLE: "#009E73",
    INACCURATE: "#F0E442",
    OVERLAP: "#56B4E9",
    ENERGY: "#E69F00",
    LOST: "#D55E00",
    REFUSED: "#8a929b",
}
"""After Okabe and Ito (2008): told apart with any kind of colour vision."""

LETTERS = {STABLE: "", INACCURATE: "i", OVERLAP: "o", ENERGY: "e", LOST: "L", REFUSED: "x"}

TITLES = {
    "impact": "Single impacts (16 in each run, each met at another moment within a step)",
    "settle": "Settling: 300 particles fall into a bowl",
    "column": "At rest under a load: the settled bed, or a stack in a tube",
    "drag": "Slow drag: a workpiece goes in and is dragged through the bed",
}


def write_stability(out_dir: Path, lists: Sequence[Path]) -> None:
    """Write tables, figures and page of a map whose points were run.

    Parameters
    ----------
    out_dir : Path
        Gets ``points.csv``, ``points.parquet``, ``conditions.csv``, ``conditions.parquet``,
        ``stability.json``, ``figures/*.png`` and ``report.html``.
    lists : sequence of Path
        ``points/<regime>.json``, as ``dragdeck stability`` wrote them.

    Raises
    ------
    TableError
        A list or a run cannot be used, or a run was interrupted.
    """
    runs = read_points(lists)
    points = point_table(runs)
    found = conditions(points)
    summary = summarise(points, found, runs)
    out_dir.mkdir(parents=True, exist_ok=True)
    for name, table in (("points", points), ("conditions", found)):
        write_parquet(table, out_dir / f"{name}.parquet")
        table.to_csv(out_dir / f"{name}.csv", index=False, lineterminator="\n")
    with matplotlib.rc_context(STYLE):
        pictures = {name: png(figure) for name, figure in draw(points, found, summary).items()}
    folder = out_dir / "figures"
    folder.mkdir(exist_ok=True)
    for name, picture in pictures.items():
        (folder / f"{name}.png").write_bytes(picture)
    write_json(out_dir / "stability.json", summary)
    page = render(points, found, summary, pictures)
    (out_dir / "report.html").write_text(page, encoding="utf-8")


def summarise(
    points: pd.DataFrame, found: pd.DataFrame, runs: Sequence[PointRun]
) -> dict[str, Any]:
    """What ``dragdeck check`` uses: safe steps, errors of impacts, and where they come from."""
    engines, versions, wall, started = set(), set(), 0.0, []
    for run in runs:
        file = run.folder / "state.json"
        if file.is_file():
            state = json.loads(file.read_text(encoding="utf-8"))
            engines.add(str(state["engine_version"]))
            wall += float(state.get("wall_time_s") or 0.0)
            started.append(str(state["started"]))
            versions.add(str(run.case["versions"]["dragdeck"]))
    return {
        "schema": 2,
        "commands": ["snakemake stability"],
        "engine_versions": sorted(engines),
        "dragdeck_versions": sorted(versions),
        "measured": max(started, default=datetime.now(UTC).isoformat())[:10],
        "points": len(points),
        "engine_wall_time_s": round(wall, 1),
        "safety_factor": stability.SAFETY_FACTOR,
        "criteria": {
            "tolerance": stability.TOLERANCE,
            "overlap_limit": stability.OVERLAP_LIMIT,
            "energy_limits": dict(stability.ENERGY_LIMITS),
            "rest_floor": stability.REST_FLOOR,
        },
        "regimes": {row.pop("regime"): _finite(row) for row in regimes(found)},
        "restitution_error": error_table(points),
    }


def _finite(row: dict[str, Any]) -> dict[str, Any]:
    return {
        name: (
            (None if math.isnan(value) else float(f"{value:.4g}"))
            if isinstance(value, float)
            else value
        )
        for name, value in row.items()
    }


# --- figures ---------------------------------------------------------------------------------


def draw(
    points: pd.DataFrame, found: pd.DataFrame, summary: Mapping[str, Any]
) -> dict[str, Figure]:
    """All figures by name."""
    drawn = {
        f"map_{regime}": _map(points, found, regime)
        for regime in REGIMES
        if (points["regime"] == regime).any()
    }
    if summary["restitution_error"]["steps_per_contact"]:
        drawn["restitution_error"] = _errors(points, summary["restitution_error"])
    drawn["fraction_of_critical"] = _fractions(points)
    return drawn


def _map(points: pd.DataFrame, found: pd.DataFrame, regime: str) -> Figure:
    """Conditions down, steps across, a colour and a letter a class."""
    own = points[(points["regime"] == regime) & ~points["reference"]]
    rows = found[found["regime"] == regime].reset_index(drop=True)
    steps = np.sort(own["fraction"].unique())
    figure = Figure(figsize=(WIDTH_IN, 1.5 + 0.24 * len(rows)), layout="constrained")
    axes = figure.add_subplot()
    columns = {step: n for n, step in enumerate(steps)}
    lines = {condition: n for n, condition in enumerate(rows["condition"])}
    for _, point in own.iterrows():
        _cell(axes, columns[point["fraction"]], lines[point["condition"]], point["class"])
    for n, row in rows.iterrows():
        _mark_critical(axes, int(str(n)), row, steps)
    axes.set_xlim(-0.5, len(steps) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xticks(range(len(steps)), [f"{100 * step:g}" for step in steps])
    axes.set_yticks(range(len(rows)), rows["label"].tolist(), fontsize=7.5)
    axes.set_xlabel("time step in % of the Rayleigh time of the smallest particle")
    figure.suptitle(TITLES[regime], x=0.01, ha="left", fontsize=9.5)
    axes.grid(False)
    axes.tick_params(length=0)
    _legend(figure, own)
    return figure


def _cell(axes: Axes, column: int, line: int, kind: str) -> None:
    axes.add_patch(
        Rectangle((column - 0.48, line - 0.44), 0.96, 0.88, facecolor=COLOURS[kind], lw=0)
    )
    axes.text(column, line, LETTERS[kind], ha="center", va="center", fontsize=7, color="#1d2733")


def _mark_critical(axes: Axes, line: int, row: pd.Series[Any], steps: np.ndarray[Any, Any]) -> None:
    """Where the network's critical step lies, without and with the contact's damping."""
    place = np.arange(len(steps))
    for fraction, style in ((1.0, "-"), (row["damped_fraction"], ":")):
        at = row["critical_over_rayleigh"] * fraction
        if math.isfinite(at) and steps[0] <= at <= steps[-1]:
            x = float(np.interp(math.log(at), np.log(steps), place))
            axes.plot([x, x], [line - 0.44, line + 0.44], style, color="#1d2733", lw=1.6)


def _legend(figure: Figure, own: pd.DataFrame) -> None:
    kinds = [kind for kind in CLASSES if (own["class"] == kind).any()]
    handles: list[Patch | Line2D] = [
        Patch(facecolor=COLOURS[k], label=f"{LETTERS[k]} {k}".strip()) for k in kinds
    ]
    handles += [
        Line2D([], [], color="#1d2733", lw=1.6, label="critical step of the network"),
        Line2D([], [], color="#1d2733", lw=1.6, ls=":", label="the same, damped"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8)


def _errors(points: pd.DataFrame, table: Mapping[str, Sequence[float]]) -> Figure:
    figure = Figure(figsize=(WIDTH_IN, 3.6), layout="constrained")
    axes = figure.add_subplot()
    usable = points[points["reference"] & (points["class"] == STABLE)]["condition"]
    own = points[
        (points["regime"] == "impact")
        & ~points["reference"]
        & (points["setting_angle_deg"] == 0.0)
        & points["condition"].isin(usable)
        & points["restitution_error"].notna()
    ]
    shades = axes.scatter(
        own["steps_per_contact"],
        own["restitution_error"].abs().clip(lower=1e-6),
        c=own["setting_restitution"],
        cmap="viridis",
        s=16,
        vmin=0.0,
        vmax=1.0,
    )
    steps = table["steps_per_contact"]
    axes.plot(steps, table["worst"], color="#D55E00", label="largest, any restitution")
    axes.plot(steps, table["ordinary_worst"], color="#0072B2", label="largest, e of 0.5 or more")
    axes.plot(steps, table["median"], color="#1d2733", label="median")
    axes.axhline(stability.TOLERANCE, color="#6b7480", ls="--", lw=1, label="tolerance of the map")
    axes.set(xscale="log", yscale="log", ylim=(5e-6, 10))
    axes.set_xlabel("steps per contact (elastic Hertz contact time over time step)")
    axes.set_ylabel("largest error of restitution in a run")
    axes.set_title("Single impacts: error of restitution against the fine step")
    axes.legend(loc="upper right")
    figure.colorbar(shades, label="restitution in the deck")
    return figure


def _fractions(points: pd.DataFrame) -> Figure:
    """Every point over its step as a share of the Rayleigh time and of the critical step."""
    figure = Figure(figsize=(WIDTH_IN, 4.2), layout="constrained")
    for n, (column, label) in enumerate(
        (
            ("fraction", "step over the Rayleigh time"),
            ("fraction_of_critical", "step over the critical step"),
        )
    ):
        axes = figure.add_subplot(1, 2, n + 1)
        for line, regime in enumerate(REGIMES):
            own = points[(points["regime"] == regime) & ~points["reference"]]
            own = own[np.isfinite(own[column])]
            if own.empty:
                continue
            names = {name: n for n, name in enumerate(own["condition"].unique())}
            spread = np.linspace(-0.36, 0.36, len(names)) if len(names) > 1 else np.zeros(1)
            place = line + spread[[names[name] for name in own["condition"]]]
            axes.scatter(own[column], place, c=[COLOURS[k] for k in own["class"]], s=9, lw=0)
        axes.axvline(stability.RULE if n == 0 else 1.0, color="#1d2733", ls="--", lw=1)
        axes.set(xscale="log", xlabel=label, yticks=range(len(REGIMES)), ylim=(3.5, -0.5))
        axes.set_yticklabels(REGIMES if n == 0 else [])
    kinds = [kind for kind in CLASSES if (points["class"] == kind).any()]
    handles = [Patch(facecolor=COLOURS[kind], label=kind) for kind in kinds]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(kinds), fontsize=8)
    return figure


CAPTIONS = {
    "map_impact": "Every cell is a run. The full line marks the critical step of the contact at "
    "its largest overlap, the dotted line the same with the contact's damping.",
    "map_settle": "The critical step is that of the settled bed's contacts; a bed that still "
    "falls has harder contacts, so its limit lies lower.",
    "map_column": "A stable step leaves the particles at rest. The critical step is that of the "
    "loaded contacts before the step under test begins.",
    "map_drag": "The critical step is that of the stiffest of up to eight frames of the drag.",
    "restitution_error": "Head-on impacts of all conditions with a stable reference. The table of "
    "dragdeck check is the two lines of the largest errors.",
    "fraction_of_critical": "Left: against the Rayleigh time, with the 20 % rule. Right: "
    "against the "
    "critical step of the contact network. A line of dots is a condition.",
}


# --- page ------------------------------------------------------------------------------------


def render(
    points: pd.DataFrame,
    found: pd.DataFrame,
    summary: Mapping[str, Any],
    pictures: Mapping[str, bytes],
) -> str:
    """The page: HTML that needs no other file and no network."""
    table = summary["restitution_error"]
    return render_page(
        "stability/stability.html.j2",
        summary=summary,
        titles=TITLES,
        classes=_class_counts(points),
        axes=_axis_counts(points),
        conditions=found.to_dict("records"),
        errors=[dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)],
        refusals=_refusals(points),
        early=int(points["why"].str.contains("stopped early").sum()),
        pictures=[
            {"name": name, "caption": CAPTIONS[name], "uri": data_uri(data)}
            for name, data in pictures.items()
        ],
        rule=stability.RULE,
    )


def _class_counts(points: pd.DataFrame) -> list[dict[str, Any]]:
    own = points[~points["reference"]]
    counts = Counter(zip(own["regime"], own["class"], strict=True))
    return [
        {"regime": regime, **{kind: counts[regime, kind] for kind in CLASSES}}
        for regime in REGIMES
        if (own["regime"] == regime).any()
    ]


def _axis_counts(points: pd.DataFrame) -> list[dict[str, Any]]:
    """How many conditions and runs each axis got: which are thin."""
    rows = []
    for (regime, axis), group in points.groupby(["regime", "axis"], sort=False):
        labels = list(dict.fromkeys(group["label"]))
        values = "" if axis == "more" else "; ".join(labels)
        rows.append(
            {
                "regime": regime,
                "axis": axis,
                "conditions": len(labels),
                "runs": len(group),
                "values": values,
            }
        )
    return rows


def _refusals(points: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(points.loc[points["class"] == REFUSED, "why"]))
