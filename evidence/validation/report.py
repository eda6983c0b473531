"""A study beside the publication that it reproduces: packings, other settings, changed inputs.

The runs are the points of a plan. Each is measured by `dragchain.quantities`, and settings are
compared as in a trade-off (`dragchain.tradeoff.compare`).
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from dragchain.figures.panels import Row, interval_rows
from dragchain.figures.style import BLUE, COLOURS, GREY, ORANGE
from dragchain.quantities.document import MEASURED_FILE
from dragchain.quantities.registry import MEASURED, REPORTED
from dragchain.report.campaign import write_report
from dragchain.run.case import study_of
from dragchain.run.reference import reference_drags
from dragchain.statistics.estimate import Estimate, Real, flattened, mean_of
from dragchain.tradeoff.compare import (
    PlanRun,
    QuantityComparison,
    Setting,
    compare_quantity,
    differing_inputs,
    read_plan_runs,
)
from dragdeck.documents import Document
from dragdeck.parts import Part
from dragdeck.records.case import CaseOfRun, load_case

_COMPARED = ("drag_mean", "drag_std")
"""Quantities on which the effects of settings are stated."""


class MeanOfPackings(Part):
    """The mean of a quantity over the packings, with Student's t interval.

    Nothing is assumed of how well a single packing knows its own value.
    """

    name: str
    label: str
    unit: str
    mean: Estimate


class ComparedValue(Part):
    """The drag beside a reference figure of the study.

    Attributes
    ----------
    label, mean_n, std_n
        Of the reference.
    difference : Estimate
        Relative difference of our mean to it.
    std_ratio : Estimate or None
        Our standard deviation over it. Both intervals are those over packings alone: no source
        says how well it knows its own mean.
    """

    label: str
    mean_n: float
    std_n: float | None
    difference: Estimate
    std_ratio: Estimate | None


class Effect(Part):
    """The relative change of a quantity by a setting, or by an input at the same settings.

    Attributes
    ----------
    quantity : str
    youngs_modulus_scale, timestep_fraction, speed_factor : float
        The settings.
    runs : int
    field, value, reference_value : str
        Inputs that are changed, empty if none are, and what they are with and without the change.
    change, ci95_low, ci95_high : float
        Against the same settings without the changed input, or against the reference.
    """

    quantity: str
    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    runs: int
    field: str
    value: str
    reference_value: str
    change: float
    ci95_low: float
    ci95_high: float


class Validation(Document):
    """The content of ``validation.json``.

    Attributes
    ----------
    run_std, bed_fraction : float
        Relative standard deviation of the mean drag of a run over `arc_m`, and the fraction of its
        variance that runs from one packing have in common.
    """

    study: str
    command: str
    measured: str
    versions: Mapping[str, str]
    engine_hours: float
    runs: int
    packings: int
    arc_m: float
    run_std: Real
    bed_fraction: Real
    means: tuple[MeanOfPackings, ...]
    comparison: tuple[ComparedValue, ...]
    effects: tuple[Effect, ...]


def write_validation(out_dir: Path, run_dirs: Sequence[Path], command: str) -> None:
    """Write tables, figure and page of the runs of a validation.

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
        A run has no ``quantities.json``.
    TableError
        No run is complete.
    SeriesError
        The reference is not complete, or there are too few runs to compare settings.
    """
    files = [folder / MEASURED_FILE for folder in run_dirs]
    runs, reference, arc_m = read_plan_runs(files, run_dirs[0])
    case = load_case(run_dirs[0])
    result = validation_of(runs, reference, arc_m, case, command)
    packings = packing_table(runs, reference)
    write_report(
        out_dir,
        "validation/validation.html.j2",
        draw=lambda: {
            "comparison": interval_rows(
                list(_bars(result, packings)),
                {f"{of.label} (published)": of.mean_n for of in result.comparison},
                MEAN_DRAG,
            )
        },
        tables={
            "packings": packings,
            "means": _table(result.means),
            "comparison": _table(result.comparison),
            "effects": _table(result.effects),
        },
        documents={"validation": result},
        package="evidence",
        result=result,
        packings=packings.to_dict("records"),
        assumptions=case.assumptions,
    )


def validation_of(
    runs: Sequence[PlanRun], reference: Setting, arc_m: float, case: CaseOfRun, command: str
) -> Validation:
    """All numbers of the page."""
    compared = {
        quantity.name: compare_quantity(quantity, runs, reference)
        for quantity in MEASURED
        if quantity.name in _COMPARED
    }
    packings, every = _at(runs, reference), [run.measures for run in runs]
    means = {quantity: _mean(packings, quantity.name) for quantity in REPORTED}
    drag, std = (_mean(packings, name) for name in _COMPARED)
    return Validation(
        study=case.study_name,
        command=command,
        measured=max(measures.started for measures in every)[:10],
        versions=every[0].versions,
        engine_hours=sum(measures.cost.cpu_time_s for measures in every) / 3600.0,
        runs=len(runs),
        packings=len(packings),
        arc_m=arc_m,
        run_std=compared["drag_mean"].fit.residual_std,
        bed_fraction=compared["drag_mean"].fit.bed_fraction,
        means=tuple(
            MeanOfPackings(name=of.name, label=of.label, unit=of.unit, mean=mean)
            for of, mean in means.items()
            if mean.known
        ),
        comparison=tuple(
            ComparedValue(
                **published.model_dump(include={"label", "mean_n", "std_n"}),
                difference=published.difference(drag),
                std_ratio=std.over(published.std_n) if published.std_n else None,
            )
            for published in reference_drags(study_of(case).reference)
        ),
        effects=tuple(
            effect for of in compared.values() for effect in _effects(of, runs, reference)
        ),
    )


def _at(runs: Sequence[PlanRun], setting: Setting) -> list[PlanRun]:
    """The complete runs at a setting, by the seeds of their packings."""
    complete = (run for run in runs if run.setting == setting and run.complete)
    return sorted(complete, key=lambda run: run.measures.study.seed)


def _mean(packings: Sequence[PlanRun], name: str) -> Estimate:
    known = (run.measures.values_of_run.get(name) for run in packings)
    return mean_of([estimate.value for estimate in known if estimate is not None])


def _effects(
    comparison: QuantityComparison, runs: Sequence[PlanRun], reference: Setting
) -> Iterator[Effect]:
    """The effect of every other setting on a quantity, as far as the runs tell it."""
    for setting in comparison.errors:
        plain = Setting.of(setting)
        base = plain if setting.other and _at(runs, plain) else reference
        error = comparison.between(setting, base)
        if setting == reference or error is None:
            continue
        same, (standard, *_) = _at(runs, setting), _at(runs, base)
        changed = differing_inputs(same[0].measures, standard.measures)
        before = standard.measures.study.inputs()
        yield Effect(
            quantity=comparison.quantity.name,
            **setting.parameters(),
            runs=len(same),
            field=", ".join(changed),
            value=", ".join(map(str, changed.values())),
            reference_value=", ".join(str(before.get(field, "")) for field in changed),
            change=error.value,
            ci95_low=error.ci95_low,
            ci95_high=error.ci95_high,
        )


# --- tables and figure -------------------------------------------------------------------------


def packing_table(runs: Sequence[PlanRun], reference: Setting) -> pd.DataFrame:
    """One row per packing: its run, what it took, and its quantities with their intervals."""
    rows = [
        {
            "run": run.measures.run,
            "seed": run.measures.study.seed,
            "arc_m": run.measures.arc_m,
            **run.measures.cost.model_dump(include={"steps", "cpu_time_s"}),
            **run.measures.single,
            **flattened(dict(run.measures.values_of_run)),
        }
        for run in _at(runs, reference)
    ]
    return pd.DataFrame(rows)


def _table(rows: Sequence[Part]) -> pd.DataFrame:
    return pd.DataFrame([flattened(dict(part)) for part in rows])


MEAN_DRAG = "mean drag force (N), 95 % CI"


def _bars(result: Validation, packings: pd.DataFrame) -> Iterator[Row]:
    drag = next(of.mean for of in result.means if of.name == "drag_mean")
    yield "all packings", drag, COLOURS["drag"]
    for packing in packings.to_dict("records"):
        ends = (packing[f"drag_mean{end}"] for end in ("", "_ci95_low", "_ci95_high"))
        yield f"packing {packing['seed']}", Estimate(*ends), BLUE
    for effect in result.effects:
        if effect.quantity == "drag_mean":
            yield effect_bar(drag.value, effect)


def effect_bar(drag_n: float, effect: Any) -> Row:
    """The mean drag with an effect, which is named by the changed input, or by the settings."""
    change = Estimate(effect.change, effect.ci95_low, effect.ci95_high)
    drag = change.mapped(lambda by: drag_n * (1 + by))
    if effect.field:
        return _changed_input(effect.field, effect.value), drag, GREY
    step = f"{100 * effect.timestep_fraction:g} %"
    return f"E \u00d7 {effect.youngs_modulus_scale:g}, {step}", drag, ORANGE


def _changed_input(field: str, value: str) -> str:
    """An input as words: ``workpiece radius 4 mm`` of ``workpiece.shape.radius_m`` 0.004."""
    if not field.endswith("_m") or "," in field:
        return f"{field} {value}"
    words = field.removeprefix("motion.").removesuffix("_m").replace(".shape.", " ")
    return f"{words.replace('.', ' ').replace('_', ' ')} {1e3 * float(value):g} mm"
