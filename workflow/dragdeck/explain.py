"""What a deck models, what it leaves out, and what it is expected to cost."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from dragdeck.advice import trade_if_measured
from dragdeck.scenes import Scene

ASSUMED_BALL_STEPS_PER_S = {"drop": 1.5e6, "fill": 9e6, "process": 7e6}
"""Balls times steps a second, seen on two shared cores with two ranks. Stands
in until a run of the same study and scene has been measured here."""


@dataclass(frozen=True)
class Cost:
    """An expected cost and where the expectation comes from."""

    steps: int
    wall_time_s: float
    source: str


def expected_cost(scene: Scene, results: Path) -> Cost:
    """Steps and wall time to expect.

    Parameters
    ----------
    scene : Scene
    results : Path
        The folder of the study's runs of this scene: measured ones are used, those with
        as many balls if there are any, the others as if a step took a time a ball.
    """
    drop = scene.deck.scene == "drop"
    count = 1 if drop else scene.case["media"]["count"]
    measured = [(1 if drop else balls, rate) for balls, rate in _measured(results)]
    measured = [(balls, rate) for balls, rate in measured if balls == count] or measured
    if measured:
        rate = sum(balls / count * rate for balls, rate in measured) / len(measured)
        return Cost(scene.steps, scene.steps / rate, f"{len(measured)} run(s) of this study here")
    rate = ASSUMED_BALL_STEPS_PER_S[scene.deck.scene] / count
    return Cost(scene.steps, scene.steps / rate, "assumed: no run of this study measured here")


def _measured(results: Path) -> Iterable[tuple[int, float]]:
    """Balls and steps a second of each run."""
    for file in results.glob("*/run.json"):
        speed = json.loads(file.read_text(encoding="utf-8"))["steps_per_s"]
        case = file.with_name("case.json")
        if speed and case.is_file():
            media = json.loads(case.read_text(encoding="utf-8"))["media"]
            yield int(media["count"]), float(speed)


def price_of(name: str, trade: Mapping[str, Any]) -> str:
    """What putting a thing back costs, as measured.

    Parameters
    ----------
    name : str
        A variant of `dragdeck.costs`.
    trade : mapping
        Its ``costs`` give for each variant the ratio of processor times, with a
        95 % interval if there were rounds enough for one.
    """
    found = next((cost for cost in trade.get("costs", ()) if cost["name"] == name), None)
    if found is None:
        return "cost of putting it back: not measured"
    return f"putting it back costs {_ratio(found, trade)}"


def cheaper_choices(scene: str, trade: Mapping[str, Any]) -> Iterable[tuple[str, str]]:
    """What was measured to make a scene cheaper, beyond doubt, by a simulated second."""
    for cost in trade.get("costs", ()):
        sure = cost["high"] is not None and cost["high"] < 1
        if sure and cost["scene"] == scene and cost.get("unit", "per_second") == "per_second":
            yield cost["what"], f"{_ratio(cost, trade)}; what it does to the results is not said"


def _ratio(cost: Mapping[str, Any], trade: Mapping[str, Any]) -> str:
    interval = "" if cost["low"] is None else f" ({cost['low']:.3g} to {cost['high']:.3g})"
    engine, date = trade["versions"]["engine"], trade["measured"]
    return f"{cost['ratio']:.3g}x{interval}, LIGGGHTS {engine}, {date}"


def explanation(
    scene: Scene,
    cost: Cost,
    notes: Iterable[tuple[str, str]] = (),
    trade: Mapping[str, Any] | None = None,
) -> Table:
    """The table of one scene.

    Parameters
    ----------
    scene : Scene
    cost : Cost
    notes : iterable of (str, str)
        What its time step means for each pair of bodies.
    trade : mapping, optional
        Measured costs, if not those of `trade_if_measured`.
    """
    trade = trade_if_measured() if trade is None else trade
    deck = scene.deck
    table = Table(title=f"{deck.study}: {deck.scene} {deck.run}", title_justify="left")
    table.add_column("")
    table.add_column("what", style="bold")
    table.add_column("why or how much")
    for what, why in scene.models.items():
        table.add_row("models", what, why)
    table.add_section()
    for what, left in scene.leaves_out.items():
        price = f"; {price_of(left.cost, trade)}" if left.cost else ""
        table.add_row("leaves out", what, f"{left.why}{price}")
    table.add_section()
    rayleigh = scene.case["rayleigh_time_s"]
    share = deck.timestep_s / rayleigh
    table.add_row("costs", "time step", f"{deck.timestep_s:.3g} s, {100 * share:.3g} % of Rayleigh")
    table.add_row("", "steps", f"about {cost.steps:,}")
    minutes, seconds = divmod(round(cost.wall_time_s), 60)
    table.add_row("", "wall time", f"about {minutes} min {seconds:02d} s ({cost.source})")
    for what, text in cheaper_choices(deck.scene, trade):
        table.add_row("cheaper", what, text)
    table.add_section()
    for what, text in notes:
        table.add_row("expects", what, text)
    for warning in scene.warnings:
        table.add_section()
        table.add_row("warning", warning, "", style="yellow")
    return table


def show(tables: Iterable[Table]) -> None:
    """Print tables, wide enough for their text when nobody looks at a terminal."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=150)
    for table in tables:
        console.print(table)
