"""The fill: the particles fall into the bowl and come to rest."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dragdeck.cases import bed as beds
from dragdeck.cases.case import Case
from dragdeck.decks import outputs
from dragdeck.decks.deck import Body, Deck, LeftOut, Scene, data_file
from dragdeck.errors import InputError
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.physics.packing import primes
from dragdeck.physics.run_limits import ENGINE_NEIGHBOURS
from dragdeck.physics.walls import Container
from dragdeck.records.case import FillingCase
from dragdeck.records.run import SettlingCriterion
from dragdeck.scenes import bed_space
from dragdeck.scenes import liquid as liquids
from dragdeck.scenes import scene as scenes
from dragdeck.scenes.filling_cautions import filling_cautions
from dragdeck.study.base import Json, without_fields
from dragdeck.study.media import MOST_SIZES
from dragdeck.study.model import Study

_CHECK_INTERVAL_S = 0.02
"""Time between two looks at the kinetic energy, about the fall over one particle."""


_CELL_BYTES, _MOST_CELL_BYTES = 8, 2e9
"""Memory of LIGGGHTS for a cell of its contact search, and for all of them together."""


_SETTLING_ESTIMATE_S = 0.5
"""Time from the last particle's arrival to rest, an estimate used for expectations only."""


@dataclass(frozen=True, kw_only=True)
class FillingDeck(Deck):
    """What the fill template sees; for clumps with primes as seeds, and the top of the space, m."""

    bowl_type: int
    bowl: Container
    energy_ratio: float
    energy_unit_j: float
    check_steps: int
    most_checks: int
    max_time_s: float
    insertions: Sequence[beds.BodySize] = ()
    seeds: Sequence[int] = ()
    space_top_m: float = 0.0


def filling_scene(case: Case) -> Scene[FillingCase]:
    """The fill of a case.

    Raises
    ------
    InputError
        More particles than the bowl holds; a particle wider than the bowl; a modulus
        that the engine refuses.
    """
    study = case.study
    _check_capacity(case)
    _check_cells(case)
    liquids.check_submerged(case, bed_space.expected_bed(study))
    dt = beds.bed_timestep(study, "filling_timestep_fraction")
    check_steps = max(1, math.ceil(_CHECK_INTERVAL_S / dt))
    top, start = bed_space.box_top(study), bed_space._start(study)
    longest = study.filling.max_time_s
    types, meshed = _filling_types(study), bool(study.bowl.container.rim)
    deck = scenes.deck_of_study(
        FillingDeck,
        case,
        types,
        title=f"Filling: {study.title}",
        scene="filling",
        run=FILLING.run_id(case),
        source="particles.data",
        gravity_m_s2=liquids.acting_gravity(study),
        liquid=liquids.liquid(study),
        skin_m=beds.skin(study),
        timestep_s=dt,
        rayleigh_time_s=beds.bed_rayleigh_time(study),
        outputs=(outputs.thermo(check_steps, None), outputs.settled_particles(study.media.clumped)),
        thermo_steps=check_steps,
        checkpoint_steps=5 * check_steps,
        processors=bed_space.rank_split(case, beds.skin(study)).line,
        bowl_type=types.index(study.bowl.material) + 1,
        bowl=study.bowl.container,
        energy_ratio=study.filling.energy_ratio,
        energy_unit_j=_energy_unit(study),
        check_steps=check_steps,
        most_checks=math.ceil(longest / (check_steps * dt)),
        max_time_s=longest,
        neighbours=max(
            ENGINE_NEIGHBOURS, bed_space.bowl_neighbours(study, beds.skin(study)) if meshed else 0
        ),
        clumped=study.media.clumped,
        insertions=beds.body_sizes(study),
        seeds=primes(study.seed, 3 * MOST_SIZES * len(study.media.parts)),
        space_top_m=start.top_m,
    )
    return Scene(
        deck=deck,
        case=scenes.case_of_study(
            FillingCase,
            case,
            deck,
            inputs=_content(case),
            media=scenes.media_of_run(study, beds.buoyancy_density(study)),
            settled=SettlingCriterion(
                energy_ratio=study.filling.energy_ratio, highest_m=study.bowl.height_m
            ),
            limits=bed_space.bed_limits(study, top, start.fastest_m_s),
        ),
        steps=round(expected_time(study) / dt),
        files={
            "particles.data": lambda: _particles_data(study, top, len(types)),
            **(bed_space.bowl_files(study, top) if meshed else {}),
        },
        models={
            **_models(study),
            "settling by a criterion": f"kinetic energy below {study.filling.energy_ratio:g} m "
            f"g d per particle",
            "a separate time step": "falling particles collide faster than a packing at rest",
            **liquids.liquid_models(study),
        },
        leaves_out={
            **liquids.liquid_leaves_out(study),
            "the workpiece": LeftOut("added later; cases with other workpieces share this filling"),
            "contact output": LeftOut(
                "contacts before the drag are not analysed", "filling_contacts"
            ),
            **({} if meshed else {"facets of the bowl": LeftOut(_SETTLE_ALIKE)}),
        },
        warnings=list(filling_cautions(case)),
    )


_SETTLE_ALIKE = "particles settle in the same way on exact planes and cylinders"


def _filling_types(study: Study) -> list[str]:
    """A material for each engine type; a type the fill has no use for repeats the bowl's."""
    bowl = study.bowl.material
    used = list(dict.fromkeys((*study.media.materials, bowl)))
    return used + [bowl] * (len(study.type_names()) - len(used))


def _models(study: Study) -> dict[str, str]:
    """How particles stand in a deck."""
    if not study.media.clumped:
        return {"every particle individually": "exact number, mean and standard deviation of radii"}
    spheres = study.sphere_count / study.particle_count
    return {
        f"particles as clumps of {spheres:.3g} spheres": "mass and inertia of the body; a step "
        "takes as long as with so many times the particles"
    }


def _check_capacity(case: Case) -> None:
    """Refuse more particles than the bowl is sure to hold.

    Raises
    ------
    InputError
        The highest particle may lie above the rim.
    """
    study, bed = case.study, bed_space.expected_bed(case.study)
    rim, over = study.bowl.height_m, bed.top_m - bed.surface_m
    if bed.top_m + bed.margin_m > rim:
        most = max(0, math.floor(study.particle_count * (rim - over) / bed.highest_m))
        raise InputError(
            "more particles than fit into the bowl",
            file=case.file,
            field=f"media.{study.media.total}",
            value=f"{study.particle_count}, which fill it to {bed.surface_m:.4g} m +- "
            f"{bed.margin_m:.2g} m, with a particle on top",
            limit=f"{most} particles in a bowl {rim:g} m high",
            remedy="use fewer particles, or a wider or higher bowl",
        )


def _check_cells(case: Case) -> None:
    """Refuse a box so wide for its particles that the cells of LIGGGHTS' search fill the memory.

    A cell is half as wide as the largest particle and the neighbour skin.

    Raises
    ------
    InputError
    """
    study = case.study
    largest = max(
        float(class_.radii_m[-1] * class_.clump.radii.max()) for class_ in beds.bed_classes(study)
    )
    floor = 4 * math.prod(beds.box_half_widths(study))
    box = floor * (bed_space.box_top(study) + study.media.typical_radius_m)
    cells = box / (largest + beds.skin(study) / 2) ** 3
    if cells * _CELL_BYTES > _MOST_CELL_BYTES:
        raise InputError(
            "the bowl is too large for its particles: LIGGGHTS would divide it into "
            f"{cells:.3g} cells, with {cells * _CELL_BYTES / 1e9:.3g} GB of memory",
            file=case.file,
            field="bowl",
            limit=f"{_MOST_CELL_BYTES / 1e9:g} GB",
            remedy="use a smaller bowl, or larger particles",
        )


def _energy_unit(study: Study) -> float:
    """Number of particles times m g d of the mean particle, J."""
    radius, count = study.media.typical_radius_m, study.particle_count
    return mechanics.fall_energy(count, beds.weight_density(study), radius, study.gravity_m_s2)


def expected_time(study: Study) -> float:
    """Time in which the particles of a study come to rest, s. An estimate."""
    return (
        _arrival_speed(study, bed_space._start(study).top_m) / study.gravity_m_s2
        + _SETTLING_ESTIMATE_S
    )


def _arrival_speed(study: Study, top_m: float) -> float:
    """Speed of the highest particle on the bed if it falls from rest, m/s."""
    return mechanics.fall_speed(max(top_m - beds.expected_surface(study), 0.0), study.gravity_m_s2)


def _particles_data(study: Study, top_m: float, types: int) -> str:
    x, y = beds.box_half_widths(study)
    box = ((-x, x), (-y, y), (-study.media.typical_radius_m, top_m))
    if study.media.clumped:
        return data_file("the empty box", types, box, [])
    particles, names = (
        bed_space.first_particles(study),
        [class_.material for class_ in beds.bed_classes(study)],
    )
    kinds = [1 + study.type_names().index(name) for name in names]
    densities = [study.materials[name].density_kg_m3 for name in names]
    columns = (
        *(particles.classes, particles.radii_m),
        *(particles.positions_m, particles.velocities_m_s),
    )
    rows = zip(*(column.tolist() for column in columns), strict=True)
    bodies = [
        Body(kinds[at], radius, densities[at], place, velocity)
        for at, radius, place, velocity in rows
    ]
    return data_file("particles before they fall", types, box, bodies)


_NOT_READ = (
    *("bowl.lid_m", "drop_test", "motion", "outputs", "reduction", "workpiece", "workpieces"),
    *("fidelity.filling_youngs_modulus_scale", "fidelity.soft_start", "fidelity.speed_factor"),
    *("fidelity.timestep_fraction", "fidelity.windows"),
)
"""Fields that a filling does not depend on, so that many processes share it."""


def _content(case: Case) -> Json:
    """What a filling depends on."""
    study = case.of_filling.study
    exact = () if study.bowl.container.rim else ("bowl.facet_size_m",)
    content = without_fields(study.of_runs(study.bowl.material), *_NOT_READ, *exact)
    return {**content, "types": len(study.type_names())}


def _impact_speed(case: Case) -> float:
    """Speed of the highest particle that is thrown down and falls to the floor, m/s."""
    start = bed_space._start(case.study)
    fall = mechanics.fall_speed(start.top_m, case.study.gravity_m_s2)
    return math.hypot(start.fastest_m_s, fall)


def partners_in_bed(case: Case) -> list[tuple[str, str, float]]:
    """What a particle of a bed meets."""
    study = case.study
    return [
        ("particle", study.media.main_material, beds.smallest_radius(study)),
        ("bowl", study.bowl.material, study.bowl.container.clear_m),
    ]


FILLING = scenes.SceneType(
    name="filling",
    slug=lambda case: f"{case.study.particle_count}-particles",
    content=_content,
    build=lambda case, _: filling_scene(case.of_filling),
    inputs=("particles.data",),
    tables=("packing.json", "thermo.parquet"),
    regime="settle",
    impact_speed=_impact_speed,
    partners=partners_in_bed,
    particle_steps_per_s=9e6,
)
