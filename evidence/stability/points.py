"""The points of a stability map with their runs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from dragchain.errors import TableError
from dragchain.run.case import load_outputs
from dragchain.run.completeness import RunRecord
from dragchain.run.run_parts import iter_frames, iter_prints
from dragdeck.decks import CASE_FILE
from dragdeck.decks.case_file import CaseOfStudy
from dragdeck.dumps.frame import Columns, Frame
from evidence.stability.impact import ImpactCase, ImpactOfRun
from evidence.stability.map import PointOfMap, PointsFile


@dataclass(frozen=True)
class PointRun:
    """A point with its run."""

    point: PointOfMap
    folder: Path

    @cached_property
    def case(self) -> CaseOfStudy | None:
        """What it models; None of a point that no deck could be written for."""
        file = self.folder / CASE_FILE
        return CaseOfStudy.read(file) if file.is_file() else None

    @cached_property
    def impact(self) -> ImpactOfRun | None:
        """How its bodies meet; None outside single impacts."""
        if self.point.regime != "impact" or self.case is None:
            return None
        return ImpactCase.read(self.folder / CASE_FILE).impact

    def frames(self, name: str) -> Iterator[Frame]:
        """Frames of a dump."""
        return iter_frames(self.folder, load_outputs(self.folder)[name])

    def prints(self, name: str) -> Iterator[Columns]:
        """Blocks of rows of a ``fix print`` output."""
        return iter_prints(self.folder, load_outputs(self.folder)[name])

    @cached_property
    def record(self) -> RunRecord | None:
        """How the run ended; None of a point that was not run.

        Raises
        ------
        TableError
            The run was interrupted.
        """
        file = self.folder / "state.json"
        if not file.is_file():
            return None
        record = RunRecord.read(file)
        if record.state in ("running", "stopped"):
            raise TableError(
                f"{self.folder}: this run was interrupted; `snakemake stability` goes on with it"
            )
        return record

    @property
    def sticks(self) -> bool:
        """Whether its contacts have friction, and so a tangential stiffness."""
        return self.point.number("friction") > 0.0

    @property
    def measurable(self) -> bool:
        """Whether the run came to its end.

        One that only built its neighbour lists too late, or whose contacts gain energy by the
        step, counts: its energy says something.
        """
        if self.record is None:
            return False
        failed = {check.code for check in self.record.failed_checks}
        return self.record.complete or set() < failed <= {"neighbour_builds", "stable_timestep"}


def read_points(lists: Sequence[Path]) -> list[PointRun]:
    """The points of lists.

    Raises
    ------
    InputError
        A list cannot be used.
    """
    return [
        PointRun(point, file.parent.parent / point.folder)
        for file in lists
        for point in PointsFile.read(file).points
    ]
