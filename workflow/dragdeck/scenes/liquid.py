"""The compound of a study in its scenes: a liquid at rest that lifts particles."""

from dragdeck.cases.bed import particle_material
from dragdeck.cases.case import Case
from dragdeck.decks.deck import NOT_OF_LIQUID, LeftOut, Liquid
from dragdeck.errors import InputError
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import limit_of, round_to
from dragdeck.study.model import Study


def liquid(study: Study) -> Liquid | None:
    """The compound as an input script has it."""
    compound = study.compound
    return Liquid(study.liquid_level_m, compound.density_kg_m3) if compound else None


def acting_gravity(study: Study) -> float:
    """Gravity of a run with a bed, m/s2.

    LIGGGHTS would lift every sphere of a clump by its whole volume: submerged clumps have their
    weight minus buoyancy by a smaller gravity.
    """
    if study.compound is None or not study.media.clumped:
        return study.gravity_m_s2
    lifted = study.compound.density_kg_m3 / particle_material(study).density_kg_m3
    return round_to(study.gravity_m_s2 * (1 - lifted), 12)


def check_submerged(case: Case, bed: Bed) -> None:
    """Refuse clumps that are not wholly below the surface of a liquid.

    Raises
    ------
    InputError
        The liquid is too low.
    """
    study, highest = case.study, bed.top_m + bed.margin_m
    if study.compound and study.media.clumped and study.liquid_level_m < highest:
        raise InputError(
            "shaped media are not wholly submerged", file=case.file, field="compound.level_m",
            value=study.liquid_level_m,
            limit=f"at least {limit_of(highest, up=True)} m, the highest point of a particle",
            remedy="use a higher level, fewer particles, or spheres",
        )  # fmt: skip


def liquid_models(study: Study) -> dict[str, str]:
    """What a run with particles in a compound models of it."""
    compound, level = study.compound, study.liquid_level_m
    if compound is None:
        return {}
    lifted = f"liquid of {compound.density_kg_m3:g} kg/m3 up to {level:g} m"
    if study.media.clumped:
        lifted += "; by a smaller gravity, which acts on all particles as on submerged ones"
    return {
        "buoyancy of particles": lifted,
        "friction and restitution in liquid": "the values of pairs, those of wet contacts",
    }


def liquid_leaves_out(study: Study) -> dict[str, LeftOut]:
    """What it leaves out."""
    left = {
        f"{NOT_OF_LIQUID[0]}, {NOT_OF_LIQUID[1]} and {NOT_OF_LIQUID[2]}": "the liquid has no flow",
        NOT_OF_LIQUID[3]: "LIGGGHTS has none for meshes; the report states the force",
        NOT_OF_LIQUID[4]: "not offered: docs/explanation/limitations.md has the reasons",
    }
    return {name: LeftOut(why) for name, why in left.items()} if study.compound else {}
