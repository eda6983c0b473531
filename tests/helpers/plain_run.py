"""The main tables of a process run computed once more from its raw dumps, contact by contact.

Of clumps it knows the loads on the workpiece.

It shares no code with the packages: it reads ``case.json``, ``columns.json`` and the raw outputs by
itself, and loops over contacts. The rules are those of docs/reference/results.md. It knows a circle
whose orientation follows the path, without superposed motions, in a bowl of primitive walls.
"""

import json
import math
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from plain_dumps import binary_frames, text_frames

Vector = np.ndarray
Row = dict[str, float]
Contact = tuple[str, int, int, float]
"""Kind, a, b and normal force."""


def unit(a: Vector) -> Vector:
    return a / np.linalg.norm(a)


def vector(row: Row, what: str) -> Vector:
    """The three columns of this name, whose axis is the asterisk."""
    return np.array([row[what.replace("*", axis)] for axis in "xyz"])


def print_rows(file: Path, names: list[str]) -> Iterator[Row]:
    for line in file.read_text().splitlines()[1:]:
        yield dict(zip(names, map(float, line.split()), strict=True))


@dataclass
class OnWorkpiece:
    """A contact on the workpiece; forces on the particle."""

    particle: int
    facet: int
    point: Vector
    force: Vector
    normal: Vector
    surface: Vector


@dataclass
class PlainRun:
    """One uninterrupted process run."""

    folder: Path
    case: dict[str, Any] = field(init=False)
    outputs: dict[str, Any] = field(init=False)

    def __post_init__(self) -> None:
        self.case = json.loads((self.folder / "case.json").read_text())
        self.outputs = json.loads((self.folder / "columns.json").read_text())["outputs"]
        motion = self.case["motion"]
        assert (motion["kind"], motion["orientation"]) == ("circle", "follow_path")
        assert not self.case["bowl"].get("meshed") and not self.case.get("superposed")
        self.dt = self.case["timestep_s"]
        drag = next(phase for phase in self.case["phases"] if phase["name"] == "drag")
        self.start, self.end = drag["start_step"], drag["end_step"]
        self.sense = 1.0 if motion["direction"] == "ccw" else -1.0
        self.turning = self.sense * motion["axis_speed_m_s"] / motion["radius_m"]

    def body(self, sphere: int) -> int:
        """The body of a sphere, whose spheres have ids one after the other; itself if it is one."""
        for size in self.case.get("bodies", ()):
            spheres = len(size["radii_m"])
            if 0 <= (number := (sphere - size["first_sphere"]) // spheres) < size["count"]:
                return int(size["first_id"] + number)
        return sphere

    def friction(self, body: str) -> float:
        return float(self.case["contact_moduli"][body]["friction"])

    def file(self, name: str) -> tuple[Path, list[str]]:
        output = self.outputs[name]
        return self.folder / output["pattern"].format(part=1), output["columns"]

    def frames(self, name: str) -> Iterator[tuple[int, list[Row]]]:
        file, names = self.file(name)
        binary, content = self.outputs[name]["binary"], file.read_bytes()
        for step, columns in binary_frames(content, names) if binary else text_frames(content):
            rows = zip(*columns.values(), strict=True)
            yield step, [dict(zip(names, row, strict=True)) for row in rows]

    def pairs(self, one: str, other: str) -> Iterator[tuple[int, list[Row], list[Row]]]:
        """Step and rows of two outputs that are written together."""
        for (step, rows), (same, others) in zip(self.frames(one), self.frames(other), strict=True):
            assert step == same
            yield step, rows, others

    def counted(self, step: int) -> bool:
        first = self.start + self.case["statistics"]["transient_s"] / self.dt
        return step > self.start and first - 0.5 <= step <= self.end

    def forces(self) -> list[Row]:
        """Raw samples with direction of motion, drag, lateral and vertical force."""
        found = []
        for row in print_rows(*self.file("workpiece_force")):
            angle = self.case["motion"]["start_direction_rad"]
            if row["step"] > self.start:
                angle = math.atan2(row["ref_y_m"], row["ref_x_m"]) + self.sense * math.pi / 2
            c, s = math.cos(angle), math.sin(angle)
            row["drag_n"] = row["force_x_n"] * c + row["force_y_n"] * s
            row["lateral_n"] = row["force_y_n"] * c - row["force_x_n"] * s
            row["vertical_n"] = row["force_z_n"]
            found.append(row)
        return found

    def on_workpiece(self, name: str = "workpiece") -> Iterator[tuple[int, list[OnWorkpiece]]]:
        """The contacts with force of each sample: cut, merged over edges, and shared out.

        Of the outputs of this name: ``workpiece``, or ``touch`` at every step.
        """
        mu = self.friction("workpiece")
        for step, particles, contacts in self.pairs(f"{name}_particles", f"{name}_contacts"):
            touching: dict[float, list[Row]] = defaultdict(list)
            for contact in contacts:
                touching[contact["particle_id"]].append(contact)
            found = []
            for row in particles:
                if vector(row, "force_*_n").any():
                    found += _of_particle(row, touching[row["particle_id"]], mu)
            yield step, sorted(found, key=lambda one: (one.particle, one.facet))

    def slip(self, contact: OnWorkpiece) -> tuple[Vector, float]:
        """Tangential relative velocity, and the speed of approach."""
        x, y, _ = contact.point
        relative = contact.surface - np.array([-self.turning * y, self.turning * x, 0.0])
        apart = relative @ contact.normal
        return relative - apart * contact.normal, -apart

    def networks(self) -> Iterator[tuple[int, int, list[Contact]]]:
        """Step, number of particles and contacts with force of each frame."""
        workpiece = dict(self.on_workpiece())
        for step, particles, contacts in self.pairs("particles", "contacts"):
            centre = {row["particle_id"]: vector(row, "*_m") for row in particles}
            found: list[Contact] = []
            for contact in contacts:
                if (force := vector(contact, "force_*_n")).any():
                    a, b = contact["particle1_id"], contact["particle2_id"]
                    normal = unit(centre[a] - centre[b])
                    found.append(("particle", int(a), int(b), force @ normal))
            for one in workpiece[step]:
                found.append(("workpiece", one.particle, 0, one.force @ one.normal))
            for row in particles:
                particle, (x, y, _) = int(row["particle_id"]), vector(row, "*_m")
                if vector(row, "floor_force_*_n").any():
                    found.append(("floor", particle, -1, row["floor_force_z_n"]))
                if (force := vector(row, "side_force_*_n")).any():
                    found.append(("side", particle, -2, force @ unit(np.array([-x, -y, 0.0]))))
            yield step, len(particles), found


def _of_particle(row: Row, contacts: list[Row], friction: float) -> Iterator[OnWorkpiece]:
    """The contacts of a particle, whose forces add up to the one that the engine applied."""
    centre, applied = vector(row, "*_m"), vector(row, "force_*_n")
    heads: list[list[tuple[Row, Vector, Vector, Vector]]] = []
    for contact in sorted(contacts, key=lambda each: -each["overlap_m"]):
        point, force = vector(contact, "point_*_m"), vector(contact, "force_*_n")
        normal = unit(centre - point)
        along = force @ normal
        sideways = force - along * normal
        if (tangential := np.linalg.norm(sideways)) > friction * abs(along):
            force = along * normal + sideways * friction * abs(along) / tangential
        for head in heads:
            (deepest, place, *_), *_ = head
            reach = 2.0 * row["radius_m"] * max(deepest["overlap_m"], 0.0)
            if (point - place) @ (point - place) <= reach:
                head.append((contact, point, force, normal))
                break
        else:
            heads.append([(contact, point, force, normal)])
    evaluated = [sum(force for _, _, force, _ in head) for head in heads]
    missing = applied - sum(evaluated)
    for head, force in zip(heads, evaluated, strict=True):
        contact, point, _, normal = head[0]
        if len(head) > 1:
            normal = unit(sum(max(one["overlap_m"], 0.0) ** 1.5 * n for one, _, _, n in head))
        share = applied if len(heads) == 1 else force + missing / len(heads)
        surface = vector(row, "v*_m_s") + np.cross(vector(row, "w*_rad_s"), point - centre)
        particle, facet = int(row["particle_id"]), int(contact["facet_id"])
        yield OnWorkpiece(particle, facet, point, share, normal, surface)


def coordination(particles: int, contacts: list[Contact]) -> dict[str, float]:
    """The quantities of a row of ``network.parquet`` that need no chains."""
    kinds = Counter(kind for kind, *_ in contacts)
    count = Counter(a for _, a, _, _ in contacts)
    count.update(b for kind, _, b, _ in contacts if kind == "particle")
    loaded = [number for number in count.values() if number >= 4]
    forces = np.array([force for *_, force in contacts])
    return {
        "n_particles": particles,
        "n_contacts": len(contacts),
        **{f"n_particle_{kind}_contacts": kinds[kind] for kind in ("workpiece", "floor", "side")},
        "n_particle_particle_contacts": kinds["particle"],
        "coordination_number": count.total() / particles,
        "mechanical_coordination_number": sum(loaded) / len(loaded),
        "rattler_fraction": 1.0 - len(loaded) / particles,
        "normal_force_mean_n": forces.mean(),
        "normal_force_max_n": forces.max(),
        "above_mean_fraction": (forces > forces.mean()).mean(),
    }


def bottlenecks(contacts: list[Contact]) -> list[float]:
    """Bottleneck force of the widest path to the bowl from each loaded contact on the workpiece.

    Contacts above the mean are added in the order of falling force (Kruskal): a contact on the
    workpiece has the bottleneck of the force at which its group first touches the bowl. Sorted; 0
    where there is no path.
    """
    mean = math.fsum(force for *_, force in contacts) / len(contacts)
    leader: dict[int, int] = {}

    def root(body: int) -> int:
        while leader.setdefault(body, body) != body:
            body = leader[body]
        return body

    starts = {
        number: (a, force)
        for number, (kind, a, _, force) in enumerate(contacts)
        if kind == "workpiece" and force > mean
    }
    found: dict[int, float] = {}
    for kind, a, b, force in sorted(contacts, key=lambda one: -one[3]):
        if force <= mean:
            break
        if kind == "workpiece":
            continue
        leader[root(a)] = root(b if kind == "particle" else -1)
        for number, (particle, own) in starts.items():
            if number not in found and root(particle) == root(-1):
                found[number] = min(own, force)
    return sorted(found.get(number, 0.0) for number in starts)


def mobilised(run: PlainRun, along: float, sideways: float) -> bool:
    """Whether friction is, of a contact with these normal and tangential forces."""
    most = run.friction("workpiece") * along
    return bool(sideways >= 0.99 * most) if most > 0.0 else True


def loads(run: PlainRun) -> tuple[pd.Series, pd.DataFrame, pd.DataFrame]:
    """Totals, sums of each facet, and contact events of the counted samples.

    Amounts are of the contacts of spheres, events of particles.
    """
    interval = run.outputs["workpiece_contacts"]["period_steps"] * run.dt
    samples = [(step, contacts) for step, contacts in run.on_workpiece() if run.counted(step)]
    rows = []
    for number, (_, contacts) in enumerate(samples):
        for one in contacts:
            along = one.force @ one.normal
            sideways = np.linalg.norm(one.force - along * one.normal)
            slip, _ = run.slip(one)
            slides = mobilised(run, along, sideways)
            path = np.linalg.norm(slip) * interval
            amounts = {
                "normal_impulse_n_s": along * interval,
                "tangential_impulse_n_s": sideways * interval,
                "relative_path_m": path,
                "sliding_m": path * slides,
                "force_slide_n_m": along * path * slides,
                "friction_work_j": -(one.force @ slip) * interval,
            }
            place = {"particle": run.body(one.particle), "sample": number, "facet": one.facet}
            rows.append({**place, **amounts})
    table = pd.DataFrame(rows).sort_values(["particle", "sample"])
    begins = (table["particle"].diff() != 0) | (table["sample"].diff() > 1)
    table["event"] = begins.cumsum()
    names = list(amounts)
    events = table.groupby("event")[names].sum()
    first = table.groupby("event")[["particle", "sample"]].first()
    together = table.groupby(["event", "sample"])["normal_impulse_n_s"].sum() / interval
    events["peak_normal_force_n"] = together.groupby("event").max()
    events = first.join(events).sort_values(["sample", "particle"])
    return table[names].sum(), table.groupby("facet")[names].sum(), events


def mean_contacts(run: PlainRun) -> float:
    """Particles that touch the workpiece in a counted sample, on average: of clumps, bodies."""
    counts = [
        len({run.body(one.particle) for one in contacts})
        for step, contacts in run.on_workpiece()
        if run.counted(step)
    ]
    return sum(counts) / len(counts)


def rim_excess(run: PlainRun, widths: list[float]) -> list[tuple[float, float]]:
    """What a rod loses within each width of the rim of its tip but the last, W, and the excess.

    Excess: beyond what the same area has between that width and the next one. The rim is a polygon.
    """
    turn = -run.case["motion"]["start_direction_rad"]
    text = (run.folder / "workpiece.stl").read_text().split("vertex")[1:]
    corners = np.unique([[float(word) for word in one.split()[:3]] for one in text], axis=0)
    rim = corners[(abs(corners[:, 2]) < 1e-9) & (np.hypot(*corners[:, :2].T) > 0.00399)]
    rim = rim[np.argsort(np.arctan2(rim[:, 1], rim[:, 0]))]
    sides = np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1)
    apothem = float(np.hypot(*(0.5 * (rim + np.roll(rim, -1, axis=0)))[:, :2].T).min())
    c, s = math.cos(turn), math.sin(turn)
    rim[:, :2] = rim[:, :2] @ np.array([[c, s], [-s, c]])

    def area(width: float) -> float:
        end = apothem * sides.sum() / 2
        return sides.sum() * width + end * (1 - max(0.0, 1 - width / apothem) ** 2)

    def distance(point: Vector) -> float:
        found = []
        for a, b in zip(rim, np.roll(rim, -1, axis=0), strict=True):
            part = min(1.0, max(0.0, (point - a) @ (b - a) / ((b - a) @ (b - a))))
            found.append(float(np.linalg.norm(point - a - part * (b - a))))
        return min(found)

    within, samples = [0.0] * len(widths), 0
    places = {row["step"]: row for row in run.forces()}
    for step, contacts in run.on_workpiece():
        if not run.counted(step):
            continue
        samples += 1
        place = places[step]
        angle = math.atan2(place["ref_y_m"], place["ref_x_m"]) + run.sense * math.pi / 2
        c, s = math.cos(angle), math.sin(angle)
        for one in contacts:
            x, y, z = one.point - vector(place, "ref_*_m")
            away = distance(np.array([x * c + y * s, y * c - x * s, z]))
            along, slip = one.force @ one.normal, np.linalg.norm(run.slip(one)[0])
            sideways = float(np.linalg.norm(one.force - along * one.normal))
            if mobilised(run, along, sideways):
                for number, width in enumerate(widths):
                    within[number] += along * slip * (away < width)
    areas, means = [area(one) for one in widths], [one / samples for one in within]
    return [
        (means[n], means[n] - (means[n + 1] - means[n]) * areas[n] / (areas[n + 1] - areas[n]))
        for n in range(len(widths) - 1)
    ]


def first_touches(run: PlainRun) -> tuple[pd.DataFrame, float]:
    """The contacts of particles that begin after the first step, in order; the time of all, s.

    A particle that does not touch at one step ends its contact. What counts at the first touch is
    the contact with the largest normal force; the peak is that of all forces of a step together.
    """
    samples = [contacts for step, contacts in run.on_workpiece("touch") if run.counted(step)]
    radius = {
        row["particle_id"]: row["radius_m"] for _, rows in run.frames("particles") for row in rows
    }
    ended: list[dict[str, float]] = []
    current: dict[int, dict[str, float]] = {}
    for number, contacts in enumerate(samples):
        touching: dict[int, list[OnWorkpiece]] = defaultdict(list)
        for one in contacts:
            touching[one.particle].append(one)
        ended += [event for particle, event in current.items() if particle not in touching]
        current = {particle: one for particle, one in current.items() if particle in touching}
        for particle, of_particle in touching.items():
            forces = [one.force @ one.normal for one in of_particle]
            if particle not in current:
                slip, speed = run.slip(of_particle[int(np.argmax(forces))])
                current[particle] = {
                    "frame": number, "particle_id": particle, "radius_m": radius[particle],
                    "touch_normal_m_s": speed, "touch_tangential_m_s": float(np.linalg.norm(slip)),
                    "peak_normal_force_n": -math.inf, "duration_s": 0.0,
                }  # fmt: skip
            event = current[particle]
            event["duration_s"] += run.dt
            event["peak_normal_force_n"] = max(event["peak_normal_force_n"], sum(forces))
    found = pd.DataFrame([*ended, *current.values()]).sort_values(["frame", "particle_id"])
    return found[found["frame"] > 0], len(samples) * run.dt
