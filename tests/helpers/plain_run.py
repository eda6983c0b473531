"""The main tables of a process run computed once more from its raw dumps, in plain Python.

It shares no code with the packages: it reads ``case.json``, ``columns.json`` and the raw outputs by
itself, and loops over contacts. The rules are those of docs/reference/results.md. It knows a circle
whose orientation follows the path, without superposed motions, in a bowl of primitive walls.
"""

import json
import math
import struct
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Vector = tuple[float, float, float]
Row = dict[str, float]


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def plus(a: Vector, b: Vector, factor: float = 1.0) -> Vector:
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Vector) -> float:
    return math.sqrt(dot(a, a))


def unit(a: Vector) -> Vector:
    length = norm(a)
    return (a[0] / length, a[1] / length, a[2] / length)


def total(vectors: list[Vector]) -> Vector:
    return (
        math.fsum(v[0] for v in vectors),
        math.fsum(v[1] for v in vectors),
        math.fsum(v[2] for v in vectors),
    )


def of(row: Row, *names: str) -> Vector:
    x, y, z = (row[name] for name in names)
    return x, y, z


FORCE = ("force_x_n", "force_y_n", "force_z_n")
POINT = ("point_x_m", "point_y_m", "point_z_m")
CENTRE = ("x_m", "y_m", "z_m")
VELOCITY = ("vx_m_s", "vy_m_s", "vz_m_s")
SPIN = ("wx_rad_s", "wy_rad_s", "wz_rad_s")
REFERENCE = ("ref_x_m", "ref_y_m", "ref_z_m")
FLOOR = ("floor_force_x_n", "floor_force_y_n", "floor_force_z_n")
SIDE = ("side_force_x_n", "side_force_y_n", "side_force_z_n")


# --- raw outputs -------------------------------------------------------------------------------


def print_rows(file: Path, names: list[str]) -> Iterator[Row]:
    for line in file.read_text().splitlines()[1:]:
        yield dict(zip(names, map(float, line.split()), strict=True))


def text_frames(file: Path, names: list[str]) -> Iterator[tuple[int, list[Row]]]:
    lines = iter(file.read_text().splitlines())
    for line in lines:
        assert line == "ITEM: TIMESTEP", line
        step = int(next(lines))
        next(lines)
        count = int(next(lines))
        for _ in range(5):
            next(lines)
        rows = (next(lines).split() for _ in range(count))
        yield step, [dict(zip(names, map(float, row), strict=True)) for row in rows]


def binary_frames(file: Path, names: list[str]) -> Iterator[tuple[int, list[Row]]]:
    data, at = file.read_bytes(), 0

    def take(form: str) -> tuple[Any, ...]:
        nonlocal at
        values = struct.unpack_from(form, data, at)
        at += struct.calcsize(form)
        return values

    while at < len(data):
        step, count, tilted = take("<qqi")
        take("<6i" + ("9d" if tilted else "6d"))
        width, chunks = take("<ii")
        assert width == len(names)
        rows: list[Row] = []
        for _ in range(chunks):
            (size,) = take("<i")
            values = take(f"<{size}d")
            rows += [
                dict(zip(names, values[k : k + width], strict=True)) for k in range(0, size, width)
            ]
        assert len(rows) == count
        yield step, rows


# --- the run -----------------------------------------------------------------------------------


@dataclass
class OnWorkpiece:
    """A contact on the workpiece; forces on the particle."""

    particle: int
    facet: int
    point: Vector
    force: Vector
    normal: Vector
    overlap: float
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
        assert self.case["bowl"]["walls"] == "primitive" and not self.case.get("superposed")
        self.dt = self.case["timestep_s"]
        drag = next(phase for phase in self.case["phases"] if phase["name"] == "drag")
        self.start, self.end = drag["start_step"], drag["end_step"]
        self.sense = 1.0 if motion["direction"] == "ccw" else -1.0
        self.turning = self.sense * motion["axis_speed_m_s"] / motion["radius_m"]

    def friction(self, body: str) -> float:
        return float(self.case["contact_moduli"][body]["friction"])

    def frames(self, name: str) -> Iterator[tuple[int, list[Row]]]:
        output = self.outputs[name]
        file = self.folder / output["pattern"].format(part=1)
        read = binary_frames if output["binary"] else text_frames
        return read(file, output["columns"])

    def counted(self, step: int) -> bool:
        first = self.start + self.case["statistics"]["transient_s"] / self.dt
        return step > self.start and first - 0.5 <= step <= self.end

    def forces(self) -> list[Row]:
        """Raw samples with direction of motion, drag, lateral and vertical force."""
        output = self.outputs["workpiece_force"]
        file = self.folder / output["pattern"].format(part=1)
        found = []
        for row in print_rows(file, output["columns"]):
            angle = self.case["motion"]["start_direction_rad"]
            if row["step"] > self.start:
                angle = math.atan2(row["ref_y_m"], row["ref_x_m"]) + self.sense * math.pi / 2
            c, s = math.cos(angle), math.sin(angle)
            row["drag_n"] = row["force_x_n"] * c + row["force_y_n"] * s
            row["lateral_n"] = row["force_y_n"] * c - row["force_x_n"] * s
            row["vertical_n"] = row["force_z_n"]
            found.append(row)
        return found

    def on_workpiece(self) -> Iterator[tuple[int, list[OnWorkpiece]]]:
        """The contacts with force of each sample: cut, merged over edges, and shared out."""
        pairs = zip(
            self.frames("workpiece_particles"), self.frames("workpiece_contacts"), strict=True
        )
        mu = self.friction("workpiece")
        for (step, particles), (other, contacts) in pairs:
            assert step == other
            rows = {int(row["particle_id"]): row for row in particles if any(of(row, *FORCE))}
            touching: dict[int, list[Row]] = defaultdict(list)
            for contact in contacts:
                if int(contact["particle_id"]) in rows:
                    touching[int(contact["particle_id"])].append(contact)
            found = []
            for particle, several in touching.items():
                found += _of_particle(particle, rows[particle], several, mu)
            yield step, sorted(found, key=lambda one: (one.particle, one.facet))

    def slip(self, contact: OnWorkpiece) -> tuple[Vector, float]:
        """Tangential relative velocity, and the speed of approach."""
        x, y, _ = contact.point
        own = (-self.turning * y, self.turning * x, 0.0)
        relative = plus(contact.surface, own, -1.0)
        apart = dot(relative, contact.normal)
        return plus(relative, contact.normal, -apart), -apart

    def networks(self) -> Iterator[tuple[int, int, list[tuple[str, int, int, float]]]]:
        """Step, particles and contacts with force (kind, a, b, normal force) of each frame."""
        workpiece = dict(self.on_workpiece())
        pairs = zip(self.frames("particles"), self.frames("contacts"), strict=True)
        for (step, particles), (other, contacts) in pairs:
            assert step == other
            centre = {int(row["particle_id"]): of(row, *CENTRE) for row in particles}
            found = []
            for contact in contacts:
                force = of(contact, *FORCE)
                if not any(force):
                    continue
                a, b = int(contact["particle1_id"]), int(contact["particle2_id"])
                found.append(("particle", a, b, dot(force, unit(plus(centre[a], centre[b], -1)))))
            for one in workpiece[step]:
                found.append(("workpiece", one.particle, 0, dot(one.force, one.normal)))
            for row in particles:
                particle, (x, y, _) = int(row["particle_id"]), of(row, *CENTRE)
                if any(of(row, *FLOOR)):
                    found.append(("floor", particle, -1, row["floor_force_z_n"]))
                if any(of(row, *SIDE)):
                    inward = unit((-x, -y, 0.0))
                    found.append(("side", particle, -2, dot(of(row, *SIDE), inward)))
            yield step, len(particles), found


def _of_particle(
    particle: int, row: Row, contacts: list[Row], friction: float
) -> list[OnWorkpiece]:
    centre, applied = of(row, *CENTRE), of(row, *FORCE)
    cut = []
    for contact in sorted(contacts, key=lambda each: -each["overlap_m"]):
        point, force = of(contact, *POINT), of(contact, *FORCE)
        normal = unit(plus(centre, point, -1.0))
        along = dot(force, normal)
        sideways = plus(force, normal, -along)
        limit = friction * abs(along)
        if norm(sideways) > limit:
            shorter = limit / norm(sideways)
            force = plus(
                (along * normal[0], along * normal[1], along * normal[2]), sideways, shorter
            )
        cut.append((contact, point, force, normal))
    heads: list[list[tuple[Row, Vector, Vector, Vector]]] = []
    for one in cut:
        for head in heads:
            deepest, place = head[0][0], head[0][1]
            apart = plus(one[1], place, -1.0)
            if dot(apart, apart) <= 2.0 * row["radius_m"] * max(deepest["overlap_m"], 0.0):
                head.append(one)
                break
        else:
            heads.append([one])
    evaluated = [total([force for _, _, force, _ in head]) for head in heads]
    missing = plus(applied, total(evaluated), -1.0)
    found = []
    for head, force in zip(heads, evaluated, strict=True):
        contact, point, _, normal = head[0]
        if len(head) > 1:
            weighted = [
                (w * n[0], w * n[1], w * n[2])
                for each, _, _, n in head
                for w in [max(each["overlap_m"], 0.0) ** 1.5]
            ]
            normal = unit(total(weighted))
        share = applied if len(heads) == 1 else plus(force, missing, 1.0 / len(heads))
        turning = cross(of(row, *SPIN), plus(point, centre, -1.0))
        found.append(
            OnWorkpiece(
                particle,
                int(contact["facet_id"]),
                point,
                share,
                normal,
                contact["overlap_m"],
                plus(of(row, *VELOCITY), turning),
            )
        )
    return found


# --- what follows from them --------------------------------------------------------------------


def coordination(particles: int, contacts: list[tuple[str, int, int, float]]) -> dict[str, float]:
    """The quantities of a row of ``network.parquet`` that need no chains."""
    count: dict[int, int] = defaultdict(int)
    kinds: dict[str, int] = defaultdict(int)
    for kind, a, b, _ in contacts:
        kinds[kind] += 1
        count[a] += 1
        if kind == "particle":
            count[b] += 1
    loaded = [number for number in count.values() if number >= 4]
    forces = [force for *_, force in contacts]
    mean = math.fsum(forces) / len(forces)
    return {
        "n_particles": particles,
        "n_contacts": len(contacts),
        **{f"n_particle_{kind}_contacts": kinds[kind] for kind in ("workpiece", "floor", "side")},
        "n_particle_particle_contacts": kinds["particle"],
        "coordination_number": sum(count.values()) / particles,
        "mechanical_coordination_number": sum(loaded) / len(loaded),
        "rattler_fraction": 1.0 - len(loaded) / particles,
        "normal_force_mean_n": mean,
        "normal_force_max_n": max(forces),
        "above_mean_fraction": sum(force > mean for force in forces) / len(forces),
    }


def bottlenecks(contacts: list[tuple[str, int, int, float]]) -> list[float]:
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


def loads(run: PlainRun) -> tuple[dict[str, float], dict[int, dict[str, float]], list[Row]]:
    """Totals, sums of each facet, and contact events of the counted samples."""
    interval = run.outputs["workpiece_contacts"]["period_steps"] * run.dt
    facets: dict[int, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    open_: dict[int, Row] = {}
    events: list[Row] = []
    for step, contacts in run.on_workpiece():
        if not run.counted(step):
            continue
        seen: dict[int, float] = defaultdict(float)
        for one in contacts:
            along = dot(one.force, one.normal)
            sideways = norm(plus(one.force, one.normal, -along))
            slip, _ = run.slip(one)
            most = run.friction("workpiece") * along
            slides = sideways >= 0.99 * most if most > 0.0 else True
            path = norm(slip) * interval
            amounts = {
                "normal_impulse_n_s": along * interval,
                "tangential_impulse_n_s": sideways * interval,
                "relative_path_m": path,
                "sliding_m": path * slides,
                "force_slide_n_m": along * path * slides,
                "friction_work_j": -dot(one.force, slip) * interval,
                "samples": 1.0,
            }
            event = open_.setdefault(
                one.particle, defaultdict(float, start=step, particle=one.particle)
            )
            for name, amount in amounts.items():
                facets[one.facet][name] += amount
                event[name] += amount
            seen[one.particle] += along
        for particle, force in seen.items():
            event = open_[particle]
            event["peak_normal_force_n"] = max(event["peak_normal_force_n"], force)
            event["frames"] += 1.0
        for particle in [each for each in open_ if each not in seen]:
            events.append(open_.pop(particle))
    events += open_.values()
    names = next(iter(facets.values())).keys()
    totals = {name: math.fsum(each[name] for each in facets.values()) for name in names}
    events.sort(key=lambda each: (each["start"], each["particle"]))
    return totals, facets, events
