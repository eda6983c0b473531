"""The same scene with larger particles, from which the report extrapolates to their true size."""

from dataclasses import replace
from typing import Any

from dragdeck.cases.bed import typical_reach
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.fit import clearances
from dragdeck.scenes.moving_bowl import bed_in_motion
from dragdeck.study.media import Grains, Media, Sieve
from dragdeck.study.model import Assumption, Study

LEAST_GAP = 2.7
"""Smallest gap between workpiece and wall, in diameters of the larger particles, from which the
drag was linear in their diameter (docs/evidence/simplifications.md)."""


def with_larger_particles(case: Case) -> Case:
    """The case with the larger particles that its study asks for; itself if it asks for none.

    Raises
    ------
    InputError
        The gap between workpiece and wall is too narrow for them.
    """
    if case.study.reduction is None or case.study.reduction.coarser is None:
        return case
    factor = case.study.reduction.coarser
    study = coarsened(case.study, factor)
    wide = replace(case, study=study)
    gap = clearances(wide, bed_in_motion(study, expected_bed(study)).surface_m).wall_m
    diameter = 2 * typical_reach(study)
    if factor > 1 and gap < LEAST_GAP * diameter * (1 - 1e-6):
        raise InputError(
            "the gap between workpiece and wall is too narrow for larger particles: the drag would "
            "not be linear in their diameter",
            field="reduction.coarser",
            value=factor,
            limit=f"at most {gap / LEAST_GAP / diameter * factor:.3g}: the gap of {gap:.4g} m is "
            f"at least {LEAST_GAP:g} diameters",
            remedy="use a smaller factor or a wider bowl",
        )
    return wide


def coarsened(study: Study, factor: float) -> Study:
    """The study with particles larger by a factor, and fewer of them in the same space."""
    media = study.media
    if factor == 1:
        return study
    larger: dict[str, Any] = _larger(media, factor)
    larger["classes"] = {
        name: part.model_copy(update=_larger(part, factor)) for name, part in media.classes.items()
    }
    if media.count is not None:
        larger["count"] = max(1, round(media.count / factor**3))
    coarse = study.model_copy(update={"media": Media.model_validate({**dict(media), **larger})})
    why = (
        f"particles {factor:g} times as large: {coarse.particle_count:,} in place of "
        f"{study.particle_count:,}; values of this run are those of larger particles"
    )
    said = Assumption(field="reduction.coarser", why=why)
    return coarse.model_copy(update={"assumptions": [*study.assumptions, said]})


def _larger(grains: Grains, factor: float) -> dict[str, Any]:
    """Sizes of particles of one distribution."""
    sizes: dict[str, Any] = {"radius_std_m": factor * grains.radius_std_m}
    if grains.radius_mean_m is not None:
        sizes["radius_mean_m"] = factor * grains.radius_mean_m
    if grains.sieve is not None:
        sizes["sieve"] = [Sieve(factor * size, passing) for size, passing in grains.sieve]
    return sizes
