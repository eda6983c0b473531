"""The quantities of one run, extrapolated to the physical Young's modulus where a law applies."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path

from dragchain.report.extrapolated import FILE, Extrapolated, ExtrapolatedQuantity, WindowsOfRun
from dragchain.run.case import Case, load_case
from dragchain.statistics.estimate import Estimate
from dragchain.tradeoff.path_blocks import quantities_along
from dragchain.tradeoff.quantities import QUANTITIES
from dragchain.tradeoff.stiffness_document import StiffnessRecord
from dragchain.windows.document import Round

_WIDENING = 0.1
"""How far beyond the scenes of the record a number of a scene still counts as measured."""

_SCENE_SIZE = "particles"
"""A number of a scene that no law depends on."""


def extrapolate_run(run_dir: Path, record: Path, round_file: Path | None = None) -> None:
    """Write ``extrapolated.json`` of a run: its quantities, and what the laws make of them.

    No law applies to a run at the physical modulus or below the smallest one of the record, nor to
    a workpiece that is faster than the study says: the laws were measured at a study's own speed.
    None applies if a template of the study changed the contact law.

    Parameters
    ----------
    run_dir : Path
        A complete process run with tables and chains.
    record : Path
        ``stiffness.json``.
    round_file : Path, optional
        Last round of the windows of the run, whose values replace those of the laws.

    Raises
    ------
    DocumentError
        If the record or the run's case cannot be used.
    TableError
        If a table is missing.
    """
    if round_file is not None:
        _from_windows(load_case(run_dir), Round.read(round_file)).write(run_dir / FILE)
        return
    case, known = load_case(run_dir), StiffnessRecord.read(record)
    scale = case.fidelity.youngs_modulus_scale
    softest = min(float(one) for scene in known.scenes for one in scene.runs)
    applies = softest <= scale < 1.0 and case.fidelity.speed_factor == 1.0 and not case.changed_law
    along = quantities_along(run_dir, case)
    diameters = along.arc_m / (2.0 * case.media.radius_mean_m)
    values = along.values()
    found = []
    for quantity in QUANTITIES:
        entry, measured = known.laws.get(quantity.name), values.get(quantity.name, math.nan)
        if not math.isfinite(measured):
            continue
        low = value = high = None
        # the laws are written in the logarithm of a coefficient of friction
        if applies and entry and measured and case.numbers.get(entry.friction):
            guess = entry.at_physical_modulus(measured, case.numbers, scale, diameters)
            half = guess.half_width(entry.quantile)
            low, value, high = sorted(
                math.copysign(math.exp(guess.logarithm + s * half), measured) for s in (-1, 0, 1)
            )
        found.append(
            ExtrapolatedQuantity(
                name=quantity.name,
                label=quantity.label,
                unit=quantity.unit,
                measured=measured,
                value=value,
                ci95_low=low,
                ci95_high=high,
            )
        )
    Extrapolated(
        youngs_modulus_scale=scale,
        source=f"{len(known.scenes)} scenes, measured {known.measured}",
        outside=(*_other_law(case), *(_outside(case.numbers, known) if applies else ())),
        quantities=tuple(found),
    ).write(run_dir / FILE)


def _from_windows(case: Case, found: Round) -> Extrapolated:
    """The quantities of a run as its windows have them at physical stiffness."""
    names = [field.name for field in fields(Estimate) if field.name != "reliable"]
    return Extrapolated(
        youngs_modulus_scale=case.fidelity.youngs_modulus_scale,
        source=f"{len(found.windows)} windows at the physical Young's modulus",
        outside=(),
        windows=WindowsOfRun(
            tolerance=found.tolerance,
            asked=tuple(one.label for one in found.quantities if one.asked),
            reached=found.reached,
            runs=found.windows,
            refused={one.run: one.why for one in found.refused},
            enough=found.enough,
        ),
        quantities=tuple(
            ExtrapolatedQuantity(
                name=one.name,
                label=one.label,
                unit=one.unit,
                measured=one.soft,
                **({name: getattr(one, name) for name in names} if one.estimate.known else {}),
            )
            for one in found.quantities
        ),
    )


def _other_law(case: Case) -> Iterator[str]:
    for command in case.changed_law:
        yield f"the laws were measured without the template's command: {command}"


def _outside(numbers: Mapping[str, float], record: StiffnessRecord) -> Iterator[str]:
    for name in {**record.scenes[0].numbers, **numbers}:
        values = [scene.numbers.get(name, 0.0) for scene in record.scenes]
        low, high = (1 - _WIDENING) * min(values), (1 + _WIDENING) * max(values)
        if name != _SCENE_SIZE and not low <= numbers.get(name, 0.0) <= high:
            yield f"{name} {numbers.get(name, 0.0):.3g} is outside of {low:.3g} to {high:.3g}"
