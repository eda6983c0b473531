"""The ``case.json`` of a process run: the workpiece, its motion, and what was asked."""

from collections.abc import Mapping, Sequence
from typing import Literal

from pydantic import Field

from dragdeck.decks.advised import AdvisedSettings
from dragdeck.decks.case_file import CaseOfStudy, SteadyCriterion
from dragdeck.documents import Part
from dragdeck.physics.run_limits import RunLimits
from dragdeck.study.driven import PathEntry, SuperposedEntry


class WorkpieceOfRun(Part):
    """The workpiece.

    Attributes
    ----------
    number, count : int
        Number of this workpiece, from 1, and number of all; absent if there is only one.
    wake_from_m : float or None
        Path length after which its axis is where a workpiece has passed before; absent if that
        never happens, or if the path is not a circle.
    kind : str
        ``cylinder`` or ``mesh``.
    radius_m : float
        Radius of the vertical cylinder around its immersed part, m.
    length_m : float
        Height, m.
    mesh : str
        File of its mesh.
    immersion_depth_m : float
        Depth of its tip below the settled surface, m.
    """

    kind: Literal["cylinder", "mesh"]
    radius_m: float
    length_m: float
    mesh: str
    immersion_depth_m: float
    number: int = Field(default=0, exclude_if=lambda value: not value)
    count: int = Field(default=1, exclude_if=lambda value: value == 1)
    wake_from_m: float | None = Field(default=None, exclude_if=lambda value: value is None)


class StatisticsOfRun(Part):
    """The part of the drag that is excluded from the statistics.

    Attributes
    ----------
    transient_s : float
        Initial time of the drag, s of simulated time.
    """

    transient_s: float


class ProcessCase(CaseOfStudy):
    """A process run: the workpiece is dragged through the settled packing.

    Attributes
    ----------
    case : str
        Readable name of the case.
    upstream : mapping
        Run ids of its filling and drop test.
    lead : str or None
        Run id of the softer run that it continues; absent if there is none.
    entry_step : int
        Step of the drag at which it continues its lead; absent if it has none.
    marks : sequence of str
        Files of states from which other runs continue; absent if there are none.
    numbers : mapping
        Dimensionless numbers of the scene at the physical modulus and the speed of the study.
    surface_m : float
        Height of the settled surface above the floor, m.
    output_of : str or None
        Run whose raw output is read, for a second or further workpiece; otherwise absent.
    superposed : sequence
        Motions superposed on the path; absent if there are none.
    steady : SteadyCriterion
        Criterion for a steadily moving bed; absent if the bowl is at rest.
    workpiece : WorkpieceOfRun
        Geometry and immersion.
    motion : mapping
        Path of the drag as simulated.
    statistics : StatisticsOfRun
        Transient that is excluded.
    limits : RunLimits
        Limits of energy and speed; beyond them the run is stopped.
    asked : AdvisedSettings or None
        Tolerance from which the settings were derived.
    files : mapping
        SHA-256 of every file from which the run starts.
    inputs : mapping
        All values of the study, by dotted name.
    contact_moduli : mapping
        Contact constants of a particle with ``particle``, ``bowl`` and ``workpiece``.
    phases : sequence of Phase
        Plunge, approach and drag.
    unsafe_timestep : str or None
        Why an unstable time step is accepted.
    """

    scene: Literal["process"] = "process"
    case: str
    upstream: Mapping[str, str]
    output_of: str | None = Field(default=None, exclude_if=lambda value: value is None)
    lead: str | None = Field(default=None, exclude_if=lambda value: value is None)
    entry_step: int = Field(default=0, exclude_if=lambda value: not value)
    marks: Sequence[str] = Field(default=(), exclude_if=lambda value: not value)
    numbers: Mapping[str, float]
    surface_m: float
    workpiece: WorkpieceOfRun
    motion: PathEntry
    superposed: Sequence[SuperposedEntry] = Field(default=(), exclude_if=lambda value: not value)
    statistics: StatisticsOfRun
    steady: SteadyCriterion | None = Field(default=None, exclude_if=lambda value: value is None)
    limits: RunLimits
    asked: AdvisedSettings | None = None
