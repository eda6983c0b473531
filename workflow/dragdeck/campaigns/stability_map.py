"""The stability map: its points, their scenes, and how a batch of them is run."""

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import jinja2
from pydantic import Field, ValidationError, model_validator

from dragdeck.cases.case import Case
from dragdeck.decks import PACKING_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.templates import environment
from dragdeck.documents import Document, Part
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import Report, say
from dragdeck.errors import InputError
from dragdeck.project import find_project
from dragdeck.scenes.column import Packing, column_scene
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.impact import Impact, impact_scene
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import Bed, read_bed
from dragdeck.study.base import Model, Number
from dragdeck.study.model import CirclePath, Motion, Study
from dragdeck.study.yaml import explained, read_yaml
from dragdeck.sweep.cases import load_cases

Regime = Literal["impact", "settle", "column", "drag"]
REGIMES: tuple[Regime, ...] = ("impact", "settle", "column", "drag")
"""What a point models: single impacts; a bed that settles; a bed or a stack at
rest under a load; a bed with a workpiece dragged through it."""

_BEDS = "beds"

_MOST_ELASTIC_BED = 0.86
"""Restitution of the beds of more elastic particles while they settle."""

_BED_ENERGY_RATIO = 1e-4
"""When such a bed counts as settled: without friction single particles go round for long."""

_SAFE_FILLING_FRACTION = 0.1
"""Step over the Rayleigh time of the beds that drags and columns start from."""

DRAG_S, SHORTEST_DRAG_M, LONGEST_DRAG_REVOLUTIONS = 1.0, 0.005, 2.0
"""A drag lasts this long, but goes this far at the least and at the most."""

_TRANSIENT_FRACTION = 0.2
"""Fraction of a drag that its mean force leaves out."""

Value = Packing | Number
Settings = Mapping[str, Value]


class _Axis(Model):
    """Values that one setting takes, while others change with it."""

    values: list[Value]
    others: dict[str, Value] = Field(default_factory=dict, alias="with")


class _Plan(Model):
    """The points of a regime: ``map.yaml`` describes them."""

    base: dict[str, Value]
    fractions: list[Number]
    reference: Number
    axes: dict[str, _Axis] = Field(default_factory=dict)
    more: list[dict[str, Value]] = Field(default_factory=list)

    @model_validator(mode="after")
    def _known(self) -> "_Plan":
        changes = {*self.axes, *(key for axis in self.axes.values() for key in axis.others)}
        unknown = changes.union(*self.more) - set(self.base)
        if unknown:
            raise ValueError(f"{', '.join(sorted(unknown))} is not among the base point's settings")
        return self

    def conditions(self) -> Iterator[tuple[str, Settings]]:
        """The settings of each condition, and the axis that they lie on."""
        yield "base", self.base
        for name, axis in self.axes.items():
            for value in axis.values:
                yield name, {**self.base, name: value, **axis.others}
        for changes in self.more:
            yield "more", {**self.base, **changes}


class Point(Part):
    """One run of the map.

    Attributes
    ----------
    regime : str
        One of `REGIMES`.
    axis : str
        The setting that differs from the base point: ``base``, the name of an
        axis, or ``more``.
    condition : str
        Name of all but the step: 8 hex digits.
    settings : mapping
        All settings but the step.
    fraction : float
        Time step over the Rayleigh time of the smallest particle.
    reference : bool
        Whether it is the fine-step run that the others are compared with.
    """

    regime: Regime
    axis: str
    condition: str
    settings: Settings
    fraction: float
    reference: bool

    @property
    def name(self) -> str:
        """Name of the run's folder."""
        return f"{self.axis}-{self.condition}-dt-{self.fraction:g}"

    @property
    def packing(self) -> str:
        """What a column or a drag starts from."""
        return str(self.settings.get("packing", "bed"))

    def number(self, name: str) -> float:
        """A setting that is a number."""
        return float(self.settings[name])


def _digest(content: Mapping[str, str | float]) -> str:
    text = json.dumps(content, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


class PointOfMap(Point):
    """A point that was run: its folder in the results, and how it ended.

    A point is refused if its deck cannot be made, and failed if an acceptance check did not pass.
    """

    folder: str
    refused: str | None = None
    state: Literal["refused", "failed", "complete"]


class PointsFile(Document):
    """``points/<regime>.json``: the points of a regime."""

    points: Sequence[PointOfMap]


class BedOfMap(Part):
    """A settled bed: its materials and its folder in the results."""

    settings: Settings
    folder: str


class _BedsFile(Document):
    """``points/beds.json``: the beds that columns and drags start from."""

    beds: Sequence[BedOfMap]


def load_points(file: Path, regime: str) -> list[Point]:
    """The points of a regime, each condition's reference first.

    Raises
    ------
    InputError
        The file is no such map, or lacks the regime.
    """
    data = read_yaml(file)
    known = {name: name for name in REGIMES if name in data}
    if regime not in known:
        raise InputError(
            "the map has no such regime",
            file=file,
            value=regime,
            limit=f"one of: {', '.join(known)}",
        )
    try:
        plan = _Plan.model_validate(data[regime])
    except ValidationError as error:
        raise explained(error, file) from None
    return list(_points(plan, known[regime]))


def _points(plan: _Plan, regime: Regime) -> Iterator[Point]:
    fractions = [(plan.reference, True), *((fraction, False) for fraction in plan.fractions)]
    seen: set[str] = set()
    for axis, settings in plan.conditions():
        for fraction, reference in fractions:
            point = Point(
                regime=regime,
                axis=axis,
                condition=_digest({"regime": regime, **settings}),
                settings=settings,
                fraction=fraction,
                reference=reference,
            )
            if point.name not in seen and (axis == "base" or settings != plan.base):
                seen.add(point.name)
                yield point


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
    path = study.motion.path
    if not isinstance(path, CirclePath):
        raise InputError("the map's study drags on a circle", field="motion.path")
    around = 2 * math.pi * path.radius_m
    length = min(max(DRAG_S * speed, SHORTEST_DRAG_M), LONGEST_DRAG_REVOLUTIONS * around)
    turned = path.model_copy(update={"revolutions": length / around})
    update = {"speed_m_s": speed, "path": turned, "transient_m": _TRANSIENT_FRACTION * length}
    return study.motion.model_copy(update=update)


def bed_names(map_file: Path) -> list[str]:
    """Run ids of the beds that columns and drags start from, in ``filling/``."""
    return list(_bed_settings(map_file))


def _bed_settings(map_file: Path) -> dict[str, Settings]:
    """Every bed that a point of the map starts from, by its run id."""
    known = read_yaml(map_file)
    points = [
        point
        for regime in ("column", "drag")
        if regime in known
        for point in load_points(map_file, regime)
        if point.packing == "bed"
    ]
    return {_bed_name(point.settings): _own(point.settings) for point in points}


def _bed_name(settings: Settings) -> str:
    return f"bed-{_digest(_own(settings))}"


def _own(settings: Settings) -> dict[str, float]:
    """What a bed depends on. One of elastic particles would never rest.

    It settles with damped ones.
    """
    own = {key: float(settings[key]) for key in ("youngs_modulus_pa", "restitution", "friction")}
    return {**own, "restitution": min(own["restitution"], _MOST_ELASTIC_BED)}


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
        for name, own in _bed_settings(map_file).items():
            batch.result(name, self._bed(own))
            beds.append(BedOfMap(settings=own, folder=f"filling/{name}"))
            self.report(f"bed settled: {name}")
        return self._listed(_BEDS, _BedsFile(beds=beds))

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
        folder = self.results / "filling" / _bed_name(point.settings)
        return read_bed(folder / "tables" / "packing.json")

    def _scene(self, point: Point, settled: Bed | None) -> AnyScene:
        case = point_case(self.base, point.settings, point.fraction)
        bed = _bed_name(point.settings)
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
