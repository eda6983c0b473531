"""``case.json`` of a run of a study: what it models, for whoever reads its output."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import JsonValue, PlainSerializer, PositiveFloat, PositiveInt

from dragdeck.errors import DocumentError, choices
from dragdeck.parts import Part, omitted
from dragdeck.physics.run_limits import RunLimits
from dragdeck.records.advised import AdvisedSettings
from dragdeck.records.bed import CaseOfBed
from dragdeck.records.run import CaseFile, RanksOfRun, SettlingCriterion
from dragdeck.study.base import Json
from dragdeck.study.drive import PathEntry, SuperposedEntry
from dragdeck.study.model import Study

StudyOfRun = Annotated[Study, PlainSerializer(Study.plain)]
"""The study of a case, with its settings in place of a fidelity's name; its files are not read."""


class FidelityOfRun(RanksOfRun):
    """The settings for speed and accuracy with which this run is simulated.

    A drop test and a filling have their own time step, and no workpiece that could be faster.

    Attributes
    ----------
    name : str
        Name of the fidelity of the case.
    youngs_modulus_scale, speed_factor : float
        Multipliers of every Young's modulus and of the speed of the workpiece.
    timestep_fraction : float
        Time step as a fraction of the Rayleigh time.
    skin_m : float
        Neighbour skin, m.
    ranks : int
        MPI ranks.
    """

    name: str
    youngs_modulus_scale: PositiveFloat
    timestep_fraction: PositiveFloat
    speed_factor: PositiveFloat
    skin_m: PositiveFloat


class WorkpieceOfRun(Part):
    """The workpiece.

    Attributes
    ----------
    number, count : int
        Number of this workpiece, from 1, and number of all; absent if there is only one.
    wake_from_m : float or None
        Path length after which its axis is where a workpiece has passed before; absent if that
        never happens, or if the path is not a circle.
    remeshed : str or None
        How its surface differs from that in the file; absent if it is that of the file.
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
    radius_m: PositiveFloat
    length_m: PositiveFloat
    mesh: str
    immersion_depth_m: float
    number: int = omitted(0)
    count: PositiveInt = omitted(1)
    wake_from_m: PositiveFloat | None = omitted(None)
    remeshed: str | None = omitted(None)


class AssumptionOfRun(Part):
    """A value that the source of the study does not report.

    Attributes
    ----------
    field : str
        Dotted name of the field.
    value : JSON value
        The assumed value.
    why : str
        Reason for the value.
    std : float or None
        Its standard uncertainty.
    """

    field: str
    value: JsonValue
    why: str
    std: PositiveFloat | None = omitted(None)


class StatisticsOfRun(Part):
    """The part of the drag that is excluded from the statistics.

    Attributes
    ----------
    transient_s : float
        Initial time of the drag, s of simulated time.
    """

    transient_s: float


class CaseOfRun(CaseOfBed):
    """The content of ``case.json`` of a run of a study.

    The attributes are the keys of the document. Those that a scene does not have are absent.

    Attributes
    ----------
    fidelity : FidelityOfRun
        Settings for speed and accuracy.
    assumptions : tuple of AssumptionOfRun
        Values that the source of the study does not report.
    study : Study or None
        The study of the case of a process.
    case : str or None
        Readable name of the case of a process.
    upstream : mapping
        Run ids of the filling and drop test of a process.
    output_of : str or None
        Run whose raw output is read, for a second or further workpiece.
    lead : str or None
        Run id of the softer run that a process continues.
    numbers : mapping
        Dimensionless numbers of a process at the physical modulus and the speed of the study.
    surface_m : float or None
        Height of the settled surface above the floor, m.
    workpiece : WorkpieceOfRun or None
        Geometry and immersion.
    motion, superposed
        Path of the drag as simulated, and motions superposed on it.
    statistics : StatisticsOfRun or None
        Transient that is excluded.
    asked : AdvisedSettings or None
        Tolerance from which the settings were derived.
    restitution : float or None
        Coefficient of restitution in the input script of a drop test.
    """

    fidelity: FidelityOfRun
    assumptions: tuple[AssumptionOfRun, ...]
    study: StudyOfRun | None = omitted(None)
    case: str | None = omitted(None)
    upstream: Mapping[str, str] = omitted({})
    output_of: str | None = omitted(None)
    lead: str | None = omitted(None)
    numbers: Mapping[str, float] = omitted({})
    surface_m: PositiveFloat | None = omitted(None)
    workpiece: WorkpieceOfRun | None = omitted(None)
    motion: PathEntry | None = omitted(None)
    superposed: tuple[SuperposedEntry, ...] = omitted(())
    statistics: StatisticsOfRun | None = omitted(None)
    asked: AdvisedSettings | None = omitted(None)
    restitution: float | None = omitted(None)


class DropTestCase(CaseOfRun):
    """The ``case.json`` of a drop test; `inputs`: what it depends on."""

    scene: Literal["drop_test"] = "drop_test"
    inputs: Json
    restitution: float


class FillingCase(CaseOfRun):
    """The ``case.json`` of a filling; `inputs`: what it depends on."""

    scene: Literal["filling"] = "filling"
    inputs: Json
    settled: SettlingCriterion
    limits: RunLimits


class ProcessCase(CaseOfRun):
    """The ``case.json`` of a process: the workpiece is dragged through the settled packing."""

    scene: Literal["process"] = "process"
    study: StudyOfRun
    case: str
    upstream: Mapping[str, str]
    numbers: Mapping[str, float]
    surface_m: PositiveFloat
    workpiece: WorkpieceOfRun
    motion: PathEntry
    statistics: StatisticsOfRun
    limits: RunLimits
    asked: AdvisedSettings | None = None


_OF_SCENE: Mapping[str, type[CaseOfRun]] = {
    "drop_test": DropTestCase,
    "filling": FillingCase,
    "process": ProcessCase,
}


def load_case(run_dir: Path | str) -> CaseOfRun:
    """Read ``case.json`` of a run folder.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    CaseOfRun
        A `DropTestCase`, `FillingCase` or `ProcessCase`.

    Raises
    ------
    DocumentError
        If the file is absent, is not JSON, has another schema number, or lacks
        a key or has a value of the wrong type.
    """
    file = Path(run_dir) / "case.json"
    scene = CaseFile.read(file).scene
    if scene not in _OF_SCENE:
        raise DocumentError(
            "the scene is not one of a study",
            file=file,
            field="scene",
            value=scene,
            limit=choices(scene, _OF_SCENE),
            remedy=CaseFile.remedy,
        )
    return _OF_SCENE[scene].read(file)
