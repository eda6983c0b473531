"""What a study's runs will take: `./run dragdeck advise`."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from rich.table import Table

from dragdeck import __version__
from dragdeck.advice.advise import Advice, Option, advised_settings, shown_share, with_option
from dragdeck.advice.smaller_scenes import smaller_scenes
from dragdeck.cases.case import Case
from dragdeck.engine.reports import shown_time
from dragdeck.outlook.explain import expected_cost, measured_speeds
from dragdeck.records.advice import AdviceFile, AdvisedCase, OptionEntry, SettingsOfOption, WayEntry
from dragdeck.records.tradeoff import TradeoffRecord
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.lead import FIRST_WINDOWS, with_leads
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.study.fidelity import RESTITUTION, Tolerance

_DEFAULT_TOLERANCE = Tolerance(tolerance=0.1)
"""What is advised for where a study asks for nothing."""

_OF_WINDOWS = (
    "windows are run until the 95 % confidence interval of each quantity at the physical Young's "
    "modulus is inside it, or the whole drag where that costs less; steps and wall time are those "
    f"of {FIRST_WINDOWS}"
)

_OF_STIFF_RUN = (
    "windows would take most of the path: the whole drag has the physical Young's modulus"
)


def question(case: Case, tolerance: float | None, quantity: str | None) -> Tolerance:
    """The tolerance that is advised for: of the command line, of the study, or the default.

    Raises
    ------
    pydantic.ValidationError
        The command line asks for what no study may.
    """
    base = case.requested or _DEFAULT_TOLERANCE
    named = {"tolerance": tolerance, "quantity": quantity}
    given = {name: value for name, value in named.items() if value is not None}
    return Tolerance.model_validate({**base.model_dump(), **given})


def advised_case(
    case: Case, advice: Advice, results: Path, tradeoff: TradeoffRecord
) -> AdvisedCase:
    """A case of ``advice.json``: its options with their steps and wall time.

    Parameters
    ----------
    case : Case
        Of the study.
    advice : Advice
    results : Path
        The study's results: what earlier runs took, or else an assumption, gives the speed.
    tradeoff : TradeoffRecord
        What steps cost.
    """
    chosen = replace(case, study=with_option(case.study, advice.chosen))
    return AdvisedCase(
        case=chosen.name,
        run=PROCESS.run_id(chosen),
        asked=advice.for_case,
        options=[_forecast(case, role, option, results) for role, option in _roles(advice)],
        ways=[*_ways(advice)],
        smaller_scenes=smaller_scenes(case, advice.requested.quantities, tradeoff),
    )


def _ways(advice: Advice) -> Iterator[WayEntry]:
    """The ways of an advice, the cheapest first, with their cost over that of the reference."""
    for way in sorted(advice.ways, key=lambda way: way.relative_cost):
        half = way.half_width if math.isfinite(way.half_width) else None
        yield WayEntry(name=way.name, half_width=half, relative_cost=way.relative_cost)


def _roles(advice: Advice) -> Iterator[tuple[str, Option]]:
    """Roles and options of an advice, each option once."""
    yield "advised", advice.chosen
    if advice.reference != advice.chosen:
        yield "reference", advice.reference


def _forecast(case: Case, role: str, option: Option, results: Path) -> OptionEntry:
    """Steps and wall time of an option: a softer run and the first windows count in the process."""
    chosen = replace(case, study=with_option(case.study, option))
    steps, wall_times_s, source = {}, {}, ""
    about_drop = option.drop_timestep_fraction is not None
    for kind in [DROP_TEST] if about_drop else [FILLING, PROCESS]:
        runs = with_leads([chosen]) if kind is PROCESS else [chosen]
        scenes = (
            kind.build(member, None) for member in runs if member.rank_of_window <= FIRST_WINDOWS
        )
        speeds = measured_speeds(results / kind.name)
        costs = [expected_cost(kind, scene, speeds) for scene in scenes]
        steps[kind.name] = sum(cost.steps for cost in costs)
        wall_times_s[kind.name] = sum(cost.wall_time_s for cost in costs)
        source = costs[-1].source
    settings = chosen.study.chosen_fidelity().model_dump() | {"ranks": chosen.ranks}
    return OptionEntry(
        role=role,
        settings=SettingsOfOption(**settings),
        drop_timestep_fraction=option.drop_timestep_fraction,
        error=option.error,
        relative_cost=option.relative_cost,
        inputs=process_scene(chosen).case.study.inputs(),
        steps=steps,
        wall_time_s=wall_times_s,
        steps_per_s={scene: round(n / wall_times_s[scene], 1) for scene, n in steps.items()},
        source=source,
    )


def advice_file(case: Case, cases: Sequence[AdvisedCase]) -> AdviceFile:
    """The content of ``advice.json``."""
    return AdviceFile(
        study=case.study_name,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        versions={"dragdeck": __version__},
        cases=cases,
    )


def advice_tables(case: Case, advice: Advice, advised: AdvisedCase) -> Iterator[Table]:
    """What `./run dragdeck advise` prints of a case: the options, and what must be said of them."""
    requested = advice.requested
    what = ", ".join(requested.quantities)
    title = f"{case.study_name} {case.name}: {what} within {shown_share(requested.tolerance)}"
    table = Table(title=title, title_justify="left")
    for name in ("", "settings", "cost", "steps", "wall time"):
        table.add_column(name)
    for (role, option), row in zip(_roles(advice), advised.options, strict=True):
        style = "bold" if role == "advised" else None
        cost, steps = _cost_text(option), f"{sum(row.steps.values()):,}"
        wall = shown_time(sum(row.wall_time_s.values()))
        table.add_row(role, str(option), cost, steps, wall, style=style)
    yield table
    for title, ways in (("ways", advised.ways), ("smaller scenes", advised.smaller_scenes)):
        if ways:
            yield _ways_table(title, ways, requested)
    said = Table(show_header=False)
    said.add_column(style="bold")
    said.add_column()
    for heading, text in _about(case, advice, advised.options[0]):
        said.add_row(heading, text)
    yield said


def ways_in_words(case: Case, tradeoff: TradeoffRecord) -> str:
    """What the ways to a case's tolerance are expected to give and to cost; empty without one."""
    requested = case.requested
    if requested is None or case.part or RESTITUTION in requested.quantities:
        return ""
    ways = list(_ways(advised_settings(case, requested, tradeoff)))
    shown = [f"{way.name} ({_half_width(way.half_width)}, {way.relative_cost:.2g})" for way in ways]
    known = [way.half_width for way in ways if way.half_width is not None]
    packings = math.ceil((min(known, default=0.0) / requested.tolerance) ** 2)
    short = f"; none is expected to reach it: about {packings:,} packings (sweep: seed) would"
    what = f"{', '.join(requested.quantities)} within {shown_share(requested.tolerance)}"
    return (
        f"ways to {what}, with the expected half-width and the cost relative to a plain run: "
        f"{', '.join(shown) or 'none is cheaper than that'}{short if packings > 1 else ''}"
    )


def _half_width(half_width: float | None) -> str:
    return "not known" if half_width is None else shown_share(half_width)


def _ways_table(what: str, ways: Sequence[WayEntry], requested: Tolerance) -> Table:
    """What each way is expected to give, and to cost."""
    title = f"{what}, with the half-width expected from other scenes"
    table = Table(title=title, title_justify="left")
    for name in ("", "half-width", "cost"):
        table.add_column(name)
    for way in ways:
        enough = way.half_width is not None and way.half_width <= requested.tolerance
        table.add_row(
            way.name,
            _half_width(way.half_width),
            f"{way.relative_cost:.3g}",
            style="bold" if enough else None,
        )
    return table


def _cost_text(option: Option) -> str:
    least, most = f"{option.relative_cost:.3g}", f"{option.largest_cost:.3g}"
    return least if least == most else f"{least} to {most}"


def _about(case: Case, advice: Advice, advised: OptionEntry) -> Iterator[tuple[str, str]]:
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
    if case.requested is None:
        yield "own fidelity", "the study sets no tolerance and keeps its own fidelity"
