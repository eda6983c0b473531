"""The report on a validation: its document, tables, figures and page."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.drag import drag_peaks, read_counted
from dragchain.figures.panels import legend_below, new_panels, row, row_names
from dragchain.figures.style import BLUE, COLOURS, GREY
from dragchain.report.campaign import write_report
from dragchain.run.kinematics import drag_start_s
from dragchain.statistics.estimate import Estimate
from dragdeck.documents import Document
from evidence.validation.force import (
    Compared,
    Effect,
    Force,
    LoadingOverPackings,
    compare_drag,
    effect_table,
    force_of_packings,
    load_of_packings,
    setting_effects,
)
from evidence.validation.runs import MeasuredRun, RunsByBed, read_validation_runs


class Validation(Document):
    """The content of ``validation.json``."""

    study: str
    command: str
    measured: str
    versions: Mapping[str, str]
    engine_hours: float
    force: Force
    comparison: tuple[Compared, ...]
    load: LoadingOverPackings
    effects: tuple[Effect, ...]


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
    DocumentError
        A run has no measures.
    TableError
        Fewer than two packings are complete.
    SeriesError
        There are too few runs to compare settings.
    """
    runs = read_validation_runs(run_dirs)
    first, validation = runs.packings[0], validation_of(runs, command)
    write_report(
        out_dir,
        "validation/validation.html.j2",
        draw=lambda: _draw(runs, validation),
        pictures={"workpiece": (first.folder / "figures" / "workpiece.png").read_bytes()},
        tables=_tables(validation),
        documents={"validation": validation},
        package="evidence",
        found=json.loads(validation.as_text()),
        assumptions=first.case.assumptions,
        varied={row.field for row in validation.effects},
        runs=runs,
    )


def validation_of(runs: RunsByBed, command: str) -> Validation:
    """All numbers of the page."""
    first = runs.packings[0]
    force = force_of_packings(runs.packings)
    return Validation(
        study=first.case.study_name,
        command=command,
        measured=max(run.measures.started for run in runs.all)[:10],
        versions=first.measures.versions,
        engine_hours=sum(run.measures.cost.cpu_time_s for run in runs.all) / 3600.0,
        force=force,
        comparison=compare_drag(force.together["drag_n"], first.case),
        load=load_of_packings(runs.packings),
        effects=tuple(setting_effects(runs)),
    )


def _tables(validation: Validation) -> dict[str, pd.DataFrame]:
    """The numbers of the page as tables, by name."""
    compared = [
        row.model_dump(exclude={"std_ratio"} if row.std_ratio is None else None)
        for row in validation.comparison
    ]
    return {
        "packings": pd.json_normalize(
            [row.model_dump() for row in validation.force.packings], sep="_"
        ),
        "effects": effect_table(validation.effects),
        "load": pd.DataFrame([dict(row) for row in validation.load.rows]),
        "comparison": pd.json_normalize(compared, sep="_"),
    }


# --- figures -----------------------------------------------------------------------------------


def _draw(runs: RunsByBed, validation: Validation) -> dict[str, Figure]:
    """The figures of the page, by name."""
    return {
        "comparison": _comparison(validation.force, validation.comparison, validation.effects),
        "traces": _traces(runs.packings, validation.comparison),
    }


def _traces(packings: Sequence[MeasuredRun], compared: Sequence[Compared]) -> Figure:
    """The drag of every packing over process time, its peaks marked, over the source's band."""
    height = 0.7 + 1.35 * len(packings)
    figure, panels = new_panels(height, len(packings), columns=1, sharex=True, sharey=True)
    for axes, run in zip(panels, packings, strict=True):
        _bands(axes, compared)
        _trace(axes, run)
        axes.set_ylabel("drag force (N)")
    panels[-1].set_xlabel("process time (s)")
    return legend_below(figure)


def _trace(axes: Axes, run: MeasuredRun) -> None:
    samples = read_counted(run.folder, ("time_s", "drag_n"))
    time_s, drag = samples["time_s"].to_numpy(np.float64), samples["drag_n"].to_numpy(np.float64)
    peaks = drag_peaks(samples, run.case)
    zero = drag_start_s(run.case)
    axes.plot(time_s - zero, drag, color=COLOURS["drag"], linewidth=0.5)
    axes.plot(peaks.time_s - zero, peaks.drag_n, "v", color=COLOURS["peak"], label="peak")
    axes.axhline(float(drag.mean()), color="black", linewidth=1.0, label="mean of the packing")
    force = f"{drag.mean():.2f} ± {drag.std(ddof=1):.2f} N"
    axes.set_title(f"packing {run.seed}: {force}, {len(peaks.index)} peaks")


def _bands(axes: Axes, compared: Sequence[Compared]) -> None:
    for reference in compared:
        colour = COLOURS[reference.label]
        axes.axhline(
            reference.mean_n, color=colour, linestyle="--", label=f"{reference.label} mean"
        )
        if reference.std_n and reference.label == "experiment":
            low, high = reference.mean_n - reference.std_n, reference.mean_n + reference.std_n
            label = "experiment, ± one standard deviation"
            axes.axhspan(low, high, color=colour, alpha=0.12, linewidth=0, label=label)


_Row = tuple[str, Estimate, str]
"""Name, value and colour of a row of `_rows`."""


def _comparison(force: Force, compared: Sequence[Compared], effects: Sequence[Effect]) -> Figure:
    """Mean drags: the source's, each packing's with its own interval, and all together."""
    together = force.together["drag_n"].mean
    rows: list[_Row] = [
        (mean.label, Estimate.around(mean.mean_n, 0.0), COLOURS[mean.label]) for mean in compared
    ]
    rows += [
        (f"packing {packing.seed}", packing.drag_n.estimate, BLUE) for packing in force.packings
    ]
    rows.append(("all packings", together, "black"))
    for effect in effects:
        if effect.quantity == "drag_mean" and not effect.field:
            changed = _change(effect).mapped(lambda change: together.value * (1.0 + change))
            rows.append((_fidelity(effect), changed, GREY))
    return _rows(rows, "mean drag (N); bars: 95 % CI")


def _change(effect: Effect) -> Estimate:
    return Estimate(effect.change, effect.ci95_low, effect.ci95_high)


def _fidelity(effect: Effect) -> str:
    name = f"E x {effect.youngs_modulus_scale:g}, {100 * effect.timestep_fraction:g} %"
    return name if effect.speed_factor == 1.0 else f"{name}, speed x {effect.speed_factor:g}"


def _rows(rows: Sequence[_Row], label: str) -> Figure:
    """Values with their intervals, one below the other."""
    figure, (axes,) = new_panels(0.9 + 0.27 * len(rows))
    for place, (_, estimate, colour) in enumerate(rows):
        row(axes, place, estimate.value, estimate, colour)
    row_names(axes, [name for name, *_ in rows])
    axes.set(xlabel=label)
    return figure
