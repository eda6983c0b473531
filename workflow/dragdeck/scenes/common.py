"""What all scenes share: the deck's data, and the table of materials."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from dragdeck import __version__
from dragdeck.cases import Case, SceneName
from dragdeck.derive import rayleigh_time
from dragdeck.errors import InputError
from dragdeck.mesh import Mesh
from dragdeck.outputs import Output
from dragdeck.packing import Array, radii
from dragdeck.ranks import ENGINE_CHOOSES
from dragdeck.study import Material, Study

ENGINE_SOFTEST_PA = 5e6
"""The engine's `units si` refuses a softer Young's modulus."""

ENGINE_HARD_PA = 1e9
"""Above this the engine wants `hard_particles yes`."""


@dataclass(frozen=True)
class Materials:
    """Material constants as the engine wants them.

    Attributes
    ----------
    names : sequence of str
        A material for each type, in the engine's order; the balls are first.
    youngs_moduli_pa, poissons_ratios : sequence of float
        One a type.
    restitutions, frictions : sequence of float
        The full table of pairs, row by row.
    """

    names: Sequence[str]
    youngs_moduli_pa: Sequence[float]
    poissons_ratios: Sequence[float]
    restitutions: Sequence[float]
    frictions: Sequence[float]


@dataclass(frozen=True, kw_only=True)
class Deck:
    """What every template sees as ``deck``.

    Attributes
    ----------
    source : str
        The data or restart file that the run starts from.
    gravity_direction : (float, float, float)
        Unit vector of gravity.
    checkpoint_steps : int
        Steps between restart points; 0 for none.
    processors : str
        How the ranks are laid out along x, y and z.
    """

    title: str
    study: str
    scene: str
    run: str
    source: str
    materials: Materials
    limit_force: bool
    gravity_m_s2: float
    skin_m: float
    timestep_s: float
    outputs: Sequence[Output]
    gravity_direction: tuple[float, float, float] = (0, 0, -1)
    thermo_steps: int = 0
    checkpoint_steps: int = 0
    processors: str = ENGINE_CHOOSES
    version: str = __version__
    templates: str = ""

    @property
    def hard(self) -> bool:
        """Whether a modulus is above the engine's usual range."""
        return max(self.materials.youngs_moduli_pa) > ENGINE_HARD_PA


@dataclass(frozen=True)
class LeftOut:
    """Why a deck leaves something out.

    Attributes
    ----------
    why : str
    cost : str, optional
        The variant of `dragdeck.costs` that puts it back.
    """

    why: str
    cost: str | None = None


@dataclass(frozen=True)
class Scene:
    """All that one engine run needs, before any file is written.

    Attributes
    ----------
    deck : Deck
    case : mapping
        Content of ``case.json``.
    steps : int
        Steps expected; an estimate where the engine decides.
    files : mapping of str to str
        Other input files: name to content.
    meshes : mapping of str to Mesh
        Mesh files, by name.
    models : mapping of str to str
        What the deck models, and why.
    leaves_out : mapping of str to LeftOut
        What it leaves out.
    warnings : sequence of str
        What the user should know before the run.
    """

    deck: Deck
    case: Mapping[str, Any]
    steps: int
    files: Mapping[str, str] = field(default_factory=dict)
    meshes: Mapping[str, Mesh] = field(default_factory=dict)
    models: Mapping[str, str] = field(default_factory=dict)
    leaves_out: Mapping[str, LeftOut] = field(default_factory=dict)
    warnings: Sequence[str] = ()


def material_table(study: Study, names: Sequence[str], scale: float, case: Case) -> Materials:
    """The constants of the given materials.

    Parameters
    ----------
    study : Study
    names : sequence of str
        A material for each engine type, the balls first.
    scale : float
        On every Young's modulus.
    case : Case
        For the error message.

    Raises
    ------
    InputError
        A scaled modulus is softer than the engine takes.
    """
    materials = [study.materials[name] for name in names]
    moduli = [round_to(scale * material.youngs_modulus_pa, 12) for material in materials]
    for name, modulus in zip(names, moduli, strict=True):
        _check_modulus(name, modulus, scale, case)
    pairs = [study.pair(names[0], name) for name in names]
    return Materials(
        names=names,
        youngs_moduli_pa=moduli,
        poissons_ratios=[material.poissons_ratio for material in materials],
        restitutions=_symmetric([pair.restitution for pair in pairs]),
        frictions=_symmetric([pair.friction for pair in pairs]),
    )


def _symmetric(with_ball: Sequence[float]) -> list[float]:
    """Pair table from the ball's row; pairs without a ball never touch."""
    size = range(len(with_ball))
    return [with_ball[max(i, j)] for i in size for j in size]


def _check_modulus(name: str, modulus_pa: float, scale: float, case: Case) -> None:
    if modulus_pa >= ENGINE_SOFTEST_PA:
        return
    least = ENGINE_SOFTEST_PA / case.study.materials[name].youngs_modulus_pa
    raise InputError(
        "the engine refuses so soft a material",
        file=case.file,
        field="fidelity.youngs_modulus_scale",
        value=f"{scale:g}, which makes {name} {modulus_pa:.3g} Pa",
        limit=f"at least {ENGINE_SOFTEST_PA:.0e} Pa, a scale of {least:.3g} for {name}",
        remedy="choose a larger scale",
    )


def bed_radii(study: Study) -> Array:
    """Radii of a study's balls in ascending order, (count,), m."""
    media = study.media
    return radii(media.count, media.radius_mean_m, media.radius_sd_m)


def smallest_radius(study: Study) -> float:
    """Radius of the smallest ball of the bed, m."""
    return float(bed_radii(study).min())


def bed_rayleigh_time(study: Study) -> float:
    """Rayleigh time of the bed's smallest ball at the fidelity's modulus, s."""
    scale = study.chosen_fidelity().youngs_modulus_scale
    return rayleigh_time(ball_material(study), smallest_radius(study), scale)


def ball_material(study: Study) -> Material:
    """Material of the balls."""
    return study.materials[study.media.material]


def skin(study: Study) -> float:
    """Neighbour skin, m: the fidelity's own, or a tenth of the mean radius."""
    chosen = study.chosen_fidelity().skin_m
    return chosen if chosen is not None else round_to(0.1 * study.media.radius_mean_m, 3)


def base_case(case: Case, scene: SceneName, timestep_s: float, rayleigh_s: float) -> dict[str, Any]:
    """The entries of ``case.json`` that all scenes share."""
    study = case.study
    fidelity = study.chosen_fidelity().model_dump(mode="json")
    return {
        "schema": 1,
        "study": case.study_name,
        "title": study.title,
        "scene": scene,
        "run": case.run_ids[scene],
        "timestep_s": timestep_s,
        "rayleigh_time_s": rayleigh_s,
        "gravity_m_s2": study.gravity_m_s2,
        "fidelity": {
            "name": case.fidelity_name,
            **fidelity,
            "skin_m": skin(study),
            "ranks": case.ranks,
        },
        **case.asked_of(scene),
        "inputs": flat(case.content(scene)),
        "media": {
            "count": study.media.count,
            "radius_mean_m": study.media.radius_mean_m,
            "radius_sd_m": study.media.radius_sd_m,
            "density_kg_m3": ball_material(study).density_kg_m3,
        },
        "bowl": {
            "radius_m": study.bowl.radius_m,
            "walls": "primitive" if study.bowl.facet_size_m is None else "mesh",
        },
        "assumptions": _assumptions(study),
        "reference": study.reference.model_dump(mode="json") if study.reference else None,
        "versions": {"dragdeck": __version__},
    }


def _assumptions(study: Study) -> list[dict[str, Any]]:
    values = flat(study.model_dump(mode="json"))
    return [
        {"field": entry.field, "value": values.get(entry.field), "why": entry.why}
        for entry in study.assumptions
    ]


def flat(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mappings as one mapping of dotted names."""
    found: dict[str, Any] = {}
    for key, value in data.items():
        if isinstance(value, Mapping):
            found.update(flat(value, f"{prefix}{key}."))
        else:
            found[f"{prefix}{key}"] = value
    return found


def round_to(value: float, digits: int) -> float:
    """Round to significant digits."""
    return float(f"{value:.{digits}g}")


def timestep(rayleigh_s: float, fraction: float) -> float:
    """A share of the Rayleigh time, rounded down to four significant digits, s."""
    exact = rayleigh_s * fraction
    unit = 10.0 ** (math.floor(math.log10(exact)) - 3)
    return round_to(math.floor(exact / unit * (1 + 1e-12)) * unit, 4)
