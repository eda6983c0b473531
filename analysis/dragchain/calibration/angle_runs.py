"""The heaps and drums that a calibration of friction and rolling friction needs."""

from collections.abc import Mapping
from functools import partial

from dragdeck.cases.case import Case
from dragdeck.decks import RUN_FILE
from dragdeck.documents import Document
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import Report
from dragdeck.errors import InputError
from dragdeck.scenes.angles import AngleRun, angle_scene
from dragdeck.study.calibration import Angles, Rig

_POINTS, _REPEATED, _OTHER_SEED = 20, 4, 1000
"""Pairs of coefficients; every so many are simulated again, with another seed."""

_STEPS = (0.7548776662466927, 0.5698402909980532)
"""Inverses of the plastic number and of its square: the fractional parts of their multiples fill a
square evenly, however many there are (Roberts 2018, The unreasonable effectiveness of
quasirandom sequences)."""


class AngleSet(Document):
    """The measured angles of a study, and the runs that they are compared with.

    Attributes
    ----------
    pair : str
        The particles' material with itself.
    friction, rolling_friction : (float, float)
        Ranges in which the coefficients are looked for.
    measured : mapping
        Measured angle and its standard uncertainty, degrees, by ``repose`` and ``drum``.
    runs : tuple of str
        Names of their folders; a run that failed is absent.
    """

    remedy = "make it with: ./run calibrate"

    study: str
    title: str
    pair: str
    friction: tuple[float, float]
    rolling_friction: tuple[float, float]
    measured: Mapping[Rig, tuple[float, float]]
    runs: tuple[str, ...]


def angle_runs(angles: Angles) -> dict[str, AngleRun]:
    """The runs of all measurements by their names.

    The coefficients fill the study's ranges evenly in the square roots of the distances from the
    lower ends: angles change most where the coefficients are small.
    """
    scenes = {}
    for number in range(1, _POINTS + 1):
        friction, rolling = (
            round(low + (high - low) * ((0.5 + number * step) % 1) ** 2, 6)
            for (low, high), step in zip(
                (angles.friction, angles.rolling_friction), _STEPS, strict=True
            )
        )
        for seed in (number, number + _OTHER_SEED)[: 1 + (number % _REPEATED == 0)]:
            for rig in angles.rigs:
                run = AngleRun(rig=rig, friction=friction, rolling_friction=rolling, seed=seed)
                scenes[f"{rig}-{seed:04d}"] = run
    return scenes


def run_angles(case: Case, batch: Batch, report: Report, cores: int = 1) -> AngleSet:
    """Simulate all measurements, each run in a folder of its own.

    Parameters
    ----------
    case : Case
    batch : Batch
        Its folder gets a folder for each run.
    report : callable
        Gets a line for each run.
    cores : int
        Runs at the same time.

    Raises
    ------
    InputError
        The study has no measured angle, or one that cannot be simulated.
    EngineError
        No LIGGGHTS, or it was interrupted.
    """
    calibration, material = case.study.calibration, case.study.media.main_material
    if calibration is None or calibration.angles is None:
        raise InputError("no measured angle", file=case.file, field="calibration.angles")
    angles = calibration.angles
    runs = angle_runs(angles)
    for run in {scene.rig: scene for scene in runs.values()}.values():
        angle_scene(case, run)  # what cannot be simulated is refused before all runs
    batch.each(
        {name: partial(angle_scene, case, scene) for name, scene in runs.items()}, report, cores
    )
    return AngleSet(
        study=case.study_name,
        title=case.study.title,
        pair=f"{material}-{material}",
        friction=angles.friction,
        rolling_friction=angles.rolling_friction,
        measured={name: (rig.angle_deg, rig.angle_std_deg) for name, rig in angles.rigs.items()},
        runs=tuple(name for name in runs if (batch.folder / name / RUN_FILE).is_file()),
    )
