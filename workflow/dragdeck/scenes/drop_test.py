"""The drop test: one mean particle on a plate of the workpiece's material."""

import math
from dataclasses import dataclass

from dragdeck.cases.bed import impact_time, particle_material
from dragdeck.cases.case import Case
from dragdeck.decks import outputs
from dragdeck.decks.deck import Body, Deck, LeftOut, Scene, data_file
from dragdeck.physics.contact_mechanics import fall_speed, rayleigh_time
from dragdeck.physics.rounding import timestep
from dragdeck.records.case import DropTestCase
from dragdeck.scenes.scene import SceneType, case_of_study, deck_of_study, material_table
from dragdeck.study.base import Json, without_fields
from dragdeck.study.model import Study

_MARGIN = 0.5
"""Steps written before and after a contact, as a fraction of its Hertz time."""


@dataclass(frozen=True, kw_only=True)
class DropDeck(Deck):
    """What the drop template sees."""

    plate_type: int
    particle_radius_m: float
    impacts: int
    margin_steps: int
    impact_steps: int


@dataclass(frozen=True)
class DropFidelity:
    """What a drop gives up so that it runs as another scene does.

    Attributes
    ----------
    youngs_modulus_scale : float
        Factor on every Young's modulus, dimensionless.
    timestep_s : float, optional
        Time step, s; None: the study's `drop_test.timestep_fraction` of the Rayleigh time.
    """

    youngs_modulus_scale: float = 1.0
    timestep_s: float | None = None


def drop_scene(case: Case, fidelity: DropFidelity | None = None) -> Scene[DropTestCase]:
    """The drop test of a case, by default at the full modulus: one particle costs nothing.

    Parameters
    ----------
    case : Case
    fidelity : DropFidelity, optional
        To see what another modulus and step make of the same drop.

    Raises
    ------
    InputError
        A modulus that the engine refuses.
    """
    study = case.study
    fidelity = fidelity or DropFidelity()
    scale = fidelity.youngs_modulus_scale
    radius = study.media.typical_radius_m
    names = list(dict.fromkeys((study.media.main_material, study.workpiece.material)))
    rayleigh = rayleigh_time(particle_material(study), radius, scale)
    dt = fidelity.timestep_s or timestep(rayleigh, study.drop_test.timestep_fraction)
    contact_steps = _slowest_contact_time(study, scale) / dt
    margin = max(10, round(_MARGIN * contact_steps))
    deck = deck_of_study(
        DropDeck,
        case,
        names,
        title=f"Drop test: {study.title}",
        scene="drop_test",
        run=DROP_TEST.run_id(case),
        source="particle.data",
        materials=material_table(study, names, scale, case, one_particle=True),
        skin_m=radius,
        timestep_s=dt,
        rayleigh_time_s=rayleigh,
        outputs=(outputs.impacts(),),
        plate_type=len(names),
        particle_radius_m=radius,
        impacts=study.drop_test.impacts,
        margin_steps=margin,
        impact_steps=2 * margin + round(1.5 * contact_steps),
    )
    return Scene(
        deck=deck,
        case=case_of_study(
            DropTestCase,
            case,
            deck,
            settings={"ranks": 1},
            inputs=_content(case),
            bodies=(),
            restitution=study.pair(study.media.main_material, study.workpiece.material).restitution,
        ),
        steps=round(_duration(study) / dt),
        files={"particle.data": lambda: _particle_data(study, len(names))},
        models={
            "particle against plate": "the only contact",
            **_modulus(scale),
            "every step near an impact": "peak force and rebound are read from it",
        },
        leaves_out={
            "particle-particle contacts": LeftOut("there is one particle", "drop_contacts"),
            "output in flight": LeftOut(
                "height and speed give the time of the next impact", "drop_every_step"
            ),
            "facets of the plate": LeftOut("a plane is exact and faster"),
            "n_checkpoints": LeftOut("the run takes seconds"),
        },
    )


def _modulus(scale: float) -> dict[str, str]:
    if scale == 1.0:
        return {"full Young's modulus": "one particle is cheap at any stiffness"}
    return {f"Young's modulus times {scale:g}": "as requested, to measure its effect"}


def _slowest_contact_time(study: Study, scale: float = 1.0) -> float:
    """Hertz time of the last impact, the slowest and so the longest, s."""
    pair = study.pair(study.media.main_material, study.workpiece.material)
    speed = fall_speed(study.drop_test.height_m, study.gravity_m_s2)
    return impact_time(study, scale, speed * pair.restitution ** (study.drop_test.impacts - 1))


def _duration(study: Study) -> float:
    """Free fall and the flights between impacts, s."""
    pair = study.pair(study.media.main_material, study.workpiece.material)
    fall = fall_speed(study.drop_test.height_m, study.gravity_m_s2) / study.gravity_m_s2
    flights = sum(pair.restitution**k for k in range(1, study.drop_test.impacts))
    return fall * (1 + 2 * flights)


def _particle_data(study: Study, types: int) -> str:
    radius = study.media.typical_radius_m
    start = study.drop_test.height_m + radius
    side = 4 * radius
    box = ((-side, side), (-side, side), (-radius, 2 * start + 2 * radius))
    particle = Body(1, radius, particle_material(study).density_kg_m3, (0.0, 0.0, start))
    return data_file("one particle above a plate", types, box, [particle])


_NOT_READ = (
    *("bowl", "compound", "fidelity", "filling", "motion", "outputs", "seed"),
    *("reduction", "workpiece.shape", "workpieces"),
)
_NOT_READ_OF_MEDIA = (
    *("classes", "count", "distribution", "fill_height_m", "fraction", "fractions_of"),
    *("mass_kg", "radius_std_m", "shape"),
)
"""Fields that a drop test does not depend on: it has the first class's mean particle."""


def _content(case: Case) -> Json:
    """What a drop test depends on."""
    study = case.study
    particle, plate = study.media.main_material, study.workpiece.material
    return {
        **without_fields(study.of_runs(), *_NOT_READ),
        "materials": {name: study.materials[name].plain() for name in (particle, plate)},
        "pairs": {f"{particle}-{plate}": study.pair(particle, plate).plain()},
        "media": without_fields(study.media.main.plain(), *_NOT_READ_OF_MEDIA),
    }


DROP_TEST = SceneType(
    name="drop_test",
    slug=lambda case: f"{case.study.media.main_material}-on-{case.study.workpiece.material}",
    content=_content,
    build=lambda case, _: drop_scene(case),
    inputs=("particle.data",),
    tables=("impacts.parquet",),
    regime="impact",
    impact_speed=lambda case: fall_speed(case.study.drop_test.height_m, case.study.gravity_m_s2),
    partners=lambda case: [("plate", case.study.workpiece.material, math.inf)],
    particle_steps_per_s=1.5e6,
    single_particle=True,
)
