"""How the mean drag depends on one field of a study: runs, power law and its figure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.errors import SeriesError, TableError
from dragchain.figures.panels import legend_below, log_ticks, new_panels
from dragchain.figures.style import BLUE, INK, ORANGE, WIDTH_IN, drawing, png
from dragchain.quantities.document import MEASURED_FILE, RunQuantities
from dragchain.run.case import changed_inputs, study_of
from dragchain.run.kinematics import motion_of, needed
from dragchain.scaling.document import Expectation, FittedLaw, Level, ScaledRun, ScalingFile
from dragchain.statistics.bed_effects import EffectsFit, fit_effects
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate, EstimateColumns
from dragdeck.files import write_bytes, write_text
from dragdeck.project import find_project, scaling_of
from dragdeck.records.case import CaseOfRun, load_case
from dragdeck.records.run import RunRecord
from dragdeck.study.model import Scaling
from dragdeck.study.paths.circle import CirclePath

SCENE = ("bowl_to_particle", "particle_friction", "lowest_restitution", "particles")
"""Numbers of the scene that a scaling reports."""

_CURVE_POINTS = 41

_LEAST_LEVELS = 3
"""A line through two levels always fits."""

# --- the runs --------------------------------------------------------------------------------


def read_scaled_runs(run_dirs: Sequence[Path], field: str) -> list[tuple[ScaledRun, CaseOfRun]]:
    """Read the runs of a scaling with their cases, ordered by level and bed.

    Raises
    ------
    TableError
        If a run has no such field or no number there, the mean drag does not
        point against the motion, or runs differ in more than the field and the seed.
    """
    cases = {case.run: (folder, case) for folder in run_dirs for case in [load_case(folder)]}
    _check_alike([case for _, case in cases.values()], field)
    runs = [(_scaled_run(folder, case, field), case) for folder, case in cases.values()]
    return sorted(runs, key=lambda run: (run[0].level, run[0].bed))


def _scaled_run(folder: Path, case: CaseOfRun, field: str) -> ScaledRun:
    study = study_of(case)
    level = study.inputs().get(field)
    if isinstance(level, bool) or not isinstance(level, int | float) or level <= 0:
        raise TableError(f"{folder}: field {field} is {level!r}, a power law needs numbers above 0")
    drag = RunQuantities.read(folder / MEASURED_FILE).values_of_run["drag_mean"]
    if drag.value >= 0.0:
        raise TableError(f"{folder}: the mean drag is {drag.value:+.3g} N, along the motion")
    workpiece = needed(case.workpiece, "workpiece")
    weight = case.media.weight_kg_m3 * case.gravity_m_s2 * 2.0 * workpiece.radius_m
    return ScaledRun(
        run=case.run,
        seed=study.seed,
        level=float(level),
        drag_n=-drag.value,
        standard_error_n=drag.half_width / NORMAL_QUANTILE,
        reliable=drag.reliable,
        eta=-drag.value / (weight * workpiece.immersion_depth_m**2),
        bed=case.upstream.get("filling", case.run),
    )


def _check_alike(cases: Sequence[CaseOfRun], field: str) -> None:
    """Refuse runs that differ in more than the field and the seed."""
    first, *others = (
        {**study_of(case).inputs(), "fidelity": case.fidelity.model_dump()} for case in cases
    )
    for case, inputs in zip(cases[1:], others, strict=True):
        changed = [name for name in changed_inputs(inputs, first) if name not in (field, "seed")]
        if changed:
            raise TableError(
                f"{case.run}: {changed[0]} is {inputs.get(changed[0])!r}, in {cases[0].run} it is "
                f"{first.get(changed[0])!r}; the runs of a scaling differ in {field} and seed only"
            )


# --- the law ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class PowerLaw:
    """``drag = a x^n``, fitted to the logarithms of the mean drags of runs.

    Attributes
    ----------
    levels : (L,) ndarray
        The different levels, rising.
    fit : EffectsFit
        Logarithm of the drag at the centre of the levels, and n.
    """

    levels: Floats
    fit: EffectsFit

    @cached_property
    def centre(self) -> float:
        """Geometric mean of the levels."""
        return float(np.exp(np.mean(np.log(self.levels))))

    @property
    def exponent(self) -> Estimate:
        """The exponent n."""
        return self.fit.estimate([0.0, 1.0])

    def at(self, x: float) -> Estimate:
        """The drag at a level, N."""
        return self.fit.estimate([1.0, math.log(x / self.centre)]).exp()


def fit_power_law(rows: Sequence[ScaledRun]) -> PowerLaw:
    """Fit a power law to the mean drags of runs that partly share beds.

    Raises
    ------
    SeriesError
        If there are too few levels or runs.
    """
    x = np.array([row.level for row in rows])
    levels = np.unique(x)
    if len(levels) < _LEAST_LEVELS:
        raise SeriesError(
            f"{len(levels)} level(s) are too few to test a power law: use {_LEAST_LEVELS} or more"
        )
    design = np.column_stack([np.ones(len(x)), np.log(x) - np.mean(np.log(levels))])
    drag = np.log([row.drag_n for row in rows])
    return PowerLaw(levels, fit_effects(design, drag, [row.bed for row in rows]))


def find(run_dirs: Sequence[Path], asked: Scaling, commands: Sequence[str] = ()) -> ScalingFile:
    """The power law of a field from runs.

    Parameters
    ----------
    run_dirs : sequence of Path
        Folders of runs, with their tables made.
    asked : Scaling
        The field, and what is expected of it.
    commands : sequence of str
        What made the runs, for the record.

    Raises
    ------
    TableError, SeriesError
        If the runs do not make a scaling.
    """
    runs = read_scaled_runs(run_dirs, asked.field)
    low, high = asked.fit_range or (0.0, math.inf)
    fitted = [row for row, _ in runs if low <= row.level <= high]
    law, expected, first = fit_power_law(fitted), asked.expected_exponent, runs[0][1]
    files = [folder / "run.json" for folder in run_dirs]
    records = [RunRecord.read(file) for file in files if file.is_file()]
    levels = dict[float, list[tuple[ScaledRun, CaseOfRun]]]()
    for row, case in runs:
        levels.setdefault(row.level, []).append((row, case))
    return ScalingFile(
        study=first.study_name,
        field=asked.field,
        expected=Expectation(exponent=expected, source=asked.source, within=asked.fit_range),
        verdict="no expectation" if expected is None else law.exponent.agrees_with(expected),
        fit=FittedLaw(
            exponent=law.exponent,
            change_per_decade=law.exponent.exp(factor=math.log(10.0), minus=1.0),
            runs=len(fitted),
        ),
        eta=_mean_eta(fitted),
        levels=tuple(_level(law, level, of_level) for level, of_level in levels.items()),
        runs=tuple(row for row, _ in runs),
        scene={
            **{name: float(first.numbers[name]) for name in SCENE if name in first.numbers},
            "particle_diameter_m": 2.0 * first.media.radius_mean_m,
        },
        fidelity=first.fidelity,
        versions=first.versions,
        commands=tuple(commands),
        started=min((record.started for record in records), default=None),
        engine=records[0].engine_version if records else None,
        cpu_time_s=sum(record.cpu_time_s for record in records) if records else None,
    )


def _mean_eta(rows: Sequence[ScaledRun]) -> Estimate:
    """Geometric mean of eta over runs; a trend in it widens the interval."""
    etas = np.log([row.eta for row in rows])
    fit = fit_effects(np.ones((len(rows), 1)), etas, [row.bed for row in rows])
    return fit.estimate([1.0]).exp()


def _level(law: PowerLaw, level: float, runs: Sequence[tuple[ScaledRun, CaseOfRun]]) -> Level:
    rows, cases = [row for row, _ in runs], [case for _, case in runs]
    return Level(
        x=level,
        runs=len(rows),
        eta=_geometric_mean([row.eta for row in rows]),
        inertial_number=cases[0].numbers.get("inertial_number"),
        gap_particles=gap_particles(cases[0]),
        floor_particles=float(np.mean([floor_particles(case) for case in cases])),
        drag_n=_geometric_mean([row.drag_n for row in rows]),
        fitted_n=law.at(level).value,
    )


def gap_particles(case: CaseOfRun) -> float | None:
    """Gap between workpiece and bowl wall in mean particle diameters; None off a circle."""
    path = motion_of(case).motion.path
    if not isinstance(path, CirclePath):
        return None
    bowl, workpiece = needed(case.bowl, "bowl"), needed(case.workpiece, "workpiece")
    gap = float(bowl.side_distance(np.array([path.start_point]))[0]) - workpiece.radius_m
    return gap / (2.0 * case.media.radius_mean_m)


def floor_particles(case: CaseOfRun) -> float:
    """Gap between tip and floor in mean particle diameters."""
    depth = needed(case.workpiece, "workpiece").immersion_depth_m
    return (needed(case.surface_m, "surface_m") - depth) / (2.0 * case.media.radius_mean_m)


def _geometric_mean(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))


def write_scaling(study: str, out_dir: Path, run_dirs: Sequence[Path], command: str) -> str:
    """Write ``scaling.json``, ``scaling.csv`` (one row per level) and ``scaling.png``.

    Parameters
    ----------
    study : str
        Its name.
    out_dir : Path
    run_dirs : sequence of Path
        Folders of its runs, with their tables made.
    command : str
        What made the runs, for the record.

    Returns
    -------
    str
        What the scaling says in words.

    Raises
    ------
    InputError
        The study asks for no scaling.
    TableError, SeriesError
        If the runs do not make a scaling.
    """
    scaling = find(run_dirs, scaling_of(find_project(Path.cwd()).cases(study)[0]), [command])
    with drawing():
        picture = png(draw_scalings([scaling]))
    scaling.write(out_dir / "scaling.json")
    rows = table(scaling).to_csv(index=False, float_format="%.6g", lineterminator="\n")
    write_text(out_dir / "scaling.csv", rows)
    write_bytes(out_dir / "scaling.png", picture)
    return said(scaling)


def table(scaling: ScalingFile) -> pd.DataFrame:
    """The levels of a scaling, one row each."""
    return pd.DataFrame(map(dict, scaling.levels)).rename(columns={"x": scaling.field})


def said(scaling: ScalingFile) -> str:
    """The exponent, and whether its confidence interval contains the expected one."""
    expected = scaling.expected
    words = f"{scaling.field}: exponent {_rounded(scaling.fit.exponent)}"
    if expected.exponent is None:
        return words
    source = f" ({expected.source})" if expected.source else ""
    return f"{words}; expected {expected.exponent:g}{source}: {scaling.verdict}"


def _rounded(exponent: Estimate) -> str:
    value, low, high = (
        f"{round(number, 2) + 0.0:.2f}"
        for number in (exponent.value, exponent.ci95_low, exponent.ci95_high)
    )
    return f"{value} ({low} to {high})"


# --- the figure ------------------------------------------------------------------------------

_LEAST_SPAN = 2.5
"""An axis of drag spans at least this factor, so that chance does not look like a trend."""

_PAD = 1.12
_SIDEWAYS = 0.015
"""Runs of a level stand side by side, this part of the level apart."""

_TICKS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)


def draw_scalings(scalings: Sequence[ScalingFile]) -> Figure:
    """Runs, means of the levels, the law with its band and the expected slope of each scaling."""
    width = (0.72 if len(scalings) == 1 else 1.2) * WIDTH_IN
    height = 3.35 * math.ceil(len(scalings) / 2) + 0.55
    figure, panels = new_panels(height, len(scalings), width, 2)
    for axes, scaling in zip(panels, scalings, strict=True):
        label, unit, factor = scaling.axis
        axes.set(xscale="log", yscale="log", ylabel="mean drag force magnitude (N)")
        axes.set(xlabel=f"{label} ({unit})" if unit else label, title=_title(scaling))
        _law(axes, scaling, factor)
        _points(axes, scaling, factor)
        _ticks(axes, scaling, factor)
    return legend_below(figure)


def _title(scaling: ScalingFile) -> str:
    words, expected = f"exponent {_rounded(scaling.fit.exponent)}", scaling.expected.exponent
    return words if expected is None else f"{words}, expected {expected:g}: {scaling.verdict}"


def _law(axes: Axes, scaling: ScalingFile, factor: float) -> None:
    law = fit_power_law(scaling.fitted)
    level = np.geomspace(law.levels[0], law.levels[-1], _CURVE_POINTS)
    drag = EstimateColumns.of([law.at(float(x)) for x in level])
    x = factor * level
    axes.fill_between(
        x, drag.ci95_low, drag.ci95_high, color=BLUE, alpha=0.15, lw=0, label="95 % confidence band"
    )
    axes.plot(x, drag.value, color=BLUE, lw=1.8, label="fitted power law")
    if scaling.expected.exponent is not None:
        slope = (x / (factor * law.centre)) ** scaling.expected.exponent
        slope *= law.at(law.centre).value
        axes.plot(x, slope, "--", color=ORANGE, lw=1.4, label="expected slope")


def _points(axes: Axes, scaling: ScalingFile, factor: float) -> None:
    levels = [level for level in scaling.levels if level.runs > 1]
    x = [factor * level.x for level in levels]
    means = [level.drag_n for level in levels]
    axes.plot(x, means, "_", ms=17, mew=2.0, color=INK, label="mean per level")
    x = [factor * place for place in _beside(scaling.runs)]
    drag, error = zip(*((run.drag_n, run.standard_error_n) for run in scaling.runs), strict=True)
    label = "run, ± standard error"
    axes.errorbar(x, drag, error, color=INK, fmt="o", mfc="white", zorder=3, label=label)


def _beside(runs: Sequence[ScaledRun]) -> list[float]:
    """Levels of runs, those of beds side by side."""
    beds = sorted({run.bed for run in runs})
    middle = 0.5 * (len(beds) - 1)
    return [run.level * (1.0 + _SIDEWAYS * (beds.index(run.bed) - middle)) for run in runs]


def _ticks(axes: Axes, scaling: ScalingFile, factor: float) -> None:
    """Every level on the horizontal axis, round numbers on the vertical."""
    levels = [factor * level.x for level in scaling.levels]
    axes.set_xlim(levels[0] / _PAD, levels[-1] * _PAD)
    low, high = axes.get_ylim()
    stretch = max(1.0, math.sqrt(_LEAST_SPAN * low / high))
    low, high = low / stretch, high * stretch
    axes.set_ylim(low, high)
    log_ticks(axes.yaxis, steps=(1.0, 2.0, 5.0) if high > 12.0 * low else _TICKS)
    axes.set_xticks(levels, [f"{level:g}" for level in levels])
    axes.minorticks_off()
