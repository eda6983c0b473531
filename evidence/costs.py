"""The cost of options that a study's input scripts omit (docs/development/benchmarks.md).

``costs.yaml`` is the design: each of its options is the standard case with other values of study
fields. The runs of all rounds are ordinary ones, in ``costs/`` beside the result; the same command
resumes an interrupted measurement.
"""

import copy
import os
import shlex
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal, NamedTuple

import jinja2
import numpy as np

from dragchain.statistics.estimate import Estimate, finite, mean_of
from dragdeck import __version__
from dragdeck.cases.case import Case
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import Report, say
from dragdeck.errors import InputError
from dragdeck.parts import Part
from dragdeck.project import by_run, find_project
from dragdeck.records.run import RunRecord
from dragdeck.records.tradeoff import CostEntry, CostsFile, Machine
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import read_bed
from dragdeck.study.base import Json
from dragdeck.study.model import Study
from dragdeck.sweep.cases import settle_case
from dragdeck.sweep.design import Design, Settings, Variation
from evidence.beds import filled

DESIGN = Path(__file__).with_suffix(".yaml")

SECONDS = 0.5
"""Drag of every run, s of process time at the speed of the study."""

_QUIET = 0.3
"""Load average above which the machine counts as busy: half a process and more."""

_FIDELITY = "fidelity."
_PARAMETERS = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")


# --- the design ------------------------------------------------------------------------------


class CostOption(Variation):
    """Points of the design with their name, in which ``{}`` stands for what varies, and words."""

    name: str
    what: str
    unit: Literal["per_step", "per_second"] = "per_second"


class TimedOption(NamedTuple):
    """An option with its words, the fields that it sets, and its case."""

    option: CostOption
    values: Settings
    case: Case


def option_case(case: Case, values: Settings, seconds: float) -> Case:
    """The case of a study with an option's values, and so much of its drag.

    It neither continues a softer run nor has windows.

    Raises
    ------
    InputError
        The study has no such field, or may not have the value.
    """
    data = copy.deepcopy(case.written.model_dump(mode="json", exclude_unset=True))
    data["fidelity"] = case.study.chosen_fidelity().model_dump(
        mode="json", exclude_unset=True, exclude={"soft_start", "windows"}
    )
    changes = {field: _value(value, case.study) for field, value in values.items()}
    study = settle_case(case.file, data, changes).study
    path, name = study.motion.path, study.motion.path.length_field
    fraction = min(1.0, seconds * study.motion.nominal_speed_m_s / study.motion.path_length_m)
    length: Json = {
        f"motion.path.{name}": fraction * getattr(path, name),
        "motion.transient_m": 0.0,
        "motion.counted_from_revolution": None,
    }
    return settle_case(case.file, data, {**changes, **length}, {})


def _value(value: Any, study: Study) -> Any:
    """A value, or a number times a field of the study; also within an object of fields."""
    if isinstance(value, Mapping):
        return {name: _value(entry, study) for name, entry in value.items()}
    factor, times, field = value.partition(" * ") if isinstance(value, str) else ("", "", "")
    if not times:
        return value
    try:
        current = attrgetter(field)(study)
    except AttributeError:
        raise InputError("the study has no such field", file=DESIGN, field=field) from None
    return type(current)(float(factor) * current)


def timed_options(
    case: Case, seconds: float, report: Report, design: Path = DESIGN
) -> dict[str, TimedOption]:
    """The options that the study can have and does not have itself; the reference first."""
    timed, standard = dict[str, TimedOption](), None
    for block, values in Design[CostOption].read(design).settings():
        shown = [values[field] for field in block.vary]
        words = {"name": block.name.format(*shown), "what": block.what.format(*shown)}
        try:
            of_option = option_case(case, values, seconds)
        except InputError as error:
            if standard is None:
                raise
            report(f"{words['name']} is left out: {error}")
            continue
        if of_option.study != standard:
            option = block.model_copy(update=words)
            timed[option.name] = TimedOption(option, values, of_option)
        standard = standard or of_option.study
    return timed


# --- the result ------------------------------------------------------------------------------


class BaseCost(Part):
    """How fast the standard case is."""

    name: str
    what: str
    timestep_s: float
    steps: int
    cpu_us_per_step: float
    steps_per_s: float


class TimedCosts(CostsFile):
    """``costs.json``: what each option costs, and how, when and where that was measured."""

    study: str
    particles: int
    seconds: float
    measured: str
    command: str
    versions: Mapping[str, str]
    machine: Machine
    load_average_before: float
    base: BaseCost


def geometric(ratios: Sequence[float]) -> Estimate:
    """Geometric mean of ratios, one for each round, with its interval; NaN for one round."""
    return mean_of(np.log(ratios)).exp()


def cost(
    option: CostOption,
    values: Settings,
    rounds: Sequence[tuple[RunRecord, RunRecord]],
    steps_s: tuple[float, float],
    against: str,
) -> CostEntry:
    """The cost of an option.

    Parameters
    ----------
    option : CostOption
    values : mapping
        The fields that it sets.
    rounds : sequence of (RunRecord, RunRecord)
        Its run and that of the standard case in each round.
    steps_s : float, float
        Time step of both, s.
    against : str
        What the standard case is.
    """
    steps_per_second = steps_s[1] / steps_s[0]
    factor = steps_per_second if option.unit == "per_second" else 1.0
    cpu, wall = (
        geometric([getattr(a, name) / a.steps / (getattr(b, name) / b.steps) for a, b in rounds])
        for name in ("cpu_time_s", "wall_time_s")
    )
    alone = [name.removeprefix(_FIDELITY) for name in values]
    parameter = alone[0] if len(alone) == 1 and alone[0] in _PARAMETERS else None
    return CostEntry(
        name=option.name,
        scene="process",
        what=option.what,
        against=against,
        unit=option.unit,
        parameter=parameter,
        level=float(values[_FIDELITY + parameter]) if parameter else None,
        ratio=cpu.value * factor,
        ci95_low=finite(cpu.ci95_low * factor),
        ci95_high=finite(cpu.ci95_high * factor),
        per_step=cpu.value,
        per_second=cpu.value * steps_per_second,
        wall_ratio=wall.value * factor,
        rounds=len(rounds),
        steps=rounds[0][0].steps,
        timestep_s=steps_s[0],
    )


# --- the measurement -------------------------------------------------------------------------


def time_options(
    case: Case,
    templates: jinja2.Environment,
    out: Path,
    report: Report,
    *,
    rounds: int = 3,
    seconds: float = SECONDS,
    design: Path = DESIGN,
) -> None:
    """Run all options of the design and write their costs.

    Parameters
    ----------
    case : Case
        Its fidelity gives modulus and step of the standard case.
    templates : Environment
        Those of the study.
    out : Path
        The result; runs go to ``costs/`` beside it.
    report : callable
        Gets lines.
    rounds : int
    seconds : float
        Process time of every drag, s.
    design : Path
        The options.

    Raises
    ------
    InputError
        The result is there already, or there is nothing to time.
    EngineError, RejectedRunError
        A packing or a run of the standard case failed, or a run was interrupted.
    """
    if out.exists():
        remedy = "move it away, or give another --out"
        raise InputError("this measurement is there already", file=out, remedy=remedy)
    if rounds < 1:
        raise InputError("nothing to time", field="--rounds", value=rounds, limit="at least 1")
    load = os.getloadavg()[0]
    if load > _QUIET:
        report(f"warning: the machine is busy (load average {load:.2f}); CPU times will scatter")
    chosen = timed_options(case, seconds, report, design)
    cases = {name: timed.case for name, timed in chosen.items()}
    first, *others = cases
    folder = out.resolve().parent / "costs"
    filling = Batch(folder / "filling", templates)
    beds = {
        run: read_bed(filled(filling, of_bed))
        for run, of_bed in by_run(cases.values(), FILLING).items()
    }
    scenes = {
        name: partial(process_scene, option, beds[FILLING.run_id(option)])
        for name, option in cases.items()
    }
    records: dict[str, list[RunRecord]] = {name: [] for name in cases}
    for number in range(1, rounds + 1):
        batch = Batch(folder / f"round-{number}", templates)
        records[first].append(batch.result(first, scenes[first]()))
        refused = batch.each({name: scenes[name] for name in others}, report)
        for name in others:
            if name not in refused:
                records[name].append(RunRecord.read(batch.folder / name / "state.json"))
    steps_s = {name: make().deck.timestep_s for name, make in scenes.items() if records[name]}
    base = records[first]
    standard, of_standard, _ = chosen[first]
    timed = []
    for name in others:
        option, values, _ = chosen[name]
        changed = {key: value for key, value in values.items() if of_standard.get(key) != value}
        pairs = [(a, b) for a, b in zip(records[name], base, strict=False) if a.complete]
        if pairs:
            steps = steps_s[name], steps_s[first]
            timed.append(cost(option, changed, pairs, steps, standard.what))
    study = cases[first].study
    TimedCosts(
        study=case.study_name,
        fidelity=study.chosen_fidelity(),
        particles=study.particle_count,
        seconds=seconds,
        measured=datetime.now(UTC).date().isoformat(),
        command=shlex.join(["python", "-m", "evidence", *sys.argv[1:]]),
        versions={"dragdeck": __version__, "engine": base[0].engine_version},
        machine=Machine.here(),
        load_average_before=load,
        base=BaseCost(
            name=first,
            what=standard.what,
            timestep_s=steps_s[first],
            steps=base[0].steps,
            cpu_us_per_step=1e6 * geometric([run.cpu_time_s / run.steps for run in base]).value,
            steps_per_s=geometric([run.steps / run.wall_time_s for run in base]).value,
        ),
        costs=tuple(timed),
    ).write(out)


def measure_costs(study: str, fidelity: str | None, out: Path, rounds: int) -> None:
    """Time the options of a study by its name; see `time_options`."""
    project = find_project(Path.cwd())
    case = project.cases(study, fidelity)[0]
    time_options(case, project.templates_of(case), out, say, rounds=rounds)
