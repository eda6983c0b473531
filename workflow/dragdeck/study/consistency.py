"""What no single field of a study shows: names that do not exist, values that contradict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import combinations_with_replacement

from dragdeck.errors import InputError, near
from dragdeck.study.base import NAME, NAME_LIMIT
from dragdeck.study.model import BUILT_IN_FIDELITIES, CylinderShape, Study

_MOST_FACETS = 1_000_000
"""Facets of a generated mesh."""

_NO_SWEEP = ("accepted", "assumptions", "reference", "scaling", "sweep", "title")
"""Blocks that no run depends on: cases that differ in them would be the same."""


def contradictions(study: Study) -> Iterator[InputError]:
    """Every contradiction within a study; the errors name no file."""
    yield from _names(study)
    yield from _materials(study)
    yield from _motion(study)
    yield from _facets(study)
    for field in study.sweep:
        if field.split(".")[0] in _NO_SWEEP:
            yield InputError(
                "no run depends on it: it cannot be swept",
                field=f"sweep.{field}",
                remedy="name a field that the runs depend on",
            )


def check_name(name: str, field: str | None = None, *, dash: bool = True) -> Iterator[InputError]:
    """The problem of a name that cannot be part of a path or a command, if it has one."""
    if not NAME.fullmatch(name) or (not dash and "-" in name):
        yield InputError(
            "is no name that can be used in paths and commands",
            field=field,
            value=ascii(name),
            limit=NAME_LIMIT if dash else f"{NAME_LIMIT}; no '-', which joins two materials",
            remedy="rename it",
        )


def _names(study: Study) -> Iterator[InputError]:
    for name in study.materials:
        yield from check_name(name, "materials", dash=False)
    for name in study.fidelities:
        yield from check_name(name, "fidelities")
    known = {**BUILT_IN_FIDELITIES, **study.fidelities}
    if isinstance(study.fidelity, str):
        yield from _known(study.fidelity, known, "fidelity", "unknown fidelity")


def _known(name: str, known: Iterable[str], field: str, problem: str) -> Iterator[InputError]:
    if name not in known:
        limit = f"one of: {', '.join(known)}"
        problem = f"{problem} {name!r}"
        yield InputError(problem, field=field, limit=limit, remedy=near(name, known))


def _materials(study: Study) -> Iterator[InputError]:
    for owner in ("media", "bowl", "workpiece"):
        name = getattr(study, owner).material
        yield from _known(name, study.materials, f"{owner}.material", "no such material:")
    both = combinations_with_replacement(study.materials, 2)
    pairs = {f"{one}-{other}" for pair in both for one, other in (pair, pair[::-1])}
    for key, pair in study.pairs.items():
        yield from _known(key, pairs, f"pairs.{key}", "no pair of two materials:")
        back = "-".join(key.split("-")[::-1])
        if key < back and study.pairs.get(back, pair) != pair:
            yield InputError(
                f"{key} and {back} are the same pair with different values",
                field=f"pairs.{back}",
                remedy="remove one of them",
            )
    for other in study.type_names():
        key, back = f"{study.media.material}-{other}", f"{other}-{study.media.material}"
        if key in pairs and not {key, back} & set(study.pairs):
            yield InputError(
                f"pairs has no entry '{key}', and these two will touch",
                field="pairs",
                remedy="add it",
            )


def _motion(study: Study) -> Iterator[InputError]:
    motion, length = study.motion, study.motion.path_length_m
    if motion.transient_m >= length:
        yield InputError(
            "no path is left for the statistics",
            field="motion.transient_m",
            value=motion.transient_m,
            limit=f"below the length of the path, {length:.4g} m",
            remedy="use a shorter transient or a longer path",
        )
    seconds = length / motion.speed_m_s
    if study.outputs.network_hz * seconds < 1:
        yield InputError(
            "not one frame of the contact network is written during the drag",
            field="outputs.network_hz",
            value=study.outputs.network_hz,
            limit=f"at least {1 / seconds:.3g} Hz, one frame in a drag of {seconds:.3g} s",
            remedy="use a higher rate or a longer path",
        )


def _facets(study: Study) -> Iterator[InputError]:
    shape, bowl, depth = study.workpiece.shape, study.bowl, study.motion.immersion_depth_m
    sizes = {}
    if isinstance(shape, CylinderShape):
        area = 4 * math.pi * shape.radius_m * (depth + 8 * study.media.radius_mean_m)
        sizes["workpiece.shape.facet_size_m"] = area / shape.facet_size_m / shape.facet_length_m
    if bowl.facet_size_m is not None:
        area = 2 * math.pi * bowl.radius_m * (2 * bowl.height_m + bowl.radius_m)
        sizes["bowl.facet_size_m"] = area / bowl.facet_size_m**2
    for field, facets in sizes.items():
        if facets > _MOST_FACETS:
            yield InputError(
                f"makes a mesh of some {facets:.1g} facets",
                field=field,
                limit=f"at most {_MOST_FACETS} facets",
                remedy="use larger facets",
            )
