"""Whether the content of a study file can be used: errors name field, value, limit and remedy."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dragdeck.errors import Caution, InputError, near, together
from dragdeck.study.base import Model
from dragdeck.study.consistency import contradictions
from dragdeck.study.model import AnyPath, Study
from dragdeck.study.plausible import implausible
from dragdeck.study.recorded import Places, with_recording
from dragdeck.study.yaml import located, shown


def validate(data: Mapping[str, Any], file: Path | str, *, whole: bool = False) -> Study:
    """Check plain data against the study model, and its values against each other.

    Parameters
    ----------
    data : mapping
    file : Path or str
        For error messages.
    whole : bool
        Whether it is a study with its sweep, and not a case of it.

    Raises
    ------
    InputError
        Names every problem with its line, field, value, limit and a remedy.
    """
    data, places = with_recording(data, Path(file))
    found, study = [], None
    try:
        study = Study.model_validate(data)
    except ValidationError as error:
        found = _problems(error)
    wrong = {error.field for error in found}
    implied = study.motion.path.implied if study else {}
    doubts = [row for row in implausible({**data, **implied}) if row[0].field not in wrong]
    found += [error for error, _ in doubts]
    doubtful = {error.field for error in found}
    others = contradictions(study, whole) if study else iter(())
    more = [error for error in others if error.field not in doubtful]
    if study is None or more or any(refused for _, refused in doubts):
        raise _of_file([*found, *more], file, places)
    return study


def warnings(study: Study) -> list[Caution]:
    """Values of a valid study that are hardly meant, one line each."""
    return [
        Caution(
            "implausible", f"{one.field} {one.value:g} {one.problem}; {one.remedy}; {one.limit}"
        )
        for one, _ in implausible({**study.plain(), **study.motion.path.implied})
    ]


_FORMS = (
    *(get_args(path.model_fields["kind"].annotation)[0] for path in get_args(AnyPath)),
    "cylinder",
    "mesh",
    "a-name",
    "a-number",
    "a-word",
    "settings",
    "a-tolerance",
    "[key]",
)
"""Names of alternatives, which are no part of a field's dotted name."""

_LIMITS = {
    "greater_than": "greater than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "finite_number": "a finite number",
}


def explained(error: ValidationError, file: Path | str) -> InputError:
    """What a model found in a file, as one error for the user."""
    return _of_file(_problems(error), file, {})


def _of_file(found: list[InputError], file: Path | str, places: Places) -> InputError:
    for error in found:
        here = file, error.line, error.field
        error.file, error.line, error.field = places.get(error.field, here)
    return located(together(found))


def _problems(error: ValidationError) -> list[InputError]:
    return [_problem(issue) for issue in error.errors()]


def _problem(issue: ErrorDetails) -> InputError:
    """One problem that a model found."""
    kind = issue["type"]
    field = ".".join(str(part) for part in issue["loc"] if part not in _FORMS)
    limit = _LIMITS[kind].format(**issue.get("ctx", {})) if kind in _LIMITS else None
    problem, remedy = issue["msg"].removeprefix("Value error, "), None
    value: object = issue["input"]
    if kind == "extra_forbidden":
        hint = near(str(issue["loc"][-1]), _every_key())
        problem, remedy = (
            "unknown key",
            f"{hint}remove it, or see docs/reference/study.md for its spelling",
        )
    elif kind == "missing":
        problem, remedy, value = "a required key is missing", "add it", None
    if isinstance(value, Mapping | BaseModel):
        value = None
    return InputError(problem, field=field or None, value=shown(value), limit=limit, remedy=remedy)


def _every_key(model: type[Model] = Model) -> set[str]:
    """Every key that some part of a study may have."""
    inner = (_every_key(part) for part in model.__subclasses__())
    return set(model.model_fields).union(*inner)
