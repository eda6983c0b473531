"""Whether the content of a study file can be used: errors name field, value, limit and remedy.

Some errors no single field shows: names that do not exist, values that contradict each other.
"""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dragdeck.errors import Caution, InputError, near, together
from dragdeck.files import table_rows
from dragdeck.study.base import Json, Model
from dragdeck.study.contradictions import contradictions, decimal_commas, signal_problems
from dragdeck.study.fidelity import BUILT_IN_FIDELITIES, Fidelity
from dragdeck.study.model import Study
from dragdeck.study.plausible import implausible
from dragdeck.study.recorded import Places, mesh_errors, with_recording
from dragdeck.study.removal import disagreements
from dragdeck.study.yaml import located, shown


def validate(data: Json, file: Path | str, *, whole: bool = False) -> Study:
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
    data, places, unread = with_recording(data, Path(file))
    problems, study = list(unread.values()), None
    try:
        study = Study.model_validate(data)
    except ValidationError as error:
        problems += [problem for problem in _problems(error) if problem.field not in _named(unread)]
    wrong = {error.field for error in problems}
    implied = study.motion.path.implied if study else {}
    doubts = [row for row in implausible({**data, **implied}) if row[0].field not in wrong]
    problems += [error for error, _ in doubts]
    known = {error.field for error, refused in doubts if refused}
    others = [*contradictions(study, whole), *signal_problems(study, Path(file))] if study else []
    others += decimal_commas(study, Path(file)) if study and whole else ()
    more = [error for error in others if error.field not in known]
    if study is None or more or any(refused for _, refused in doubts):
        meshes = mesh_errors(data, Path(file)) if whole else ()
        raise _of_file([*problems, *more, *meshes], file, places)
    return study


def _named(unread: Iterable[str]) -> set[str]:
    """Fields that the model misses, because the files that they name cannot be used."""
    return {name for field in unread for name in (field, f"{field}.points")}


def warnings(study: Study) -> list[Caution]:
    """What a valid study hardly means, one line each."""
    cautions = [
        Caution(
            "implausible",
            f"{caution.field} {caution.value:g} {caution.problem}; {caution.remedy}; "
            f"{caution.limit}",
        )
        for caution, _ in implausible({**study.plain(), **study.motion.path.implied})
    ]
    chosen = {"youngs_modulus_scale", "timestep_fraction", "soft_start"}
    fidelity, draft = study.fidelity, BUILT_IN_FIDELITIES["draft"]
    if isinstance(fidelity, Fidelity) and not fidelity.model_fields_set & chosen:
        text = (
            "fidelity is a block without youngs_modulus_scale and timestep_fraction: it replaces "
            "any named fidelity, and means the stiffness and time step of reference; to keep those "
            f"of draft, add youngs_modulus_scale: {draft.youngs_modulus_scale:g} and "
            f"timestep_fraction: {draft.timestep_fraction:g} to it"
        )
        cautions.append(Caution("fidelity", text))
    if study.removal:
        cautions += [Caution("trials", text) for text in disagreements(study.removal)]
    if study.roughness:
        cautions += [Caution("roughness", text) for text in study.roughness.doubts()]
    return cautions


_FORMS = ("a-name", "a-list", "a-number", "a-word", "settings", "a-tolerance", "[key]")
"""Names of alternatives, which are no part of a field's dotted name; nor are kinds."""


_WORDS = {row.pop("type"): row for row in table_rows(Path(__file__).with_name("refusals.csv"))}
"""Problem and limit by the type of an error of pydantic, whose own words are about Python."""


def explained(error: ValidationError, file: Path | str) -> InputError:
    """What a model found in a file, as one error for the user."""
    return _of_file(_problems(error), file, {})


def _of_file(errors: list[InputError], file: Path | str, places: Places) -> InputError:
    for error in errors:
        here = error.file or file, error.line, error.field
        error.file, error.line, error.field = here if error.line else places.get(error.field, here)
    return located(together(errors))


def _problems(error: ValidationError) -> list[InputError]:
    return [_problem(issue) for issue in error.errors()]


def _problem(issue: ErrorDetails) -> InputError:
    """One problem that a model found."""
    kind = issue["type"]
    places = pairwise(("", *issue["loc"]))
    named = (part for above, part in places if above not in ("path", "shape", "bowl"))
    field = ".".join(str(part) for part in named if part not in _FORMS)
    problem, limit, remedy = issue["msg"].removeprefix("Value error, "), None, None
    if kind in _WORDS:
        context = issue.get("ctx", {})
        if "actual_length" in context:  # pydantic does not count the entries of a mapping
            context = {**context, "actual_length": len(issue["input"])}
        problem, limit = (text.format(**context) for text in _WORDS[kind].values())
    value: object = issue["input"]
    if kind == "union_tag_invalid" and isinstance(value, Mapping):
        field, value = f"{field}.kind", value.get("kind")
    if kind == "extra_forbidden":
        word, known = str(issue["loc"][-1]), _every_key()
        problem, remedy = "unknown key", "remove it: another kind of this block has it"
        if ".".join(field.split(".")[-2:]) not in known - {word}:
            hint = _hint(word, known)
            remedy = f"{hint}remove it, or see docs/reference/study.md for its spelling"
    elif kind in ("float_type", "int_type") and isinstance(value, list) and len(value) == 2:
        remedy = "if its comma is a decimal comma, write a decimal point, without brackets"
    elif kind == "missing":
        what = "entry" if isinstance(issue["loc"][-1], int) else "key"
        problem, remedy, value = f"a required {what} is missing", "add it", None
    if isinstance(value, Mapping | BaseModel):
        value = None
    return InputError(
        problem, field=field or None, value=shown(value), limit=limit or None, remedy=remedy
    )


def _hint(word: str, known: set[str]) -> str:
    """A question about the blocks that have a key, or about the key that it resembles."""
    elsewhere = sorted({word} & set(Study.model_fields))
    elsewhere += sorted(name for name in known if name.endswith(f".{word}"))[:3]
    return f"did you mean {' or '.join(map(repr, elsewhere))}? " if elsewhere else near(word, known)


def _every_key(model: type[Model] = Model) -> set[str]:
    """Every key that some part of a study may have, alone and behind the name of its block."""
    fields = model.model_fields.items()
    blocks = {name: _blocks(field.annotation) for name, field in fields}
    nested = {f"{name}.{key}" for name, parts in blocks.items() for key in parts}
    return nested.union(blocks, *map(_every_key, model.__subclasses__()))


def _blocks(annotation: object) -> set[str]:
    """The keys of all models within a type."""
    if isinstance(annotation, type) and issubclass(annotation, Model):
        return set(annotation.model_fields)
    return set().union(*map(_blocks, get_args(annotation)))
