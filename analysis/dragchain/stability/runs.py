"""What the runs of a stability map show: numbers from their folders, then classes."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import KDTree

from dragchain.arrays import Floats, Ints
from dragchain.dumps.frame import Frame
from dragchain.dumps.run_parts import iter_frames, iter_prints
from dragchain.errors import TableError
from dragchain.network.critical_timestep import (
    Network,
    critical_step,
    damped_fraction,
    hertz_stiffness,
    largest_frequency,
)
from dragchain.run.case import load_outputs
from dragchain.run.completeness import RunRecord
from dragchain.run.kinematics import drag_phase, needed
from dragchain.stability.classes import CONFIDENCE_SCORES, REST_FLOOR, Error, Seen, classify
from dragchain.statistics.correlated import estimate_mean
from dragchain.tables.network_contacts import contact_rows
from dragchain.tables.run_folder import Run
from dragchain.tables.workpiece_contacts import WorkpieceFrame, iter_workpiece_frames
from dragchain.tables.write import workpiece_force_rows

Numbers = dict[str, float]

SMALL_STEP = 0.4
"""Steps over the Rayleigh time up to which the heights of settled beds differ by chance."""

LAST_SAMPLES = 50
"""Samples at the end of a resting bed's run whose mean energy counts: a quarter of them."""

NETWORK_FRAMES = 8
"""Frames of a drag whose networks are looked at; the stiffest counts."""


@dataclass(frozen=True)
class PointRun:
    """A point of the list, with its folder."""

    row: Mapping[str, Any]
    folder: Path

    @property
    def regime(self) -> str:
        """Regime of the point."""
        return str(self.row["regime"])

    @property
    def sticks(self) -> bool:
        """Whether its contacts have friction, and so a tangential stiffness."""
        return float(self.row["settings"]["friction"]) > 0.0

    @property
    def case(self) -> dict[str, Any]:
        """Content of ``case.json``."""
        return _json(self.folder / "case.json")


def _json(file: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return content


def read_points(lists: Sequence[Path]) -> list[PointRun]:
    """The points of lists that ``dragdeck stability`` wrote.

    Raises
    ------
    TableError
        A list is of another kind.
    """
    found = []
    for file in lists:
        content = _json(file)
        if content.get("schema") != 2 or "points" not in content:
            raise TableError(f"{file}: this is no list of points; make it with dragdeck stability")
        results = file.parent.parent
        found += [
            PointRun(row, results / row["folder"]) for row in content["points"] if "regime" in row
        ]
    return found


def point_table(points: Sequence[PointRun]) -> pd.DataFrame:
    """Numbers and class of every point, one row a point."""
    groups: dict[str, list[PointRun]] = {}
    for point in points:
        groups.setdefault(str(point.row["condition"]), []).append(point)
    bases = {point.regime: point.row["settings"] for point in points if point.row["axis"] == "base"}
    rows = [row for group in groups.values() for row in _condition_rows(group, bases)]
    return pd.DataFrame(rows)


def _condition_rows(
    group: Sequence[PointRun], bases: Mapping[str, Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Rows of one condition; its reference is measured first."""
    group = sorted(group, key=lambda point: not point.row["reference"])
    reference = group[0]
    numbers = [measure(point) for point in group]
    static = _static(reference, numbers[0])
    if numbers[0] is not None and reference.regime == "settle":
        numbers[0]["height_scatter"] = _height_scatter(group, numbers)
    return [
        {
            **_point_row(point, numbers[0], static, own),
            "label": _label(point.row, bases.get(point.regime, {})),
        }
        for point, own in zip(group, numbers, strict=True)
    ]


def _height_scatter(group: Sequence[PointRun], numbers: Sequence[Numbers | None]) -> float:
    """Relative standard deviation of bed heights that differ by chance, from the small steps."""
    heights = [
        own["height_m"]
        for point, own in zip(group, numbers, strict=True)
        if own is not None and point.row["fraction"] <= SMALL_STEP
    ]
    return float(np.std(heights, ddof=1) / np.mean(heights)) if len(heights) > 2 else math.inf


def _static(reference: PointRun, own: Numbers | None) -> Numbers:
    """What belongs to a condition whatever the step: Rayleigh time, critical step."""
    if not (reference.folder / "case.json").is_file():
        return {"rayleigh_time_s": math.nan, "critical_step_s": math.nan}
    frequency = own.get("frequency_rad_s", 0.0) if own else 0.0
    step = critical_step(frequency)
    return {
        "rayleigh_time_s": float(reference.case["rayleigh_time_s"]),
        "critical_step_s": step if math.isfinite(step) else math.nan,
    }


def _point_row(
    point: PointRun, reference: Numbers | None, static: Numbers, numbers: Numbers | None
) -> dict[str, Any]:
    seen = _seen(point, numbers, reference)
    kind, why = classify(seen)
    settings = {f"setting_{name}": value for name, value in point.row["settings"].items()}
    case = point.case if (point.folder / "case.json").is_file() else {}
    step = float(case.get("timestep_s", math.nan))
    contact = case.get("impact", {}).get("contact_time_s", math.nan)
    return {
        "regime": point.regime,
        "condition": point.row["condition"],
        "axis": point.row["axis"],
        "label": "",
        "fraction": point.row["fraction"],
        "reference": point.row["reference"],
        "state": seen.state,
        "class": kind,
        "why": why,
        "timestep_s": step,
        **static,
        "fraction_of_critical": step / static["critical_step_s"],
        "damped_fraction": damped_fraction(point.row["settings"]["restitution"]),
        "steps_per_contact": contact / step,
        "steps": seen.steps,
        "energy_ratio": _or_nan(seen.energy_ratio),
        "overlap_ratio": _or_nan(seen.overlap_ratio),
        **_error_columns(seen.errors),
        **{name: numbers.get(name, math.nan) if numbers else math.nan for name in _KEPT},
        **settings,
        "folder": point.row["folder"],
    }


_KEPT = (
    *("restitution_mean", "restitution_low", "restitution_high", "peak_force_n"),
    *("height_m", "peak_energy_j", "rest_energy_ratio", "drag_mean_n", "drag_se_n"),
    *("energy_after_over_before", "frequency_rad_s"),
)
_ERRORS = ("restitution", "peak force", "tangential speed", "height", "mean drag")


def _error_columns(errors: Mapping[str, Error]) -> Numbers:
    found: Numbers = {}
    for name in _ERRORS:
        column = name.replace(" ", "_")
        error = errors.get(name, Error(math.nan, math.nan, math.nan))
        found[f"{column}_error"] = error.value
        if name == "mean drag":
            found |= {f"{column}_error_low": error.low, f"{column}_error_high": error.high}
    return found


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


_SHOWN = {
    "youngs_modulus_pa": "E {:g} Pa",
    "speed_m_s": "{:g} m/s",
    "restitution": "e {:g}",
    "friction": "friction {:g}",
    "size_ratio": "size ratio {:g}",
    "angle_deg": "{:g} degrees",
    "load_factor": "load {:g} g",
    "packing": "{}",
    "workpiece_speed_m_s": "workpiece {:g} m/s",
}


def _label(row: Mapping[str, Any], base: Mapping[str, Any]) -> str:
    """What sets a condition apart from the base point, in words."""
    shown = [
        _SHOWN[name].format(value)
        for name, value in row["settings"].items()
        if value != base.get(name) or name == row["axis"]
    ]
    return ", ".join(shown) or "base point"


# --- one run ---------------------------------------------------------------------------------


def measure(point: PointRun) -> Numbers | None:
    """Numbers of a run that ended; None of one that did not.

    A run that only built its neighbour lists too late has numbers too: its energy counts.
    """
    state = _state(point)
    if state is None:
        return None
    failed = {check.code for check in state.failed_checks}
    if not state.complete and failed != {"neighbour_builds"}:
        return None
    measured = {
        "impact": _measure_impact,
        "settle": _measure_settle,
        "column": _measure_column,
        "drag": _measure_drag,
    }[point.regime](point)
    return measured


def _state(point: PointRun) -> RunRecord | None:
    """How the run ended; None of a point that no deck could be written for."""
    file = point.folder / "state.json"
    if not file.is_file():
        return None
    state = RunRecord.read(file)
    if state.state in ("running", "stopped"):
        raise TableError(
            f"{point.folder}: this run was interrupted; run `dragdeck stability` once more"
        )
    return state


def _seen(point: PointRun, numbers: Numbers | None, reference: Numbers | None) -> Seen:
    """What classifies a point."""
    state = _state(point)
    energy = _energy_ratio(point.regime, numbers, reference) if numbers else None
    return Seen(
        regime=point.regime,
        state=state.state if state else "refused",
        steps=state.last_step if state else 0,
        failed=state.failed_checks if state else (),
        refused=point.row["refused"],
        energy_ratio=energy,
        overlap_ratio=numbers.get("overlap_ratio") if numbers else None,
        errors=_errors(numbers, reference) if numbers and reference else {},
    )


def _energy_ratio(regime: str, numbers: Numbers, reference: Numbers | None) -> float | None:
    if regime == "impact":
        return numbers["energy_ratio"] / max(1.0, reference["energy_ratio"] if reference else 1.0)
    if regime == "drag":
        return numbers["drag_energy_ratio"]
    name = {"settle": "peak_energy_j", "column": "rest_energy_ratio"}
    if reference is None:
        return None
    allowed = reference[name[regime]]
    if regime == "column":
        allowed = max(allowed, REST_FLOOR)
    return numbers[name[regime]] / allowed


def _errors(numbers: Numbers, reference: Numbers) -> dict[str, Error]:
    """Errors against the reference; of impacts, the largest of all phases counts."""
    found = {}
    if "restitution_mean" in numbers:
        for name, key, relative in (
            ("restitution", "restitution", False),
            ("peak force", "peak", True),
            ("tangential speed", "along", False),
        ):
            fine = reference[f"{key}_mean"]
            scale = fine if relative else 1.0
            ends = [(numbers[f"{key}_{end}"] - fine) / scale for end in ("low", "high")]
            worst = max(ends, key=abs)
            found[name] = Error(worst, worst, worst)
    if "height_m" in numbers:
        error = numbers["height_m"] / reference["height_m"] - 1.0
        half = CONFIDENCE_SCORES * math.sqrt(2.0) * reference.get("height_scatter", 0.0)
        found["height"] = Error(error, error - half, error + half)
    if "drag_mean_n" in numbers:
        fine = abs(reference["drag_mean_n"])
        error = (numbers["drag_mean_n"] - reference["drag_mean_n"]) / -fine
        half = CONFIDENCE_SCORES * math.hypot(numbers["drag_se_n"], reference["drag_se_n"]) / fine
        found["mean drag"] = Error(error, error - half, error + half)
    return found


# --- impacts ---------------------------------------------------------------------------------


def _measure_impact(point: PointRun) -> Numbers:
    case = point.case
    impact, outputs = case["impact"], load_outputs(point.folder)
    frames = [_sorted(frame) for frame in iter_frames(point.folder, outputs["particles"])]
    plate = impact["size_ratio"] == 0.0
    first, last = frames[0], frames[-1]
    striking = slice(None) if plate else slice(0, None, 2)
    velocity = last.vectors("vx_m_s", "vy_m_s", "vz_m_s")
    speed = velocity if plate else velocity[0::2] - velocity[1::2]
    before = impact["normal_speed_m_s"]
    force = np.stack(
        [
            np.linalg.norm(frame.vectors("force_x_n", "force_y_n", "force_z_n")[striking], axis=1)
            for frame in frames
        ]
    )
    overlap = max(float(_impact_overlap(frame, plate).max()) for frame in frames)
    pairs = 1 if plate else 2
    energies = [_kinetic(frame, case["media"]["density_kg_m3"]) for frame in (first, last)]
    gained = energies[1].reshape(-1, pairs).sum(axis=1) / energies[0].reshape(-1, pairs).sum(axis=1)
    radius = float(first.columns["radius_m"].min())
    found = {
        **_spread("restitution", speed[:, 2] / before),
        **_spread("peak", force.max(axis=0)),
        **_spread("along", speed[:, 0] / impact["speed_m_s"]),
        "energy_ratio": float(gained.max()),
        "overlap_ratio": overlap / radius,
        "frequency_rad_s": _impact_frequency(point, first, overlap, plate),
    }
    return {
        **found,
        "peak_force_n": found["peak_mean"],
        "energy_after_over_before": found["energy_ratio"],
    }


def _spread(name: str, values: Floats) -> Numbers:
    return {
        f"{name}_mean": float(values.mean()),
        f"{name}_low": float(values.min()),
        f"{name}_high": float(values.max()),
    }


def _sorted(frame: Frame) -> Frame:
    order = np.argsort(frame.columns["particle_id"])
    return Frame(frame.step, {name: col[order] for name, col in frame.columns.items()})


def _impact_overlap(frame: Frame, plate: bool) -> Floats:
    centre, radius = frame.vectors("x_m", "y_m", "z_m"), frame.vectors("radius_m")[:, 0]
    if plate:
        return np.asarray(radius - centre[:, 2])
    distance = np.linalg.norm(centre[0::2] - centre[1::2], axis=1)
    return np.asarray(radius[0::2] + radius[1::2] - distance)


def _kinetic(frame: Frame, density: float) -> Floats:
    """Kinetic energy of each particle, spin included, J."""
    radius = frame.vectors("radius_m")[:, 0]
    mass = 4.0 / 3.0 * np.pi * radius**3 * density
    speed = (frame.vectors("vx_m_s", "vy_m_s", "vz_m_s") ** 2).sum(axis=1)
    spin = (frame.vectors("wx_rad_s", "wy_rad_s", "wz_rad_s") ** 2).sum(axis=1)
    return np.asarray(0.5 * mass * (speed + 0.4 * radius**2 * spin))


def _impact_frequency(point: PointRun, frame: Frame, overlap: float, plate: bool) -> float:
    """Of the contact at its largest overlap."""
    case = point.case
    bodies = 1 if plate else 2
    radius = frame.vectors("radius_m")[:bodies, 0]
    modulus, shear = _moduli(case, "particle")
    effective = np.array([case["impact"]["effective_radius_m"]])
    normal, tangential = hertz_stiffness(
        np.array([overlap]), effective, np.array([modulus]), np.array([shear])
    )
    return largest_frequency(
        Network(
            radius_m=radius,
            mass_kg=4.0 / 3.0 * np.pi * radius**3 * case["media"]["density_kg_m3"],
            a=np.array([0]),
            b=np.array([-1 if plate else 1]),
            normal=np.array([[0.0, 0.0, -1.0]]),
            normal_stiffness_n_m=normal,
            tangential_stiffness_n_m=tangential if point.sticks else 0.0 * tangential,
        )
    )


def _moduli(case: Mapping[str, Any], partner: str) -> tuple[float, float]:
    """Effective moduli E* and G* of a particle with a particle or with the bowl, Pa."""
    moduli = case["contact_moduli"][partner]
    return moduli["modulus_pa"], moduli["shear_pa"]


# --- beds ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Contacts:
    """Contacts of a bed; ``b`` is -1 for bowl and workpiece."""

    a: Ints
    b: Ints
    normal: Floats
    overlap: Floats


def _touching(centre: Floats, radius: Floats, bowl_radius: float) -> _Contacts:
    """Overlaps of particles with each other, the floor and the side, from where they are."""
    tree = KDTree(centre)
    pairs = tree.query_pairs(2.0 * float(radius.max()), output_type="ndarray").astype(np.int64)
    away = centre[pairs[:, 1]] - centre[pairs[:, 0]]
    distance = np.linalg.norm(away, axis=1)
    overlap = radius[pairs].sum(axis=1) - distance
    hit = overlap > 0.0
    across = np.linalg.norm(centre[:, :2], axis=1)
    side = radius - (bowl_radius - across)
    floor = radius - centre[:, 2]
    at_side, at_floor = np.flatnonzero(side > 0.0), np.flatnonzero(floor > 0.0)
    outward = np.zeros((len(at_side), 3))
    outward[:, :2] = centre[at_side, :2] / across[at_side, None]
    down = np.tile([0.0, 0.0, -1.0], (len(at_floor), 1))
    walls = np.full(len(at_side) + len(at_floor), -1)
    return _Contacts(
        np.concatenate([pairs[hit, 0], at_side, at_floor]),
        np.concatenate([pairs[hit, 1], walls]),
        np.concatenate([away[hit] / distance[hit, None], outward, down]),
        np.concatenate([overlap[hit], side[at_side], floor[at_floor]]),
    )


def _bed_network(point: PointRun, radius: Floats, contacts: _Contacts) -> Network:
    case = point.case
    particle = _moduli(case, "particle")
    wall = _moduli(case, "bowl")  # the workpiece is of the bowl's material
    at_wall = contacts.b < 0
    other = np.where(at_wall, 0, contacts.b)
    own = radius[contacts.a]
    effective = np.where(at_wall, own, own * radius[other] / (own + radius[other]))
    modulus, shear = (np.where(at_wall, wall[k], particle[k]) for k in (0, 1))
    normal, tangential = hertz_stiffness(contacts.overlap, effective, modulus, shear)
    return Network(
        radius_m=radius,
        mass_kg=4.0 / 3.0 * np.pi * radius**3 * case["media"]["density_kg_m3"],
        a=contacts.a,
        b=contacts.b,
        normal=contacts.normal,
        normal_stiffness_n_m=normal,
        tangential_stiffness_n_m=tangential if point.sticks else 0.0 * tangential,
    )


def _thermo(folder: Path) -> dict[str, Floats]:
    blocks = list(iter_prints(folder, load_outputs(folder)["thermo"]))
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


def _energy(rows: Mapping[str, Floats]) -> Floats:
    return np.asarray(rows["kinetic_energy_j"] + rows["rotational_energy_j"])


def _frame_numbers(point: PointRun, frame: Frame) -> Numbers:
    """Overlap and frequency of a bed of particles in a bowl."""
    centre, radius = frame.vectors("x_m", "y_m", "z_m"), frame.vectors("radius_m")[:, 0]
    contacts = _touching(centre, radius, point.case["bowl"]["radius_m"])
    network = _bed_network(point, radius, contacts)
    return {
        "overlap_ratio": float((contacts.overlap / radius[contacts.a]).max(initial=0.0)),
        "frequency_rad_s": largest_frequency(network),
    }


def _measure_settle(point: PointRun) -> Numbers:
    outputs = load_outputs(point.folder)
    *_, last = iter_frames(point.folder, outputs["particles"])
    return {
        **_frame_numbers(point, last),
        "height_m": float(last.columns["z_m"].mean()),
        "peak_energy_j": float(_energy(_thermo(point.folder)).max()),
    }


def _measure_column(point: PointRun) -> Numbers:
    case, outputs = point.case, load_outputs(point.folder)
    first, *_, last = iter_frames(point.folder, outputs["particles"])
    media = case["media"]
    mass = 4.0 / 3.0 * np.pi * media["radius_mean_m"] ** 3 * media["density_kg_m3"]
    unit = media["count"] * mass * case["gravity_m_s2"] * 2.0 * media["radius_mean_m"]
    return {
        **_frame_numbers(point, first),
        "height_m": float(last.columns["z_m"].mean()),
        "rest_energy_ratio": float(_energy(_thermo(point.folder))[-LAST_SAMPLES:].mean()) / unit,
    }


def _measure_drag(point: PointRun) -> Numbers:
    run = Run.open(point.folder)
    blocks = [workpiece_force_rows(rows, run.case) for rows in run.prints("workpiece_force")]
    drag, counted = (
        np.concatenate([np.asarray(block[name]) for block in blocks])
        for name in ("drag_n", "in_statistics")
    )
    mean = estimate_mean(drag[counted])
    media, speed = run.case.media, point.row["settings"]["workpiece_speed_m_s"]
    mass = 4.0 / 3.0 * np.pi * media.radius_mean_m**3 * media.density_kg_m3
    thrown = mass * run.case.gravity_m_s2 * 2.0 * media.radius_mean_m
    moving = media.count * 0.5 * mass * speed**2
    thermo = _thermo(point.folder)
    during = thermo["step"] > drag_phase(run.case).start_step
    motion = thermo["kinetic_energy_j"]  # nothing damps a spin about a contact's normal
    return {
        **_drag_network(point, run),
        "drag_mean_n": mean.mean,
        "drag_se_n": mean.se if mean.reliable else math.inf,
        "drag_energy_ratio": float(np.median(motion[during])) / (moving + thrown),
    }


def _drag_network(point: PointRun, run: Run) -> Numbers:
    """Largest overlap of the drag, and frequency of the stiffest of some frames."""
    particles = {frame.step: frame for frame in run.frames("particles")}
    pairs = {frame.step: frame for frame in run.frames("contacts")}
    steps = np.array(sorted(pairs))
    every = steps[np.linspace(0, len(steps) - 1, min(len(steps), NETWORK_FRAMES)).astype(int)]
    some = set(every.tolist() if point.row["reference"] else every[:1].tolist())
    largest = frequency = 0.0
    for workpiece in iter_workpiece_frames(run.folder, run.outputs):
        if workpiece.step not in pairs:
            continue
        frame = _sorted(particles[workpiece.step])
        radius = frame.vectors("radius_m")[:, 0]
        contacts = _engine_contacts(frame, pairs[workpiece.step], workpiece, run)
        own = contacts.overlap / radius[contacts.a]
        largest = max(largest, float(own.max(initial=0.0)))
        if workpiece.step in some:
            network = _bed_network(point, radius, contacts)
            frequency = max(frequency, largest_frequency(network))
    return {"overlap_ratio": largest, "frequency_rad_s": frequency}


def _engine_contacts(frame: Frame, pairs: Frame, workpiece: WorkpieceFrame, run: Run) -> _Contacts:
    """The contacts of one frame as the engine wrote them, with bowl and workpiece."""
    bowl_radius = needed(run.case.bowl, "bowl").radius_m
    rows = contact_rows(frame, pairs, workpiece.workpiece, workpiece.bowl, bowl_radius)
    ids = np.asarray(frame.columns["particle_id"], dtype=np.int64)
    a = np.searchsorted(ids, rows.a_id)
    b = np.where(rows.b_id > 0, np.searchsorted(ids, rows.b_id), -1)
    towards = rows.point_m - frame.vectors("x_m", "y_m", "z_m")[a]
    normal = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    hit = rows.overlap_m > 0.0
    return _Contacts(a[hit], b[hit], normal[hit], rows.overlap_m[hit])
