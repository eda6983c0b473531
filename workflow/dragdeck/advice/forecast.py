"""What a study's runs will take: `dragdeck advise`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from rich.table import Table

from dragdeck import __version__
from dragdeck.advice.advise import SCALE, Advice, Option, shown_share, step_cost, with_option
from dragdeck.cases.case import Case
from dragdeck.engine.reports import shown_time
from dragdeck.outlook.explain import Cost, expected_cost, measured_speeds
from dragdeck.records.advice import AdviceFile, AdvisedCase, OptionEntry, SettingsOfOption, Speed
from dragdeck.records.tradeoff import TradeoffRecord
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.lead import FIRST_WINDOWS, with_leads
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.scene import SceneType, StudyScene
from dragdeck.study.base import Json
from dragdeck.study.model import Tolerance

_DEFAULT_TOLERANCE = Tolerance(tolerance=0.1)
"""What is advised for where a study asks for nothing."""

_OF_WINDOWS = (
    "windows are run until the 95 % confidence interval of each quantity at the physical Young's "
    f"modulus is inside it; steps and wall time are those of {FIRST_WINDOWS}"
)

_OF_STIFF_RUN = (
    "windows would take most of the path: the whole drag has the physical Young's modulus"
)


@dataclass(frozen=True)
class Forecast:
    """What an option costs on this machine.

    Attributes
    ----------
    role : str
        ``advised`` or ``reference``.
    option : Option
    case : Case
        With the option's settings.
    inputs : mapping
        Of the process run, as in its ``case.json``: tells which run this is about.
    steps : mapping of str to int
        Of each scene that the tolerance concerns: fill and process, or the drop; a softer run and
        the first windows count in the process.
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

    def for_file(self) -> OptionEntry:
        """An entry of ``options`` in ``advice.json``."""
        chosen = self.case.study.chosen_fidelity()
        return OptionEntry(
            role=self.role,
            settings=SettingsOfOption(**chosen.model_dump() | {"ranks": self.case.ranks}),
            drop_timestep_fraction=self.option.drop_timestep_fraction,
            error=self.option.error,
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


def roles(advice: Advice) -> Iterator[tuple[str, Option]]:
    """Roles and options of an advice, each option once."""
    yield "advised", advice.chosen
    if advice.reference != advice.chosen:
        yield "reference", advice.reference


def forecast(
    case: Case,
    role: str,
    option: Option,
    speed: Speed | None,
    results: Path,
    tradeoff: TradeoffRecord,
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
    tradeoff : TradeoffRecord
        What steps of soft particles cost.
    """
    chosen = replace(case, study=with_option(case.study, option))
    process = process_scene(chosen)
    about_drop = option.drop_timestep_fraction is not None
    costs = {}
    for kind in [DROP_TEST] if about_drop else [FILLING, PROCESS]:
        runs = with_leads([chosen]) if kind is PROCESS else [chosen]
        scenes = (kind.build(one, None) for one in runs if one.rank_of_window <= FIRST_WINDOWS)
        found = [_cost(kind, scene, speed, results, tradeoff) for scene in scenes]
        steps, time = sum(one.steps for one in found), sum(one.wall_time_s for one in found)
        costs[kind.name] = Cost(steps, time, found[-1].source)
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
    kind: SceneType, scene: StudyScene, speed: Speed | None, results: Path, tradeoff: TradeoffRecord
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


def advice_tables(case: Case, advice: Advice, rows: Sequence[Forecast]) -> Iterator[Table]:
    """What `dragdeck advise` prints of a case: the options, and what must be said of them."""
    asked = advice.asked
    what = ", ".join(asked.quantities)
    title = f"{case.study_name} {case.name}: {what} within {shown_share(asked.tolerance)}"
    table = Table(title=title, title_justify="left")
    for name in ("", "settings", "cost", "steps", "wall time"):
        table.add_column(name)
    for row in rows:
        style = "bold" if row.role == "advised" else None
        cost, steps = _cost_text(row.option), f"{sum(row.steps.values()):,}"
        wall = shown_time(sum(row.wall_times_s.values()))
        table.add_row(row.role, str(row.option), cost, steps, wall, style=style)
    yield table
    said = Table(show_header=False)
    said.add_column(style="bold")
    said.add_column()
    for heading, text in _about(case, advice, rows[0]):
        said.add_row(heading, text)
    yield said


def _cost_text(option: Option) -> str:
    least, most = f"{option.relative_cost:.3g}", f"{option.largest_cost:.3g}"
    return least if least == most else f"{least} to {most}"


def _about(case: Case, advice: Advice, advised: Forecast) -> Iterator[tuple[str, str]]:
    runs, chosen = " and ".join(advised.steps), advice.chosen.fidelity
    yield "cost", f"CPU time of {runs} / that of the reference"
    if advice.chosen.error is not None:
        yield "error", f"largest measured error of an impact: {shown_share(advice.chosen.error)}"
    elif chosen.windows is not None:
        yield "tolerance", _OF_WINDOWS
    elif chosen.soft_start is not None:
        yield "tolerance", _OF_STIFF_RUN
    if advice.fallback:
        yield "fallback", advice.fallback
    if skin := chosen.skin_m:
        yield "neighbour skin", f"{1e3 * skin:.3g} mm"
    yield "wall time", f"{runs}; speed: {advised.source}"
    if case.asked is None:
        yield "own fidelity", "the study sets no tolerance and keeps its own fidelity"
