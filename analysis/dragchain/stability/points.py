"""The points of a stability map, as ``dragdeck step stability`` listed them, with their runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Literal

from dragchain.documents import Document, Part
from dragchain.errors import TableError
from dragchain.run.completeness import RunRecord
from dragchain.tables.run_folder import Run

_Regime = Literal["impact", "settle", "column", "drag"]


class Settings(Part):
    """All settings of a point but its step; some belong to single regimes."""

    youngs_modulus_pa: float
    speed_m_s: float | None = None
    restitution: float
    friction: float
    size_ratio: float | None = None
    angle_deg: float | None = None
    packing: Literal["stack", "bed"] | None = None
    load_factor: float | None = None
    workpiece_speed_m_s: float | None = None

    @property
    def given(self) -> dict[str, float | str]:
        """The settings of the point's regime by name."""
        return self.model_dump(exclude_none=True)


_SHOWN: Mapping[str, str] = {
    "youngs_modulus_pa": "E {:g} Pa",
    "speed_m_s": "{:g} m/s",
    "restitution": "e {:g}",
    "friction": "friction {:g}",
    "size_ratio": "size ratio {:g}",
    "angle_deg": "{:g} degrees",
    "packing": "{}",
    "load_factor": "load {:g} g",
    "workpiece_speed_m_s": "workpiece {:g} m/s",
}


class Point(Part):
    """A run of the map.

    Attributes
    ----------
    regime, axis, condition : str
        What it models, the setting that differs from the base point, and the name of all settings
        but the step.
    fraction : float
        Time step over the Rayleigh time of the smallest particle.
    reference : bool
        Whether it is the fine-step run of its condition.
    folder : str
        The run's, below that of the results.
    refused : str or None
        Why no deck could be written.
    """

    regime: _Regime
    axis: str
    condition: str
    settings: Settings
    fraction: float
    reference: bool
    folder: str
    refused: str | None

    def label(self, base: Settings | None) -> str:
        """What sets the condition apart from the base point, in words."""
        usual = base.given if base is not None else {}
        shown = [
            _SHOWN[name].format(value)
            for name, value in self.settings.given.items()
            if value != usual.get(name) or name == self.axis
        ]
        return ", ".join(shown) or "base point"


class PointList(Document):
    """The content of ``points/<regime>.json``."""

    made_by: ClassVar[str] = "snakemake stability"

    points: tuple[Point, ...]


@dataclass(frozen=True)
class PointRun:
    """A point with its run."""

    point: Point
    folder: Path

    @cached_property
    def run(self) -> Run | None:
        """Its run folder; None of a point that no deck could be written for."""
        return Run.open(self.folder) if (self.folder / "case.json").is_file() else None

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
        return self.point.settings.friction > 0.0

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
    DocumentError
        A list cannot be used.
    """
    return [
        PointRun(point, file.parent.parent / point.folder)
        for file in lists
        for point in PointList.read(file).points
    ]
