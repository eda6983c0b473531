"""How the mean drag depends on one field of a study: a power law and its test."""

import html
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.figures.style import drawing, png
from dragchain.report.page import page_environment
from dragchain.run.completeness import RunRecord
from dragchain.scaling import document
from dragchain.scaling.figures import draw_scaling
from dragchain.scaling.runs import Run, read_runs
from dragchain.statistics import power_law
from dragchain.statistics.estimate import Estimate, flattened
from dragchain.statistics.power_law_forms import fit_shifted, fit_two_terms
from dragdeck.files import write_bytes, write_text

_STORED = Path(__file__).parent / "data"
"""The scalings that were measured for the documentation."""

_ORDER = ("drag-depth", "drag-diameter", "drag-speed", "drag-friction")
"""The studies of slow drag, in the order of the documentation; others follow."""

SCENE = ("bowl_to_particle", "particle_friction", "lowest_restitution", "particles")
"""Numbers of the scene that a scaling reports."""

_CURVE_POINTS = 41


def find(
    run_dirs: Sequence[Path],
    field: str,
    expected: document.Expectation,
    commands: Sequence[str] = (),
) -> document.ScalingFile:
    """Everything that runs say of a field.

    Parameters
    ----------
    run_dirs : sequence of Path
        Folders of runs, with their tables made.
    field : str
        Dotted name.
    expected : Expectation
    commands : sequence of str
        What made the runs, for the record.

    Raises
    ------
    TableError, SeriesError
        If the runs do not make a scaling.
    """
    runs = read_runs(run_dirs, field)
    law = power_law.fit_power_law(_sample(runs))
    inner = None
    if expected.within is not None:
        inner = power_law.fit_power_law(law.runs.within(*expected.within))
    judged = inner or law
    shaped = expected.exponent is not None and expected.exponent >= 1.0
    power = expected.exponent or 0.0
    first = runs[0].case
    files = [folder / "run.json" for folder in run_dirs]
    records = [RunRecord.read(file) for file in files if file.is_file()]
    return document.ScalingFile(
        study=first.study,
        field=field,
        expected=expected,
        verdict=_verdict(judged.exponent, expected.exponent),
        fit=_fitted(law),
        fit_within=None if inner is None else _fitted(inner),
        two_terms=fit_two_terms(judged, power) if shaped else None,
        shifted=_shifted(judged, power) if shaped else None,
        eta=_mean_eta(runs, judged),
        levels=tuple(_level(law, number, runs) for number in range(len(law.runs.levels))),
        local_exponents=tuple(law.local_exponents()),
        runs=tuple(run.row for run in runs),
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


def _sample(runs: Sequence[Run]) -> power_law.Runs:
    rows = [run.row for run in runs]
    drag = np.array([row.drag_n for row in rows])
    errors = np.array([row.standard_error_n for row in rows]) / drag
    return power_law.Runs(
        np.array([row.level for row in rows]), drag, errors, [row.bed for row in rows]
    )


def _verdict(exponent: Estimate, expected: float | None) -> document.Judged:
    if expected is None:
        return "no expectation"
    return "confirmed" if exponent.contains(expected) else "contradicted"


def _fitted(law: power_law.PowerLaw) -> document.FittedLaw:
    levels = law.runs.levels
    return document.FittedLaw(
        exponent=law.exponent,
        change_per_decade=law.exponent.exp(factor=math.log(10.0), minus=1.0),
        centre=law.runs.centre,
        drag_at_centre_n=law.at(law.runs.centre),
        lowest=float(levels[0]),
        highest=float(levels[-1]),
        runs=len(law.runs.x),
        degrees=law.line.degrees,
        **vars(law.scatter),
        lack_of_fit=law.lack_of_fit,
        curve=tuple(document.BandPoint(x=x, **asdict(law.at(x))) for x in _curve(law)),
    )


def _curve(law: power_law.PowerLaw) -> list[float]:
    """Levels at which a curve is drawn."""
    levels = law.runs.levels
    return [float(x) for x in np.geomspace(levels[0], levels[-1], _CURVE_POINTS)]


def _shifted(law: power_law.PowerLaw, power: float) -> document.ShiftedLaw:
    """The expected power of a shifted level."""
    found = fit_shifted(law, power)
    curve = tuple(document.CurvePoint(x=x, value=found.at(x)) for x in _curve(law))
    return document.ShiftedLaw(**vars(found), curve=curve)


def _mean_eta(runs: Sequence[Run], law: power_law.PowerLaw) -> Estimate:
    """Geometric mean of eta over the runs of a law; a trend in it widens the interval."""
    known = [run.row.eta for run in runs if run.row.level in law.runs.levels]
    etas = replace(law.runs, values=np.array(known))
    constant = np.ones((len(known), 1))
    covariance = etas.covariance(power_law.estimate_scatter(etas, constant))
    fit = power_law.solve(constant, etas.logarithms, covariance, etas.degrees(1))
    return fit.estimate([1.0]).exp()


def _level(law: power_law.PowerLaw, number: int, runs: Sequence[Run]) -> document.Level:
    x = float(law.runs.levels[number])
    here = [run for run in runs if run.row.level == x]
    return document.Level(
        x=x,
        runs=len(here),
        eta=float(np.exp(np.mean([math.log(run.row.eta) for run in here]))),
        inertial_number=here[0].case.numbers.get("inertial_number"),
        gap_particles=here[0].gap_particles,
        floor_particles=float(np.mean([run.floor_particles for run in here])),
        drag_n=law.level(number),
        fitted_n=law.at(x).value,
        deviation=law.deviation(number),
    )


def write_scaling(
    out_dir: Path,
    run_dirs: Sequence[Path],
    field: str,
    expected: document.Expectation,
    commands: Sequence[str] = (),
) -> document.ScalingFile:
    """Write ``scaling.json``, ``scaling.csv`` (one row per level) and ``scaling.png``.

    Raises
    ------
    TableError, SeriesError
        If the runs do not make a scaling.
    """
    found = find(run_dirs, field, expected, commands)
    with drawing():
        picture = png(draw_scaling(found))
    found.write(out_dir / "scaling.json")
    rows = table(found).to_csv(index=False, float_format="%.6g", lineterminator="\n")
    write_text(out_dir / "scaling.csv", rows)
    write_bytes(out_dir / "scaling.png", picture)
    return found


def table(found: document.ScalingFile) -> pd.DataFrame:
    """The levels of a scaling, one row each, intervals as ``*_ci95_low`` and ``*_ci95_high``."""
    exponents = (*found.local_exponents, None)
    rows = [
        flattened({**dict(level), "local_exponent": local})
        for level, local in zip(found.levels, exponents, strict=True)
    ]
    return pd.DataFrame(rows).rename(columns={"x": found.field})


def read_scalings() -> list[document.ScalingFile]:
    """The scalings that come with the package, those of slow drag first."""
    found = [document.ScalingFile.read(file) for file in _STORED.glob("*.json")]
    place = {name: number for number, name in enumerate(_ORDER)}
    return sorted(found, key=lambda one: (place.get(one.study, len(_ORDER)), one.study))


def scaling_command(
    out_dir: Path,
    run_dirs: Sequence[Path],
    field: str,
    expected: float | None,
    source: str | None,
    fit_range: Sequence[float] | None,
    command: str | None,
) -> str:
    """Fit a scaling as the command line asks for; what it says, in words."""
    within = (fit_range[0], fit_range[1]) if fit_range else None
    asked = document.Expectation(exponent=expected, source=source, within=within)
    return said(write_scaling(out_dir, run_dirs, field, asked, [command] if command else []))


def said(found: document.ScalingFile) -> str:
    """What a scaling says in words, one remark per line."""
    template = page_environment().get_template("scaling/said.txt.j2")
    return html.unescape(template.render(found=found)).rstrip()
