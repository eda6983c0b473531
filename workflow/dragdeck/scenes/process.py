"""The process: the tool plunges into the settled bed and is dragged along its path."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from dragdeck import outputs
from dragdeck.cases import Case
from dragdeck.derive import ball_mass, effective_modulus, hertz_contact_time
from dragdeck.errors import InputError
from dragdeck.mesh import Mesh, bowl
from dragdeck.motion import Leg, farthest_reach, legs, plunge_point, start_heading
from dragdeck.outputs import Output
from dragdeck.ranks import warnings as rank_warnings
from dragdeck.scenes.common import (
    Deck,
    LeftOut,
    Scene,
    ball_material,
    base_case,
    bed_radii,
    bed_rayleigh_time,
    flat,
    material_table,
    round_to,
    skin,
    timestep,
)
from dragdeck.scenes.fill import (
    bed_limits,
    box_top,
    expected_surface,
    first_balls,
    rank_split,
)
from dragdeck.scenes.numbers import describe
from dragdeck.scenes.tool import tool_length, tool_mesh, tool_radius
from dragdeck.study import CirclePath, CylinderShape, MeshShape, Study

FEWEST_STEPS_PER_CONTACT = 5
"""Below this many steps in a contact at the tool's speed a warning is given."""

JAMMING_GAP = 2.0
"""Ball diameters between tool and bowl below which a warning is given: an arch of
two balls at 1.7 diameters held a rod until the force was 190 N, and then left the bowl."""


@dataclass(frozen=True)
class TimedLeg:
    """A leg of the motion with its steps, as the template writes it."""

    leg: Leg
    start_step: int
    end_step: int
    heading_rad: float

    name = property(lambda self: self.leg.name)
    kind = property(lambda self: self.leg.kind)
    duration_s = property(lambda self: self.leg.duration_s)
    velocity_m_s = property(lambda self: self.leg.velocity_m_s)
    angular_speed_rad_s = property(lambda self: self.leg.angular_speed_rad_s)

    @property
    def speed_m_s(self) -> float:
        """Speed of the tool's axis, m/s."""
        return math.hypot(*self.leg.velocity_m_s)

    @property
    def period_s(self) -> float:
        """Time of a revolution, s."""
        return 2 * math.pi / abs(self.leg.angular_speed_rad_s)

    @property
    def sense(self) -> float:
        """1 counter-clockwise from above, -1 not."""
        return math.copysign(1.0, self.leg.angular_speed_rad_s)


@dataclass(frozen=True, kw_only=True)
class ProcessDeck(Deck):
    """What the process template sees."""

    bowl_type: int
    bowl_radius_m: float
    bowl_facets: bool
    tool_type: int
    tool_start_m: tuple[float, float, float]
    tool_turn_deg: float
    legs: Sequence[TimedLeg]


@dataclass(frozen=True)
class Periods:
    """Steps between frames of each output, each a multiple of the one before."""

    force: int
    contacts: int
    network: int


@dataclass(frozen=True)
class Bed:
    """A settled bed, as measured in the fill.

    Attributes
    ----------
    surface_m : float
        Its mean height above the floor.
    top_m : float
        The highest point of any ball.
    """

    surface_m: float
    top_m: float


def process_scene(case: Case, bed: Bed | None = None) -> Scene:
    """The process run of a case.

    Parameters
    ----------
    case : Case
    bed : Bed, optional
        As measured in the fill. Without it an expected height stands in: good
        for `explain` and `check`, not for a run.

    Raises
    ------
    InputError
        The tool does not fit between path and bowl, would reach below the
        floor, or has a mesh that cannot be used.
    """
    study = case.study
    fidelity = study.chosen_fidelity()
    bed = bed or _expected_bed(study)
    surface = bed.surface_m
    check_fit(case, surface)
    rayleigh = bed_rayleigh_time(study)
    dt = timestep(rayleigh, fidelity.timestep_fraction)
    periods = output_periods(study, dt)
    clear = round_to(bed.top_m + study.media.radius_mean_m, 6)
    start = (*plunge_point(study.motion), clear)
    dive = start[2] - (surface - study.motion.submersion_m)
    timed = timed_legs(legs(study.motion, dive, fidelity.speed_factor), study, dt, periods.network)
    drag, last = timed[-1], timed[-1].end_step
    types = study.type_names()
    top = box_top(study, first_balls(study))
    check_headroom(case, clear, top)
    parts = rank_split(case, top)
    deck = ProcessDeck(
        title=study.title,
        study=case.study_name,
        scene="process",
        run=case.run_ids["process"],
        source=f"../../fill/{case.run_ids['fill']}/fill.restart",
        materials=material_table(study, types, fidelity.youngs_modulus_scale, case),
        limit_force=study.contact.limit_force,
        gravity_m_s2=study.gravity_m_s2,
        skin_m=skin(study),
        timestep_s=dt,
        outputs=_outputs(periods, drag.start_step, last, study.bowl.facet_size_m is not None),
        thermo_steps=periods.network,
        checkpoint_steps=_checkpoint_steps(study, last),
        processors=parts.line,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl_radius_m=study.bowl.radius_m,
        bowl_facets=study.bowl.facet_size_m is not None,
        tool_type=types.index(study.workpiece.material) + 1,
        tool_start_m=start,
        tool_turn_deg=_tool_turn(study),
        legs=timed,
    )
    return Scene(
        deck=deck,
        case={
            **base_case(case, "process", dt, rayleigh),
            **_process_case(case, surface, timed),
            "limits": bed_limits(study, top, max(leg.speed_m_s for leg in timed)),
        },
        steps=last,
        meshes={"tool.stl": tool_mesh(case), **bowl_meshes(study, top)},
        models=_models(study),
        leaves_out=_leaves_out(study),
        warnings=[*_warnings(case, dt), *rank_warnings(parts)],
    )


def _expected_bed(study: Study) -> Bed:
    surface = expected_surface(study)
    return Bed(surface, surface + 2 * study.media.radius_mean_m)


def check_fit(case: Case, surface_m: float) -> None:
    """Refuse a tool that leaves the bowl or goes through its floor.

    Raises
    ------
    InputError
        Names the field that has to change.
    """
    study = case.study
    radius, reach = tool_radius(case), farthest_reach(study.motion)
    gap = study.bowl.radius_m - reach - radius
    if gap <= 0:
        raise InputError(
            "the tool does not fit between its path and the bowl",
            file=case.file,
            field="motion.path",
            value=f"axis up to {reach:.4g} m from the bowl's axis, tool radius {radius:.4g} m",
            limit=f"together below the bowl's radius {study.bowl.radius_m:g} m",
            remedy="use a smaller path or tool, or a wider bowl",
        )
    deepest = surface_m - 2 * float(bed_radii(study).max())
    if study.motion.submersion_m > deepest:
        below = study.motion.submersion_m > surface_m
        raise InputError(
            "the tool would reach below the floor"
            if below
            else "the tool would crush balls between its tip and the floor",
            file=case.file,
            field="motion.submersion_m",
            value=study.motion.submersion_m,
            limit=f"at most {deepest:.4g} m: a bed {surface_m:.4g} m high less one largest ball",
            remedy="submerge the tool less, or fill in more balls",
        )


def check_headroom(case: Case, tip_m: float, top_m: float) -> None:
    """Refuse a tool that would stick out of the simulation box before it goes in.

    Raises
    ------
    InputError
        The tool is too long.
    """
    longest = top_m - tip_m - 0.001
    if tool_length(case) > longest:
        raise InputError(
            "the tool is longer than the simulation box above the bed",
            file=case.file,
            field="workpiece.shape",
            value=f"length {tool_length(case):.4g} m",
            limit=f"at most {longest:.4g} m",
            remedy="cut the mesh off higher up, or state a higher bowl (bowl.height_m)",
        )


def output_periods(study: Study, timestep_s: float) -> Periods:
    """Steps between frames: at least the asked rates, each a multiple of the faster one."""
    rates = study.outputs
    per_second = study.chosen_fidelity().speed_factor * timestep_s
    force = max(1, math.floor(1 / (rates.tool_force_hz * per_second)))
    contacts = force * max(1, math.floor(1 / (rates.tool_contacts_hz * per_second * force)))
    network = contacts * max(1, math.floor(1 / (rates.network_hz * per_second * contacts)))
    return Periods(force, contacts, network)


def timed_legs(plan: Sequence[Leg], study: Study, timestep_s: float, period: int) -> list[TimedLeg]:
    """Give every leg its steps; each ends with a whole network period.

    A plunge or an approach goes a little slower to end where it should; the
    drag keeps its speed and goes a little farther.
    """
    found: list[TimedLeg] = []
    start = 0
    for leg in plan:
        steps = period * max(1, math.ceil(leg.duration_s / timestep_s / period - 1e-9))
        duration = steps * timestep_s
        if leg.name != "drag":
            slower = leg.duration_s / duration
            x, y, z = (round_to(slower * v, 12) for v in leg.velocity_m_s)
            leg = replace(leg, velocity_m_s=(x, y, z))
        timed = replace(leg, duration_s=round_to(duration, 12))
        found.append(TimedLeg(timed, start, start + steps, start_heading(study.motion)))
        start += steps
    return found


def _outputs(periods: Periods, first: int, last: int, facets: bool) -> tuple[Output, ...]:
    return (
        outputs.thermo(periods.network, last),
        outputs.rod_force(periods.force, last),
        outputs.rod_balls(periods.contacts, first, last),
        outputs.rod_contacts(periods.contacts, first, last, facets),
        outputs.balls(periods.network, first, last, facets),
        outputs.contacts(periods.network, first, last),
    )


def _checkpoint_steps(study: Study, last: int) -> int:
    count = study.outputs.checkpoints
    return math.ceil(last / (count + 1)) if count else 0


def _tool_turn(study: Study) -> float:
    """A mesh looks along +x in its own file: turn it into the direction of motion, degrees."""
    if not isinstance(study.workpiece.shape, MeshShape):
        return 0.0
    return math.degrees(start_heading(study.motion))


def _process_case(case: Case, surface_m: float, timed: Sequence[TimedLeg]) -> Mapping[str, Any]:
    study = case.study
    fidelity = study.chosen_fidelity()
    speed = study.motion.speed_m_s * fidelity.speed_factor
    return {
        "case": case.name,
        "inputs": flat(study.model_dump(mode="json", include=_INPUTS)),
        "upstream": {scene: case.run_ids[scene] for scene in ("fill", "drop")},
        "numbers": describe(case),
        "surface_m": surface_m,
        "tool": {
            "kind": study.workpiece.shape.kind,
            "radius_m": tool_radius(case),
            "length_m": tool_length(case),
            "mesh": "tool.stl",
            "submersion_m": study.motion.submersion_m,
        },
        "motion": {
            **_path(study),
            "speed_m_s": speed,
            "start_heading_rad": start_heading(study.motion),
        },
        "phases": [
            {"name": leg.name, "start_step": leg.start_step, "end_step": leg.end_step}
            for leg in timed
        ],
        "statistics": {"run_in_s": study.motion.run_in_m / speed},
    }


_INPUTS = {
    "materials", "pairs", "media", "bowl", "workpiece", "motion", "contact", "drop", "fill",
    "outputs", "gravity_m_s2", "seed",
}  # fmt: skip


def _path(study: Study) -> dict[str, Any]:
    path = study.motion.path
    turns = {"turns_with_path": study.motion.turns_with_path}
    if isinstance(path, CirclePath):
        return {"kind": "circle", "radius_m": path.radius_m, "sense": path.sense, **turns}
    heading = math.radians(path.heading_deg)
    return {"kind": "line", "start_m": list(path.start_m), "heading_rad": heading, **turns}


def bowl_meshes(study: Study, top_m: float) -> dict[str, Mesh]:
    """The bowl as a mesh, if the study asks for facets."""
    size = study.bowl.facet_size_m
    if size is None:
        return {}
    return {"bowl.stl": bowl(study.bowl.radius_m, min(study.bowl.height_m, 0.99 * top_m), size)}


def _models(study: Study) -> dict[str, str]:
    bowl = "exact plane and cylinder" if study.bowl.facet_size_m is None else "facets, as asked"
    return {
        "ball-ball, ball-tool, ball-bowl": "all three carry the chains",
        f"bowl: {bowl}": "its contacts end the chains, read from the force on each ball",
        "tool as facets": "the engine moves meshes only",
        f"total force, {study.outputs.tool_force_hz:g} Hz": "drag, its spread and its peaks",
        f"tool contacts, {study.outputs.tool_contacts_hz:g} Hz": "few, so cheap at a high rate",
        f"network and balls, {study.outputs.network_hz:g} Hz": "chains; positions serve both",
    }


def _leaves_out(study: Study) -> dict[str, LeftOut]:
    tool, network = study.outputs.tool_contacts_hz, study.outputs.network_hz
    found = {
        "positions, torques, areas of contacts": LeftOut(
            "the balls of the same step have the positions; no report reads the rest",
            "contact_columns",
        ),
        "network during plunge and approach": LeftOut(
            "no statistic counts them", "network_before_drag"
        ),
        "wear, stress and heat of the mesh": LeftOut("no report reads them"),
        "rolling friction": LeftOut("the study gives none"),
    }
    if network < tool:
        found[f"network at {tool:g} Hz"] = LeftOut("chains need no such rate", "network_rate")
    if study.bowl.facet_size_m is None:
        found["facets of the bowl"] = LeftOut(
            "slower, and no report asks for contacts per bowl facet", "bowl_facets"
        )
    shape = study.workpiece.shape
    if isinstance(shape, CylinderShape) and shape.facet_length_m > shape.facet_size_m:
        found["short facets along the rod"] = LeftOut(
            "a straight side needs none", "rod_short_facets"
        )
    return found


def _warnings(case: Case, timestep_s: float) -> list[str]:
    study = case.study
    diameter = 2 * study.media.radius_mean_m
    found = []
    gap = study.bowl.radius_m - farthest_reach(study.motion) - tool_radius(case)
    if gap < JAMMING_GAP * diameter:
        found.append(
            f"the gap between tool and bowl is {gap / diameter:.2g} ball diameters, less than "
            f"{JAMMING_GAP:g}: balls can jam in it, with forces far beyond those of the bed"
        )
    steps = contact_steps(study, timestep_s)
    if steps < FEWEST_STEPS_PER_CONTACT:
        found.append(
            f"a contact at the tool's speed takes {steps:.1f} steps, fewer than "
            f"{FEWEST_STEPS_PER_CONTACT}: single impacts are not resolved"
        )
    return found


def contact_steps(study: Study, timestep_s: float) -> float:
    """Steps of an elastic impact of a ball on the tool at the tool's speed."""
    fidelity = study.chosen_fidelity()
    ball, tool = ball_material(study), study.materials[study.workpiece.material]
    radius = study.media.radius_mean_m
    modulus = effective_modulus(ball, tool, fidelity.youngs_modulus_scale)
    speed = study.motion.speed_m_s * fidelity.speed_factor
    return hertz_contact_time(ball_mass(ball, radius), radius, modulus, speed) / timestep_s
