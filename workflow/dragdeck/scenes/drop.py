"""The drop test: one mean ball on a plate of the workpiece's material."""

from __future__ import annotations

from dataclasses import dataclass

from dragdeck import outputs
from dragdeck.cases import Case
from dragdeck.derive import (
    ball_mass,
    effective_modulus,
    fall_speed,
    hertz_contact_time,
    rayleigh_time,
)
from dragdeck.scenes.common import (
    Deck,
    LeftOut,
    Scene,
    ball_material,
    base_case,
    material_table,
    timestep,
)
from dragdeck.study import Study

MARGIN = 0.5
"""Steps written before and after a contact, as a share of its Hertz time."""


@dataclass(frozen=True, kw_only=True)
class DropDeck(Deck):
    """What the drop template sees."""

    plate_type: int
    ball_radius_m: float
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
        Time step, s; None: the study's `drop.timestep_fraction` of the Rayleigh time.
    """

    youngs_modulus_scale: float = 1.0
    timestep_s: float | None = None


def drop_scene(case: Case, fidelity: DropFidelity | None = None) -> Scene:
    """The drop test of a case, by default at the full modulus: one ball costs nothing.

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
    radius = study.media.radius_mean_m
    names = list(dict.fromkeys((study.media.material, study.workpiece.material)))
    rayleigh = rayleigh_time(ball_material(study), radius, scale)
    dt = fidelity.timestep_s or timestep(rayleigh, study.drop.timestep_fraction)
    contact_steps = slowest_contact_time(study, scale) / dt
    margin = max(10, round(MARGIN * contact_steps))
    deck = DropDeck(
        title=f"Drop test: {study.title}",
        study=case.study_name,
        scene="drop",
        run=case.run_ids["drop"],
        source="ball.data",
        materials=material_table(study, names, scale, case),
        limit_force=study.contact.limit_force,
        gravity_m_s2=study.gravity_m_s2,
        skin_m=radius,
        timestep_s=dt,
        outputs=(outputs.impacts(),),
        plate_type=len(names),
        ball_radius_m=radius,
        impacts=study.drop.impacts,
        margin_steps=margin,
        impact_steps=2 * margin + round(1.5 * contact_steps),
    )
    return Scene(
        deck=deck,
        case={
            **base_case(case, "drop", dt, rayleigh),
            "restitution": study.pair(study.media.material, study.workpiece.material).restitution,
            "youngs_modulus_scale": scale,
            "phases": [],
        },
        steps=round(_duration(study) / dt),
        files={"ball.data": _ball_data(study, len(names))},
        models={
            "ball against plate": "the only contact there is",
            **_modulus(scale),
            "every step near an impact": "peak force and rebound are read from it",
        },
        leaves_out={
            "ball-ball contacts": LeftOut("there is one ball", "drop_contacts"),
            "output in flight": LeftOut(
                "height and speed give the time of the next impact", "drop_every_step"
            ),
            "facets of the plate": LeftOut("a plane is exact and faster"),
            "checkpoints": LeftOut("the run takes seconds"),
        },
    )


def _modulus(scale: float) -> dict[str, str]:
    if scale == 1.0:
        return {"full Young's modulus": "one ball is cheap at any stiffness"}
    return {f"Young's modulus times {scale:g}": "as asked, to see what it changes"}


def slowest_contact_time(study: Study, scale: float = 1.0) -> float:
    """Hertz time of the last impact, the slowest and so the longest, s."""
    ball, plate = ball_material(study), study.materials[study.workpiece.material]
    radius = study.media.radius_mean_m
    pair = study.pair(study.media.material, study.workpiece.material)
    speed = fall_speed(study.drop.height_m, study.gravity_m_s2)
    last = speed * pair.restitution ** (study.drop.impacts - 1)
    modulus = effective_modulus(ball, plate, scale)
    return hertz_contact_time(ball_mass(ball, radius), radius, modulus, last)


def _duration(study: Study) -> float:
    """Free fall and the flights between impacts, s."""
    pair = study.pair(study.media.material, study.workpiece.material)
    fall = fall_speed(study.drop.height_m, study.gravity_m_s2) / study.gravity_m_s2
    flights = sum(pair.restitution**k for k in range(1, study.drop.impacts))
    return fall * (1 + 2 * flights)


def _ball_data(study: Study, types: int) -> str:
    radius = study.media.radius_mean_m
    start = study.drop.height_m + radius
    side, top = 4 * radius, 2 * start + 2 * radius
    density = ball_material(study).density_kg_m3
    return (
        "one ball above a plate\n\n"
        f"1 atoms\n{types} atom types\n\n"
        f"{-side!r} {side!r} xlo xhi\n{-side!r} {side!r} ylo yhi\n{-radius!r} {top!r} zlo zhi\n\n"
        f"Atoms\n\n1 1 {2 * radius!r} {density!r} 0.0 0.0 {start!r}\n"
    )
