"""What a study's run will take and how far it may err: `dragdeck advise`."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from rich.table import Table

from dragdeck import __version__
from dragdeck.advice.advise import RESTITUTION, Advice, Spread, percent, signed
from dragdeck.advice.options import Option, process_options, step_cost, with_option
from dragdeck.advice.speed import SCALE, Speed
from dragdeck.cases.case import Case
from dragdeck.decks.advised import AdvisedSettings
from dragdeck.decks.deck import StudyScene
from dragdeck.documents import Document, Part
from dragdeck.engine.reports import shown_time
from dragdeck.outlook.explain import Cost, expected_cost, measured_speeds
from dragdeck.outlook.measured import MeasuredError, Tradeoff
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.scene import SceneType
from dragdeck.study.base import Json
from dragdeck.study.model import Fidelity, Study, Tolerance

_DEFAULT_TOLERANCE = Tolerance(tolerance=0.05)
"""What is advised for where a study asks for nothing."""


@dataclass(frozen=True)
class Forecast:
    """What an option costs on this machine.

    Attributes
    ----------
    role : str
        ``advised``, ``cheaper``, ``dearer``, ``reference`` or ``own``.
    option : Option
    case : Case
        With the option's settings.
    inputs : mapping
        Of the process run, as in its ``case.json``: tells which run this is about.
    steps : mapping of str to int
        Of each scene that the tolerance concerns: fill and process, or the drop.
    wall_times_s : mapping of str to float
        Expected, of the same scenes.
    source : str
        Where the speed comes from.
    """

    role: str
    option: Option
    case: Case
    inputs: Json
    steps: Mapping[str, int]
    wall_times_s: Mapping[str, float]
    source: str

    def for_file(self) -> "OptionEntry":
        """An entry of ``options`` in ``advice.json``."""
        error = self.option.error
        chosen = self.case.study.chosen_fidelity()
        return OptionEntry(
            role=self.role,
            settings=SettingsOfOption(**chosen.model_dump() | {"ranks": self.case.ranks}),
            drop_timestep_fraction=self.option.drop_timestep_fraction,
            error=error,
            relative_cost=self.option.relative_cost,
            inputs=self.inputs,
            steps=self.steps,
            wall_time_s=self.wall_times_s,
            steps_per_s={
                scene: round(steps / self.wall_times_s[scene], 1)
                for scene, steps in self.steps.items()
            },
            source=self.source,
        )


class SettingsOfOption(Fidelity):
    """The settings of an option, with the MPI ranks of its runs.

    Attributes
    ----------
    ranks : int
        MPI ranks.
    """

    ranks: int


class OptionEntry(Part):
    """An option of ``advice.json``: settings, their error and their expected cost.

    Attributes
    ----------
    role : str
        ``advised``, ``cheaper``, ``dearer``, ``reference`` or ``own``.
    settings : SettingsOfOption
        Settings of filling and process.
    drop_timestep_fraction : float or None
        Time step of the drop test as a fraction of the Rayleigh time.
    error : MeasuredError or None
        Expected error; None for the reference.
    relative_cost : float
        CPU time / CPU time of the reference settings.
    inputs : mapping
        Inputs of the process run, as in its ``case.json``.
    steps, wall_time_s, steps_per_s : mapping
        Expected steps, wall-clock time (s) and speed, by scene.
    source : str
        Where the speed comes from.
    """

    role: str
    settings: SettingsOfOption
    drop_timestep_fraction: float | None
    error: MeasuredError | None
    relative_cost: float
    inputs: Json
    steps: Mapping[str, int]
    wall_time_s: Mapping[str, float]
    steps_per_s: Mapping[str, float]
    source: str


class AdvisedCase(Part):
    """A case of ``advice.json``: its process run and its options.

    Attributes
    ----------
    case, run : str
        Name of the case, and its run id.
    asked : AdvisedSettings
        The tolerance, and the expected error of the advised settings.
    options : sequence of OptionEntry
        The advised settings first.
    """

    case: str
    run: str
    asked: AdvisedSettings
    options: Sequence[OptionEntry]


class AdviceFile(Document):
    """``advice.json``: settings for a tolerance, with their expected error and cost.

    Attributes
    ----------
    date : str
        Date on which it was written.
    speed : Speed or None
        Measured speed of LIGGGHTS on this machine.
    cases : sequence of AdvisedCase
        One entry per process run.
    """

    study: str
    date: str
    versions: Mapping[str, str | None]
    speed: Speed | None
    cases: Sequence[AdvisedCase]


def question(case: Case, tolerance: float | None, quantity: str | None) -> Tolerance:
    """The tolerance that is advised for: of the command line, of the study, or the default.

    Raises
    ------
    pydantic.ValidationError
        The command line asks for what no study may.
    """
    base = case.asked or _DEFAULT_TOLERANCE
    named = {"tolerance": tolerance, "quantity": quantity}
    given = {name: value for name, value in named.items() if value is not None}
    return Tolerance.model_validate({**base.model_dump(), **given})


def own_option(case: Case, asked: Tolerance, tradeoff: Tradeoff) -> Option | None:
    """The measured option that a study without a tolerance has chosen itself, if it has."""
    if case.asked is not None or asked.quantity == RESTITUTION:
        return None
    fidelity = case.study.chosen_fidelity()
    for option in process_options(case, tradeoff, asked):
        if option.same_settings(fidelity):
            return replace(option, fidelity=fidelity)
    return None


def roles(advice: Advice, own: Option | None) -> Iterator[tuple[str, Option]]:
    """Roles and options of an advice, each option once."""
    found = {
        "advised": advice.chosen,
        "cheaper": advice.cheaper,
        "dearer": advice.dearer,
        "reference": advice.reference,
        "own": own,
    }
    seen: list[Option] = []
    for role, option in found.items():
        if option is not None and option not in seen:
            seen.append(option)
            yield role, option


def forecast(
    case: Case,
    role: str,
    option: Option,
    speed: Speed | None,
    results: Path,
    tradeoff: Tradeoff,
) -> Forecast:
    """Steps and wall time of an option.

    Parameters
    ----------
    case : Case
        Of the study.
    role : str
    option : Option
    speed : Speed or None
        Of this machine; None: what earlier runs took, or an assumption.
    results : Path
        The study's results.
    tradeoff : Tradeoff
        What steps of soft particles cost.
    """
    chosen = replace(case, study=with_option(case.study, option))
    process = process_scene(chosen)
    about_drop = option.drop_timestep_fraction is not None
    kinds = [DROP_TEST] if about_drop else [FILLING, PROCESS]
    costs = {
        kind.name: _cost(kind, kind.build(chosen, None), speed, results, tradeoff) for kind in kinds
    }
    return Forecast(
        role=role,
        option=option,
        case=chosen,
        inputs=process.case.inputs,
        steps={scene: cost.steps for scene, cost in costs.items()},
        wall_times_s={scene: cost.wall_time_s for scene, cost in costs.items()},
        source=list(costs.values())[-1].source,
    )


def _cost(
    kind: SceneType, scene: StudyScene, speed: Speed | None, results: Path, tradeoff: Tradeoff
) -> Cost:
    """Steps and wall time of a scene, by the speed of this machine if it was measured."""
    if speed is None or kind.single_particle:
        return expected_cost(kind, scene, measured_speeds(results / kind.name))
    here = speed.of(scene.case.media.count)
    rate = here.filling_steps_per_s
    if kind is PROCESS:
        modulus = scene.case.fidelity.youngs_modulus_scale
        rate = here.drag_steps_per_s * step_cost(SCALE, tradeoff) / step_cost(modulus, tradeoff)
    ranks = f"{speed.ranks} rank{'s' if speed.ranks > 1 else ''}"
    return Cost(scene.steps, scene.steps / rate, f"a short run of this study, {ranks}")


def advice_file(
    case: Case, advices: Sequence[tuple[Advice, Sequence[Forecast]]], speed: Speed | None
) -> AdviceFile:
    """The content of ``advice.json``."""
    return AdviceFile(
        study=case.study_name,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        versions={"dragdeck": __version__, "engine": speed.engine_version if speed else None},
        speed=speed,
        cases=[
            AdvisedCase(
                case=rows[0].case.name,
                run=PROCESS.run_id(rows[0].case),
                asked=advice.for_case,
                options=[row.for_file() for row in rows],
            )
            for advice, rows in advices
        ],
    )


def tables(
    case: Case, advice: Advice, rows: Sequence[Forecast], own: Option | None
) -> Iterator[Table]:
    """What `dragdeck advise` prints of a case: the options, and what must be said of them."""
    asked = advice.asked
    title = f"{case.study_name} {case.name}: {advice.label} within {percent(asked.tolerance)}"
    table = Table(title=title, title_justify="left")
    for name in ("", "settings", "error (95 %)", "bound", "cost", "steps", "wall time"):
        table.add_column(name)
    for row in rows:
        option = row.option
        error = "reference" if option.error is None else _error_text(option.error)
        bound = "" if option.error is None else percent(option.error.bound)
        style = "bold" if row.role == "advised" else None
        cost, steps = f"{option.relative_cost:.3g}", f"{sum(row.steps.values()):,}"
        wall = shown_time(sum(row.wall_times_s.values()))
        table.add_row(row.role, str(option), error, bound, cost, steps, wall, style=style)
    yield table
    said = Table(show_header=False)
    said.add_column(style="bold")
    said.add_column()
    for what, text in [*remarks(advice, case.study), *_about(case, advice, rows[0], own)]:
        said.add_row(what, text)
    yield said


def _about(
    case: Case, advice: Advice, advised: Forecast, own: Option | None
) -> Iterator[tuple[str, str]]:
    runs = " and ".join(advised.steps)
    yield "cost", f"CPU time of {runs} / that of the reference; advised: 1/{advice.speedup:.3g}"
    if skin := advice.chosen.fidelity.skin_m:
        yield "neighbour skin", f"{1e3 * skin:.3g} mm"
    yield "errors", f"relative to the reference settings, {advice.source}"
    yield "wall time", f"{runs}; speed: {advised.source}"
    if case.asked is None:
        yield "tolerance", "the study sets no tolerance and keeps its own fidelity"
    if case.asked is None and advice.chosen.drop_timestep_fraction is None:
        yield "own fidelity", _of_own(case, advice, own)


def _of_own(case: Case, advice: Advice, own: Option | None) -> str:
    """What is known of the fidelity of a study that asks for no tolerance."""
    name, settings = case.fidelity_name, case.study.chosen_fidelity()
    if advice.reference.same_settings(settings):
        return f"{name} has the reference settings"
    if own is None or own.error is None:
        return f"{name} is not among the measured settings that apply here"
    return (
        f"{name}: error of {advice.label} {_error_text(own.error)}, "
        f"bound {percent(own.error.bound)}, cost {own.relative_cost:.3g}"
    )


def remarks(advice: Advice, study: Study) -> list[tuple[str, str]]:
    """What must be said of an advice: a heading and a sentence each."""
    found = [("outside", str(number)) for number in advice.outside]
    if advice.outside:
        text = (
            f"the error is therefore limited to {percent(advice.held_to)} (an assumption: its "
            "growth outside the measured range is unknown)"
        )
        found.append(("safe side", text))
    if advice.chosen.extrapolated:
        text = (
            f"the {advice.label} of the run is extrapolated to the physical Young's modulus; the "
            "error is that of the extrapolation; the report shows both values"
        )
        found.append(("extrapolated", text))
    if advice.fallback:
        found.append(("fallback", advice.fallback))
    cheaper = advice.cheaper
    if cheaper is not None and cheaper.error is not None:
        bound = cheaper.error.limit
        text = f"error up to {percent(bound)}, {percent(bound - advice.held_to)} above the limit"
        found.append(("cheaper", f"{cheaper}: {text}"))
    if advice.spread is not None:
        found.append(("scatter", _of_chance(advice, advice.spread, study)))
    return found


def _of_chance(advice: Advice, spread: Spread, study: Study) -> str:
    """The uncertainty of one run, and what would bring it below the tolerance."""
    text = (
        f"the {advice.label} of a single run has a 95 % confidence interval of +/- "
        f"{percent(spread.half_width)} over {spread.counted_m:.3g} m of path in the statistics"
    )
    if spread.half_width <= advice.asked.tolerance:
        return text
    length = spread.needed_m + study.motion.uncounted_m
    around = study.motion.path.revolution_m
    whole = f"{length:.3g} m" if around is None else f"{length / around:.3g} revolutions"
    seeds = math.ceil(spread.needed_m / spread.counted_m)
    return f"{text}: more than the tolerance, which requires {whole} or the mean of {seeds} seeds"


def _error_text(error: MeasuredError) -> str:
    """An error with its interval."""
    return f"{signed(error.value)} ({signed(error.ci95_low)} to {signed(error.ci95_high)})"
