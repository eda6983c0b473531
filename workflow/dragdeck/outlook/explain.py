"""What a deck models, what it leaves out, and what it is expected to cost."""

import json
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from dragdeck.records.tradeoff import CostEntry, TradeoffRecord
from dragdeck.scenes.bed_space import particles_step_s
from dragdeck.scenes.scene import SceneType, StudyScene
from dragdeck.scenes.workpiece import FACET_STEP_S


@dataclass(frozen=True)
class Cost:
    """An expected cost and where the expectation comes from."""

    steps: int
    wall_time_s: float
    source: str

    @property
    def basis(self) -> str:
        """Whether its speed is ``measured`` or ``assumed``."""
        return "assumed" if self.source.startswith("assumed") else "measured"


def expected_cost(kind: SceneType, scene: StudyScene, speeds: Sequence[tuple[int, float]]) -> Cost:
    """Steps and wall time to expect.

    Parameters
    ----------
    kind : SceneType
    scene : Scene
        A case of that kind.
    speeds : sequence of (int, float)
        The `measured_speeds` of the study's runs of this scene: those with as many particles
        count if there are any, the others as if a step took a time per particle.
    """
    single = kind.single_particle
    count = 1 if single else scene.case.media.n_spheres
    measured = [(1 if single else particles, rate) for particles, rate in speeds]
    measured = [(particles, rate) for particles, rate in measured if particles == count] or measured
    if measured:
        rate = sum(particles / count * rate for particles, rate in measured) / len(measured)
        return Cost(scene.steps, scene.steps / rate, f"{len(measured)} run(s) of this study here")
    particles_s = particles_step_s(count, kind.particle_steps_per_s)
    rate = 1 / (particles_s + scene.facets * FACET_STEP_S)
    return Cost(scene.steps, scene.steps / rate, "assumed: no run of this study measured here")


def measured_speeds(results: Path) -> list[tuple[int, float]]:
    """Particles and steps per second of each complete run in a folder."""
    speeds = []
    for file in results.glob("*/run.json"):
        with suppress(OSError, ValueError, LookupError, TypeError):  # damaged: tells nothing
            speed = json.loads(file.read_text(encoding="utf-8"))["steps_per_s"]
            media = json.loads(file.with_name("case.json").read_text(encoding="utf-8"))["media"]
            speeds += [(int(media.get("spheres", media["count"])), float(speed))] if speed else []
    return speeds


def price_of(name: str, tradeoff: TradeoffRecord) -> str:
    """What putting a thing back costs, as measured.

    Parameters
    ----------
    name : str
        Name of an entry of the record.
    tradeoff : TradeoffRecord
        Its costs give for each variant the ratio of processor times, with a
        95 % interval if there were rounds enough for one.
    """
    cost = tradeoff.cost(name)
    if cost is None:
        return "cost of enabling it: not measured"
    return f"enabling it costs {_ratio(cost, tradeoff)}"


def _cheaper_choices(scene: str, tradeoff: TradeoffRecord) -> Iterable[tuple[str, str]]:
    """What was measured to make a scene cheaper, beyond doubt, by a simulated second."""
    for cost in tradeoff.costs:
        sure = cost.ci95_high is not None and cost.ci95_high < 1
        if sure and cost.scene == scene and cost.unit == "per_second":
            yield (
                cost.what,
                f"{_ratio(cost, tradeoff)}; its effect on the results is not stated here",
            )


def _ratio(cost: CostEntry, tradeoff: TradeoffRecord) -> str:
    interval = "" if cost.ci95_low is None else f" ({cost.ci95_low:.3g} to {cost.ci95_high:.3g})"
    engine, date = tradeoff.versions["engine"], tradeoff.measured
    return f"{cost.ratio:.3g}x{interval}, LIGGGHTS {engine}, {date}"


def scene_lines(scene: StudyScene, runs: int, width: int) -> Iterator[str]:
    """The lines of one scene on a page that fits a terminal: names without reasons and prices.

    Parameters
    ----------
    scene : Scene
        Of the first of its runs.
    runs : int
        How many there are.
    width : int
        Of the page, characters.
    """
    yield f"{scene.deck.scene} {scene.deck.run}" + (f" and {runs - 1} more" if runs > 1 else "")
    for name, texts in (("models", scene.models), ("leaves out", scene.leaves_out)):
        yield from textwrap.wrap(
            "; ".join(texts), width, initial_indent=f"  {name:<11}", subsequent_indent=13 * " ",
            max_lines=2, placeholder=" ...",
        )  # fmt: skip


def explanation(scene: StudyScene, tradeoff: TradeoffRecord) -> Table:
    """The table of one scene, with measured costs of what it leaves out."""
    deck = scene.deck
    table = Table(title=f"{deck.study}: {deck.scene} {deck.run}", title_justify="left")
    table.add_column("")
    table.add_column("what", style="bold")
    table.add_column("why or how much")
    for what, why in scene.models.items():
        table.add_row("models", what, why)
    table.add_section()
    for what, left in scene.leaves_out.items():
        price = f"; {price_of(left.cost, tradeoff)}" if left.cost else ""
        table.add_row("leaves out", what, f"{left.why}{price}")
    table.add_section()
    for what, text in _cheaper_choices(deck.scene, tradeoff):
        table.add_row("cheaper", what, text)
    return table


def show(tables: Iterable[Table]) -> None:
    """Print tables, wide enough for their text when nobody looks at a terminal."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=150)
    for table in tables:
        console.print(table)
