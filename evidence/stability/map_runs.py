"""The runs of a stability map: the scene of each point, and how a batch of them is run."""

from dataclasses import dataclass, replace
from pathlib import Path

import jinja2

from dragdeck.cases.case import Case
from dragdeck.decks import PACKING_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.templates import environment
from dragdeck.documents import Document
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
from evidence.stability.column import Packing, column_scene
from evidence.stability.impact import Impact, impact_scene
from evidence.stability.map import (
    BedOfMap,
    BedsFile,
    Point,
    PointOfMap,
    PointsFile,
    Settings,
    bed_name,
    bed_settings,
    load_points,
)

_BEDS = "beds"

_BED_ENERGY_RATIO = 1e-4
"""When such a bed counts as settled: without friction single particles go round for long."""

_SAFE_FILLING_FRACTION = 0.1
"""Step over the Rayleigh time of the beds that drags and columns start from."""

DRAG_S, SHORTEST_DRAG_M, LONGEST_DRAG_REVOLUTIONS = 1.0, 0.005, 2.0
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
    particles = study.materials[study.media.material]
    scale = float(settings["youngs_modulus_pa"]) / particles.youngs_modulus_pa
    fidelity = study.chosen_fidelity().model_copy(
        update={
            "youngs_modulus_scale": scale,
            "timestep_fraction": fraction,
            "filling_timestep_fraction": fraction,
            "speed_factor": 1.0,
            "ranks": 1,
        }
    )
    speed = settings.get("workpiece_speed_m_s")
    changes = {
        "pairs": {name: old.model_copy(update=pair) for name, old in study.pairs.items()},
        "fidelity": fidelity,
        "motion": study.motion if speed is None else _motion(study, float(speed)),
    }
    return Case(base.file, {}, study.model_copy(update=changes))


def _motion(study: Study, speed: float) -> Motion:
    around = study.motion.path.revolution_m
    if around is None:
        raise InputError("the map's study drags on a circle", field="motion.path")
    length = min(max(DRAG_S * speed, SHORTEST_DRAG_M), LONGEST_DRAG_REVOLUTIONS * around)
    motion = study.motion.at(speed / study.motion.axis_speed_m_s, length)
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

    def settle_beds(self, map_file: Path) -> Path:
        """Settle the beds with a small step; the list of them.

        Raises
        ------
        EngineError
            No LIGGGHTS, or it was interrupted.
        RejectedRunError
            A bed did not come to rest.
        """
        batch, beds = Batch(self.results / "filling", self.templates), []
        for name, own in bed_settings(map_file).items():
            batch.result(name, self._bed(own))
            beds.append(BedOfMap(settings=own, folder=f"filling/{name}"))
            self.report(f"bed settled: {name}")
        return self._listed(_BEDS, BedsFile(beds=beds))

    def _bed(self, own: Settings) -> AnyScene:
        case = point_case(self.base, own, _SAFE_FILLING_FRACTION)
        filling = case.study.filling.model_copy(update={"energy_ratio": _BED_ENERGY_RATIO})
        return filling_scene(
            replace(case, study=case.study.model_copy(update={"filling": filling}))
        )

    def run_points(self, map_file: Path, regime: str) -> Path:
        """Run all points of a regime; the list of them. A run that fails is a finding.

        Raises
        ------
        InputError
            The map cannot be used, or a bed is not there yet.
        EngineError
            No LIGGGHTS, or it was interrupted.
        """
        points, rows = load_points(map_file, regime), []
        batch = Batch(self.results / regime, self.templates)
        for number, point in enumerate(points, 1):
            rows.append(self._run(batch, point))
            self.report(f"{regime} {number} of {len(points)}: {point.name}: {rows[-1].state}")
        return self._listed(regime, PointsFile(points=rows))

    def _listed(self, name: str, content: Document) -> Path:
        file = self.results / "points" / f"{name}.json"
        content.write(file)
        return file

    def _run(self, batch: Batch, point: Point) -> PointOfMap:
        bed = self._settled(point) if point.regime == "drag" else None
        own = {**dict(point), "folder": f"{point.regime}/{point.name}"}
        try:
            scene = self._scene(point, bed)
        except InputError as error:
            return PointOfMap(**own, state="refused", refused=str(error))
        passed = batch.run(point.name, scene).state == "complete"
        return PointOfMap(**own, state="complete" if passed else "failed")

    def _settled(self, point: Point) -> Bed:
        """The bed that a drag starts from; one that is missing is no finding."""
        folder = self.results / "filling" / bed_name(point.settings)
        return read_bed(folder / "tables" / "packing.json")

    def _scene(self, point: Point, settled: Bed | None) -> AnyScene:
        case = point_case(self.base, point.settings, point.fraction)
        bed = bed_name(point.settings)
        if point.regime == "impact":
            how = Impact(*map(point.number, ("speed_m_s", "angle_deg", "size_ratio")))
            return impact_scene(case, point.name, how, point.fraction)
        if point.regime == "settle":
            return filling_scene(case)
        if point.regime == "column":
            packing: Packing = "stack" if point.packing == "stack" else "bed"
            load = point.number("load_factor")
            return column_scene(case, point.name, packing, load, point.fraction, bed)
        scene = process_scene(case, settled)
        source = f"../../filling/{bed}/{PACKING_FILE}"
        return replace(scene, deck=replace(scene.deck, source=source))


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
    if regime == _BEDS:
        runs.settle_beds(points)
    else:
        runs.run_points(points, regime)
