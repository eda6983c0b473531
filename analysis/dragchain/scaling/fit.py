"""How the mean drag depends on one field of a study: a power law and its test."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd

from dragchain.drag.force import summarise_forces
from dragchain.errors import TableError
from dragchain.figures.style import STYLE, png
from dragchain.files import write_json
from dragchain.run.case import Case, Circle, load_case
from dragchain.run.completeness import RunRecord
from dragchain.run.kinematics import needed
from dragchain.scaling.figures import draw_scaling, draw_scalings
from dragchain.scaling.words import interval, remarks
from dragchain.statistics.estimate import CONFIDENCE, Estimate
from dragchain.statistics.power_law import (
    PowerLaw,
    Runs,
    estimate_scatter,
    fit_power_law,
    solve,
)
from dragchain.statistics.power_law_forms import fit_shifted, fit_two_terms

__all__ = ["Expectation", "Run", "draw_scalings", "find", "read_runs", "read_scalings"]

SCHEMA = 2
STORED = "scaling/data"
"""Folder in the package of the scalings that were measured for the documentation."""

ORDER = ("drag-depth", "drag-diameter", "drag-speed", "drag-friction")
"""The studies of slow drag, in the order of the documentation; others follow."""

UNLIKE = frozenset({"seed"})
"""Inputs that runs of one scaling may differ in, beside its field."""

CURVE_POINTS = 41


@dataclass(frozen=True)
class Expectation:
    """What is expected of a field.

    Attributes
    ----------
    exponent : float or None
    source : str or None
        Where the exponent comes from.
    within : (float, float) or None
        Levels for which it is meant; all if None.
    """

    exponent: float | None = None
    source: str | None = None
    within: tuple[float, float] | None = None


@dataclass(frozen=True)
class Run:
    """One run of a scaling.

    Attributes
    ----------
    name, bed : str
    level : float
        Value of the field.
    drag_n, standard_error_n : float
        Size of the mean drag and its standard error, autocorrelation counted, N.
    reliable : bool
        Whether the series was long enough to rely on that error.
    eta : float
        Drag over ``rho g d H^2``, with d the diameter of the workpiece, H the depth
        of its tip and rho the density of a particle (Albert et al. 1999, Phys. Rev.
        Lett. 82, 205).
    inertial_number : float or None
    gap_particles : float or None
        Gap between workpiece and bowl wall in mean particle diameters; None off a circle.
    floor_particles : float
        Gap between tip and floor in mean particle diameters.
    case : Case
    """

    name: str
    bed: str
    level: float
    drag_n: float
    standard_error_n: float
    reliable: bool
    eta: float
    inertial_number: float | None
    gap_particles: float | None
    floor_particles: float
    case: Case


def read_runs(run_dirs: Sequence[Path], field: str) -> list[Run]:
    """Read the runs of a scaling from their tables, ordered by level and bed.

    Raises
    ------
    TableError
        If a run has no such field or no number there, the mean drag does not
        point against the motion, or runs differ in more than the field and the seed.
    """
    runs = [_read_run(folder, field) for folder in run_dirs]
    _check_alike(runs, field)
    return sorted(runs, key=lambda run: (run.level, run.bed))


def _read_run(folder: Path, field: str) -> Run:
    case = load_case(folder)
    level = case.inputs.get(field)
    if isinstance(level, bool) or not isinstance(level, int | float) or level <= 0:
        raise TableError(f"{folder}: field {field} is {level!r}, a power law needs numbers above 0")
    drag = summarise_forces(folder)["drag_n"]
    if drag.mean >= 0.0:
        raise TableError(f"{folder}: the mean drag is {drag.mean:+.3g} N, along the motion")
    workpiece, surface = needed(case.workpiece, "workpiece"), needed(case.surface_m, "surface_m")
    diameter = 2.0 * case.media.radius_mean_m
    weight = case.media.density_kg_m3 * case.gravity_m_s2 * 2.0 * workpiece.radius_m
    return Run(
        name=case.run,
        bed=case.upstream.get("filling", case.run),
        level=float(level),
        drag_n=-drag.mean,
        standard_error_n=drag.se,
        reliable=drag.reliable,
        eta=-drag.mean / (weight * workpiece.immersion_depth_m**2),
        inertial_number=case.numbers.get("inertial_number"),
        gap_particles=_gap_particles(case),
        floor_particles=(surface - workpiece.immersion_depth_m) / diameter,
        case=case,
    )


def _gap_particles(case: Case) -> float | None:
    """Gap between the workpiece and the bowl's wall on a circle, mean particle diameters."""
    if not isinstance(case.motion, Circle):
        return None
    bowl, workpiece = needed(case.bowl, "bowl"), needed(case.workpiece, "workpiece")
    gap = bowl.radius_m - case.motion.radius_m - workpiece.radius_m
    return gap / (2.0 * case.media.radius_mean_m)


def _check_alike(runs: Sequence[Run], field: str) -> None:
    first = runs[0].case
    for run in runs:
        same = {**run.case.inputs, "fidelity": run.case.fidelity}
        for name, value in {**first.inputs, "fidelity": first.fidelity}.items():
            if name not in (field, *UNLIKE) and same.get(name) != value:
                raise TableError(
                    f"{run.name}: {name} is {same.get(name)!r}, in {runs[0].name} it is {value!r}; "
                    f"the runs of a scaling differ in {field} and seed only"
                )


def find(runs: Sequence[Run], field: str, expected: Expectation) -> dict[str, Any]:
    """Everything that the runs say of a field, as plain data for ``scaling.json``.

    Parameters
    ----------
    runs : sequence of Run
    field : str
    expected : Expectation

    Returns
    -------
    dict
        See docs/scaling.md.
    """
    law = fit_power_law(_sample(runs))
    inner = None
    if expected.within is not None:
        inner = fit_power_law(law.runs.within(*expected.within))
    judged = inner or law
    found = {
        "schema": SCHEMA,
        "study": runs[0].case.study,
        "field": field,
        "confidence": CONFIDENCE,
        "expected": {
            "exponent": expected.exponent,
            "source": expected.source,
            "within": expected.within,
        },
        "verdict": _verdict(judged.exponent, expected.exponent),
        "statement": statement(judged.exponent, expected),
        "fit": _plain(law),
        "fit_within": None if inner is None else _plain(inner),
        **_other_forms(judged, expected.exponent),
        "eta": asdict(_mean_eta(runs, judged)),
        "levels": _levels(law, runs),
        "local_exponents": [asdict(one) for one in law.local_exponents()],
        "runs": [_row(run) for run in runs],
        "scene": _scene(runs),
        "fidelity": vars(runs[0].case.fidelity),
        "versions": dict(runs[0].case.versions),
    }
    return {**found, "remarks": remarks(found)}


def _sample(runs: Sequence[Run]) -> Runs:
    drag = np.array([run.drag_n for run in runs])
    errors = np.array([run.standard_error_n for run in runs]) / drag
    return Runs(np.array([run.level for run in runs]), drag, errors, [run.bed for run in runs])


def _verdict(exponent: Estimate, expected: float | None) -> str:
    if expected is None:
        return "no expectation"
    return "agrees" if exponent.contains(expected) else "deviates"


def statement(exponent: Estimate, expected: Expectation) -> str:
    """The exponent and whether its interval holds what is expected, in one sentence."""
    found = f"exponent {interval(asdict(exponent))}"
    if expected.exponent is None:
        return found
    source = f" of {expected.source}" if expected.source else ""
    verb = "holds" if exponent.contains(expected.exponent) else "excludes"
    verdict = _verdict(exponent, expected.exponent)
    return f"{verdict}: {found}, the interval {verb} the {expected.exponent:g}{source}"


def _plain(law: PowerLaw) -> dict[str, Any]:
    levels = law.runs.levels
    return {
        "exponent": asdict(law.exponent),
        "change_per_decade": asdict(law.exponent.exp(factor=math.log(10.0), minus=1.0)),
        "centre": law.runs.centre,
        "drag_at_centre_n": asdict(law.at(law.runs.centre)),
        "from": float(levels[0]),
        "to": float(levels[-1]),
        "runs": len(law.runs.x),
        "degrees": law.line.degrees,
        "spread": law.scatter.spread,
        "bed_fraction": law.scatter.bed_fraction,
        "lack_of_fit": law.lack_of_fit,
        "curve": [{"x": x, **asdict(law.at(x))} for x in _curve(law)],
    }


def _curve(law: PowerLaw) -> list[float]:
    """Levels at which a curve is drawn."""
    levels = law.runs.levels
    return [float(x) for x in np.geomspace(levels[0], levels[-1], CURVE_POINTS)]


def _other_forms(law: PowerLaw, power: float | None) -> dict[str, Any]:
    """The expected power with a lower one beside it, and of a shifted level, if there is one."""
    if power is None or power < 1.0:
        return {"two_terms": None, "shifted": None}
    shifted = fit_shifted(law, power)
    curve = [{"x": x, "value": shifted.at(x)} for x in _curve(law)]
    return {
        "two_terms": asdict(fit_two_terms(law, power)),
        "shifted": {**asdict(shifted), "curve": curve},
    }


def _mean_eta(runs: Sequence[Run], law: PowerLaw) -> Estimate:
    """Geometric mean of eta over the runs of a law; a trend in it widens the interval."""
    known = [run for run in runs if run.level in law.runs.levels]
    etas = replace(law.runs, values=np.array([run.eta for run in known]))
    constant = np.ones((len(known), 1))
    covariance = etas.covariance(estimate_scatter(etas, constant))
    fit = solve(constant, etas.logarithms, covariance, etas.degrees(1))
    return fit.estimate([1.0]).exp()


def _levels(law: PowerLaw, runs: Sequence[Run]) -> list[dict[str, Any]]:
    return [
        {
            "x": float(x),
            **_of_level([run for run in runs if run.level == x]),
            "drag_n": asdict(law.level(number)),
            "fitted_n": law.at(float(x)).value,
            "deviation": _or_none(law.deviation(number)),
        }
        for number, x in enumerate(law.runs.levels)
    ]


def _or_none(estimate: Estimate | None) -> dict[str, float] | None:
    return None if estimate is None else asdict(estimate)


def _of_level(runs: Sequence[Run]) -> dict[str, Any]:
    return {
        "runs": len(runs),
        "eta": float(np.exp(np.mean([math.log(run.eta) for run in runs]))),
        "inertial_number": runs[0].inertial_number,
        "gap_particles": runs[0].gap_particles,
        "floor_particles": float(np.mean([run.floor_particles for run in runs])),
    }


def _row(run: Run) -> dict[str, Any]:
    names = ("level", "drag_n", "standard_error_n", "reliable", "eta", "bed")
    return {"run": run.name, "seed": run.case.inputs.get("seed")} | {
        name: getattr(run, name) for name in names
    }


def _scene(runs: Sequence[Run]) -> dict[str, float]:
    """The scene's own figures: those of the first run, but for what the field changes."""
    case = runs[0].case
    wanted = ("bowl_to_particle", "particle_friction", "lowest_restitution", "particles")
    found = {name: float(case.numbers[name]) for name in wanted if name in case.numbers}
    return {**found, "particle_diameter_m": 2.0 * case.media.radius_mean_m}


def write_scaling(
    out_dir: Path,
    run_dirs: Sequence[Path],
    field: str,
    expected: Expectation,
    commands: Sequence[str] = (),
) -> dict[str, Any]:
    """Write ``scaling.json``, ``scaling.csv`` (a row a level) and ``scaling.png``.

    Returns
    -------
    dict
        What ``scaling.json`` holds.

    Raises
    ------
    TableError, SeriesError
        If the runs do not make a scaling.
    """
    found = find(read_runs(run_dirs, field), field, expected)
    found |= {"commands": list(commands), **_record(run_dirs)}
    out_dir.mkdir(parents=True, exist_ok=True)
    write_json(out_dir / "scaling.json", found)
    table(found).to_csv(out_dir / "scaling.csv", index=False, float_format="%.6g")
    with matplotlib.rc_context(STYLE):
        picture = png(draw_scaling(found))
    draft = out_dir / ".scaling.png.tmp"
    draft.write_bytes(picture)
    os.replace(draft, out_dir / "scaling.png")
    return found


def _record(run_dirs: Sequence[Path]) -> dict[str, Any]:
    """When the first run began, the engine's version, and its processor time over all runs."""
    records = [
        RunRecord.read(folder / "run.json")
        for folder in run_dirs
        if (folder / "run.json").is_file()
    ]
    if not records:
        return {"started": None, "engine": None, "cpu_time_s": None}
    return {
        "started": min(record.started for record in records),
        "engine": records[0].engine_version,
        "cpu_time_s": sum(record.cpu_time_s for record in records),
    }


def table(found: Mapping[str, Any]) -> pd.DataFrame:
    """The levels of a scaling, one row each, intervals as columns ``*_low`` and ``*_high``."""
    rows = []
    for number, level in enumerate(found["levels"]):
        local = [*found["local_exponents"], None][number]
        row: dict[str, Any] = {found["field"]: level["x"]}
        for name, value in {**level, "local_exponent": local}.items():
            if name == "x":
                continue
            if isinstance(value, Mapping):
                row |= {name: value["value"]}
                row |= {f"{name}_{end}": value[end] for end in ("ci95_low", "ci95_high")}
            else:
                row[name] = value
        rows.append(row)
    return pd.DataFrame(rows)


def read_scalings() -> list[dict[str, Any]]:
    """The scalings that come with the package, those of slow drag first.

    Returns
    -------
    list of dict
        Content of each ``scaling.json``, made by the commands in ``commands``.
    """
    folder = resources.files("dragchain").joinpath(STORED)
    files = [file for file in folder.iterdir() if file.name.endswith(".json")]
    found = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    place = {name: number for number, name in enumerate(ORDER)}
    return sorted(found, key=lambda one: (place.get(one["study"], len(ORDER)), one["study"]))


def scaling_command(
    out_dir: Path,
    run_dirs: Sequence[Path],
    field: str,
    expected: float | None,
    source: str | None,
    fit_range: Sequence[float] | None,
    command: str | None,
) -> str:
    """Fit a scaling as the command line asks for; what to say of it."""
    within = (fit_range[0], fit_range[1]) if fit_range else None
    found = write_scaling(
        out_dir,
        run_dirs,
        field,
        Expectation(expected, source, within),
        [command] if command else [],
    )
    return f"{field}: {found['statement']}"
