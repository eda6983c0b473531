"""What a scene is to the rest of the project, and what all scenes share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import ValidationError

from dragdeck import __version__
from dragdeck.cases.bed import bed_classes, bed_density, body_sizes
from dragdeck.cases.case import Case, digest, slug
from dragdeck.decks.deck import Deck, Materials, Scene, contact_law
from dragdeck.errors import InputError
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to
from dragdeck.physics.run_limits import ENGINE_SOFTEST_PA
from dragdeck.records.bed import BowlOfRun, ClassOfRun, MediaOfRun
from dragdeck.records.case import AssumptionOfRun, CaseOfRun, FidelityOfRun
from dragdeck.records.packing import Packing
from dragdeck.study.base import Json, flat, without_fields
from dragdeck.study.contact_law import Pair
from dragdeck.study.fidelity import LARGEST_TIMESTEP_FRACTION
from dragdeck.study.model import Study

C = TypeVar("C", bound=CaseOfRun)
D = TypeVar("D", bound=Deck)


StudyScene = Scene[CaseOfRun]
"""A run of a study's case."""


_LONGEST_SLUG = 160
"""Characters of a run id's readable part: a folder's name has 255 bytes at most."""


Regime = Literal["impact", "settle", "column", "drag"]
"""What the stability map tells apart: each has its own limit of the time step."""


def read_bed(file: Path) -> Bed:
    """The settled bed that a ``packing.json`` describes.

    Raises
    ------
    InputError
        The file is missing or another version's.
    """
    packing = Packing.read(file)
    return Bed(packing.bed_height_m, packing.top_m)


_NOT_SAID = ("calibration", "fidelities", "licence", "scaling", "search", "sweep")


_OF_PROCESS = (
    *("accepted", "assumptions", "compound", "drop_test", "fidelity", "filling", "motion"),
    *("outputs", "reduction", "reference", "removal", "roughness", "seed"),
    *("workpiece.shape", "workpieces"),
)
"""Fields that no file of a run says, and those that only files of a process do."""


@dataclass(frozen=True)
class SceneType:
    """What one engine run models: all that the rest of the project asks of it.

    Attributes
    ----------
    name : str
        Of the scene, its template and its folder of results.
    slug : callable
        The readable start of a case's run id.
    content : callable
        The plain values that a case's run depends on, and nothing more: they name it.
    build : callable
        The scene of a case; the settled bed matters to those that start from one.
    inputs : tuple of str
        Files of a run's folder beside deck, case.json and columns.json.
    tables, network, loading : tuple of str
        Files that dragchain makes of a run: tables of its raw output, of the contact network
        and its chains, and of the loading of the workpiece.
    needs_bed : bool
        Whether it starts from the bed of a filling.
    single_particle : bool
        Whether it is a single particle at full modulus and not a bed.
    regime : Regime
        Of the stability map, whose limits apply here.
    impact_speed : callable
        Largest speed that an impact is expected to have, m/s.
    partners : callable
        What a particle meets: name, material and radius, m, of each body.
    particle_steps_per_s : float
        Particles times steps per second to expect of a small bed where no run was measured.
    """

    name: str
    slug: Callable[[Case], str]
    content: Callable[[Case], Json]
    build: Callable[[Case, Bed | None], StudyScene]
    inputs: tuple[str, ...]
    tables: tuple[str, ...]
    regime: Regime
    impact_speed: Callable[[Case], float]
    partners: Callable[[Case], Sequence[tuple[str, str, float]]]
    particle_steps_per_s: float
    needs_bed: bool = False
    single_particle: bool = False
    network: tuple[str, ...] = ()
    loading: tuple[str, ...] = ()

    def run_id(self, case: Case) -> str:
        """Run id of a case: a readable slug and 8 hex digits of what the run depends on.

        All workpieces share a run; what is made for each but the first is named by its number.
        """
        whole = case.all_workpieces
        tag = digest(self.content(whole))
        full_name = whole.left.get(tag) or f"{slug(self.slug(whole))[:_LONGEST_SLUG]}-{tag}"
        return f"{full_name}.{case.number}" if self.needs_bed and case.number > 1 else full_name

    def digest(self, case: Case) -> str:
        """Hash of all that the run's files say, remarks included.

        An edit of the study that does not concern the scene does not change it.
        """
        study, content = case.study, dict(self.content(case))
        said: dict[str, Any] = {"content": content}
        if self.needs_bed:
            asked = case.advised and case.advised.model_dump(mode="json")
            values = without_fields(study.plain(), *_NOT_SAID)
            said |= {
                **values,
                "case": case.name,
                "asked": asked,
                "assumptions": [assumption.model_dump() for assumption in assumed(study)],
            }
        else:
            said |= without_fields(study.plain(), *_NOT_SAID, *_OF_PROCESS)
        return digest(said)


def deck_of_study(kind: type[D], of: Case, types: Sequence[str], **parts: Any) -> D:
    """The content of an input script of a run of a study's case.

    Parameters
    ----------
    kind : type
        Of the scene's decks.
    of : Case
    types : sequence of str
        The material of each type of LIGGGHTS, the particles first.
    **parts
        What this scene's deck has beyond the others', or has otherwise.
    """
    study = of.study
    entries = {
        "title": study.title,
        "study": of.study_name,
        "materials": material_table(study, types, study.chosen_fidelity().youngs_modulus_scale, of),
        "limit_force": study.contact.limit_force,
        "gravity_m_s2": study.gravity_m_s2,
    }
    return kind(**{**entries, **parts})


def case_of_study(
    kind: type[C],
    of: Case,
    deck: Deck,
    *,
    rayleigh_time_s: float | None = None,
    settings: Json | None = None,
    **parts: Any,
) -> C:
    """The content of ``case.json`` of a run of a study's case.

    Parameters
    ----------
    kind : type
        The model of the scene's case file.
    of : Case
    deck : Deck
        Of the run.
    rayleigh_time_s : float, optional
        If not that of the deck.
    settings : mapping, optional
        What is not the deck's, the case's number of ranks, and no faster workpiece.
    **parts
        What this scene's case file has beyond the others', or has otherwise.
    """
    study = of.study
    rayleigh_time_s = rayleigh_time_s or deck.rayleigh_time_s
    usual = {
        "name": of.fidelity_name,
        "youngs_modulus_scale": deck.materials.youngs_modulus_scale,
        "timestep_fraction": round_to(deck.timestep_s / rayleigh_time_s, 3),
        "speed_factor": 1.0,
        "skin_m": deck.skin_m,
        "ranks": of.ranks,
    }
    fidelity = FidelityOfRun(**{**usual, **(settings or {})})
    main = study.media.main_material
    entries = {
        "study_name": of.study_name,
        "title": study.title,
        "run": deck.run,
        "timestep_s": deck.timestep_s,
        "rayleigh_time_s": rayleigh_time_s,
        "gravity_m_s2": study.gravity_m_s2,
        "fidelity": fidelity,
        "media": media_of_run(study),
        "bowl": bowl_of_run(study),
        "contact_moduli": _contact_moduli(study, main, fidelity.youngs_modulus_scale),
        "attractive": _attractive(study, main, fidelity.youngs_modulus_scale),
        "classes": _classes(study, fidelity.youngs_modulus_scale),
        "bodies": body_sizes(study),
        "assumptions": [],
        "versions": {"dragdeck": __version__},
    }
    return kind(**{**entries, **parts})


def said_study(study: Study) -> Study:
    """What ``case.json`` of a process has of a study: all that is about its runs."""
    settings = study.chosen_fidelity()
    said = without_fields(study.plain(), *_NOT_SAID) | {"fidelity": settings.plain()}
    try:
        return Study.model_validate(said)
    except ValidationError:
        # A stability map goes past the limits of a study on purpose; `fidelity` of the case has
        # what holds.
        step = min(settings.timestep_fraction, LARGEST_TIMESTEP_FRACTION)
        steps = {"timestep_fraction": step, "filling_timestep_fraction": min(step, 1.0)}
        within = settings.model_copy(update=steps)
        return Study.model_validate(said | {"fidelity": within.plain()})


def media_of_run(study: Study, buoyancy_kg_m3: float = 0.0) -> MediaOfRun:
    """The media, whose particles displace that mass of liquid per volume, kg/m3."""
    return MediaOfRun(
        count=study.particle_count,
        spheres=study.sphere_count if study.media.clumped else 0,
        radius_mean_m=study.media.typical_radius_m,
        radius_std_m=study.media.typical_std_m,
        density_kg_m3=bed_density(study),
        buoyancy_kg_m3=buoyancy_kg_m3,
    )


def bowl_of_run(study: Study) -> BowlOfRun:
    """The bowl before the process: open, with exact walls."""
    return BowlOfRun(**dict(study.bowl.container))


def _classes(study: Study, scale: float) -> tuple[ClassOfRun, ...]:
    """The classes of the media; none where there is one only."""
    classes, first = [], 1
    for class_ in bed_classes(study) if study.media.classes else ():
        classes.append(
            ClassOfRun(
                name=class_.name,
                material=class_.material,
                first_id=first,
                count=len(class_.radii_m),
                volume_m3=float((4 / 3 * np.pi * class_.radii_m**3).sum()),
                radius_mean_m=float(class_.radii_m.mean()),
                radius_std_m=float(class_.radii_m.std()),
                density_kg_m3=study.materials[class_.material].density_kg_m3,
                contact_moduli=_contact_moduli(study, class_.material, scale),
                attractive=_attractive(study, class_.material, scale),
            )
        )
        first += len(class_.radii_m)
    return tuple(classes)


def _bodies(study: Study) -> dict[str, str]:
    """The material of what a particle touches: other classes by their names."""
    others = {name: str(part.material) for name, part in study.media.parts.items() if name}
    return {
        "particle": study.media.main_material,
        "bowl": study.bowl.material,
        "workpiece": study.workpiece.material,
        **others,
    }


def _attractive(study: Study, material: str, scale: float) -> dict[str, dict[str, float]]:
    """Attractive coefficients of particles of a material by what they touch, as simulated."""
    pairs = {body: study.pair(material, other) for body, other in _bodies(study).items()}
    forces = {body: pair.softened(scale).attractive() for body, pair in pairs.items()}
    return {body: values for body, values in forces.items() if values}


def _contact_moduli(
    study: Study, material: str, scale: float
) -> dict[str, mechanics.ContactConstants]:
    """Contact constants of particles of a material by what they touch."""
    particle = study.materials[material]
    return {
        name: mechanics.ContactConstants(
            modulus_pa=mechanics.effective_modulus(particle, study.materials[other], scale),
            shear_pa=mechanics.effective_shear(particle, study.materials[other], scale),
            restitution=study.pair(material, other).restitution,
            friction=study.pair(material, other).friction,
        )
        for name, other in _bodies(study).items()
    }


_OF_A_KIND = ("motion.path.", "workpiece.shape.")
"""Blocks of several kinds: an assumption about a field of another kind says nothing of a run."""


def assumed(study: Study) -> list[AssumptionOfRun]:
    """What a study assumes, with the values."""
    values = flat(study.plain())
    assumptions = [
        AssumptionOfRun(value=values.get(entry.field), **dict(entry))
        for entry in study.assumptions
        if entry.field in values or not entry.field.startswith(_OF_A_KIND)
    ]
    if reason := study.accepted.unsafe_timestep:
        step = study.chosen_fidelity().timestep_fraction
        why = f"a step that may be too long, accepted on purpose: {reason}"
        assumptions.append(AssumptionOfRun(field="fidelity.timestep_fraction", value=step, why=why))
    return assumptions


def material_table(
    study: Study, names: Sequence[str], scale: float, case: Case, *, one_particle: bool = False
) -> Materials:
    """The constants of the given materials, and their contact law.

    Parameters
    ----------
    study : Study
    names : sequence of str
        The material of each type, the particles first.
    scale : float
        Factor on every Young's modulus.
    case : Case
        For the error message.
    one_particle : bool
        Whether no particle meets another one.

    Raises
    ------
    InputError
        A scaled modulus is softer than LIGGGHTS takes.
    """
    materials = [study.materials[name] for name in names]
    moduli = [round_to(scale * material.youngs_modulus_pa, 12) for material in materials]
    for name, modulus in zip(names, moduli, strict=True):
        _check_modulus(name, modulus, scale, case)
    particles = {names[0], *(() if one_particle else study.media.materials)}
    size = range(len(names))

    def pair(i: int, j: int) -> Pair:
        """Of two types; those that never touch repeat one that does."""
        low, high = min(i, j), max(i, j)
        first = names[low] if names[low] in particles else names[0]
        other = names[-1] if one_particle and high == 0 else names[high]
        return study.pair(first, other).softened(scale)

    law = contact_law([[pair(i, j) for j in size] for i in size], study.contact)
    return Materials(
        names=names,
        youngs_moduli_pa=moduli,
        poissons_ratios=[material.poissons_ratio for material in materials],
        law=law,
        youngs_modulus_scale=scale,
    )


def _check_modulus(name: str, modulus_pa: float, scale: float, case: Case) -> None:
    if modulus_pa >= ENGINE_SOFTEST_PA:
        return
    least = ENGINE_SOFTEST_PA / case.study.materials[name].youngs_modulus_pa
    raise InputError(
        "the Young's modulus is below the minimum of LIGGGHTS", file=case.file,
        field="fidelity.youngs_modulus_scale",
        value=f"{scale:g}, which gives {modulus_pa:.3g} Pa for {name}",
        limit=f"at least {ENGINE_SOFTEST_PA:.0e} Pa, a scale of {least:.3g} for {name}",
        remedy="choose a larger scale",
    )  # fmt: skip
