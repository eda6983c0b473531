"""Runs that begin softer: the softer run that leads to a run, and how the moduli are raised.

Filling, plunge, approach and the beginning of the drag decide nothing that is counted, so they can
run with reduced moduli and long time steps. A run then goes on where its lead was: the moduli are
raised in stages while the drag goes on, the bed relaxes, and the statistics begin.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from dragdeck.cases.bed import bed_timestep, weight_acceleration
from dragdeck.cases.case import Case, Stretch, of_each_workpiece
from dragdeck.decks.deck import Materials
from dragdeck.errors import InputError
from dragdeck.scenes.motion import driven, output_periods
from dragdeck.scenes.process_deck import Stop
from dragdeck.study.drive import Drive
from dragdeck.study.fidelity import SoftStart
from dragdeck.study.model import Study

LEAD = "lead"
"""Part of a case that only leads to another one's process."""

WHOLE_DRAG = "whole-drag"
"""Part of a case that runs its whole drag at the physical modulus, instead of windows."""

RAMP_STAGES = 24

_SHORTEST_RAMP_S, _RAMP_FALLS, _SETTLING_FALLS = 0.05, 2.0, 9.0
"""Time in which the moduli are raised, and in which the bed relaxes then, before anything is
counted: in units of the root of d/g, about the fall over half a particle, and at least the first,
s. The bed rises by what the overlaps give up; in a drag with an inertial number of 0.06, its
coordination number is at its plateau after that time (docs/evidence/windows.md)."""

FIRST_WINDOWS = 3
"""Windows that are run first, if so many fit."""

_FEWEST = 2
"""Windows of which one alone says nothing of its scatter."""

_FRAMES = 10
"""Least number of frames of the network in a window's sample."""


@dataclass(frozen=True)
class Covered:
    """The steps of a run.

    Attributes
    ----------
    entry : int
        0, or the step of the drag at which the run goes on from its lead.
    end : int
    ramp_end : int
        From here on the moduli are those of the run.
    counted : int
        First step of the statistics.
    """

    entry: int
    end: int
    ramp_end: int
    counted: int


def with_lead(case: Case) -> Case:
    """The case with what its process covers, and with its lead, as its fidelity says."""
    study, chosen = case.study, case.study.chosen_fidelity()
    if case.stretch != Stretch():
        return case
    if chosen.windows is not None:
        marks = _marks(study)
        if len(marks) < _FEWEST:
            raise _too_short(case)
        return replace(case, stretch=Stretch(marks=marks))
    if chosen.soft_start is None:
        return case
    begin = _entry_fraction(study)
    whole = replace(case.all_workpieces, stretch=Stretch(0.0, begin, (begin,)), part=LEAD)
    lead = replace(whole, study=whole.study.at_start(), requested=None, advised=None)
    return replace(case, stretch=Stretch(begin), lead=lead)


def windows_of(case: Case) -> list[Case]:
    """The windows of a case in the order in which they are run; none if its fidelity asks for none.

    Each begins at a mark of the case's own run, raises the moduli to the physical ones, relaxes,
    and samples a stretch. Any number of the first ones is spread over the path. Those of a further
    workpiece are those of the run, seen from it.
    """
    lead = with_lead(case.all_workpieces)
    if lead.study.chosen_fidelity().windows is None:
        return []
    study, length = _window_study(lead.study), window_fraction(lead.study)
    return [
        _from_mark(lead, study, case.number, mark, length, f"window-{mark + 1}", rank)
        for rank, mark in enumerate(spread_out(len(lead.stretch.marks)), 1)
    ]


def whole_drag(case: Case) -> list[Case]:
    """The whole counted path at the physical modulus, instead of windows where these cost more.

    It begins at the first mark of the case's own run, which is its soft start. A list of one case,
    or of none if the fidelity asks for no windows.
    """
    lead = with_lead(case.all_workpieces)
    if lead.study.chosen_fidelity().windows is None:
        return []
    rank = FIRST_WINDOWS + len(lead.stretch.marks) + 1
    study = _window_study(lead.study)
    return [_from_mark(lead, study, case.number, 0, 1.0, WHOLE_DRAG, rank)]


def _from_mark(
    lead: Case, study: Study, number: int, mark: int, length: float, part: str, rank: int
) -> Case:
    """A run at the physical modulus that goes on at a mark of a softer one; seen from a workpiece.

    The number of the workpiece is 0 for that of all.
    """
    begin = lead.stretch.marks[mark]
    stretch = Stretch(begin, min(begin + length, 1.0))
    run = replace(lead, study=study, stretch=stretch, lead=lead, part=part, rank_of_window=rank)
    return of_each_workpiece(run)[number - 1] if number else run


def whole_lengths(study: Study) -> float:
    """How many windows cost as much as the whole drag at the physical modulus."""
    return (1.0 - _marks(study)[0]) / window_fraction(study)


def _too_short(case: Case) -> InputError:
    """Refuses a path on which hardly a window fits."""
    study = _window_study(case.study)
    speed = driven(study).drive.speed_m_s
    before, sample = _before_s(study) * speed, _sample_s(study) * speed
    least = max(before, study.motion.uncounted_m) + _FEWEST * sample
    return InputError(
        f"the path is too short for {_FEWEST} windows", file=case.file,
        field=f"motion.path.{study.motion.path.length_field}",
        value=f"{1e3 * study.motion.path_length_m:.4g} mm of path",
        limit=f"at least {1e3 * least:.4g} mm: a window needs {1e3 * before:.3g} mm to raise the "
        f"moduli and to settle, and {1e3 * sample:.3g} mm to sample",
        remedy="use a longer path, or fidelity: {youngs_modulus_scale: 1}",
    )  # fmt: skip


def window_count(study: Study) -> int:
    """How many windows there can be; 0 if the fidelity asks for none."""
    return len(_marks(study)) if study.chosen_fidelity().windows is not None else 0


def window_fraction(study: Study) -> float:
    """Part of the drag that a window takes."""
    stiff = _window_study(study)
    return float((_before_s(stiff) + _sample_s(stiff)) / driven(stiff).drive.duration_s)


def counted_blocks(study: Study) -> tuple[float, float]:
    """Blocks of about a mean particle diameter: of the counted path, and of a window's sample."""
    stiff = _window_study(study)
    motion, block = stiff.motion, _block_s(stiff)
    counted = _seconds(motion.path_length_m - motion.uncounted_m, stiff)
    return counted / block, _sample_s(stiff) / block


def covered_fraction(study: Study) -> float:
    """Part of the drag that a softer run covers before a run goes on from it; 0 without one."""
    return 0.0 if study.chosen_fidelity().soft_start is None else _entry_fraction(study)


def with_leads(cases: Iterable[Case]) -> list[Case]:
    """Cases, each after the case of its lead and before its windows."""
    every = (
        part
        for case in cases
        for part in (with_lead(case).lead, case, *windows_of(case), *whole_drag(case))
    )
    return [part for part in every if part is not None]


def mark_file(number: int) -> str:
    """File of the state at a mark, by its number from 1."""
    return f"state.{number}.restart"


def covered(case: Case, drag: Drive) -> Covered:
    """The steps that the process of a case runs.

    Parameters
    ----------
    case : Case
        As `with_lead` returns it.
    drag : Drive
        The whole drag.
    """
    study, stretch = case.study, case.stretch
    end = drag.end if stretch.end == 1 else step_at(stretch.end, drag)
    uncounted = _until_counted(study)
    counted = drag.start + math.ceil(uncounted / drag.timestep_s)
    if not stretch.begin:
        return Covered(0, end, 0, counted)
    entry = step_at(stretch.begin, drag)
    ramp, settling = (math.ceil(time / drag.timestep_s) for time in _before_counted(study))
    ramp_end = entry + RAMP_STAGES * math.ceil(ramp / RAMP_STAGES)
    settled = ramp_end + settling
    return Covered(entry, end, ramp_end, max(settled, counted))


def step_at(fraction: float, drag: Drive) -> int:
    """The step at a fraction of the drag."""
    return drag.start + round(fraction * (drag.end - drag.start))


def stops(case: Case, drag: Drive, steps: Covered, materials: Materials) -> Iterator[Stop]:
    """Where the engine stops in the drag: at marks, where the moduli change, and at the end.

    Parameters
    ----------
    case : Case
        As `with_lead` returns it.
    drag : Drive
    steps : Covered
    materials : Materials
        Of the run.
    """
    if steps.entry:
        chosen = case.study.chosen_fidelity()
        first = chosen.of_start.youngs_modulus_scale / chosen.youngs_modulus_scale
        every = (steps.ramp_end - steps.entry) // RAMP_STAGES
        for stage in range(1, RAMP_STAGES + 1):
            softer = first ** (1 - stage / RAMP_STAGES)
            yield Stop(steps.entry + stage * every, materials.softened(softer), first=stage == 1)
    ends = [step_at(mark, drag) for mark in case.stretch.marks]
    for number, end in enumerate(ends, 1):
        yield Stop(end, writes=number == 1, mark=mark_file(number))
    if steps.end not in ends:
        yield Stop(steps.end, writes=not ends)


def _before_counted(study: Study) -> tuple[float, float]:
    """Time in which the moduli are raised, and in which the bed relaxes then, s."""
    fall = math.sqrt(2 * study.media.typical_radius_m / weight_acceleration(study))
    return max(_SHORTEST_RAMP_S, _RAMP_FALLS * fall), _SETTLING_FALLS * fall


def _seconds(path_m: float, study: Study) -> float:
    """Time in which the workpiece is driven along a path at full speed, s."""
    return float(path_m / study.motion.path_length_m * driven(study).drive.full_duration_s)


def _until_counted(study: Study) -> float:
    """Time from the start of the drag until the statistics may begin, s."""
    drive = driven(study).drive
    return _seconds(study.motion.uncounted_m, study) + drive.begin.steps / 2 * drive.timestep_s


def _frame(study: Study) -> float:
    """A frame of the network as a fraction of the drag."""
    timestep = bed_timestep(study, "timestep_fraction")
    return float(output_periods(study, timestep).network / driven(study).drive.steps)


def _entry_fraction(study: Study) -> float:
    """Where a run with a soft start enters its drag: at a frame of the network."""
    frame = _frame(study)
    before_s = max(0.0, _until_counted(study) - _before_s(study))
    return float(max(1, math.floor(before_s / driven(study).drive.duration_s / frame)) * frame)


def _window_study(study: Study) -> Study:
    """The study as its windows run it: at physical stiffness, with a frame for each short path."""
    chosen = study.chosen_fidelity()
    assert chosen.windows is not None
    often = _FRAMES / _block_s(study)
    rates = {name: max(rate, often) for name, rate in study.outputs if name.endswith("_hz")}
    fidelity = chosen.model_copy(
        update={
            "youngs_modulus_scale": 1.0,
            "soft_start": SoftStart(
                youngs_modulus_scale=chosen.youngs_modulus_scale,
                timestep_fraction=chosen.timestep_fraction,
            ),
            "timestep_fraction": chosen.windows.timestep_fraction,
            "ranks": 1,
            "windows": None,
        }
    )
    outputs = study.outputs.model_copy(update={**rates, "first_touch_fraction": 0.0})
    return study.model_copy(update={"fidelity": fidelity, "outputs": outputs})


def _before_s(study: Study) -> float:
    """Time that passes in a window before it samples, s."""
    return sum(_before_counted(study))


def _block_s(study: Study) -> float:
    """Time of a block of the counted path, about a mean particle diameter, s."""
    motion = study.motion
    counted_m = motion.path_length_m - motion.uncounted_m
    blocks = max(1, round(counted_m / (2 * study.media.typical_radius_m)))
    return _seconds(counted_m / blocks, study)


def _sample_s(study: Study) -> float:
    """Time that a window samples, s: whole blocks, about as long as what goes before."""
    block = _block_s(study)
    return block * max(1, round(_before_s(study) / block))


def _marks(study: Study) -> tuple[float, ...]:
    """Where windows begin: each samples blocks of its own of the counted path."""
    stiff, windows = _window_study(study), study.chosen_fidelity().windows
    assert windows is not None
    drag, frame, sample = driven(stiff).drive.duration_s, _frame(stiff), _sample_s(stiff)
    before = _before_s(stiff)
    first = max(_until_counted(stiff), before + frame * drag)
    places = math.floor((drag - first) / sample + 1e-9)
    chosen = sorted(spread_out(places)[: windows.most])
    starts = ((first + number * sample - before) / drag for number in chosen)
    return tuple(frame * math.floor(start / frame + 1e-9) for start in starts)


def spread_out(count: int) -> list[int]:
    """Numbers below `count`: the middles of thirds first, then of ninths, from both ends at once.

    Any number of the first ones is about symmetric: their mean has that of a drift along the path.
    """
    places, parts = list[int](), 3
    while len(dict.fromkeys(places)) < count:
        ends = (end for first in range((parts + 1) // 2) for end in (first, parts - 1 - first))
        places += [(2 * part + 1) * count // (2 * parts) for part in ends]
        parts *= 3
    return [*dict.fromkeys(places)]
