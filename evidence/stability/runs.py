"""The runs of a stability map: the scene of each point, in a batch for each regime."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

from dragdeck.cases.bed import particle_material
from dragdeck.cases.case import Case
from dragdeck.decks import PACKING_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.errors import InputError
from dragdeck.physics.packing import Bed
from dragdeck.project import find_project
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import read_bed
from dragdeck.study.model import Study
from dragdeck.study.motion import Motion
from dragdeck.sweep.cases import load_cases, study_file
from evidence.beds import settled
from evidence.stability.measures import PointRun
from evidence.stability.points import (
    REGIMES,
    MapPoint,
    PointSettings,
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


def point_case(base: Case, settings: PointSettings, fraction: float) -> Case:
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


def run_map(map_file: Path, folder: Path, cores: int) -> list[PointRun]:
    """Run the points of a map in folders of their regimes, after the beds that they start from.

    Runs of the same inputs are not repeated; one that was interrupted is gone on with. A point
    that fails is a finding.

    Raises
    ------
    InputError
        The map or its study cannot be used.
    EngineError
        No LIGGGHTS, or it was interrupted.
    RejectedRunError
        A bed did not come to rest.
    """
    project = find_project(Path.cwd())
    (base,) = load_cases(study_file(project.studies, "stability"))
    templates = project.templates_of(base)
    points = {regime: load_points(map_file, regime) for regime in REGIMES}
    starts = bed_settings(chain.from_iterable(points.values()))
    beds = {
        name: _settled_bed(base, name, settings, Batch(folder / "filling", templates))
        for name, settings in starts.items()
    }
    runs = []
    for regime, of_regime in points.items():
        batch = Batch(folder / regime, templates)
        scenes = {point.name: partial(_scene_of, point, base, beds) for point in of_regime}
        refused = batch.each(scenes, say, cores)
        runs += [
            PointRun(point, batch.folder / point.name, refused.get(point.name))
            for point in of_regime
        ]
    return runs


def _settled_bed(base: Case, name: str, settings: PointSettings, batch: Batch) -> Bed:
    """A bed, settled with a small step."""
    case = point_case(base, settings, _SAFE_FILLING_FRACTION)
    filling = case.study.filling.model_copy(update={"energy_ratio": _BED_ENERGY_RATIO})
    study = case.study.model_copy(update={"filling": filling})
    return read_bed(settled(batch, name, filling_scene(replace(case, study=study))))


def _scene_of(point: MapPoint, base: Case, beds: Mapping[str, Bed]) -> AnyScene:
    case, source = point_case(base, point.settings, point.fraction), bed_name(point.settings)
    if point.regime == "impact":
        impact = ImpactSettings.model_validate(point.settings)
        return impact_scene(case, point.name, impact, point.fraction)
    if point.regime == "settle":
        return filling_scene(case)
    if point.regime == "column":
        load = LoadedPacking.model_validate({"packing": "bed", **point.settings})
        return column_scene(case, point.name, load, point.fraction, source)
    scene = process_scene(case, beds[source])
    deck = replace(scene.deck, source=f"../../filling/{source}/{PACKING_FILE}")
    return replace(scene, deck=deck)
