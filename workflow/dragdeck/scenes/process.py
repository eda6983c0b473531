"""The process: the workpiece plunges into the settled bed and is dragged along its path."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from trimesh import Trimesh

from dragdeck.cases.bed import bed_rayleigh_time, bed_timestep, skin
from dragdeck.cases.case import Case, materials_content, mesh_file
from dragdeck.decks import PACKING_FILE, outputs
from dragdeck.decks.case_file import (
    CircleOfRun,
    LineOfRun,
    Phase,
    ProcessCase,
    StatisticsOfRun,
    WorkpieceOfRun,
)
from dragdeck.decks.deck import Deck, LeftOut, Scene
from dragdeck.decks.outputs import Output
from dragdeck.files import file_checksum
from dragdeck.mesh import bowl
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
from dragdeck.scenes.motion import Leg, legs, plunge_point, start_direction
from dragdeck.scenes.scene import Bed, SceneType, case_of_study, material_table
from dragdeck.scenes.workpiece import workpiece_length, workpiece_mesh, workpiece_radius
from dragdeck.study.base import Json
from dragdeck.study.contact_law import explained
from dragdeck.study.model import CirclePath, CylinderShape, MeshShape, Study

_WORKPIECE_MESH = "workpiece.stl"


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
    workpiece_type: int
    workpiece_start_m: tuple[float, float, float]
    workpiece_turn_deg: float
    legs: Sequence[TimedLeg]


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
    bed = bed or _expected_bed(study)
    surface = bed.surface_m
    rayleigh = bed_rayleigh_time(study)
    dt = bed_timestep(study, "timestep_fraction")
    check_fit(case, surface, dt)
    periods = _output_periods(study, dt)
    clear = round_to(bed.top_m + study.media.radius_mean_m, 6)
    start = (*plunge_point(study.motion), clear)
    dive = start[2] - (surface - study.motion.immersion_depth_m)
    timed = _timed_legs(legs(study.motion, dive, fidelity.speed_factor), study, dt, periods.network)
    drag, last = timed[-1], timed[-1].end_step
    types = study.type_names()
    top = box_top(study)
    check_headroom(case, clear, top)
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
        outputs=_outputs(periods, drag.start_step, last, study.bowl.facet_size_m is not None),
        thermo_steps=periods.network,
        checkpoint_steps=_checkpoint_steps(study, last),
        processors=parts.line,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl_radius_m=study.bowl.radius_m,
        bowl_facets=study.bowl.facet_size_m is not None,
        workpiece_type=types.index(study.workpiece.material) + 1,
        workpiece_start_m=start,
        workpiece_turn_deg=_workpiece_turn(study),
        legs=timed,
    )
    return Scene(
        deck=deck,
        case=_process_case(case, bed.surface_m, timed, top, dt, rayleigh),
        steps=last,
        meshes={_WORKPIECE_MESH: workpiece_mesh(case), **_bowl_meshes(study, top)},
        models=_models(study),
        leaves_out=_leaves_out(study),
        warnings=[*process_cautions(case), *rank_warnings(parts)],
    )


def _expected_bed(study: Study) -> Bed:
    surface = expected_surface(study)
    return Bed(surface, surface + 2 * study.media.radius_mean_m)


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
        found.append(TimedLeg(timed, start, start + steps, start_direction(study.motion)))
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


def _workpiece_turn(study: Study) -> float:
    """A mesh looks along +x in its own file: turn it into the direction of motion, degrees."""
    if not isinstance(study.workpiece.shape, MeshShape):
        return 0.0
    return math.degrees(start_direction(study.motion))


def _process_case(
    case: Case,
    surface_m: float,
    timed: Sequence[TimedLeg],
    top_m: float,
    timestep_s: float,
    rayleigh_s: float,
) -> ProcessCase:
    study = case.study
    return case_of_study(
        ProcessCase,
        case,
        PROCESS.run_id(case),
        {name: value for name, value in study.plain().items() if name in _INPUTS},
        timestep_s,
        rayleigh_s,
        asked=case.advised,
        unsafe_timestep=study.accepted.unsafe_timestep,
        case=case.name,
        upstream={scene.name: scene.run_id(case) for scene in (FILLING, DROP_TEST)},
        numbers=describe(case),
        surface_m=surface_m,
        workpiece=WorkpieceOfRun(
            kind=study.workpiece.shape.kind,
            radius_m=workpiece_radius(case),
            length_m=workpiece_length(case),
            mesh=_WORKPIECE_MESH,
            immersion_depth_m=study.motion.immersion_depth_m,
        ),
        motion=_motion(case),
        phases=[
            Phase(name=leg.name, start_step=leg.start_step, end_step=leg.end_step) for leg in timed
        ],
        statistics=StatisticsOfRun(transient_s=study.motion.transient_m / case.axis_speed_m_s),
        limits=bed_limits(study, top_m, max(leg.speed_m_s for leg in timed)),
    )


_INPUTS = (
    *("materials", "pairs", "media", "bowl", "workpiece", "motion", "contact", "drop_test"),
    *("filling", "outputs", "gravity_m_s2", "seed"),
)


def _motion(case: Case) -> CircleOfRun | LineOfRun:
    motion = case.study.motion
    speed, direction = case.axis_speed_m_s, start_direction(motion)
    if isinstance(motion.path, CirclePath):
        return CircleOfRun(
            axis_speed_m_s=speed,
            start_direction_rad=direction,
            orientation=motion.orientation,
            radius_m=motion.path.radius_m,
            direction=motion.path.direction,
        )
    return LineOfRun(
        axis_speed_m_s=speed,
        start_direction_rad=direction,
        orientation=motion.orientation,
        start_m=motion.path.start_m,
        direction_rad=math.radians(motion.path.direction_deg),
    )


def _bowl_meshes(study: Study, top_m: float) -> dict[str, Trimesh]:
    """The bowl as a mesh, if the study asks for facets."""
    size = study.bowl.facet_size_m
    if size is None:
        return {}
    return {"bowl.stl": bowl(study.bowl.radius_m, min(study.bowl.height_m, 0.99 * top_m), size)}


def _models(study: Study) -> dict[str, str]:
    optional, _ = explained(study.pairs.values())
    bowl = "exact plane and cylinder" if study.bowl.facet_size_m is None else "facets, as asked"
    return {
        "particle-particle, particle-workpiece, particle-bowl": "all three carry the chains",
        f"bowl: {bowl}": "its contacts end the chains, read from the force on each particle",
        **{words: "as the study gives it" for words in optional},
        "workpiece as facets": "the engine moves meshes only",
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
    if study.bowl.facet_size_m is None:
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
