"""The runs of a stability map: the scene of each point, in a batch for each regime."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import jinja2

from dragdeck.cases.bed import particle_material
from dragdeck.cases.case import Case
from dragdeck.decks import PACKING_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import Report, say
from dragdeck.errors import InputError
from dragdeck.physics.packing import Bed
from dragdeck.project import find_project
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import read_bed
from dragdeck.study.model import Motion, Study
from dragdeck.sweep.cases import load_cases
from evidence.stability.points import (
    Point,
    PointsFile,
    Settings,
    bed_name,
    bed_settings,
    load_points,
)
from evidence.stability.scenes import ImpactSettings, LoadedPacking, column_scene, impact_scene

_BED_ENERGY_RATIO = 1e-4
"""When such a bed counts as settled: without friction single particles go round for long."""

_SAFE_FILLING_FRACTION = 0.1
"""Step over the Rayleigh time of the beds that drags and columns start from."""

_DRAG_S, _SHORTEST_DRAG_M, _LONGEST_DRAG_REVOLUTIONS = 1.0, 0.005, 2.0
"""A drag lasts this long, but goes this far at the least and at the most."""

_TRANSIENT_FRACTION = 0.2
"""Fraction of a drag that its mean force leaves out."""


def point_case(base: Case, settings: Settings, fraction: float) -> Case:
    """The study's case with a point's values.

    The limits of the study model do not hold here: the map goes past them on
    purpose, to see what the engine does.
    """
    study = base.study
    pair = {"restitution": settings["restitution"], "friction": settings["friction"]}
    modulus, media = (
        float(settings["youngs_modulus_pa"]),
        particle_material(study).youngs_modulus_pa,
    )
    fidelity = {
        "youngs_modulus_scale": modulus / media,
        "timestep_fraction": fraction,
        "filling_timestep_fraction": fraction,
        "speed_factor": 1.0,
        "ranks": 1,
    }
    speed = settings.get("workpiece_speed_m_s")
    changes = {
        "pairs": {name: old.model_copy(update=pair) for name, old in study.pairs.items()},
        "fidelity": study.chosen_fidelity().model_copy(update=fidelity),
        "motion": study.motion if speed is None else _motion(study, float(speed)),
    }
    return Case(base.file, {}, study.model_copy(update=changes))


def _motion(study: Study, speed: float) -> Motion:
    around = study.motion.path.revolution_m
    if around is None:
        raise InputError("the map's study drags on a circle", field="motion.path")
    length = min(max(_DRAG_S * speed, _SHORTEST_DRAG_M), _LONGEST_DRAG_REVOLUTIONS * around)
    motion = study.motion.at(speed / study.motion.nominal_speed_m_s, length)
    return motion.model_copy(update={"transient_m": _TRANSIENT_FRACTION * length})


@dataclass(frozen=True)
class MapRuns:
    """Runs the points of a map, and the beds that they start from.

    Runs of the same inputs are not repeated; one that was interrupted is gone on with.

    Attributes
    ----------
    base : Case
        Of the map's study.
    results : Path
        Gets ``<regime>/<point>/``, ``filling/<bed>/`` and ``points/<regime>.json``.
    templates : jinja2.Environment
    report : callable
        Gets lines.
    """

    base: Case
    results: Path
    templates: jinja2.Environment
    report: Report

    def settle_beds(self, map_file: Path) -> None:
        """Settle the beds with a small step.

        Raises
        ------
        EngineError
            No LIGGGHTS, or it was interrupted.
        RejectedRunError
            A bed did not come to rest.
        """
        batch = Batch(self.results / "filling", self.templates)
        for name, settings in bed_settings(map_file).items():
            case = point_case(self.base, settings, _SAFE_FILLING_FRACTION)
            filling = case.study.filling.model_copy(update={"energy_ratio": _BED_ENERGY_RATIO})
            study = case.study.model_copy(update={"filling": filling})
            batch.result(name, filling_scene(replace(case, study=study)))
            self.report(f"bed settled: {name}")

    def run_points(self, map_file: Path, regime: str) -> Path:
        """Run all points of a regime; the list of them. A run that fails is a finding.

        Raises
        ------
        InputError
            The map cannot be used, or a bed is not there yet.
        EngineError
            No LIGGGHTS, or it was interrupted.
        """
        points = load_points(map_file, regime)
        batch = Batch(self.results / regime, self.templates)
        refused = batch.each({point.name: self._scene(point) for point in points}, self.report)
        rows = [point.model_copy(update={"refused": refused.get(point.name)}) for point in points]
        file = self.results / "points" / f"{regime}.json"
        PointsFile(points=rows).write(file)
        return file

    def _scene(self, point: Point) -> Callable[[], AnyScene]:
        """What makes the scene of a point; the bed of a drag has to be there before."""
        bed = None
        if point.regime == "drag":
            folder = self.results / "filling" / bed_name(point.settings)
            bed = read_bed(folder / "tables" / "packing.json")
        return partial(_scene_of, point, self.base, bed)


def _scene_of(point: Point, base: Case, bed: Bed | None) -> AnyScene:
    case, source = point_case(base, point.settings, point.fraction), bed_name(point.settings)
    if point.regime == "impact":
        how = ImpactSettings(*map(point.number, ("speed_m_s", "angle_deg", "size_ratio")))
        return impact_scene(case, point.name, how, point.fraction)
    if point.regime == "settle":
        return filling_scene(case)
    if point.regime == "column":
        load = LoadedPacking.model_validate({"packing": "bed", **point.settings})
        return column_scene(case, point.name, load, point.fraction, source)
    scene = process_scene(case, bed)
    deck = replace(scene.deck, source=f"../../filling/{source}/{PACKING_FILE}")
    return replace(scene, deck=deck)


def map_runs(study_file: Path, results: Path, templates: Path, report: Report) -> MapRuns:
    """The runs of the map of a study.

    Raises
    ------
    InputError
        The study cannot be used.
    """
    (base,) = load_cases(study_file)
    return MapRuns(base, results, environment(templates, study_file.parent / "templates"), report)


def stability_command(regime: str, points: Path) -> None:
    """Run one regime of the map, or settle its beds."""
    project = find_project(Path.cwd())
    study = project.studies / "stability" / "study.yaml"
    runs = map_runs(study, project.results("stability"), project.templates, say)
    if regime == "beds":
        runs.settle_beds(points)
    else:
        runs.run_points(points, regime)
