"""From a tolerance to settings.

The settings of a process promise nothing: its windows measure what they give in the scene itself,
and stop when the tolerance is met (docs/evidence/windows.md). Those of a drop test were measured
beforehand. Nothing here runs LIGGGHTS.
"""

from dataclasses import dataclass, replace

from dragdeck.advice.options import (
    Option,
    drop_options,
    finest_drop,
    plain_option,
    process_option,
    with_option,
)
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.records.advised import AdvisedSettings
from dragdeck.records.tradeoff import TradeoffRecord, measured_tradeoff
from dragdeck.study.model import RESTITUTION, Tolerance


@dataclass(frozen=True)
class Advice:
    """The settings for a tolerance.

    Attributes
    ----------
    asked : Tolerance
    chosen : Option
    reference : Option
        That costs are compared with; of a drop test, the finest.
    fallback : str or None
        Why the reference was chosen.
    """

    asked: Tolerance
    chosen: Option
    reference: Option
    fallback: str | None = None

    @property
    def for_case(self) -> AdvisedSettings:
        """What ``case.json`` keeps of it."""
        return AdvisedSettings(
            tolerance=self.asked.tolerance,
            quantities=self.asked.quantities,
            error=self.chosen.error,
            relative_cost=self.chosen.relative_cost,
            largest_cost=self.chosen.largest_cost,
            fallback=self.fallback,
        )


def resolve(case: Case, asked: Tolerance, tradeoff: TradeoffRecord | None = None) -> Case:
    """The case with the settings that a tolerance asks for; it remembers the question.

    Parameters
    ----------
    case : Case
    asked : Tolerance
    tradeoff : TradeoffRecord, optional
        Instead of `measured_tradeoff`.

    Raises
    ------
    InputError
        The quantities do not go together.
    """
    advice = advised_settings(case, asked, tradeoff or measured_tradeoff())
    study = with_option(case.study, advice.chosen)
    return replace(case, study=study, asked=asked, advised=advice.for_case)


def advised_settings(case: Case, asked: Tolerance, tradeoff: TradeoffRecord) -> Advice:
    """The settings for a tolerance.

    Parameters
    ----------
    case : Case
        Its own fidelity does not matter.
    asked : Tolerance
    tradeoff : TradeoffRecord
        Errors of the drop test, and what steps cost.

    Raises
    ------
    InputError
        The quantities do not go together.
    """
    if RESTITUTION not in asked.quantities:
        return Advice(asked, process_option(case, asked, tradeoff), plain_option(case))
    if len(asked.quantities) > 1:
        raise InputError(
            "the restitution is a quantity of the drop test, others are of the process",
            file=case.file,
            field="fidelity.quantity",
            value=", ".join(asked.quantities),
            limit=f"{RESTITUTION} alone, or quantities of the process",
            remedy="remove one of them",
        )
    finest = finest_drop(case, tradeoff)
    good = [one for one in drop_options(case, tradeoff) if (one.error or 0.0) <= asked.tolerance]
    if good:
        return Advice(asked, min(good, key=lambda one: one.relative_cost), finest)
    why = (
        "no measured time step has an error of the restitution below "
        f"{shown_share(asked.tolerance)}: the smallest one is used, with "
        f"{shown_share(finest.error or 0.0)}"
    )
    return Advice(asked, finest, finest, why)


def shown_share(fraction: float) -> str:
    """A share without its sign, as a percentage with two significant digits."""
    return f"{float(f'{100 * abs(fraction):.2g}'):g} %"
