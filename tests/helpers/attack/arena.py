"""Where one attack on the finished study takes place, and how its end is judged."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from attack.calls import LARGEST_FILE, Call, Said, engines, gone_within, kill, main_of
from attack.disk import Disk, small_disk
from attack.ground import CleanRuns, Ground, Phase, differences, resumed_at

ENGINE_PHASES = ("drop test", "filling", "process")
PHASES = (*ENGINE_PHASES, "tables", "chains", "loading", "figures", "report")

ENDS_WITHIN_S = 5.0
"""An engine whose runner was killed is gone after this time, s."""

MOST_TRIES = 4


@dataclass(frozen=True)
class Arena:
    """A folder for the attack, and the study that nobody disturbed."""

    folder: Path
    ground: Ground
    clean: CleanRuns

    def phase(self, place: str) -> Phase:
        """The command that runs the engine for a scene."""
        return self.ground.phases[place.replace("_", " ")]

    @contextmanager
    def disk(self) -> Iterator[Disk]:
        """A small disk; skips the attack where none can be mounted."""
        with small_disk(self.folder) as disk:
            if disk is None:
                pytest.skip("a small disk can be mounted by root only")
            yield disk

    @contextmanager
    def bounded(self) -> Iterator[Path]:
        """A folder to be, for a project, on a small disk where one can be mounted."""
        with small_disk(self.folder) as disk:
            yield (disk.folder if disk else self.folder) / "project"

    def again(self, phase: Phase, project: Path) -> Said:
        """Make the same call again: it answers, and one engine at most runs, and to its end."""
        running = Call(phase.words, project, self.folder / "again.log")
        before: set[int] = set()

        def doubled() -> bool:
            """Two of them at two looks: one look takes longer than an engine takes to follow."""
            nonlocal before
            found = {engine.pid for engine in engines(project)}
            both, before = found & before, found
            return len(both) > 1

        if phase.engine and running.wait_until(doubled, poll_s=0.1):
            kill([*running.tree(), *engines(project)])
            running.wait()
            pytest.fail("two engines in one folder")
        said = running.wait()
        assert not said.has_traceback, said.tail
        assert said.status is not None, f"no answer: {said.tail}"
        assert_no_engine(project, 1.0)
        assert_bounded(project)
        return said

    def finish(self, phase: Phase, project: Path, said_before: str = "") -> None:
        """The same call again gives the tables that nobody disturbed."""
        said = self.again(phase, project)
        assert said.status == 0, f"refused: {said_before}\nthen: {said.tail}"
        self.assert_same_tables(phase, project)

    def assert_same_tables(self, phase: Phase, project: Path) -> None:
        """A phase has made what it makes undisturbed, to the last bit of every column."""
        found, wanted, steps = project / phase.run, self.ground.root / phase.run, []
        if phase.engine:
            made = main_of("dragchain", ["tables", phase.run], project)
            assert made.status == 0, f"complete, but tables refuse: {made.tail}"
            steps = resumed_at(found)
            wanted = self.clean.tables(found.parent.name, steps)
            found = found / "tables"
        else:
            wanted = self._only_so_far(wanted, phase)
        problems = differences(found, wanted) + self._cut_pictures(project, phase)
        assert not problems, f"resumed at {steps}: {problems}"

    def _only_so_far(self, wanted: Path, phase: Phase) -> Path:
        """The undisturbed folder with the files that there are after a phase."""
        order = list(self.ground.phases.values())
        place = [each.name for each in order].index(phase.name)
        if place + 1 == len(order):
            return wanted
        return self.ground.copy_before(order[place + 1], self.folder / "wanted") / phase.run

    def _cut_pictures(self, project: Path, phase: Phase) -> list[str]:
        """Figures and pages that were not made, or are cut."""
        made = (self.ground.root / phase.run).rglob("*")
        own = {
            "loading": lambda file: file.stem == "workpiece",
            "figures": lambda file: file.stem != "workpiece",
            "report": lambda file: True,
        }.get(phase.name, lambda file: False)
        problems = []
        for file in made:
            if file.suffix in (".png", ".html") and own(file):
                other = project / file.relative_to(self.ground.root)
                if not other.is_file() or other.stat().st_size < 0.9 * file.stat().st_size:
                    problems.append(f"{file.name} is missing or cut")
        return problems


def assert_no_engine(project: Path, within_s: float) -> None:
    """No engine of a project goes on for more than some seconds of processor time."""
    left = not gone_within(project, within_s)
    kill(engines(project))
    assert not left, "an engine is left over"


def assert_bounded(project: Path) -> None:
    """Nothing wrote without end until the limit of a file's size."""
    files = [file for file in project.rglob("*") if file.is_file()]
    endless = [file.name for file in files if file.stat().st_size >= 0.9 * LARGEST_FILE]
    assert not endless, f"endless output: {endless}"
