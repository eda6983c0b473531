"""Smaller scenes that could stand for a machine: what each is expected to give, and to cost."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from dragdeck.advice.ways import Work
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.records.advice import WayEntry
from dragdeck.records.tradeoff import TradeoffRecord
from dragdeck.records.windows import WindowsRecord, front_of
from dragdeck.scenes.numbers import describe
from dragdeck.study.reduction import Reduction
from dragdeck.sweep.cases import with_larger_particles
from dragdeck.sweep.cut_out import with_cut_out

_FACTORS = 1.5, 2.0
"""Sizes of larger particles from which values at the true size are extrapolated."""

_RISE = 1.2
"""Of the drag per unit of the factor, relative to that at the true size, as measured in a machine
and its cut-out (docs/evidence/simplifications.md)."""

_WITH_RULE = {"drag_mean", "workpiece_contacts", "contact_force_mean", "normal_load"}
"""Quantities that can be extrapolated to the true size."""


def smaller_scenes(
    case: Case, quantities: Sequence[str], tradeoff: TradeoffRecord
) -> list[WayEntry]:
    """The machine of a case and what could stand for it, with the CPU time over the machine's.

    All have the case's own settings. The half-width is that of one packing, from the scatter in
    other scenes (docs/evidence/windows.md); it does not contain what a cut-out changes. Scenes
    that are refused are left out. If nothing can stand for the machine, the list is empty.
    """
    alone = {"reduction": None, "fidelity": case.study.chosen_fidelity()}
    study = (case.machine or case.study).model_copy(update=alone)
    machine = replace(case, study=study, machine=None)
    extrapolated = _WITH_RULE.issuperset(quantities)
    ways = [*_ways(machine, quantities, tradeoff, extrapolated)]
    return sorted(ways, key=lambda way: way.relative_cost) if len(ways) > 1 else []


def _ways(
    machine: Case, quantities: Sequence[str], tradeoff: TradeoffRecord, extrapolated: bool
) -> Iterator[WayEntry]:
    plain = 0.0
    for cut_out, name in ((False, "machine"), (True, "cut-out")):
        for factors in ((1.0,), _FACTORS) if extrapolated else ((1.0,),):
            try:
                cases = [_reduced(machine, cut_out, factor) for factor in factors]
            except InputError:
                continue
            label = f"{name}, particles {' and '.join(f'{k:g}' for k in factors)} times as large"
            counts = ", ".join(f"{member.study.particle_count:,}" for member in cases)
            half, cost = _half_width(cases, factors, quantities), _cost(cases, tradeoff)
            plain = plain or cost  # the machine comes first
            yield WayEntry(
                name=f"{label if len(factors) > 1 else name}: {counts} particles",
                half_width=half if math.isfinite(half) else None,
                relative_cost=cost / plain,
            )


def _reduced(machine: Case, cut_out: bool, factor: float) -> Case:
    reduction = Reduction(cut_out=cut_out, coarser=None if factor == 1 else factor)
    study = machine.study.model_copy(update={"reduction": reduction})
    return with_larger_particles(with_cut_out(replace(machine, study=study)))


def _cost(cases: Sequence[Case], tradeoff: TradeoffRecord) -> float:
    return sum(Work.of(case, tradeoff).cpu_time(case.study.chosen_fidelity()) for case in cases)


def _half_width(
    cases: Sequence[Case], factors: Sequence[float], quantities: Sequence[str]
) -> float:
    """Expected relative half-width, the largest of the quantities.

    Of two sizes it is that of the line through both values at the factor 1.
    """
    widths = [_of_run(case, quantities) for case in cases]
    if len(cases) == 1:
        return widths[0]
    low, high = factors
    weights = (high - 1) / (high - low), (1 - low) / (high - low)
    rises = (1 + _RISE * (factor - 1) for factor in factors)
    parts = zip(weights, rises, widths, strict=True)
    return math.hypot(*(weight * rise * width for weight, rise, width in parts))


def _of_run(case: Case, quantities: Sequence[str]) -> float:
    motion = case.study.motion
    counted_m = motion.path_length_m - motion.uncounted_m
    blocks = counted_m / (2 * case.study.media.typical_radius_m)
    front = front_of(describe(case))
    return WindowsRecord.shipped().widest(
        quantities, front, lambda known: known.soft_half_width(blocks, 0.0)
    )
