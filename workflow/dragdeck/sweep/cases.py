"""The cases of a study file: one per combination of its sweep."""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from dragdeck.cases.case import Case
from dragdeck.errors import InputError, near, together
from dragdeck.study.consistency import check_name
from dragdeck.study.model import STUDY_FILE, Scaling, Study, Tolerance
from dragdeck.study.yaml import read_yaml, validate

Resolve = Callable[[Case, Tolerance], Case]
"""Finds the settings of a case for a tolerance: `dragdeck.advice.advise.resolve`."""


def load_cases(
    file: Path, fidelity: str | None = None, resolve: Resolve | None = None
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

    Raises
    ------
    InputError
        The file cannot be used; the message names field, value and limit.
    """
    data = read_yaml(file)
    if fidelity is not None:
        data["fidelity"] = fidelity
    study = validate(data, file)
    sweep = study.sweep
    if study.scaling is not None:
        _check_scaling(study.scaling, sweep, file)
    _check_sweep(study, file)
    plain = {**data, "sweep": {}}
    found: list[Case] = []
    errors: list[InputError] = []
    for settings in _combinations(sweep):
        try:
            found.append(settle_case(file, plain, settings, resolve=resolve))
        except InputError as error:
            errors.append(error)
    if errors:
        raise together(errors)
    _check_doubles(found)
    return beside_each_other(found)


def _check_sweep(study: Study, file: Path) -> None:
    """Refuse a sweep without values or with more cases than are accepted."""
    for field, values in study.sweep.items():
        if not values:
            raise InputError("no values", file=file, field=f"sweep.{field}", remedy="give some")
    count, most = math.prod(map(len, study.sweep.values())), study.accepted.cases
    if count > most:
        raise InputError(
            "more cases than are accepted",
            file=file,
            field="sweep",
            value=f"{count} cases",
            limit=f"{most} (accepted.cases)",
            remedy=f"sweep fewer values; or, if you mean it, set accepted.cases: {count}",
        )


def _check_doubles(found: list[Case]) -> None:
    """Refuse two cases of the same content: a value is given twice, perhaps written otherwise."""
    first: dict[str, Case] = {}
    for case in found:
        same = first.setdefault(f"{case.asked} {case.study.model_dump_json()}", case)
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


_LEAST_LEVELS = 3
"""Levels that a power law is fitted to: two would fit any."""


def _check_scaling(scaling: Scaling, sweep: Mapping[str, list[Any]], file: Path) -> None:
    """Refuse a scaling that the sweep cannot tell.

    Raises
    ------
    InputError
        Its field is not in the sweep, is not alone there but for the seed, or has
        a level that is no number above zero; or too few levels are within its range.
    """
    field = scaling.field
    if field not in sweep:
        raise InputError(
            "not a field of sweep",
            file=file,
            field="scaling.field",
            value=field,
            limit=f"one of: {', '.join(name for name in sweep if name != 'seed') or 'none here'}",
            remedy="add its levels to sweep, or name a field that is there",
        )
    others = [name for name in sweep if name not in (field, "seed")]
    if others:
        raise InputError(
            "another field varies too, so that the drag is no function of one",
            file=file,
            field="sweep",
            value=", ".join(others),
            limit=f"{field} and seed",
            remedy="give each field a study of its own, or leave out scaling",
        )
    levels = [_level(value, field, file) for value in sweep[field]]
    low, high = scaling.fit_range or (min(levels), max(levels))
    if sum(low <= level <= high for level in levels) < _LEAST_LEVELS:
        raise InputError(
            f"too few levels from {low:g} to {high:g} for a power law",
            file=file,
            field=f"sweep.{field}",
            value=sweep[field],
            limit=f"{_LEAST_LEVELS} levels or more",
            remedy="add levels" + (", or widen scaling.fit_range" if scaling.fit_range else ""),
        )


def _level(value: Any, field: str, file: Path) -> float:
    """A level of a scaling as a number."""
    try:
        level = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        level = math.nan
    if not (math.isfinite(level) and level > 0):
        raise InputError(
            "a power law needs numbers above 0",
            file=file,
            field=f"sweep.{field}",
            value=value,
            remedy="remove this level, or leave out scaling",
        )
    return level


def settle_case(
    file: Path,
    data: Mapping[str, Any],
    values: Mapping[str, Any],
    shown: Mapping[str, Any] | None = None,
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
        _set(combined, field, value, named_in or file)
    study = validate(combined, named_in or file)
    case = Case(file, values if shown is None else shown, study)
    if not isinstance(study.fidelity, Tolerance):
        return case
    if resolve is None:
        raise InputError(
            "a tolerance cannot be used here",
            file=named_in or file,
            field="fidelity.tolerance",
            value=study.fidelity.tolerance,
            limit="the name of a fidelity, or its settings",
            remedy="take the settings that dragdeck advise shows for it",
        )
    return resolve(case, study.fidelity)


def study_file(studies: Path, name: str) -> Path:
    """The file of a study by name.

    Raises
    ------
    InputError
        No such study; lists those there are.
    """
    for error in check_name(name, "name of the study"):
        raise error
    file = studies / name / STUDY_FILE
    if not file.is_file():
        known = sorted(found.parent.name for found in studies.glob(f"*/{STUDY_FILE}"))
        raise InputError(
            f"unknown study {name!r}",
            file=studies,
            limit=f"one of: {', '.join(known) or 'none here'}",
            remedy=near(name, known) or f"choose one of these, or make {file}",
        )
    return file


def _combinations(sweep: Mapping[str, list[Any]]) -> Iterator[dict[str, Any]]:
    for combination in itertools.product(*sweep.values()):
        yield dict(zip(sweep, combination, strict=True))


def _set(data: dict[str, Any], field: str, value: Any, file: Path) -> None:
    *parents, last = field.split(".")
    place = data
    for name in parents:
        place = place.setdefault(name, {})
        if not isinstance(place, dict):
            raise InputError(
                "leads through a value",
                file=file,
                field=field,
                remedy="give the dotted name of one field",
            )
    place[last] = value
