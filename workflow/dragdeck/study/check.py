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
    known = {error.field for error, refused in doubts if refused}
    others = contradictions(study, whole) if study else iter(())
    more = [error for error in others if error.field not in known]
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

_OUT_OF_RANGE = "the value is out of range"
_ENTRIES = "the list has {actual_length} entries"
_BLOCK, _LIST = "a block of fields is required", "a list is required"
_WHOLE, _SWITCH = "a whole number is required", "true or false is required"
_WORDS = {
    "string_type": ("text is required", None),
    "bool_type": (_SWITCH, None),
    "bool_parsing": (_SWITCH, None),
    "float_type": ("a number is required", None),
    "int_type": (_WHOLE, None),
    "int_from_float": (_WHOLE, None),
    "dict_type": (_BLOCK, None),
    "model_type": (_BLOCK, None),
    "model_attributes_type": (_BLOCK, None),
    "list_type": (_LIST, None),
    "tuple_type": (_LIST, None),
    "named_tuple_type": (_LIST, None),
    "too_long": (_ENTRIES, "at most {max_length}"),
    "too_short": (_ENTRIES, "at least {min_length}"),
    "union_tag_not_found": ("the block does not state its kind", None),
    "union_tag_invalid": ("unknown kind", "one of {expected_tags}"),
    "literal_error": ("the value is unknown", "{expected}"),
    "string_pattern_mismatch": ("a character is not accepted", "none of {{ and }}"),
    "greater_than": (_OUT_OF_RANGE, "greater than {gt}"),
    "greater_than_equal": (_OUT_OF_RANGE, "at least {ge}"),
    "less_than": (_OUT_OF_RANGE, "less than {lt}"),
    "less_than_equal": (_OUT_OF_RANGE, "at most {le}"),
    "finite_number": (_OUT_OF_RANGE, "a finite number"),
}
"""Problem and limit by the type of an error of pydantic, whose own words are about Python."""


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
    words = _WORDS.get(kind, (issue["msg"].removeprefix("Value error, "), None))
    problem, limit, remedy = *words, None
    if kind in _WORDS:
        context = issue.get("ctx", {})
        problem, limit = problem.format(**context), limit and limit.format(**context)
    value: object = issue["input"]
    if kind == "union_tag_invalid" and isinstance(value, Mapping):
        field, value = f"{field}.kind", value.get("kind")
    if kind == "extra_forbidden":
        hint = near(str(issue["loc"][-1]), _every_key())
        problem, remedy = (
            "unknown key",
            f"{hint}remove it, or see docs/reference/study.md for its spelling",
        )
    elif kind == "missing":
        what = "entry" if isinstance(issue["loc"][-1], int) else "key"
        problem, remedy, value = f"a required {what} is missing", "add it", None
    if isinstance(value, Mapping | BaseModel):
        value = None
    return InputError(problem, field=field or None, value=shown(value), limit=limit, remedy=remedy)


def _every_key(model: type[Model] = Model) -> set[str]:
    """Every key that some part of a study may have."""
    inner = (_every_key(part) for part in model.__subclasses__())
    return set(model.model_fields).union(*inner)
