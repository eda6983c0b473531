"""What a number of a run says of the physical process: the one place that decides it.

A run has settings of its own: a reduced Young's modulus, a faster workpiece, a time step, rates of
output, a packing. Report, summary, terminal, network page, `dragchain.load` and crate ask `judge`
what each number stands for and `notes` what the settings do; they decide nothing themselves.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from dragchain.quantities.other_scenes import OtherScenes, other_scenes
from dragchain.quantities.registry import Quantity
from dragchain.statistics.estimate import Estimate
from dragdeck.physics.contact_mechanics import AT_SPEED, SOFT_AT_SPEED
from dragdeck.records.case import CaseOfRun, FidelityOfRun
from dragdeck.records.run import changed_in_words

_TIMES = "\N{MULTIPLICATION SIGN}"


class Basis(StrEnum):
    """What a value of the physical process rests on."""

    SIMULATED = "as simulated"
    WINDOWS = "from windows at the physical Young's modulus"
    SCALED = "scaled to process time"
    NONE = "not available"


class Correction(NamedTuple):
    """The factor from a run's value to that at the physical modulus, from so many windows."""

    factor: Estimate
    windows: int


@dataclass(frozen=True)
class Standing:
    """A quantity of a run, and what it says of the process.

    Attributes
    ----------
    quantity : Quantity
    run : Estimate
        The value of the run, in process time; its interval is NaN where one run gives none.
    value : Estimate or None
        The value of the physical process, None if there is none.
    basis : Basis
        What that rests on.
    reason : str
        Why it is not available, or what it is not corrected for; empty if nothing is to be said.
    windows : int
        Number of windows that the value is from; 0 if it is from the whole drag.
    other_scenes : OtherScenes or None
        What other scenes say of the value at the physical modulus, where the run has another one.
    """

    quantity: Quantity
    run: Estimate
    value: Estimate | None
    basis: Basis
    reason: str = ""
    windows: int = 0
    other_scenes: OtherScenes | None = None

    @property
    def estimated(self) -> Estimate | None:
        """The value at the physical modulus as other scenes suggest it; never a measurement."""
        return self.other_scenes.estimate(self.run) if self.other_scenes else None

    @property
    def reliable(self) -> bool:
        """Whether the interval of the run is reliable."""
        return self.run.reliable

    @property
    def corrected(self) -> bool:
        """Whether the value is from windows."""
        return self.basis is Basis.WINDOWS

    @property
    def rests_on(self) -> str:
        """The basis in words, with the number of windows."""
        runs = f"{self.windows} windows" if self.windows else "the whole drag"
        return self.basis.replace("windows", runs)

    @property
    def shown(self) -> Estimate:
        """The value of the process, or else that of the run."""
        return self.value or self.run


def judge(
    quantity: Quantity, measured: Estimate, case: CaseOfRun, correction: Correction | None
) -> Standing:
    """Decide what the value of a run says of the process.

    Parameters
    ----------
    quantity : Quantity
    measured : Estimate
        Value of the run, in simulated time.
    case : CaseOfRun
        A process run.
    correction : Correction or None
        What windows make of it; None if they do not give it.
    """
    factor = case.fidelity.speed_factor**quantity.time
    run = measured.over(1.0 / factor)
    scaled = Basis.SCALED if factor != 1.0 else Basis.SIMULATED
    if quantity.radial and case.study and case.study.reduction and case.study.reduction.cut_out:
        return Standing(quantity, run, None, Basis.NONE, "a straight cut-out does not give it")
    doubts = changed_settings(case.fidelity)
    if not doubts:
        return Standing(quantity, run, run, scaled)
    if correction is not None:
        ends = (correction.factor.ci95_low, correction.factor.ci95_high)
        low, high = sorted(run.value * end for end in ends)
        value = Estimate(run.value * correction.factor.value, low, high)
        return Standing(quantity, run, value, Basis.WINDOWS, "", correction.windows)
    reason = f"not corrected for {' and '.join(doubts)}"
    if case.marks:
        reason += f": {_why_not(case)}"
    others = other_scenes(quantity, case)
    if quantity.robust:
        return Standing(quantity, run, run, scaled, reason, other_scenes=others)
    return Standing(quantity, run, None, Basis.NONE, reason, other_scenes=others)


def changed_settings(fidelity: FidelityOfRun) -> dict[str, str]:
    """The settings that are not those of the process, and what they were measured to give."""
    changes = {}
    if fidelity.youngs_modulus_scale != 1.0:
        setting = f"Young's modulus {_TIMES} {fidelity.youngs_modulus_scale:g}"
        changes[setting] = "more and smaller contact forces than the physical one"
    if fidelity.speed_factor != 1.0:
        setting = f"speed {_TIMES} {fidelity.speed_factor:g}"
        changes[setting] = "fewer and larger contact forces than the speed of the process"
    return changes


def effects(fidelity: FidelityOfRun) -> list[str]:
    """A sentence on each of `changed_settings`."""
    changed = changed_settings(fidelity).items()
    return [f"{setting[0].upper()}{setting[1:]} gives {effect}." for setting, effect in changed]


def _why_not(case: CaseOfRun) -> str:
    if case.fidelity.speed_factor != 1.0:
        return "the effect of a higher speed is not measured"
    if case.changed_law:
        return "no effect is measured for the contact law of a template"
    if case.marks:
        return "its windows do not give this quantity"
    return "fidelity: {tolerance: 0.1} would measure values at the physical modulus"


def notes(case: CaseOfRun) -> list[str]:
    """What each setting of a process run does to its numbers, one sentence each."""
    changed = changed_in_words(case.changed_scripts)
    of_script = [f"{changed[0].upper()}{changed[1:]}."] if changed else []
    of_script += [f"{finding}." for finding in case.script_findings]
    return [*of_script, *_of_modulus_and_speed(case), _of_step(case)]


def _of_modulus_and_speed(case: CaseOfRun) -> Iterator[str]:
    scale, factor = case.fidelity.youngs_modulus_scale, case.fidelity.speed_factor
    if scale == 1.0:
        yield "Young's modulus is the physical one."
    yield from effects(case.fidelity)
    if factor != 1.0:
        yield (
            f"Nothing is corrected: {_why_not(case)}. Process time is simulated time {_TIMES} "
            f"{factor:g}: times, impulses and rates of the report are in process time, those of "
            "the tables in simulated time."
        )
    elif scale != 1.0 and case.marks:
        yield "Values at the physical modulus are from windows: short runs at that modulus."
    elif scale != 1.0:
        yield f"Nothing is corrected: {_why_not(case)}."
    if scale != 1.0 and case.numbers.get("inertial_number", 0.0) > AT_SPEED:
        yield f"{SOFT_AT_SPEED[0].upper()}{SOFT_AT_SPEED[1:]}."
    if case.lead:
        yield (
            "Plunge, approach and the start of the drag have a reduced modulus; it was raised "
            "before the statistics begin."
        )


def _of_step(case: CaseOfRun) -> str:
    percent = f"{100 * case.fidelity.timestep_fraction:.3g} %"
    text = f"The time step is {percent} of the Rayleigh time"
    if reason := case.unsafe_timestep:
        return (
            f"{text}, which may be unstable and is accepted on purpose ({reason}): "
            "forces may be too small by a quarter without any other sign."
        )
    return f"{text}; below the largest stable step no effect of it was measured."
