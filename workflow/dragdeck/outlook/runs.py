"""The runs of a study: what each is expected to take, how far it is, and how long all will take."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from dragdeck.cases.case import Case
from dragdeck.decks.outputs import OutputOfRun
from dragdeck.engine.reports import shown_bytes, shown_time
from dragdeck.engine.space import expected_bytes
from dragdeck.engine.status import RunStatus, run_status
from dragdeck.errors import InputError
from dragdeck.outlook.explain import Cost, expected_cost, measured_speeds
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.lead import with_lead
from dragdeck.scenes.scene import SceneType, StudyScene

WAITING = RunStatus("waiting")

_SLOW, _LONG_S = 4.0, 60.0
"""A run is slow if its speed was estimated as so many times the measured one, and it still needs
so long: the first seconds tell the start of LIGGGHTS."""


@dataclass(frozen=True)
class StudyRun:
    """A run of LIGGGHTS: what it is expected to take, and how far it is.

    Attributes
    ----------
    scene : str
    folder : Path
    after : Path or None
        Folder of the filling or of the softer run that it starts from.
    ranks : int
    cost : Cost
        Expected for the whole run.
    size_bytes : float
        Expected on the disk.
    status : RunStatus
    """

    scene: str
    folder: Path
    after: Path | None
    ranks: int
    cost: Cost
    size_bytes: float
    status: RunStatus = WAITING

    @property
    def name(self) -> str:
        """Scene and run id."""
        return f"{self.scene} {self.folder.name}"

    def now(self) -> "StudyRun":
        """The same with the status that its folder has now."""
        return replace(self, status=run_status(self.folder))

    @property
    def fraction(self) -> float:
        """How much of it is done, by its steps; of a filling by the expected ones."""
        if self.status.state == "complete":
            return 1.0
        end = self.status.last or self.cost.steps
        return min(self.status.step / end, 0.99) if end else 0.0

    @property
    def left_s(self) -> float:
        """Wall time that it still needs: by its own speed where that is known. An estimate."""
        if self.status.final:
            return 0.0
        speed = self.status.steps_per_s
        if speed is None:
            return (1 - self.fraction) * self.cost.wall_time_s
        return max(0.0, ((self.status.last or self.cost.steps) - self.status.step) / speed)

    @property
    def basis(self) -> str:
        """Whether the speed behind `left_s` is ``measured`` or ``assumed``."""
        return "measured" if self.status.steps_per_s else self.cost.basis

    @property
    def cells(self) -> tuple[str, str, str]:
        """Percent, speed with what a filling waits for, and time, for a reader."""
        status, left = self.status, f"about {shown_time(self.left_s)} left"
        doing = f"{status.steps_per_s:,.0f} steps/s" if status.steps_per_s else ""
        if status.final:
            return "", doing, shown_time(status.wall_time_s) if status.wall_time_s else ""
        if not (status.last or self.cost.steps):  # of no study: nothing is expected of it
            return "", doing, ""
        if not status.step:
            return "", f"speed {self.cost.basis}", left
        if status.energy is not None and status.at_rest is not None:
            sign = ">" if status.energy > status.at_rest else "<"
            doing = f"{doing}, energy {status.energy:.1e} {sign} {status.at_rest:g}"
        if status.last is None and status.step >= self.cost.steps:
            left = "longer than expected"
        about = "" if status.last else "~"  # where a filling ends is an estimate
        return f"{about}{100 * self.fraction:.0f} %", doing.strip(", "), left

    @property
    def slow(self) -> str:
        """How far the measured speed is below the estimate, and why; empty if it is not far."""
        measured, time = self.status.steps_per_s or math.inf, self.cost.wall_time_s
        slower = self.cost.steps / measured / time if time else 0.0
        if self.status.state != "running" or slower < _SLOW or self.left_s < _LONG_S:
            return ""
        wait = "; MPI ranks wait for each other: use fewer fidelity.ranks"
        return (
            f"{slower:.0f} times slower than estimated: other processes may occupy the cores"
            f"{wait if self.ranks > 1 else ''}"
        )

    def __str__(self) -> str:
        said = f"{self.name}: {', '.join(filter(None, (self.status.state, *self.cells)))}"
        return "\n  ".join(filter(None, (said, self.slow)))


def alike_but_for_seed(runs: Mapping[Path, Case]) -> list[dict[Path, Case]]:
    """Runs by their folders, those that differ in the seed alone together: they cost the same."""
    groups: dict[str, dict[Path, Case]] = {}
    for folder, case in runs.items():
        but_for_the_seed = case.study.model_copy(update={"seed": 0}).model_dump_json()
        covers = with_lead(case).stretch
        groups.setdefault(f"{but_for_the_seed} {covers.end - covers.begin:.6f}", {})[folder] = case
    return list(groups.values())


def written(kind: SceneType, scene: StudyScene) -> tuple[dict[str, OutputOfRun], int]:
    """The outputs of a run by their names, and its number of spheres."""
    count = 1 if kind.single_particle else scene.case.media.n_spheres
    return {output.name: output.as_part() for output in scene.deck.outputs}, count


def expected_runs(
    kind: SceneType,
    runs: Mapping[Path, Case],
    build: Callable[[Mapping[Path, Case]], StudyScene] | None = None,
) -> Iterator[StudyRun]:
    """What runs of a scene are expected to take; those whose scene cannot be built are left out.

    Parameters
    ----------
    kind : SceneType
    runs : mapping of Path to Case
        By their folders.
    build : callable, optional
        The scene of runs that differ in the seed alone, if not that of `kind`.
    """
    speeds = measured_speeds(next(iter(runs)).parent) if runs else []
    for group in alike_but_for_seed(runs):
        first = next(iter(group.values()))
        try:
            scene = build(group) if build else kind.build(first, None)
        except InputError:
            continue
        size, cost = expected_bytes(*written(kind, scene)), expected_cost(kind, scene, speeds)
        ranks = 1 if kind.single_particle else first.ranks
        for folder, case in group.items():
            after = folder.parents[1] / FILLING.name / FILLING.run_id(case)
            if kind.needs_bed and (lead := with_lead(case).lead):
                after = folder.parents[1] / kind.name / kind.run_id(lead)
            yield StudyRun(kind.name, folder, after if kind.needs_bed else None, ranks, cost, size)


def by_their_speeds(runs: Sequence[StudyRun]) -> list[StudyRun]:
    """Runs, those of an assumed speed corrected by the speeds of others of the same scene."""
    seen: dict[str, list[float]] = {}
    for run in runs:
        speed = run.status.steps_per_s
        if speed and run.cost.wall_time_s:
            seen.setdefault(run.scene, []).append(run.cost.steps / speed / run.cost.wall_time_s)
    return [_corrected(run, seen.get(run.scene, [])) for run in runs]


def _corrected(run: StudyRun, slower: Sequence[float]) -> StudyRun:
    if not slower or run.cost.basis == "measured":
        return run
    time = run.cost.wall_time_s * sum(slower) / len(slower)
    return replace(run, cost=Cost(run.cost.steps, time, f"{len(slower)} run(s) of this study here"))


def time_left(runs: Sequence[StudyRun], cores: int) -> float:
    """Wall time that runs still need beside each other on so many cores. An estimate.

    No less than their work shared by all cores, and than any run with those before it.
    """
    by_folder = {run.folder: run for run in runs}
    work = sum(run.left_s * min(run.ranks, cores) for run in runs) / cores

    def chain(run: StudyRun | None) -> float:
        return run.left_s + chain(by_folder.get(run.after) if run.after else None) if run else 0.0

    return max(work, *map(chain, runs), 0.0)


def done_fraction(runs: Sequence[StudyRun]) -> float:
    """How much of the expected CPU time of runs is behind them."""
    work = [run.cost.wall_time_s * run.ranks for run in runs]
    done = sum(run.fraction * share for run, share in zip(runs, work, strict=True))
    return done / sum(work) if sum(work) else 1.0


def cost_in_words(runs: Sequence[StudyRun], cores: int) -> str:
    """Time and space that runs still need, in one line."""
    waiting = [run for run in runs if not run.status.final]
    bases = {run.basis for run in waiting}
    basis = "partly assumed" if bases == {"assumed", "measured"} else "".join(bases)
    said = f"about {shown_time(time_left(runs, cores))} on {cores} core{'s' if cores > 1 else ''}"
    size = shown_bytes(sum(run.size_bytes for run in waiting))
    return f"{said}, {size} (estimates; speed {basis})"


def plan_in_words(runs: Sequence[StudyRun], cores: int) -> list[str]:
    """What will be run, as lines for a reader."""
    todo = [run for run in runs if not run.status.final]
    lines = [f"{_counted(todo)}, {cost_in_words(todo, cores)}"] if todo else []
    for scene in dict.fromkeys(run.scene for run in todo):
        mine = [run for run in todo if run.scene == scene]
        size = shown_bytes(sum(run.size_bytes for run in mine))
        time = shown_time(time_left(mine, cores))
        lines.append(f"{scene}: {_counted(mine)}, about {time}, {size}")
    if ended := len(runs) - len(todo):
        lines.append(f"{ended} already ended: repeated only if the input script has changed")
    return lines


def _counted(runs: Sequence[StudyRun]) -> str:
    return f"{len(runs)} run{'s' if len(runs) != 1 else ''}"
