"""Designs of runs, and the cases of a study file: one per combination of its sweep.

Every campaign has one shape (`dragchain.report.campaign` has the rest of it): a design of runs,
a row of measures of each run, a judgement of the rows, and a report. This is the grammar of all
designs; a campaign whose runs need more, as seeds or a path, adds fields to `Variation` or
`Design`::

    base: {friction: 0.3, restitution: 0.8}         # at all points that do not set it
    reference: {vary: {timestep_fraction: [0.05]}}  # what the others are compared with
    points:
      - vary: {timestep_fraction: [0.2, 0.4]}       # every combination
        one_by_one: {friction: [0, 1]}              # at each of them, one at a time
        with: {restitution: 1}                      # at all of them

Fields are those of the study by their dotted names, or the settings of a scene that no study has.
"""

import copy
import itertools
import math
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Generic, NamedTuple, Self, TypeVar

from pydantic import Field, JsonValue, ValidationError

from dragdeck.cases.case import Case
from dragdeck.errors import InputError, choices, together
from dragdeck.mesh.files import FORMATS
from dragdeck.study.base import NAME, NAME_LIMIT, STUDY_FILE, Json, Model
from dragdeck.study.check import explained, validate
from dragdeck.study.contradictions import contradictions
from dragdeck.study.fidelity import Fidelity, Tolerance
from dragdeck.study.search import Search, SearchRecord
from dragdeck.study.yaml import read_study, read_yaml, studies_called
from dragdeck.sweep.coarse import with_larger_particles
from dragdeck.sweep.cut_out import with_cut_out
from dragdeck.sweep.own_part import study_of_part

Settings = Mapping[str, Any]
"""Dotted name of a field to its value."""

_NEW_STUDY = Path(__file__).with_name("new_study.yaml")
"""Text of a study that extends another."""

_MIDDLE = 0.382
"""A part of a range at which a field of whole numbers, or a switch, is no fraction by chance."""

MOST_POINTS = 10_000
"""Points of a design, over all its scenes and packings: more than anyone has run."""


# --- designs -------------------------------------------------------------------------------------


def combinations(vary: Mapping[str, Sequence[Any]]) -> Iterator[Settings]:
    """Every combination of the values that fields take."""
    for values in itertools.product(*vary.values()):
        yield dict(zip(vary, values, strict=True))


class DesignPoint(NamedTuple):
    """A point of a design: what it sets, and the field that is varied alone there (or none)."""

    axis: str
    values: Settings


class Variation(Model):
    """Points that belong together: every combination of the values that vary."""

    vary: dict[str, list[Any]] = Field(default_factory=dict)
    """dotted field name: list of values; every combination is a design point"""
    one_by_one: dict[str, list[Any]] = Field(default_factory=dict)
    """dotted field name: list of values that are varied one at a time, at every combination of
    `vary`"""
    others: dict[str, Any] = Field(default_factory=dict, alias="with")
    """dotted field name: value at all these points"""

    @property
    def count(self) -> int:
        """Number of its points, without listing them."""
        alone = sum(map(len, self.one_by_one.values())) or 1
        return math.prod(map(len, self.vary.values())) * alone

    def points(self) -> Iterator[DesignPoint]:
        """The points, the last field of `vary` changing before the first."""
        alone = [
            (field, {field: value}) for field, values in self.one_by_one.items() for value in values
        ]
        for values in combinations(self.vary):
            for axis, fields in alone or [("", {})]:
                yield DesignPoint(axis, {**self.others, **values, **fields})


Block = TypeVar("Block", bound=Variation)


class Design(Model, Generic[Block]):
    """Points with what all of them share and what they are compared with."""

    base: dict[str, Any]
    """dotted field name: value at all points that do not set it"""
    reference: Block
    """reference settings, to which errors are relative; a single point"""
    points: list[Block] = Field(default_factory=list)

    @classmethod
    def read(cls, file: Path, name: str | None = None) -> Self:
        """Read a design, or the one of this name among several in a file.

        Raises
        ------
        InputError
            The file cannot be used; the message names field, value and limit.
        """
        data = read_yaml(file)
        if name is not None and name not in data:
            problem = "the file has no such design"
            raise InputError(problem, file=file, value=name, limit=choices(name, data))
        try:
            plan = cls.model_validate(data if name is None else data[name])
        except ValidationError as error:
            raise explained(error, file) from None
        check_number(sum(block.count for block in plan.points), file)
        if plan.reference.count != 1:
            raise InputError(
                "the reference must be a single point", file=file, field="reference.vary"
            )
        return plan

    def settings(self) -> Iterator[tuple[Block, dict[str, Any]]]:
        """What is set at each point, the reference first, with the block that it is of."""
        for block in (self.reference, *self.points):
            for _, values in block.points():
                yield block, {**self.base, **values}


def check_number(points: int, file: Path) -> None:
    """Refuse a design of more points than can be listed.

    Raises
    ------
    InputError
        It has more than `MOST_POINTS`.
    """
    if points > MOST_POINTS:
        problem, limit = f"the design has {points:,} points", f"at most {MOST_POINTS:,}"
        raise InputError(problem, file=file, field="points", limit=limit, remedy="vary less")


# --- cases ---------------------------------------------------------------------------------------


Resolve = Callable[[Case, Tolerance], Case]
"""Finds the settings of a case for a tolerance: `dragdeck.advice.advise.resolve`."""


def load_cases(
    file: Path,
    fidelity: str | None = None,
    resolve: Resolve | None = None,
    searched: Path | None = None,
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
                searched_point.values for searched_point in known if not searched_point.refused
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
                file=case.file,
                field="sweep",
                remedy="remove one",
            )


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
    for field, value in values.items():
        _set(combined, field, copy.deepcopy(value), named_in or file)
    study = validate(combined, named_in or file)
    case = Case(file, values if shown is None else shown, study)
    if study.reduction is not None:
        case = _reduced(case, named_in or file)
        study = case.study
    if not isinstance(study.fidelity, Tolerance):
        return case
    if resolve is None:
        raise InputError(
            "a tolerance cannot be used here",
            file=named_in or file,
            field="fidelity.tolerance",
            value=study.fidelity.tolerance,
            limit="the name of a fidelity, or its settings",
            remedy="use the settings that ./run dragdeck advise shows for it",
        )
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
            f"unknown study {name!a}",
            file=studies,
            limit=choices(name, filter(NAME.fullmatch, known)),
            remedy=f"choose one of these, or create a folder; its name has {NAME_LIMIT}",
        )
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
    of_part = part.suffix.lower() in FORMATS and not studies_called(studies, base)
    if not of_part:
        study_file(studies, base)
    folder, problem = studies / name, None
    if not NAME.fullmatch(name):
        problem = "this name cannot be used for a study"
    elif folder.exists():
        problem = "a study has that name already"
    if problem:
        raise InputError(
            problem,
            file=studies,
            value=name,
            limit=f"a name has {NAME_LIMIT}",
            remedy="choose another",
        )
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
                "the field would lie below a single value",
                file=file,
                field=field,
                remedy="give the dotted name of one field",
            )
        place = below
    place[last] = value
