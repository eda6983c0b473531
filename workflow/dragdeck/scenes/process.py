"""The process: the workpiece plunges into the settled bed and is dragged along its path."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial

from dragdeck.cases.bed import bed_rayleigh_time, bed_timestep, buoyancy_density
from dragdeck.cases.case import Case, Stretch, of_each_workpiece
from dragdeck.decks import PACKING_FILE, WORKPIECE_MESH, outputs
from dragdeck.decks.deck import NOT_OF_LIQUID, Scene
from dragdeck.decks.outputs import Output
from dragdeck.errors import Caution
from dragdeck.files import file_checksum
from dragdeck.mesh.files import stl_text
from dragdeck.physics.domain_split import rank_warnings
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to
from dragdeck.physics.run_limits import ENGINE_NEIGHBOURS, RunLimits, thrown_speed
from dragdeck.records.case import AssumptionOfRun, ProcessCase, StatisticsOfRun, WorkpieceOfRun
from dragdeck.records.run import Phase, SteadyCriterion
from dragdeck.scenes import bed_space, moving_bowl
from dragdeck.scenes import filling as fillings
from dragdeck.scenes import fit as fits
from dragdeck.scenes import liquid as liquids
from dragdeck.scenes import motion as motions
from dragdeck.scenes import scene as scenes
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.lead import Covered, covered, mark_file, stops, with_lead
from dragdeck.scenes.numbers import describe, workpiece_buoyancy
from dragdeck.scenes.process_cautions import process_cautions
from dragdeck.scenes.process_deck import ProcessDeck, moved_workpiece
from dragdeck.scenes.process_texts import process_leaves_out, process_models
from dragdeck.scenes.workpiece import (
    PARTICLE_STEPS_PER_S,
    reference_height,
    remeshing,
    simulated_mesh,
    workpiece_facets,
    workpiece_length,
    workpiece_radius,
    workpiece_reach,
)
from dragdeck.study.base import Json, without_fields
from dragdeck.study.bowls.bowl import LID
from dragdeck.study.drive import Drive, EngineMotion
from dragdeck.study.model import Study
from dragdeck.study.workpiece import MeshShape, Shape
from dragdeck.study.yaml import mesh_beside

_ENERGY_DRIFT = 0.1
"""Largest change of the mean kinetic energy while it is counted: 5 % in the bed's speed."""


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
    whole = with_lead(case.all_workpieces)
    each = of_each_workpiece(whole)
    study, counts = whole.study, [workpiece_facets(workpiece) for workpiece in each]
    facets = study.bowl_facet_size_m is not None
    settled = bed or bed_space.expected_bed(study)
    dt, top = bed_timestep(study, "timestep_fraction"), bed_space.box_top(study)
    moving_bowl.check_bowl_motion(whole, settled, top)
    bed = moving_bowl.bed_in_motion(study, settled)
    periods, meshes = motions.output_periods(study, dt), _mesh_files(each)
    fits.check_apart(each, bed)
    fits.check_lid(whole, bed)
    liquids.check_submerged(whole, bed)
    deepest = max(workpiece.study.motion.immersion_depth_m for workpiece in each)
    courses = [
        motions.course(workpiece.study, bed, reference_height(workpiece), deepest)
        for workpiece in each
    ]
    moved = []
    drag, bowl_motion = courses[0].drag, courses[0].driven.bowl
    steps = covered(whole, drag)
    for workpiece, way in zip(each, courses, strict=True):
        fits.check_fit(workpiece, bed.lowest_m, dt)
        moved.append(
            moved_workpiece(workpiece, way, meshes[workpiece.study.workpiece.shape], steps.entry)
        )
        fits.check_headroom(
            workpiece, way.start_m[2] + bed.margin_m - reference_height(workpiece), top
        )
    skin = max(map(fits.process_skin, each))
    gravity, down = moving_bowl.driven_gravity(study, liquids.acting_gravity(study))
    types, parts = study.type_names(), bed_space.rank_split(whole, skin)
    bowl = study.bowl.closed
    primitive = tuple(wall for wall in bowl.walls if not facets or wall.name == LID)
    touches = study.outputs.first_touch_fraction if steps.end == drag.end else 0.0
    deck = scenes.deck_of_study(
        ProcessDeck,
        whole,
        types,
        case=whole.name,
        scene="process",
        run=PROCESS.run_id(whole),
        source=_source(whole),
        gravity_m_s2=gravity,
        gravity_direction=down,
        liquid=liquids.liquid(study),
        skin_m=skin,
        timestep_s=dt,
        rayleigh_time_s=bed_rayleigh_time(study),
        neighbours=max(ENGINE_NEIGHBOURS, bed_space.bowl_neighbours(study, skin), *counts),
        outputs=_outputs(
            periods,
            drag,
            steps,
            [body.name for body in moved],
            facets,
            [wall.name for wall in primitive],
            touches,
            study.media.clumped,
        ),
        thermo_steps=periods.network,
        checkpoint_steps=_checkpoint_steps(study, steps.end - steps.entry),
        processors=parts.line,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl=bowl.model_copy(update={"walls": primitive}),
        bowl_facets=facets,
        bowl_rad_s=courses[0].driven.bowl_rad_s,
        bowl_motion=bowl_motion.on_engine(dt) if bowl_motion else EngineMotion({}),
        clumped=study.media.clumped,
        workpiece_type=types.index(study.workpiece.material) + 1,
        workpieces=moved,
        entry_step=steps.entry,
    )
    deck = replace(deck, stops=list(stops(whole, drag, steps, deck.materials)))
    number = max(case.number, 1) - 1
    files = {WORKPIECE_MESH: partial(_stl, each[number])}
    fastest = max(map(_fastest, each, courses))
    limits = bed_space.bed_limits(study, top, fastest)
    jam = any(fits.may_jam(body, bed.surface_m) for body in each)
    models = {
        body.mesh: partial(_stl, body_case) for body_case, body in zip(each, moved, strict=True)
    }
    return Scene(
        deck=deck,
        case=_process_case(
            each,
            number,
            bed.surface_m,
            courses[number],
            deck,
            limits,
            steps,
            None if jam else thrown_speed(study.gravity_m_s2, top, fastest),
        ),
        steps=steps.end - steps.entry,
        facets=sum(counts),
        files=files if number else {**models, **bed_space.bowl_files(study, top)},
        models=process_models(study),
        leaves_out=process_leaves_out(study),
        warnings=[*_cautions(each), *rank_warnings(parts)],
    )


def _cautions(each: Sequence[Case]) -> Iterator[Caution]:
    """What a user should know of each workpiece; it is named where not all of them are meant."""
    by_text: dict[str, tuple[Caution, list[str]]] = {}
    for number, workpiece in enumerate(each, 1):
        for caution in (*process_cautions(workpiece), *moving_bowl.bowl_cautions(workpiece)):
            by_text.setdefault(str(caution), (caution, []))[1].append(str(number))
    for caution, numbers in by_text.values():
        owners = f"workpiece {', '.join(numbers)}: " if len(numbers) < len(each) else ""
        yield replace(caution, text=f"{owners}{caution}")


def _mesh_files(each: Sequence[Case]) -> Mapping[Shape, str]:
    """File of the mesh of each shape."""
    shapes = dict.fromkeys(workpiece.study.workpiece.shape for workpiece in each)
    return {
        shape: f"workpiece_{number}.stl" if number > 1 else WORKPIECE_MESH
        for number, shape in enumerate(shapes, 1)
    }


def _stl(case: Case) -> str:
    return stl_text(simulated_mesh(case))


def _source(case: Case) -> str:
    """The packing, or the state of the lead, from which a process starts."""
    if case.lead is None:
        return f"../../filling/{fillings.FILLING.run_id(case)}/{PACKING_FILE}"
    number = 1 + case.lead.stretch.marks.index(case.stretch.begin)
    return f"../../{PROCESS.name}/{PROCESS.run_id(case.lead)}/{mark_file(number)}"


def _outputs(
    periods: motions.Periods,
    drag: Drive,
    steps: Covered,
    names: Sequence[str],
    facets: bool,
    walls: Sequence[str],
    touches: float,
    clumped: bool,
) -> tuple[Output, ...]:
    several = facets or len(names) > 1
    begin = max(drag.start, steps.ramp_end)
    last_part = max(steps.counted, steps.end - math.ceil(touches * drag.steps))
    first_touching, first = (
        math.ceil(begin / period) * period for period in (periods.contacts, periods.network)
    )
    force, touching, network = (
        steps.end - steps.end % period
        for period in (periods.force, periods.contacts, periods.network)
    )
    return (
        outputs.thermo(periods.network, network, steps.entry),
        *(outputs.workpiece_force(periods.force, force, name, steps.entry) for name in names),
        outputs.workpiece_particles(periods.contacts, first_touching, touching),
        outputs.workpiece_contacts(periods.contacts, first_touching, touching, several),
        outputs.particles(periods.network, first, network, walls, clumped),
        outputs.contacts(periods.network, first, network),
        *(outputs.first_touch(last_part, steps.end, several) if touches else ()),
    )


def _checkpoint_steps(study: Study, last: int) -> int:
    count = study.outputs.n_checkpoints
    return math.ceil(last / (count + 1)) if count else 0


def _process_case(
    each: Sequence[Case],
    number: int,
    surface_m: float,
    way: motions.Course,
    deck: ProcessDeck,
    limits: RunLimits,
    steps: Covered,
    thrown_m_s: float | None,
) -> ProcessCase:
    case, drag = each[number], way.drag
    study, motion = case.study, case.study.motion
    transient_s = drag.time_to(motion.uncounted_m)
    if steps.entry:
        transient_s = (steps.counted - drag.start) * drag.timestep_s
    return scenes.case_of_study(
        ProcessCase,
        case,
        deck,
        settings=study.chosen_fidelity().model_dump(include={"timestep_fraction", "speed_factor"}),
        run=PROCESS.run_id(case),
        media=scenes.media_of_run(study, buoyancy_density(study)),
        bowl=bed_space.closed_bowl(study).model_copy(update={"motion": way.driven.bowl}),
        assumptions=[*scenes.assumed(study), *_of_liquid(case, surface_m)],
        asked=case.advised,
        study=scenes.said_study(study),
        unsafe_timestep=study.accepted.unsafe_timestep,
        case=case.name,
        upstream={scene.name: scene.run_id(case) for scene in (fillings.FILLING, DROP_TEST)},
        lead=case.lead and PROCESS.run_id(case.lead),
        entry_step=steps.entry,
        marks=[mark_file(number) for number, _ in enumerate(case.stretch.marks, 1)],
        numbers=describe(case),
        surface_m=surface_m,
        workpiece=WorkpieceOfRun(
            kind="mesh" if motion.inclined else study.workpiece.shape.kind,
            radius_m=workpiece_reach(case),
            length_m=workpiece_length(case),
            mesh=WORKPIECE_MESH,
            immersion_depth_m=motion.immersion_depth_m,
            number=case.number,
            count=len(each),
            wake_from_m=_wake_from(each, number),
            remeshed=remeshing(case),
        ),
        output_of=PROCESS.run_id(case.all_workpieces) if case.number > 1 else None,
        motion=way.driven.path_entry(),
        superposed=way.driven.superposed_entries(),
        phases=[
            Phase(name=leg.name, start_step=leg.start_step, end_step=min(leg.end_step, steps.end))
            for leg in way.legs
        ],
        statistics=StatisticsOfRun(transient_s=transient_s),
        steady=SteadyCriterion(from_step=steps.counted, energy_drift=_ENERGY_DRIFT)
        if motion.bowl_rad_s
        else None,
        limits=limits,
        thrown_m_s=thrown_m_s,
    )


def _of_liquid(case: Case, surface_m: float) -> Iterator[AssumptionOfRun]:
    """What the report says of the compound."""
    if (compound := case.study.compound) is None:
        return
    lifted = workpiece_buoyancy(case, surface_m)
    why = (
        "the liquid is at rest and lifts the particles only; not modelled: "
        f"{', '.join(NOT_OF_LIQUID)}. The vertical force lacks the buoyancy of the workpiece, "
        f"{lifted:+.3g} N at the start of the drag. Coefficients are those of pairs, which are "
        "taken as measured in the liquid"
    )
    yield AssumptionOfRun(field="compound", value=compound.density_kg_m3, why=why)


def _wake_from(each: Sequence[Case], number: int) -> float | None:
    """Path length after which a workpiece on a circle comes to where one began, itself included."""
    path = each[number].study.motion.path
    around, ahead = path.revolution_m, path.ahead_deg
    if around is None or ahead is None:
        return None
    others = (workpiece.study.motion.path.ahead_deg or 0.0 for workpiece in each)
    against = each[number].study.motion.against_bed
    if not against:
        return None
    sense = math.copysign(1.0, against)
    gap = min((sense * (other - ahead) - 1e-6) % 360 + 1e-6 for other in others)
    distance = around * gap / 360 / abs(against)
    return round_to(distance, 9) if distance < path.path_length_m * (1 - 1e-6) else None


def _fastest(case: Case, way: motions.Course) -> float:
    """Speed of the fastest leg, or of a surface or the bowl if one can be faster, m/s."""
    speeds, motion = [leg.speed_m_s for leg in way.legs], case.study.motion
    moved = motion.bowl or motion.bowl_rad_s
    if motion.superposed() or moved or motion.path.peak_speed_ratio > 1:
        speeds.append(fits.fastest_motion(case))
    return max(speeds)


def _partners(case: Case) -> list[tuple[str, str, float]]:
    workpiece = ("workpiece", case.study.workpiece.material, workpiece_radius(case))
    return [*fillings.partners_in_bed(case), workpiece]


def _stretches(case: Case) -> Json:
    """What a run covers, unless that is all, and from which run it goes on."""
    content = {} if case.stretch == Stretch() else {"stretch": asdict(case.stretch)}
    return {**content, "lead": PROCESS.run_id(case.lead)} if case.lead else content


_NOT_READ = ("drop_test", "fidelity.windows", "reduction")
"""Fields that a process does not depend on, besides where its windows begin."""


def _content(case: Case) -> Json:
    """What a process depends on."""
    case = with_lead(case)
    study = case.study
    content = without_fields(
        study.of_runs(study.bowl.material, study.workpiece.material), *_NOT_READ
    )
    shapes = [workpiece.study.workpiece.shape for workpiece in of_each_workpiece(case)]
    files = [mesh_beside(case.file, shape.file) for shape in shapes if isinstance(shape, MeshShape)]
    checksums = [file_checksum(file) for file in dict.fromkeys(files)]
    mesh = {"mesh": " ".join(checksums)} if checksums else {}
    return {**content, "filling": fillings.FILLING.run_id(case), **mesh, **_stretches(case)}


PROCESS = scenes.SceneType(
    name="process",
    slug=lambda case: case.name,
    content=_content,
    build=process_scene,
    inputs=(WORKPIECE_MESH,),
    tables=(
        *("thermo.parquet", "workpiece_force.parquet", "workpiece_contacts.parquet"),
        *("particles.parquet", "contacts.parquet", "closure.json"),
    ),
    network=("network.parquet", "chains.parquet", "clusters.parquet"),
    loading=("facets.parquet", "contact_events.parquet", "loading.json", "workpiece.vtp"),
    regime="drag",
    impact_speed=fits.fastest_motion,
    partners=_partners,
    particle_steps_per_s=PARTICLE_STEPS_PER_S,
    needs_bed=True,
)


_IN_ORDER = (DROP_TEST, fillings.FILLING, PROCESS)
SCENES: dict[str, scenes.SceneType] = {scene.name: scene for scene in _IN_ORDER}
"""The scenes of a study's case, by name: a new one is its module and an entry here."""
