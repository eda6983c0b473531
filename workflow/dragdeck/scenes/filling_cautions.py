"""What a user should know of a filling before it runs."""

import math
from collections.abc import Iterator
from itertools import combinations_with_replacement, product

import numpy as np

from dragdeck.cases import bed as beds
from dragdeck.cases.case import Case
from dragdeck.errors import Caution
from dragdeck.physics.contact_mechanics import (
    bed_overlap,
    effective_modulus,
    pull_off_force,
    rayleigh_time,
    sphere_mass,
    wedge_ratio,
)
from dragdeck.physics.domain_split import rank_warnings
from dragdeck.physics.rounding import rounded
from dragdeck.scenes.bed_space import rank_split
from dragdeck.study.contact_law import FrictionLimit
from dragdeck.study.model import Study

MOST_OVERLAP = 0.01
"""Overlap over the diameter, by the weight of the bed, above which a warning is given: an
assumption; forces on the workpiece are several times those of the weight."""


def floor_overlap(study: Study) -> float:
    """Overlap of two particles at the floor under the bed's weight, over the diameter.

    An estimate.
    """
    particle, scale = beds.particle_material(study), study.chosen_fidelity().youngs_modulus_scale
    return bed_overlap(effective_modulus(particle, particle, scale), beds.floor_pressure(study))


def filling_cautions(case: Case) -> Iterator[Caution]:
    """What a user should know of a filling before it runs."""
    study = case.study
    yield from rank_warnings(rank_split(case, beds.skin(study)))
    yield from _overlap_caution(study)
    yield from _cohesion_caution(study)
    yield from _class_cautions(study)
    yield from _size_cautions(study)


def _overlap_caution(study: Study) -> Iterator[Caution]:
    """A warning where particles are too soft for the bed above them."""
    overlap, scale = floor_overlap(study), study.chosen_fidelity().youngs_modulus_scale
    if overlap <= MOST_OVERLAP * beds.JUST_BEYOND:
        return
    stiffer = min(1.0, rounded(scale * (overlap / MOST_OVERLAP) ** 1.5, up=True))
    remedy = f"use a fidelity.youngs_modulus_scale of at least {stiffer:g}"
    yield Caution(
        "overlap",
        "the weight of the packing makes particles at the floor overlap by "
        f"{rounded(100 * overlap, up=True):g} % of a diameter, more than {100 * MOST_OVERLAP:g} %: "
        + (f"the packing is too dense; {remedy}" if scale < 1 else "too much for Hertz's theory"),
        {"youngs_modulus_scale": stiffer} if scale < 1 else {},
    )


def _cohesion_caution(study: Study) -> Iterator[Caution]:
    """A warning where the largest tension of some pair exceeds a particle's weight."""
    bonds = {pair: bond for pair, bond in bond_numbers(study).items() if bond > 1}
    if bonds:
        pairs = ", ".join(f"{bond:.3g} ({pair})" for pair, bond in bonds.items())
        yield Caution(
            "cohesion",
            f"the largest tension by cohesion is {pairs} times the weight of a mean particle "
            "(Bond number); above 1 a bed fills loosely or bridges, and may not come to rest, and "
            "particles stick to walls and workpiece",
        )


def bond_numbers(study: Study) -> dict[str, float]:
    """Largest tension of each pair over the weight minus buoyancy of its lighter mean particle."""
    parts = study.media.parts.items()
    particles = [
        (name or "particle", str(part.material), part.mean_radius_m) for name, part in parts
    ]
    walls = [
        ("bowl", study.bowl.material, math.inf),
        ("workpiece", study.workpiece.material, math.inf),
    ]
    pairs = [*combinations_with_replacement(particles, 2), *product(particles, walls)]
    displaced, numbers = beds.buoyancy_density(study), {}
    for (body, material, radius), (other, against, far) in pairs:
        kinds = [study.materials[name] for name in (material, against)]
        reduced = 1 / (1 / radius + 1 / far)
        limit = FrictionLimit(0.0, study.pair(material, against).attractive(), math.isinf(far))
        slope = float(limit.attraction_n(np.full(1, reduced), np.ones(1))[0])
        mass = min(
            sphere_mass(size, kind.density_kg_m3 - displaced)
            for size, kind in zip((radius, far), kinds, strict=True)
        )
        largest = pull_off_force(slope, effective_modulus(kinds[0], kinds[1]), reduced)
        numbers[f"{body}-{other}"] = largest / (mass * study.gravity_m_s2)
    return numbers


_DEAR = 10.0
"""Ratio of the cost with a class to that without it, from which a warning is given."""


def _class_cautions(study: Study) -> Iterator[Caution]:
    """A warning for each class whose small particles make a run many times dearer."""
    classes = beds.bed_classes(study) if study.media.classes else ()
    times = [
        rayleigh_time(
            study.materials[class_.material], class_.radii_m[0] * class_.clump.timestep_radius
        )
        for class_ in classes
    ]
    spheres = [len(class_.radii_m) * len(class_.clump.radii) for class_ in classes]
    total = sum(spheres)
    for at, class_ in enumerate(classes):
        others = [time for number, time in enumerate(times) if number != at]
        if not others or total == spheres[at]:
            continue
        dearer = total / (total - spheres[at]) * min(others) / min(times)
        if dearer >= _DEAR:
            share = (class_.radii_m**3).sum() / (beds.bed_radii(study) ** 3).sum()
            yield Caution(
                "class",
                f"class {class_.name} ({100 * share:.2g} % of the volume) makes the runs about "
                f"{dearer:.2g} times as long, by its number and its Rayleigh time: without it they "
                f"would take {100 / dearer:.2g} % of that",
            )


_NEVER_HELD, _WIDEST = 1.5, 20.0
"""Size ratio at which no small particle stayed in a groove, whatever its friction; largest one
that was measured (docs/data/liggghts/groove.csv)."""


def _size_cautions(study: Study) -> Iterator[Caution]:
    """A warning where small particles can be held between large ones, or one and a wall."""
    classes = beds.bed_classes(study) if not study.media.clumped else ()
    walls = {"the bowl": study.bowl.material, "the workpiece": study.workpiece.material}
    size_pairs = []
    for small, large in product(classes, classes):
        ratio = float(large.radii_m[-1] / small.radii_m[0])
        friction = study.pair(small.material, large.material).friction
        size_pairs.append((wedge_ratio(friction, wall=False) / ratio, ratio, "another large one"))
        for wall, material in walls.items():
            least = min(friction, study.pair(small.material, material).friction)
            size_pairs.append((wedge_ratio(least, wall=True) / ratio, ratio, wall))
    held = [pair for pair in size_pairs if pair[0] < 1 and pair[1] > _NEVER_HELD]
    if held:
        part, ratio, partner = min(held)
        yield Caution(
            "size_ratio",
            f"diameters differ by a factor of {rounded(ratio, up=True):g}; above "
            f"{rounded(part * ratio, up=False):g}, friction can hold a small particle between a "
            f"large one and {partner}, where the integration of LIGGGHTS squeezes it in as it "
            "rolls (docs/development/liggghts.md): leave out the fines, or compare with a run at "
            "a quarter of the fidelity.timestep_fraction",
        )
    elif size_pairs and (widest := max(ratio for _, ratio, _ in size_pairs)) > _WIDEST:
        yield Caution(
            "size_ratio",
            f"diameters differ by a factor of {rounded(widest, up=True):g}: above {_WIDEST:g}, "
            "nothing was measured (docs/development/liggghts.md); leave out the fines, or compare "
            "with a run at a quarter of the fidelity.timestep_fraction",
        )
