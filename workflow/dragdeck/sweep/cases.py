"""The cases of a study file: one per combination of its sweep."""

import copy
import itertools
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import JsonValue

from dragdeck.cases.bed import typical_reach
from dragdeck.cases.case import Case
from dragdeck.errors import InputError, choices, together
from dragdeck.mesh.files import FORMATS
from dragdeck.physics.rounding import limit_of
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.fit import LEAST_GAP, clearances
from dragdeck.scenes.moving_bowl import bed_in_motion
from dragdeck.study.base import NAME, NAME_LIMIT, STUDY_FILE, Json
from dragdeck.study.check import validate
from dragdeck.study.contradictions import contradictions
from dragdeck.study.fidelity import Fidelity, Tolerance
from dragdeck.study.media import Grains, Media, Sieve
from dragdeck.study.model import Assumption, Study
from dragdeck.study.search import Search, SearchRecord
from dragdeck.study.yaml import read_study, studies_called
from dragdeck.sweep.cut_out import with_cut_out
from dragdeck.sweep.design import Settings, combinations
from dragdeck.sweep.own_part import study_of_part

_NEW_STUDY = Path(__file__).with_name("new_study.yaml")
"""Text of a study that extends another."""


_MIDDLE = 0.382
"""A part of a range at which a field of whole numbers, or a switch, is no fraction by chance."""


Resolve = Callable[[Case, Tolerance], Case]
"""Finds the settings of a case for a tolerance: `dragdeck.advice.advise.resolve`."""


def load_cases(
    file: Path,
    fidelity: str | None = None,
    resolve: Resolve | None = None,
    searched: Path | None = None,
    failed: bool = False,
) -> list[Case]:
    """All cases of a study file.

    Parameters
    ----------
    file : Path
        The study file.
    fidelity : str, optional
        Instead of the study's own.
    resolve : callable, optional
        Finds the settings where a case asks for a tolerance.
    searched : Path, optional
        The record of the study's search: its points are cases, too.
    failed : bool
        Whether points of which a run failed are among them.

    Raises
    ------
    InputError
        The file cannot be used; the message names field, value and limit.
    """
    data = read_study(file)
    if fidelity is not None:
        data["fidelity"] = fidelity
    study = validate(data, file, whole=True)
    plain, cases, errors = {**data, "sweep": {}, "search": None}, [], []
    points = list[Settings]([{}])
    if study.search is not None:
        searched_bounds(file, study.search)
        if searched and searched.is_file():
            known = SearchRecord.read(searched).points
            points = [
                point.values for point in known if not point.refused or (failed and point.ran)
            ] or points
    for point, settings in itertools.product(points, combinations(study.sweep)):
        settings = {**point, **settings}
        try:
            cases.append(settle_case(file, plain, settings, resolve=resolve))
        except InputError as error:
            errors.append(error)
    if errors:
        raise together(errors)
    _check_doubles(cases)
    return beside_each_other(cases)


def searched_bounds(file: Path, search: Search) -> Mapping[str, Sequence[Case]]:
    """The study with each field of its search at its lowest, a middle and its highest value.

    Raises
    ------
    InputError
        A value breaks the study.
    """
    bounds = {}
    data = {**read_study(file), "sweep": {}, "search": None, "fidelity": search.confirm}
    for field in search.vary:
        cases = bounds[field] = list[Case]()
        for value in (search.value(field, part) for part in (0.0, _MIDDLE, 1.0)):
            try:
                cases.append(settle_case(file, data, {field: value}))
            except InputError as error:
                other = f"{error.field}: " if error.field not in (None, field) else ""
                raise InputError(f"the study cannot have this value: {other}{error.problem}",
                                 file=file, field=f"search.vary.{field}", value=value,
                                 limit=error.limit, remedy=error.remedy or "other bounds",
                                 ) from None  # fmt: skip
    return bounds


def _check_doubles(cases: list[Case]) -> None:
    """Refuse two cases of the same content: a value is given twice, perhaps written otherwise."""
    first: dict[str, Case] = {}
    for case in cases:
        same = first.setdefault(f"{case.requested} {case.study.model_dump_json()}", case)
        if same is not case:
            raise InputError(
                f"a value is given twice: the cases {same.name} and {case.name} are the same",
                file=case.file, field="sweep", remedy="remove one",
            )  # fmt: skip


def beside_each_other(cases: Iterable[Case]) -> list[Case]:
    """The same cases, each knowing how many there are."""
    known = list(cases)
    return [replace(case, beside=len(known)) for case in known]


def settle_case(
    file: Path,
    data: Json,
    values: Json,
    shown: Json | None = None,
    named_in: Path | None = None,
    resolve: Resolve | None = None,
) -> Case:
    """A case from a study's plain data with some of its values replaced.

    Parameters
    ----------
    file : Path
        The study file.
    data : mapping
        Its content.
    values : mapping
        Dotted field: value.
    shown : mapping, optional
        The values that name the case, if not all of them.
    named_in : Path, optional
        The file that names the values, for error messages, if not `file`.
    resolve : callable, optional
        Finds the settings if the case asks for a tolerance.

    Raises
    ------
    InputError
        A value leads nowhere or breaks the study; or a tolerance is asked that
        nothing measured can resolve, or where only settings can be used.
    """
    combined = copy.deepcopy(dict(data))
    for field in sorted(values, key=lambda name: name.count(".")):  # a block before its fields
        _set(combined, field, copy.deepcopy(values[field]), named_in or file)
    study = validate(combined, named_in or file)
    case = Case(file, values if shown is None else shown, study)
    if study.reduction is not None:
        case = _reduced(case, named_in or file)
        study = case.study
    if not isinstance(study.fidelity, Tolerance):
        return case
    if resolve is None:
        raise InputError(
            "a tolerance cannot be used here", file=named_in or file, field="fidelity.tolerance",
            value=study.fidelity.tolerance, limit="the name of a fidelity, or its settings",
            remedy="use the settings that ./run dragdeck advise shows for it",
        )  # fmt: skip
    return resolve(case, study.fidelity)


def _reduced(case: Case, named_in: Path) -> Case:
    """The case of a smaller scene, which is checked as any other."""
    study, alone = case.study, case
    if isinstance(study.fidelity, Tolerance):  # sizes do not depend on what it will come to
        alone = replace(case, study=study.model_copy(update={"fidelity": Fidelity()}))
    try:
        smaller = with_larger_particles(with_cut_out(alone))
    except InputError as error:
        for problem in (error, *error.more):
            problem.file = problem.file or named_in
        raise
    if smaller is not alone:
        reduced = smaller.study.model_copy(update={"fidelity": study.fidelity})
        case = replace(case, study=reduced, machine=study)
    if problems := list(contradictions(case.study, whole=False)):
        raise together([replace(error, file=named_in) for error in problems])
    return case


def study_file(studies: Path, name: str) -> Path:
    """The file of a study by name.

    Raises
    ------
    InputError
        No such study; lists those there are.
    """
    files = studies_called(studies, name)
    if not files:
        known = dict.fromkeys(file.parent.name for file in studies_called(studies))
        raise InputError(
            f"unknown study {name!a}", file=studies,
            limit=choices(name, filter(NAME.fullmatch, known)),
            remedy=f"choose one of these, or create a folder; its name has {NAME_LIMIT}",
        )  # fmt: skip
    return files[0]


def new_study(studies: Path, name: str, base: str) -> Path:
    """Write the file of a study that extends another or is of a part, and return it.

    Raises
    ------
    InputError
        The name cannot be one or is taken, there is no such study to extend, or the part cannot
        be used.
    """
    part = Path(base)
    is_mesh = part.suffix.lower() in FORMATS or part.is_file()
    of_part = is_mesh and not studies_called(studies, base)
    if not of_part:
        study_file(studies, base)
    folder, problem = studies / name, None
    if not NAME.fullmatch(name):
        problem = "this name cannot be used for a study"
    elif folder.exists():
        problem = "a study has that name already"
    if problem:
        raise InputError(
            problem, file=studies, value=name, limit=f"a name has {NAME_LIMIT}",
            remedy="choose another",
        )  # fmt: skip
    text = study_of_part(part) if of_part else _NEW_STUDY.read_text().format(name=name, base=base)
    folder.mkdir()
    if of_part:
        shutil.copy(part, folder / part.name)
    file = folder / STUDY_FILE
    file.write_text(text, encoding="utf-8")
    return file


def _set(data: dict[str, JsonValue], field: str, value: JsonValue, file: Path) -> None:
    *parents, last = field.split(".")
    place = data
    for name in parents:
        below = place.setdefault(name, {})
        if not isinstance(below, dict):
            raise InputError(
                "the field would lie below a single value", file=file, field=field,
                remedy="give the dotted name of one field",
            )  # fmt: skip
        place = below
    place[last] = value


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
    most = gap / LEAST_GAP / diameter * factor
    if factor > 1 and gap < LEAST_GAP * diameter * (1 - 1e-6):
        raise InputError(
            "the gap between workpiece and wall is too narrow for larger particles",
            field="reduction.coarser", value=factor,
            limit=f"at most {limit_of(most)}: the gap is at least {LEAST_GAP:g} diameters",
            remedy="use a smaller factor or a wider bowl; below 1, leave it out",
        )  # fmt: skip
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
