"""Tolerances beside plain runs of the same scenes: which are kept, and what they cost.

python -m evidence write-kinds                                # studies kind-* in this project
./run all --config study=kind-line; ./run all --config study=kind-line-plain; ...
python -m evidence judge-windows kinds.csv kind-line kind-spin ...
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from pydantic import JsonValue
from scipy.stats import binomtest, norm

from dragchain.quantities.document import EXTRAPOLATED, MEASURED_FILE, Extrapolated, RunQuantities
from dragchain.quantities.other_scenes import other_scenes
from dragchain.quantities.registry import MEASURED
from dragchain.statistics.estimate import NORMAL_QUANTILE, NOT_KNOWN, Estimate
from dragdeck.advice.advise import plain_option, ways_of
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.project import Project, by_run, project_here
from dragdeck.records.case import load_case
from dragdeck.records.run import RunRecord
from dragdeck.records.tradeoff import measured_tradeoff
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.lead import with_leads
from dragdeck.scenes.process import PROCESS
from dragdeck.study.base import Json
from dragdeck.sweep.design import Design
from evidence.beds import Repeated, designed

PLAIN = "-plain"
"""Ends the name of the study of plain runs beside one with a tolerance."""

ALL = "all"
"""Stands for a quantity in the row of all."""

KINDS = Path(__file__).with_name("kinds.yaml")


class Kinds(Repeated):
    """A scene of the design with the name of its kind."""

    kind: str


def write_pair(name: str, case: Case, fidelity: str, packings: int) -> None:
    """Write a study that asks for a tolerance, and one of plain runs with other packings.

    Parameters
    ----------
    name : str
        Of the first study.
    case : Case
        The scene.
    fidelity : str
        Block of the first study, as YAML.
    packings : int
        Of the second; 0: only the first is written.
    """
    data, studies = case.study.plain(), project_here().studies
    seeds: list[JsonValue] = [case.study.seed + number for number in range(1, packings + 1)]
    plain = {**plain_option(case).fidelity.plain(), "ranks": 1}
    pair: dict[str, Json] = {name: {"fidelity": yaml.safe_load(fidelity)}}
    if packings:
        pair[name + PLAIN] = {"fidelity": plain, "sweep": {"seed": seeds}}
    for study, changes in pair.items():
        (studies / study).mkdir(parents=True)
        text = yaml.safe_dump({**data, **changes}, sort_keys=False)
        (studies / study / "study.yaml").write_text(text)


def write_kinds(fidelity: str, packings: int) -> str:
    """Write both studies of each kind; return the names."""
    names = []
    for block, case in designed(Design[Kinds], KINDS, "kinds"):
        names.append(f"kind-{block.kind.replace(' ', '-')}")
        write_pair(names[-1], case, fidelity, packings)
    return "\n".join(names)


def judge_tolerances(out: Path, studies: Sequence[str]) -> None:
    """Write a row per study, workpiece and requested quantity: error against the plain runs.

    Parameters
    ----------
    out : Path
        CSV file; beside it, NAME_summary.csv has what `promises_of` makes of it.
    studies : sequence of str
        Those with a tolerance; the plain runs of NAME are of the study NAME-plain.
    """
    project = project_here()
    table = pd.DataFrame([row for study in studies for row in _rows(project, study)])
    table.to_csv(out, index=False, float_format="%.5g")
    of_all = promises_of(table)
    of_all.to_csv(out.with_name(f"{out.stem}_summary.csv"), index=False, float_format="%.5g")


def promises_of(table: pd.DataFrame) -> pd.DataFrame:
    """Of each quantity, and of all: promises, how many were kept, and how far values are off.

    A tolerance that was reached is a promise, which is kept if the error is within it. By chance
    are those that would be broken if all intervals, of values and of references, were exact. The
    interval of the share kept is that of Clopper and Pearson (1934, Biometrika 26, 404).

    Parameters
    ----------
    table : DataFrame
        Rows of `judge_tolerances`.
    """
    rows = []
    for quantity in [*table["quantity"].unique(), ALL]:
        of = table if quantity == ALL else table[table["quantity"] == quantity]
        given = of[of["reached"]]
        off = given["error"].abs() / given["tolerance"]
        std = np.hypot(given["half_width"] / NORMAL_QUANTILE, given["reference_error"])
        share = binomtest(int((off <= 1).sum()), max(len(given), 1)).proportion_ci()
        rows.append({
            "quantity": quantity, "values": len(of), "promises": len(given),
            "kept": int((off <= 1).sum()), "share_low": share.low, "share_high": share.high,
            "by_chance": 2 * norm.sf(given["tolerance"] / std).sum(), "largest": off.max(),
            "error": of["error"].mean(), "error_se": of["error"].sem(),
            "covered": int(of["covered"].sum()),
        })  # fmt: skip
    return pd.DataFrame(rows)


def _rows(project: Project, study: str) -> Iterator[dict[str, Any]]:
    asked = project.cases(study)
    plain = [run for case in project.cases(study + PLAIN) for run in of_each_workpiece(case)]
    plain_cpu = _cpu_time(project, plain) / len({case.study.seed for case in plain})
    cpu = _cpu_time(project, with_leads(asked))
    for case in (workpiece for whole in asked for workpiece in of_each_workpiece(whole)):
        folder = project.run_folder(case, PROCESS)
        result = Extrapolated.read(folder / EXTRAPOLATED)
        assert result.tolerance is not None and case.requested is not None
        windows = len(result.tolerance.runs)
        whole = result.tolerance.whole or not windows
        ways = ways_of(case, case.requested, measured_tradeoff())
        way = ways and (ways.whole if whole else ways.with_windows(windows))
        beside = [
            RunQuantities.read(project.run_folder(run, PROCESS) / MEASURED_FILE)
            for run in plain
            if run.number == case.number
        ]
        values = result.values or RunQuantities.read(folder / MEASURED_FILE).values_of_run
        for name in result.tolerance.asked:
            value, (mean, error) = values[name], _reference(beside, name)
            soft = _estimate(folder, name)
            yield {
                "study": study,
                "workpiece": case.number,
                "quantity": name,
                "windows": windows,
                "whole_drag": whole,
                "tolerance": result.tolerance.tolerance,
                "reached": value.relative_half_width <= result.tolerance.tolerance,
                "value": value.value,
                "half_width": value.relative_half_width,
                "reference": mean,
                "reference_error": error / abs(mean),
                "error": value.value / mean - 1,
                "covered": _agree(value, mean, error),
                "estimate": soft.value,
                "estimate_half_width": soft.relative_half_width,
                "estimate_covered": _agree(soft, mean, error) if soft.known else None,
                "cpu_time_s": cpu,
                "plain_cpu_time_s": plain_cpu,
                "forecast_cost": way and way.relative_cost,
            }


def _agree(value: Estimate, mean: float, error: float) -> bool:
    """Whether an interval includes a reference within the standard error of that."""
    return abs(value.value - mean) <= math.hypot(value.half_width, NORMAL_QUANTILE * error)


def _estimate(folder: Path, name: str) -> Estimate:
    """What the soft run and other scenes say of a quantity; unknown where these say nothing."""
    (quantity,) = (quantity for quantity in MEASURED if quantity.name == name)
    others = other_scenes(quantity, load_case(folder))
    if others is None:
        return NOT_KNOWN
    return others.estimate(RunQuantities.read(folder / MEASURED_FILE).estimates({})[name])


def _reference(runs: Sequence[RunQuantities], name: str) -> tuple[float, float]:
    """Mean over packings and its standard error, no smaller than the runs' own scatter explains."""
    estimates = [run.estimates({})[name] for run in runs]
    means = np.array([estimate.value for estimate in estimates])
    errors = np.array([estimate.half_width for estimate in estimates]) / NORMAL_QUANTILE
    within = float(np.mean(errors**2))
    between = float(means.var(ddof=1)) if len(means) > 1 else 0.0
    return float(means.mean()), math.sqrt(max(within, between) / len(means))


def _cpu_time(project: Project, cases: Sequence[Case]) -> float:
    """CPU time of all runs of some cases that were made, with their fillings, s."""
    folders = {
        project.run_folder(case, scene)
        for scene in (FILLING, PROCESS)
        for case in by_run(cases, scene).values()
    }
    files = (folder / "run.json" for folder in folders)
    return sum(RunRecord.read(file).processor_time_s for file in files if file.is_file())
