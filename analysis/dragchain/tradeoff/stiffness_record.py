"""The record of reduced stiffness: a law for each quantity, and how well it extrapolates."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from dragchain.errors import SeriesError
from dragchain.statistics.estimate import student_quantile
from dragchain.tradeoff.load_maps import compare_load_maps
from dragchain.tradeoff.measures import Measures
from dragchain.tradeoff.quantities import QUANTITIES
from dragchain.tradeoff.runs import by_scene
from dragchain.tradeoff.stable_step import fit_stable_step
from dragchain.tradeoff.stiffness_check import check_laws
from dragchain.tradeoff.stiffness_document import (
    ExtrapolationErrors,
    LawEntry,
    SceneEntry,
    StiffnessRecord,
)
from dragchain.tradeoff.stiffness_errors import PLANS, errors_entry, scaled_runs
from dragchain.tradeoff.stiffness_law import (
    COEFFICIENTS,
    fit_stiffness_law,
    left_out,
    with_misfit,
)
from dragchain.tradeoff.tradeoff_document import TradeoffRecord

_FEWEST_SCENES = 6
"""Scenes below which a law is not believed."""


def stiffness_record(
    runs: Sequence[Measures], plans: Sequence[Mapping[float, int]], tradeoff: TradeoffRecord
) -> StiffnessRecord:
    """Fit a law to each quantity, leave each scene out once, and check the laws elsewhere.

    Parameters
    ----------
    runs : sequence of Measures
        Of many scenes, at the physical Young's modulus and at a reduced one. Advised runs, and
        scenes with one modulus, count only for the law of the stability number.
    plans : sequence of mapping of float to int
        Runs at each modulus scale, for each way to extrapolate that is tried.
    tradeoff : TradeoffRecord
        Of a scene that is not among them.
    """
    plain = [run for run in runs if not run.asked]
    scenes = [everyone for _, everyone in by_scene(plain) if _at_two_moduli(everyone)]
    laws: dict[str, LawEntry] = {}
    without: dict[str, str] = {}
    errors: list[ExtrapolationErrors] = []
    for quantity in QUANTITIES:
        scaled = [scaled_runs(everyone, quantity) for everyone in scenes]
        known = [one for one in scaled if one is not None]
        try:
            if quantity.signed:
                raise SeriesError("it can change its sign")
            if len(known) < _FEWEST_SCENES:
                raise SeriesError(
                    f"only {len(known)} of {len(scenes)} scenes have this quantity with one sign"
                )
            law = fit_stiffness_law(known)
        except SeriesError as error:
            without[quantity.name] = str(error)
            continue
        by_plan = left_out(known, plans)
        rows = [
            errors_entry(quantity, plan, found, _quantile(len(found) - 1))
            for plan, found in zip(plans, by_plan, strict=True)
        ]
        errors += rows
        if sum(row.root_mean_square**2 - row.raw_root_mean_square**2 for row in rows) >= 0.0:
            without[quantity.name] = "the correction errs no less than the value as it is"
            continue
        single = {
            min(plan): found
            for plan, found in zip(plans, by_plan, strict=True)
            if sum(plan.values()) == 1
        }
        laws[quantity.name] = LawEntry(
            label=quantity.label,
            scenes=len(known),
            friction=quantity.friction,
            stiffness_power=quantity.stiffness_power,
            quantile=_quantile(len(known)),
            path_to_particle=float(np.mean([one.path_to_particle for one in known])),
            law=with_misfit(law, single),
        )
    return StiffnessRecord(
        measured=max(run.started for run in runs)[:10],
        engine_versions=tuple(sorted({run.versions["engine"] for run in runs})),
        scenes=tuple(map(_scene_entry, scenes)),
        laws=laws,
        left_out=tuple(errors),
        without_law=without,
        load_maps=tuple(compare_load_maps(scenes)),
        stable_step=fit_stable_step(runs),
        checks=tuple(check_laws(laws, tradeoff)),
    )


def _at_two_moduli(everyone: Sequence[Measures]) -> bool:
    return len({run.fidelity.youngs_modulus_scale for run in everyone}) > 1


def _quantile(scenes: int) -> float:
    return student_quantile(max(1, scenes - COEFFICIENTS))


def _scene_entry(everyone: Sequence[Measures]) -> SceneEntry:
    complete = [run for run in everyone if run.complete]
    scales = sorted({run.fidelity.youngs_modulus_scale for run in complete})
    return SceneEntry(
        numbers=everyone[0].numbers,
        runs={
            f"{scale:g}": sum(run.fidelity.youngs_modulus_scale == scale for run in complete)
            for scale in scales
        },
        failed=len(everyone) - len(complete),
    )


def stiffness_command(out_file: Path, measures: Sequence[Path], tradeoff: Path) -> str:
    """Write ``stiffness.json``; a line per quantity and plan."""
    runs = [Measures.read(file) for file in measures]
    record = stiffness_record(runs, PLANS, TradeoffRecord.read(tradeoff))
    record.write(out_file)
    return "\n".join(
        f"{row.quantity} from {dict(row.runs)}: rms error {100 * row.root_mean_square:.1f} %, "
        f"{row.inside} of {row.scenes} inside, uncorrected {100 * row.raw_root_mean_square:.1f} %"
        for row in record.left_out
    )
