"""The stability map: its points, their scenes, and how a batch of them is run."""

from __future__ import annotations

import hashlib
import json
import math
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jinja2

from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.render import environment, write_run
from dragdeck.engine.run_folder import run
from dragdeck.errors import EngineError, InputError, RejectedRunError
from dragdeck.files import replace_text
from dragdeck.project import find_project
from dragdeck.scenes.column import column_scene
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.impact import Impact, impact_scene
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import Bed
from dragdeck.study.model import CirclePath, Study
from dragdeck.study.yaml import read_yaml
from dragdeck.sweep.cases import load_cases

REGIMES = ("impact", "settle", "column", "drag")
"""What a point models: single impacts; a bed that settles; a bed or a stack at
rest under a load; a bed with a workpiece dragged through it."""

BEDS = "beds"

MOST_ELASTIC_BED = 0.86
"""Restitution of the beds of more elastic particles while they settle."""

BED_ENERGY_RATIO = 1e-4
"""When such a bed counts as settled: without friction single particles go round for long."""

SAFE_FILLING_FRACTION = 0.1
"""Step over the Rayleigh time of the beds that drags and columns start from."""

DRAG_S, SHORTEST_DRAG_M, LONGEST_DRAG_REVOLUTIONS = 1.0, 0.005, 2.0
"""A drag lasts this long, but goes this far at the least and at the most."""

TRANSIENT_FRACTION = 0.2
"""Share of a drag that its mean force leaves out."""

Report = Callable[[str], None]
Settings = Mapping[str, Any]


@dataclass(frozen=True)
class Point:
    """One run of the map.

    Attributes
    ----------
    regime : str
        One of `REGIMES`.
    axis : str
        The setting that differs from the base point: ``base``, the name of an
        axis, or ``more``.
    settings : mapping
        All settings but the step.
    fraction : float
        Time step over the Rayleigh time of the smallest particle.
    reference : bool
        Whether it is the fine-step run that the others are compared with.
    """

    regime: str
    axis: str
    settings: Settings
    fraction: float
    reference: bool

    @property
    def condition(self) -> str:
        """Name of all but the step: 8 hex digits."""
        return _digest({"regime": self.regime, **self.settings})

    @property
    def name(self) -> str:
        """Name of the run's folder."""
        return f"{self.axis}-{self.condition}-dt-{self.fraction:g}"


def _digest(content: Settings) -> str:
    text = json.dumps(content, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def load_points(file: Path, regime: str) -> list[Point]:
    """The points of a regime, each condition's reference first.

    Raises
    ------
    InputError
        The file is no such map, or lacks the regime.
    """
    data = read_yaml(file)
    if regime not in data or regime not in REGIMES:
        raise InputError(
            "the map has no such regime",
            file=file,
            value=regime,
            limit=f"one of: {', '.join(name for name in REGIMES if name in data)}",
        )
    plan = data[regime]
    try:
        return list(_points(plan, regime))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"not a map of points: {error!r}",
            file=file,
            field=regime,
            limit="base, fractions, reference, axes (each with values), more",
        ) from None


def _points(plan: Mapping[str, Any], regime: str) -> Iterator[Point]:
    seen: set[str] = set()
    for axis, settings in _conditions(plan):
        fractions = [
            (float(plan["reference"]), True),
            *((float(f), False) for f in plan["fractions"]),
        ]
        for fraction, reference in fractions:
            point = Point(regime, axis, settings, fraction, reference)
            if point.name not in seen and (axis == "base" or settings != _settings(plan, {})):
                seen.add(point.name)
                yield point


def _conditions(plan: Mapping[str, Any]) -> Iterator[tuple[str, Settings]]:
    yield "base", _settings(plan, {})
    for axis, entry in plan.get("axes", {}).items():
        for value in entry["values"]:
            yield axis, _settings(plan, {axis: value, **entry.get("with", {})})
    for changes in plan.get("more", []):
        yield "more", _settings(plan, changes)


def _settings(plan: Mapping[str, Any], changes: Settings) -> Settings:
    unknown = set(changes) - set(plan["base"])
    if unknown:
        raise ValueError(f"{', '.join(sorted(unknown))} is not among the base point's settings")
    merged = {**plan["base"], **changes}
    return {key: value if key == "packing" else float(value) for key, value in merged.items()}


def point_case(base: Case, settings: Settings, fraction: float) -> Case:
    """The study's case with a point's values.

    The limits of the study model do not hold here: the map goes past them on
    purpose, to see what the engine does.
    """
    study = base.study
    pair = {"restitution": settings["restitution"], "friction": settings["friction"]}
    particles = study.materials[study.media.material]
    fidelity = study.chosen_fidelity().model_copy(
        update={
            "youngs_modulus_scale": settings["youngs_modulus_pa"] / particles.youngs_modulus_pa,
            "timestep_fraction": fraction,
            "filling_timestep_fraction": fraction,
            "speed_factor": 1.0,
            "ranks": 1,
        }
    )
    changes: dict[str, Any] = {
        "pairs": {name: old.model_copy(update=pair) for name, old in study.pairs.items()},
        "fidelity": fidelity,
    }
    if "workpiece_speed_m_s" in settings:
        changes["motion"] = _motion(study, settings["workpiece_speed_m_s"])
    return Case(base.file, {}, study.model_copy(update=changes))


def _motion(study: Study, speed: float) -> Any:
    path = study.motion.path
    if not isinstance(path, CirclePath):
        raise InputError("the map's study drags on a circle", field="motion.path")
    around = 2 * math.pi * path.radius_m
    length = min(max(DRAG_S * speed, SHORTEST_DRAG_M), LONGEST_DRAG_REVOLUTIONS * around)
    turned = path.model_copy(update={"revolutions": length / around})
    update = {"speed_m_s": speed, "path": turned, "transient_m": TRANSIENT_FRACTION * length}
    return study.motion.model_copy(update=update)


def run_batch(
    study_file: Path, map_file: Path, regime: str, results: Path, templates: Path, report: Report
) -> Path:
    """Run all points of a regime that have not been run yet, and list them all.

    A run that fails is a finding like any other; one that was interrupted is
    gone on with when the batch is run again.

    Parameters
    ----------
    study_file, map_file : Path
    regime : str
        One of `REGIMES`, or `BEDS`: what columns and drags start from.
    results : Path
        Gets ``<regime>/<point>/`` and ``points/<regime>.json``.
    templates : Path
    report : callable
        Gets lines.

    Returns
    -------
    Path
        The list.

    Raises
    ------
    EngineError
        No engine, or the batch was interrupted.
    InputError
        Study or map cannot be used.
    RejectedRunError
        The bed that a point starts from failed, or is not there yet.
    """
    (base,) = load_cases(study_file)
    runs = _Runs(base, results, environment(templates, study_file.parent / "templates"))
    rows: list[dict[str, Any]] = []
    if regime == BEDS:
        for own in _bed_settings(map_file):
            rows.append({"settings": own, "folder": runs.settle_bed(own)})
            report(f"bed settled: {rows[-1]['folder']}")
    else:
        points = load_points(map_file, regime)
        for number, point in enumerate(points, 1):
            rows.append({**_row(point), **runs.point(point)})
            report(f"{regime} {number} of {len(points)}: {point.name}: {rows[-1]['state']}")
    file = results / "points" / f"{regime}.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    replace_text(file, json.dumps({"schema": 2, "points": rows}, indent=1) + "\n")
    return file


def _row(point: Point) -> dict[str, Any]:
    return {
        "regime": point.regime,
        "axis": point.axis,
        "condition": point.condition,
        "settings": dict(point.settings),
        "fraction": point.fraction,
        "reference": point.reference,
    }


@dataclass(frozen=True)
class _Runs:
    """Renders and runs points, and the beds that they start from."""

    base: Case
    results: Path
    templates: jinja2.Environment

    def point(self, point: Point) -> dict[str, Any]:
        """Run a point; its folder, its state and why it was refused, if it was."""
        folder = self.results / point.regime / point.name
        found: dict[str, Any] = {"folder": str(folder.relative_to(self.results)), "refused": None}
        try:
            scene = self._scene(point)
        except InputError as error:
            return {**found, "state": "refused", "refused": str(error)}
        return {**found, "state": self._run(scene, folder)}

    def _run(self, scene: AnyScene, folder: Path) -> str:
        deck = replace(scene.deck, run=folder.name)
        case = scene.case.model_copy(update={"run": folder.name})
        write_run(replace(scene, deck=deck, case=case), folder, self.templates)
        try:
            run(folder, lambda line: None)
        except RejectedRunError:
            return "failed"
        return "complete"

    def _scene(self, point: Point) -> AnyScene:
        case = point_case(self.base, point.settings, point.fraction)
        settings = point.settings
        if point.regime == "impact":
            how = Impact(settings["speed_m_s"], settings["angle_deg"], settings["size_ratio"])
            return impact_scene(case, point.name, how, point.fraction)
        if point.regime == "settle":
            return filling_scene(case)
        if point.regime == "column":
            stack = settings["packing"] == "stack"
            bed = "" if stack else self._bed(settings).name
            load = settings["load_factor"]
            return column_scene(case, point.name, settings["packing"], load, point.fraction, bed)
        folder = self._bed(settings)
        measured = json.loads((folder / "tables" / "packing.json").read_text(encoding="utf-8"))
        scene = process_scene(case, Bed(measured["bed_height_m"], measured["top_m"]))
        source = f"../../filling/{folder.name}/packing.restart"
        return replace(scene, deck=replace(scene.deck, source=source))

    def _bed(self, settings: Settings) -> Path:
        """The settled bed of these materials."""
        folder = self.results / "filling" / _bed_name(settings)
        if not (folder / "tables" / "packing.json").is_file():
            raise RejectedRunError(
                f"{folder}: the bed that this point starts from is not there\n"
                "  remedy: settle the beds first: dragdeck stability beds"
            )
        return folder

    def settle_bed(self, own: Settings) -> str:
        """Settle a bed with a small step; the name of its folder."""
        folder = self.results / "filling" / _bed_name(own)
        case = point_case(self.base, own, SAFE_FILLING_FRACTION)
        filling = case.study.filling.model_copy(update={"energy_ratio": BED_ENERGY_RATIO})
        scene = filling_scene(
            replace(case, study=case.study.model_copy(update={"filling": filling}))
        )
        if self._run(scene, folder) != "complete":
            raise RejectedRunError(
                f"{folder}: the bed that points start from failed; see its state.json"
            )
        tabulate(folder)
        return str(folder.relative_to(self.results))


def _own(settings: Settings) -> dict[str, Any]:
    """What a bed depends on. One of elastic particles would never rest.

    It settles with damped ones.
    """
    own = {key: settings[key] for key in ("youngs_modulus_pa", "restitution", "friction")}
    return {**own, "restitution": min(own["restitution"], MOST_ELASTIC_BED)}


def _bed_name(settings: Settings) -> str:
    return f"bed-{_digest(_own(settings))}"


def _bed_settings(map_file: Path) -> list[dict[str, Any]]:
    """Every bed that a point of the map starts from, once."""
    known = read_yaml(map_file)
    points = [
        point
        for regime in ("column", "drag")
        if regime in known
        for point in load_points(map_file, regime)
        if point.settings.get("packing") != "stack"
    ]
    return list({_bed_name(point.settings): _own(point.settings) for point in points}.values())


def tabulate(folder: Path) -> None:
    """Measure a settled bed with the analysis, which is a program of its own."""
    words = [sys.executable, "-m", "dragchain.cli", "tables", str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise EngineError(f"{folder}: the bed cannot be measured\n{done.stderr.strip()}")


__all__: Sequence[str] = (
    "BEDS",
    "REGIMES",
    "Point",
    "load_points",
    "point_case",
    "run_batch",
    "tabulate",
)


def stability_command(regime: str, points: Path) -> None:
    """Run one regime of the map."""
    project = find_project(Path.cwd())
    study = project.studies / "stability" / "study.yaml"

    def report(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    run_batch(study, points, regime, project.results("stability"), project.templates, report)
