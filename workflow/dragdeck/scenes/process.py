"""The process: the workpiece plunges into the settled bed and is dragged along its path."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from dragdeck.cases.bed import bed_rayleigh_time, bed_timestep, skin
from dragdeck.cases.case import Case, materials_content, mesh_file
from dragdeck.decks import PACKING_FILE, outputs
from dragdeck.decks.case_file import Phase, SteadyCriterion
from dragdeck.decks.deck import Deck, LeftOut, Scene
from dragdeck.decks.outputs import Output
from dragdeck.decks.process_case import (
    ProcessCase,
    StatisticsOfRun,
    WorkpieceOfRun,
)
from dragdeck.files import file_checksum
from dragdeck.mesh import bowl, stl_text
from dragdeck.physics.domain_split import warnings as rank_warnings
from dragdeck.physics.rounding import round_to
from dragdeck.scenes.dimensionless import describe
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import (
    FILLING,
    bed_limits,
    box_top,
    expected_surface,
    filling_content,
    partners_in_bed,
    rank_split,
)
from dragdeck.scenes.fit import check_fit, check_headroom, fastest_motion, process_cautions
from dragdeck.scenes.motion import in_steps, legs, on_engine, plunge_point
from dragdeck.scenes.scene import Bed, SceneType, case_of_study, material_table
from dragdeck.scenes.workpiece import (
    workpiece_length,
    workpiece_mesh,
    workpiece_radius,
    workpiece_reach,
)
from dragdeck.study.base import Json
from dragdeck.study.contact_law import explained
from dragdeck.study.model import CylinderShape, MeshShape, Study
from dragdeck.study.paths.kind import Leg
from dragdeck.study.superposed.kind import DragSteps, EngineMotion, SuperposedMotion

_WORKPIECE_MESH = "workpiece.stl"

_ENERGY_DRIFT = 0.1
"""Largest change of the mean kinetic energy while it is counted: 5 % in the bed's speed."""


@dataclass(frozen=True)
class TimedLeg:
    """A leg of the motion with its steps, as the template writes it."""

    leg: Leg
    start_step: int
    end_step: int
    direction_rad: float

    name = property(lambda self: self.leg.name)
    kind = property(lambda self: self.leg.kind)
    duration_s = property(lambda self: self.leg.duration_s)
    velocity_m_s = property(lambda self: self.leg.velocity_m_s)
    angular_speed_rad_s = property(lambda self: self.leg.angular_speed_rad_s)

    @property
    def speed_m_s(self) -> float:
        """Speed of the workpiece's axis, m/s."""
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
    bowl_rad_s: float
    workpiece_type: int
    workpiece_start_m: tuple[float, float, float]
    workpiece_turn_deg: float
    legs: Sequence[TimedLeg]
    staged: EngineMotion | None
    superposed: Mapping[str, EngineMotion]


@dataclass(frozen=True)
class Periods:
    """Steps between frames of each output, each a multiple of the one before."""

    force: int
    contacts: int
    network: int


def process_scene(case: Case, bed: Bed | None = None) -> Scene[ProcessCase]:
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
        The workpiece does not fit between path and bowl, would reach below the
        floor, or has a mesh that cannot be used.
    """
    study = case.study
    fidelity = study.chosen_fidelity()
    bed = bed or expected_bed(study)
    surface = bed.surface_m
    rayleigh = bed_rayleigh_time(study)
    dt = bed_timestep(study, "timestep_fraction")
    check_fit(case, surface, dt)
    periods = _output_periods(study, dt)
    start, plan = course(study, bed, fidelity.speed_factor)
    timed = _timed_legs(plan, study, dt, periods.network)
    drag, last = timed[-1], timed[-1].end_step
    steps = DragSteps(drag.start_step, last, dt)
    types = study.type_names()
    top = box_top(study)
    check_headroom(case, start[2], top)
    parts = rank_split(case)
    deck = ProcessDeck(
        title=study.title,
        study=case.study_name,
        scene="process",
        run=PROCESS.run_id(case),
        source=f"../../filling/{FILLING.run_id(case)}/{PACKING_FILE}",
        materials=material_table(study, types, fidelity.youngs_modulus_scale, case),
        limit_force=study.contact.limit_force,
        gravity_m_s2=study.gravity_m_s2,
        skin_m=skin(study),
        timestep_s=dt,
        outputs=_outputs(periods, drag.start_step, last, study.bowl_facet_size_m is not None),
        thermo_steps=periods.network,
        checkpoint_steps=_checkpoint_steps(study, last),
        processors=parts.line,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl_radius_m=study.bowl.radius_m,
        bowl_facets=study.bowl_facet_size_m is not None,
        bowl_rad_s=fidelity.speed_factor * study.motion.bowl_rad_s,
        workpiece_type=types.index(study.workpiece.material) + 1,
        workpiece_start_m=start,
        workpiece_turn_deg=workpiece_turn(study),
        legs=timed,
        staged=on_engine(in_steps(drag.leg, steps), steps.start),
        superposed={name: one.on_engine(steps) for name, one in _superposed(study).items()},
    )
    return Scene(
        deck=deck,
        case=_process_case(case, bed.surface_m, timed, top, steps, rayleigh),
        steps=last,
        files={_WORKPIECE_MESH: lambda: stl_text(workpiece_mesh(case)), **_bowl_files(study, top)},
        models=_models(study),
        leaves_out=_leaves_out(study),
        warnings=[*process_cautions(case), *rank_warnings(parts)],
    )


def expected_bed(study: Study) -> Bed:
    """The settled bed before it exists: an estimate."""
    surface = expected_surface(study)
    return Bed(surface, surface + 2 * study.media.radius_mean_m)


def course(
    study: Study, bed: Bed, speed_factor: float
) -> tuple[tuple[float, float, float], list[Leg]]:
    """Where the workpiece's reference point is before the plunge, m, and its legs from there."""
    motion = study.motion
    clear = round_to(bed.top_m + study.media.radius_mean_m, 6)
    dive = clear - (bed.surface_m - motion.immersion_depth_m + motion.path.heights_m[0])
    return (*plunge_point(motion), clear), legs(motion, dive, speed_factor)


def _output_periods(study: Study, timestep_s: float) -> Periods:
    """Steps between frames: at least the asked rates, each a multiple of the faster one."""
    rates = study.outputs
    per_second = study.chosen_fidelity().speed_factor * timestep_s
    force = max(1, math.floor(1 / (rates.workpiece_force_hz * per_second)))
    contacts = force * max(1, math.floor(1 / (rates.workpiece_contacts_hz * per_second * force)))
    network = contacts * max(1, math.floor(1 / (rates.network_hz * per_second * contacts)))
    return Periods(force, contacts, network)


def _timed_legs(
    plan: Sequence[Leg], study: Study, timestep_s: float, period: int
) -> list[TimedLeg]:
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
        found.append(TimedLeg(timed, start, start + steps, study.motion.path.direction_rad))
        start += steps
    return found


def _outputs(periods: Periods, first: int, last: int, facets: bool) -> tuple[Output, ...]:
    return (
        outputs.thermo(periods.network, last),
        outputs.workpiece_force(periods.force, last),
        outputs.workpiece_particles(periods.contacts, first, last),
        outputs.workpiece_contacts(periods.contacts, first, last, facets),
        outputs.particles(periods.network, first, last, facets),
        outputs.contacts(periods.network, first, last),
    )


def _checkpoint_steps(study: Study, last: int) -> int:
    count = study.outputs.n_checkpoints
    return math.ceil(last / (count + 1)) if count else 0


def workpiece_turn(study: Study) -> float:
    """A mesh looks along +x in its own file: turn it into the direction of motion, degrees."""
    if not isinstance(study.workpiece.shape, MeshShape) and not study.motion.tilt_deg:
        return 0.0
    return math.degrees(study.motion.path.direction_rad)


def _process_case(
    case: Case,
    surface_m: float,
    timed: Sequence[TimedLeg],
    top_m: float,
    drag: DragSteps,
    rayleigh_s: float,
) -> ProcessCase:
    study, motion = case.study, case.study.motion
    transient_s = motion.uncounted_m / case.axis_speed_m_s
    return case_of_study(
        ProcessCase,
        case,
        PROCESS.run_id(case),
        {name: value for name, value in study.plain().items() if name in _INPUTS},
        drag.timestep_s,
        rayleigh_s,
        asked=case.advised,
        unsafe_timestep=study.accepted.unsafe_timestep,
        case=case.name,
        upstream={scene.name: scene.run_id(case) for scene in (FILLING, DROP_TEST)},
        numbers=describe(case),
        surface_m=surface_m,
        workpiece=WorkpieceOfRun(
            kind="mesh" if motion.tilt_deg else study.workpiece.shape.kind,
            radius_m=workpiece_reach(case),
            length_m=workpiece_length(case),
            mesh=_WORKPIECE_MESH,
            immersion_depth_m=motion.immersion_depth_m,
        ),
        motion=motion.path.of_run(
            case.axis_speed_m_s, motion.orientation, in_steps(timed[-1].leg, drag)
        ),
        superposed=[one.of_run(drag) for one in _superposed(study).values()],
        phases=[
            Phase(name=leg.name, start_step=leg.start_step, end_step=leg.end_step) for leg in timed
        ],
        statistics=StatisticsOfRun(transient_s=transient_s),
        steady=SteadyCriterion(
            from_step=drag.start + math.ceil(transient_s / drag.timestep_s),
            energy_drift=_ENERGY_DRIFT,
        )
        if motion.bowl_rad_s
        else None,
        limits=bed_limits(study, top_m, _fastest(case, timed)),
    )


_INPUTS = (
    *("materials", "pairs", "media", "bowl", "workpiece", "motion", "contact", "drop_test"),
    *("filling", "outputs", "gravity_m_s2", "seed"),
)


def _fastest(case: Case, timed: Sequence[TimedLeg]) -> float:
    """Speed of the fastest leg, or of a surface or the bowl if one can be faster, m/s."""
    speeds, motion = [leg.speed_m_s for leg in timed], case.study.motion
    if motion.superposed() or motion.bowl_rad_s or motion.path.peak_speed_ratio > 1:
        speeds.append(fastest_motion(case))
    return max(speeds)


def _superposed(study: Study) -> Mapping[str, SuperposedMotion]:
    return study.motion.superposed(study.chosen_fidelity().speed_factor)


def _bowl_files(study: Study, top_m: float) -> dict[str, Callable[[], str]]:
    """The bowl as a mesh, if the study asks for facets."""
    size = study.bowl_facet_size_m
    if size is None:
        return {}
    mesh = bowl(study.bowl.radius_m, min(study.bowl.height_m, 0.99 * top_m), size)
    return {"bowl.stl": lambda: stl_text(mesh)}


def _models(study: Study) -> dict[str, str]:
    optional, _ = explained(study.pairs.values())
    exact, why = study.bowl_facet_size_m is None, "facets, as asked"
    if study.motion.bowl_rad_s:
        why = "facets, whose surface moves with the rotation"
    bowl = "exact plane and cylinder" if exact else why
    return {
        "particle-particle, particle-workpiece, particle-bowl": "all three carry the chains",
        f"bowl: {bowl}": "its contacts end the chains, read from the force on each particle",
        **{words: "as the study gives it" for words in optional},
        "workpiece as facets": "the engine moves meshes only",
        **{f"{name} of the workpiece": "as the study gives it" for name in _superposed(study)},
        f"total force, {study.outputs.workpiece_force_hz:g} Hz": "drag, its spread and its peaks",
        f"workpiece contacts, "
        f"{study.outputs.workpiece_contacts_hz:g} Hz": "few, so cheap at a high rate",
        f"network and particles, {study.outputs.network_hz:g} Hz": "chains; positions serve both",
    }


def _leaves_out(study: Study) -> dict[str, LeftOut]:
    _, absent = explained(study.pairs.values())
    workpiece, network = study.outputs.workpiece_contacts_hz, study.outputs.network_hz
    found = {
        "positions, torques, areas of contacts": LeftOut(
            "the particles of the same step have the positions; no report reads the rest",
            "contact_columns",
        ),
        "network during plunge and approach": LeftOut(
            "no statistic counts them", "network_before_drag"
        ),
        "wear, stress and heat of the mesh": LeftOut("no report reads them"),
        **{words: LeftOut("the study gives none") for words in absent},
    }
    if network < workpiece:
        found[f"network at {workpiece:g} Hz"] = LeftOut("chains need no such rate", "network_rate")
    if study.bowl_facet_size_m is None:
        found["facets of the bowl"] = LeftOut(
            "slower, and no report asks for contacts per bowl facet", "bowl_facets"
        )
    shape = study.workpiece.shape
    if isinstance(shape, CylinderShape) and shape.facet_length_m > shape.facet_size_m:
        found["short facets along the workpiece"] = LeftOut(
            "a straight side needs none", "workpiece_short_facets"
        )
    return found


def _partners(case: Case) -> list[tuple[str, str, float]]:
    workpiece = ("workpiece", case.study.workpiece.material, workpiece_radius(case))
    return [*partners_in_bed(case), workpiece]


def _content(case: Case) -> Json:
    """What a process depends on."""
    study = case.study
    shape = study.workpiece.shape
    mesh = {"mesh": file_checksum(mesh_file(case, shape))} if isinstance(shape, MeshShape) else {}
    return {
        "filling": dict(filling_content(case)),
        "materials": materials_content(study, study.workpiece.material),
        "pair": study.pair(study.media.material, study.workpiece.material).plain(),
        "facet_size_m": study.bowl.facet_size_m,
        "workpiece": study.workpiece.plain(),
        "motion": study.motion.plain(),
        "outputs": study.outputs.plain(),
        "fidelity": study.chosen_fidelity().plain(),
        **mesh,
    }


PROCESS = SceneType(
    name="process",
    slug=lambda case: case.name,
    content=_content,
    build=process_scene,
    inputs=(_WORKPIECE_MESH,),
    tables=(
        "thermo.parquet",
        "workpiece_force.parquet",
        "workpiece_contacts.parquet",
        "particles.parquet",
        "contacts.parquet",
        "closure.json",
        "corrections.json",
    ),
    network=("network.parquet", "chains.parquet", "clusters.parquet"),
    loading=("facets.parquet", "contact_events.parquet", "loading.json", "workpiece.vtp"),
    figures=(
        "forces",
        "network_xy",
        "network_xz",
        "force_around_workpiece",
        "force_depth",
        "chains_peaks",
    ),
    regime="drag",
    impact_speed=fastest_motion,
    partners=_partners,
    particle_steps_per_s=7e6,
    needs_bed=True,
)
