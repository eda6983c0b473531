"""Whether the content of a study file can be used: errors name field, value, limit and remedy.

Some errors no single field shows: names that do not exist, values that contradict each other.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from itertools import pairwise, product
from pathlib import Path
from typing import get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dragdeck.errors import Caution, InputError, RecordError, choices, near, together
from dragdeck.study.base import Json, Model, flat
from dragdeck.study.driven import directions
from dragdeck.study.model import (
    BUILT_IN_FIDELITIES,
    OF_NO_RUN,
    AnyBowl,
    AnyPath,
    Fidelity,
    Scaling,
    Study,
    Tolerance,
)
from dragdeck.study.plausible import implausible, plausible_range
from dragdeck.study.recorded import Places, mesh_errors, recorded_file, with_recording
from dragdeck.study.reduction import RADIAL
from dragdeck.study.removal import disagreements
from dragdeck.study.search import Search
from dragdeck.study.workpiece import CylinderShape, Shape
from dragdeck.study.yaml import comma_lists, located, shown

_LEAST_LEVELS = 3
"""Levels that a power law is fitted to: two would fit any."""

_Found = Iterator[tuple[str, str, str]]
"""Field, what is wrong with it, and what would be accepted."""


# --- values against each other -------------------------------------------------------------------


def contradictions(study: Study, whole: bool) -> Iterator[InputError]:
    """Every contradiction within a whole study, or one of its cases; the errors name no file."""
    values = flat(study.plain())
    for check in (
        _names,
        _pairs,
        _media,
        _compound,
        _angles,
        _shape,
        _motion,
        _assumptions,
        _removal,
        *([_sweep] if whole else []),
    ):
        for field, problem, limit in check(study):
            yield InputError(problem, field=field, value=values.get(field), limit=limit)


def _names(study: Study) -> _Found:
    owners = {"bowl": study.bowl.material, "workpiece": study.workpiece.material}
    for name, part in study.media.parts.items():
        owners[f"media.classes.{name}" if name else "media"] = str(part.material)
    for owner, material in owners.items():
        yield from _known(f"{owner}.material", material, study.materials, "no such material")
    if isinstance(study.fidelity, str):
        known = {**BUILT_IN_FIDELITIES, **study.fidelities}
        yield from _known("fidelity", study.fidelity, known, "unknown fidelity")


def _known(field: str, name: str, known: Iterable[str], problem: str) -> _Found:
    if name not in known:
        yield field, f"{problem} {name!r}", choices(name, known)


def _pairs(study: Study) -> _Found:
    every = ["-".join(both) for both in product(study.materials, repeat=2)]
    for key, pair in study.pairs.items():
        back = "-".join(key.split("-")[::-1])
        yield from _known(f"pairs.{key}", key, every, "not a pair of two materials:")
        if key < back and study.pairs.get(back, pair) != pair:
            yield (
                f"pairs.{back}",
                f"differs from {key}, which is the same pair",
                "one entry per pair",
            )
        model, field = study.contact.rolling_model, f"pairs.{key}.rolling_damping"
        if model == "epsd" and pair.rolling_friction and not pair.rolling_damping:
            problem = "is missing, which the rolling model epsd requires"
            yield field, problem, "a damping ratio above 0, such as 0.3"
        if model != "epsd" and pair.rolling_damping:
            yield field, f"the rolling model {model} has no damping", "contact.rolling_model epsd"
    for first, other in product(study.media.materials, study.type_names()):
        key, back = f"{first}-{other}", f"{other}-{first}"
        if key in every and not {key, back} & set(study.pairs):
            yield (
                "pairs",
                f"has no entry {key!r}, although these come into contact",
                "every pair in contact",
            )


def _media(study: Study) -> _Found:
    media = study.media
    for name in {"particle", "bowl", "workpiece"} & set(media.classes):
        yield "media.classes", f"a class must not be called {name}", "another name"
    if {str(part.material) for part in media.parts.values()} <= set(study.materials):
        for name, count in study.class_counts.items():
            if not count:
                field = f"media.classes.{name}" if name else "media"
                yield field, "not one particle of it", "a larger total or fraction"
        yield from _crowd(study)
    if (study.bowl.lid_m or 0.0) > study.bowl.height_m:
        yield "bowl.lid_m", "the lid is above the rim", f"at most {study.bowl.height_m:g} m"
    if (media.fill_height_m or 0.0) > study.bowl.height_m:
        problem = "the bed would stand above the rim of the bowl"
        yield "media.fill_height_m", problem, f"at most {study.bowl.height_m:g} m"


def _crowd(study: Study) -> _Found:
    """More spheres than a run can have, and the class and sieves that make most of them."""
    media, known = study.media, plausible_range("media.count")
    assert known is not None
    spheres = {
        name: count * media.spheres_of(media.parts[name])
        for name, count in study.class_counts.items()
    }
    name = max(spheres, key=lambda part: spheres[part])
    total, most = study.sphere_count, known.refused_above
    if total <= most or (media.count or 0) > most:
        return
    part = media.parts[name]
    field = f"media.classes.{name}" if name else "media"
    amount = f"{spheres[name]:.3g} of them in class {name}" if name else "all of one class"
    yield (
        f"{field}.sieve" if part.sieve else field,
        f"the media would be {total:.3g} spheres in LIGGGHTS, {amount}{part.most_numerous()}",
        f"{most:.3g}: a total smaller by a factor of {total / most:.3g}, or larger particles; "
        "fines can be left out, with their fraction of the mass",
    )


def _compound(study: Study) -> _Found:
    compound, rim = study.compound, study.bowl.height_m
    if compound is None:
        return
    if study.liquid_level_m > rim:
        problem = "the liquid stands above the rim of the bowl"
        yield "compound.level_m", problem, f"at most {rim:g} m"
    names = sorted({*study.media.materials} & {*study.materials})
    densities = {study.materials[name].density_kg_m3 for name in names}
    if study.media.clumped and len(densities) > 1:
        problem = "clumps have their reduced weight by gravity, which is the same for all of them"
        yield "compound", problem, "media of one density, spherical particles, or no compound"
    for name in names:
        lightest = study.materials[name].density_kg_m3
        if compound.density_kg_m3 >= lightest:
            problem = f"particles of {name} float, so that there is no bed at the floor"
            yield "compound.density_kg_m3", problem, f"below {lightest:g} kg/m3"


def _angles(study: Study) -> _Found:
    angles, media = study.calibration and study.calibration.angles, study.media
    if angles and media.classes:
        yield "calibration.angles", "the media have several classes", "media of one class"
    elif angles:
        problems = angles.problems(media.typical_radius_m, media.mean_volume_m3, study.gravity_m_s2)
        yield from ((f"calibration.angles.{field}", what, limit) for field, what, limit in problems)


def _shape(study: Study) -> _Found:
    shape, field = study.workpiece.shape, "workpiece.shape"
    if isinstance(shape, CylinderShape):
        return
    size, edge = shape.facet_size_m, shape.edge_facet_size_m
    if shape.file.lower().endswith((".step", ".stp")):
        if size is None:
            problem = f"{shape.file} is meshed by dragdeck, but the facet size is missing"
            yield f"{field}.facet_size_m", problem, "a target edge length, such as 0.0015"
        elif edge is not None and edge > size:
            problem = "the facets at edges are larger than the others"
            yield f"{field}.edge_facet_size_m", problem, f"at most facet_size_m, {size:g}"
        return
    if shape.unit is None:
        yield f"{field}.unit", f"{shape.file} states no unit", "m, cm, mm, um or in"
    if edge is not None:
        problem = f"{shape.file} is a mesh: its sharp edges are kept, with facets of one size"
        yield f"{field}.edge_facet_size_m", problem, "a STEP file (.step, .stp); or no such field"


def _motion(study: Study) -> _Found:
    """Statistics need a frame of the contact network after all that they leave out."""
    motion, problem = study.motion, "no path is left for the statistics"
    if motion.bowl_rad_s and not study.bowl.container.round:
        field = "motion.bowl" if motion.bowl else "motion.path"
        yield field, f"a bowl of kind {study.bowl.kind} cannot rotate", "a round bowl"
    length, speed = motion.path_length_m, motion.nominal_speed_m_s
    frame = speed / study.outputs.network_hz
    if length < frame * (1 - 1e-9):
        problem = "not one frame of the contact network is written during the drag"
        limit = f"at least {speed / length:.3g} Hz; or use a longer path"
        yield "outputs.network_hz", problem, limit
        return
    most = (length - frame) * (1 + 1e-9)
    if motion.transient_m > most:
        limit = (
            f"at most {most:.4g} m: the length of the path, {length:.4g} m, minus that between "
            "two frames of the contact network (outputs.network_hz)"
        )
        yield "motion.transient_m", problem, limit
    ramps = {"": motion.ramp_s} if motion.ramp_s else {}
    moving = {
        f"{name}.": superposed_motion.ramp_s
        for name, superposed_motion in motion.superposed().items()
    }
    for name, ramp in {**ramps, **moving}.items():
        if motion.passed_m(ramp) > most:
            longest = most / speed + motion.ramp_s / 2 if name else 2 * most / speed
            limit = f"at most {longest:.3g} s; or use a longer path"
            yield f"motion.{name}ramp_s", problem, limit
    if motion.uncounted_m > most and motion.counted_from_revolution is not None:
        limit = "a revolution that begins before the drag ends (motion.path.revolutions)"
        yield "motion.counted_from_revolution", problem, limit


_OF_OTHER_KINDS = [
    f"{block}.{name}"
    for block, kinds in {
        "motion.path": get_args(AnyPath),
        "workpiece.shape": get_args(get_args(Shape)[0]),
        "bowl": [get_args(kind)[0] for kind in get_args(AnyBowl)],
    }.items()
    for kind in kinds
    for name in kind.model_fields
]
"""Fields of all kinds of path, shape and bowl: a study may extend or sweep to another kind."""


def _assumptions(study: Study) -> _Found:
    values = [*flat(study.model_dump(mode="json")), *_OF_OTHER_KINDS]
    parts = (name.split(".") for name in values)
    known = {".".join(words[:count]) for words in parts for count in range(1, len(words) + 1)}
    for number, entry in enumerate(study.assumptions):
        if entry.field not in known:
            limit = f"{near(entry.field, known)}the dotted name of a field, such as media.count"
            yield f"assumptions.{number}.field", f"no such field {entry.field!r}", limit
        value = flat(study.model_dump(mode="json")).get(entry.field)
        if entry.std is not None and (
            isinstance(value, bool) or not isinstance(value, int | float)
        ):
            yield (
                f"assumptions.{number}.std",
                f"{entry.field} is no number",
                "a field with a number",
            )


def _removal(study: Study) -> _Found:
    removal = study.removal
    if removal is None:
        if study.roughness:
            yield "roughness", "roughness follows from the depth of removal", "a block removal"
        return
    if any(law.impact for law in removal.laws) and not study.outputs.first_touch_fraction:
        problem = f"the law {removal.law} reads impacts, but no run writes them"
        yield "removal.law", problem, "outputs.first_touch_fraction: 0.05, or the law archard"
    asked = study.fidelity.quantities if isinstance(study.fidelity, Tolerance) else ()
    if "force_slide" in asked and removal.laws[-1].impact:
        problem = f"windows do not see the impacts that the law {removal.law} reads"
        yield "fidelity.quantity", problem, "the law archard, or without force_slide"
    several = study.workpieces is not None or study.search or {*study.sweep} - {"seed"}
    if removal.calibrate and several:
        problem = "a weighed trial is of one process, but the study has several cases"
        yield "removal.calibrate", problem, "one workpiece, and a sweep over seed at most"


def _sweep(study: Study) -> _Found:
    for field, values in study.sweep.items():
        if not all(field.split(".")):
            yield "sweep", f"{field!r} is not a field", "a dotted name, such as motion.speed_m_s"
        if not values:
            yield f"sweep.{field}", "no values", "one value or more"
        if field.split(".")[0] in OF_NO_RUN:
            yield f"sweep.{field}", "no run depends on it", "a field that the runs depend on"
    count, most = math.prod(map(len, study.sweep.values())), study.accepted.cases
    if count > most:
        limit = f"{most}; if this is intended, set accepted.cases: {count}"
        yield "sweep", f"makes {count} cases, more than are accepted", limit
    if study.scaling is not None:
        yield from _scaling(study.scaling, study)
    if study.search is not None:
        yield from _search(study.search, study)


def _search(search: Search, study: Study) -> _Found:
    """Why no run of the study could answer the search."""
    if {*study.sweep} != {"seed"} or len(study.sweep["seed"]) < 2:
        problem = "a search knows the scatter of its runs from several packings at each setting"
        yield "sweep", problem, "seed: [1, 2] or more, and no other field"
    if study.workpieces is not None:
        yield "search", "a search is of one workpiece", "a study without workpieces"
    given = {
        "removal": study.removal is not None,
        "removal.target_depth_m": bool(study.removal and study.removal.target_depth_m),
        "outputs.first_touch_fraction": bool(study.outputs.first_touch_fraction),
        "motion.spin": study.motion.turns,
    }
    for name, measure in search.measures.items():
        if lacking := measure.lacks(given):
            limit = f"a study with {lacking}, or another quantity"
            yield f"search.{name}.quantity", f"no run has {measure.quantity}", limit
        if study.reduction and study.reduction.cut_out and measure.quantity in RADIAL:
            limit = "another quantity, or the machine without reduction.cut_out"
            yield f"search.{name}.quantity", "a straight cut-out does not give it", limit
    for field in search.vary:
        if field.split(".")[0] in (*OF_NO_RUN, "fidelity", "fidelities", "seed", "outputs"):
            yield f"search.vary.{field}", "it is no setting of the machine", "another field"
    for name, problem in search.excluded():
        yield f"search.{name}", problem, "limits that one setting can meet together"
    count, most = len(study.sweep.get("seed", ())) * (search.runs + 2), study.accepted.cases
    if count > most:
        limit = f"{most}; if this is intended, set accepted.cases: {count}"
        yield "search.runs", f"makes {count} cases, more than are accepted", limit
    known = {**BUILT_IN_FIDELITIES, **study.fidelities}
    yield from _known("search.confirm", search.confirm, known, "unknown fidelity")
    if search.confirm in known and not isinstance(study.fidelity, Tolerance):
        fidelity, confirm = study.chosen_fidelity(), known[search.confirm]
        scale, speed = confirm.youngs_modulus_scale, confirm.speed_factor
        softer = scale < 1 and scale <= fidelity.youngs_modulus_scale
        if softer or speed > fidelity.speed_factor:
            problem = f"{search.confirm} is no more accurate than the settings of the search"
            limit = "a fidelity with a larger youngs_modulus_scale and no larger speed_factor"
            yield "search.confirm", problem, limit


def _scaling(scaling: Scaling, study: Study) -> _Found:
    """Why the sweep cannot tell the power law."""
    field, others = scaling.field, [name for name in study.sweep if name != "seed"]
    if field not in others:
        yield "scaling.field", f"{field} is not a field of sweep", choices(field, others)
        return
    if len(others) > 1:
        problem = "scaling requires a sweep over exactly one field, besides seed"
        yield "sweep", problem, f"{field} and seed"
    levels = [_level(value) for value in study.sweep[field]]
    low, high = scaling.fit_range or (0.0, math.inf)
    if not all(level > 0 for level in levels):
        yield f"sweep.{field}", "a power law needs numbers above 0", "numbers above 0"
    elif sum(low <= level <= high for level in levels) < _LEAST_LEVELS:
        problem = f"too few levels from {low:g} to {high:g} for a power law"
        yield f"sweep.{field}", problem, f"{_LEAST_LEVELS} levels or more"


def _signal(study: Study, file: Path) -> Iterator[InputError]:
    """What keeps the measured force signal from being compared with that of a run."""
    signal = study.reference.signal if study.reference else None
    if signal is None:
        return
    from dragdeck.study.force_record import RATES_PER_BANDWIDTH, measured_signal

    motion, most = study.motion, study.outputs.workpiece_force_hz / RATES_PER_BANDWIDTH
    if signal.low_pass_hz > most * (1 + 1e-9):
        field, problem = "reference.signal.low_pass_hz", "the simulated force is sampled too slowly"
        limit = f"at most {most:g} Hz, a fifth of outputs.workpiece_force_hz"
        yield InputError(problem, field=field, value=signal.low_pass_hz, limit=limit)
    transient_s = motion.uncounted_m / motion.nominal_speed_m_s + motion.ramp_s / 2
    field = "reference.signal.file"
    try:
        measured_signal(
            recorded_file(signal.file, file, field),
            signal,
            partial(directions, motion),
            transient_s,
        )
    except RecordError as error:
        problem, value = f"({error.reason}) {error.problem}", error.value or signal.file
        yield InputError(problem, field=field, value=value, limit=error.limit, remedy=error.remedy)
    except InputError as error:
        yield error


def _decimal_commas(study: Study, file: Path) -> Iterator[InputError]:
    """Lists of a sweep that may be one number, ``[1,5]``; whole numbers have no fraction."""
    values, written = flat(study.plain()), comma_lists(file) if study.sweep else {}
    for name in study.sweep:
        field = f"sweep.{name}"
        if field in written and not isinstance(values.get(name), int):
            limit = f"with a space for two values, {written[field].replace(',', ', ')}; or "
            limit += f"with a decimal point for one, {written[field].replace(',', '.')}"
            problem = "the comma may separate two values or be a decimal comma"
            yield InputError(problem, field=field, value=written[field], limit=limit)


def _level(value: object) -> float:
    """A level of a scaling as a number, NaN if it is none."""
    try:
        return math.nan if isinstance(value, bool) else float(str(value))
    except ValueError:
        return math.nan


# --- the whole file ------------------------------------------------------------------------------


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
    others = [*contradictions(study, whole), *_signal(study, Path(file))] if study else []
    others += _decimal_commas(study, Path(file)) if study and whole else ()
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
    return cautions


_FORMS = ("a-name", "a-list", "a-number", "a-word", "settings", "a-tolerance", "[key]")
"""Names of alternatives, which are no part of a field's dotted name; nor are kinds."""

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
    words = _WORDS.get(kind, (issue["msg"].removeprefix("Value error, "), None))
    problem, limit, remedy = *words, None
    if kind in _WORDS:
        context = issue.get("ctx", {})
        if "actual_length" in context:  # pydantic does not count the entries of a mapping
            context = {**context, "actual_length": len(issue["input"])}
        problem, limit = problem.format(**context), limit and limit.format(**context)
    value: object = issue["input"]
    if kind == "union_tag_invalid" and isinstance(value, Mapping):
        field, value = f"{field}.kind", value.get("kind")
    if kind == "extra_forbidden":
        hint = _hint(str(issue["loc"][-1]), _every_key())
        problem, remedy = (
            "unknown key",
            f"{hint}remove it, or see docs/reference/study.md for its spelling",
        )
    elif kind in ("float_type", "int_type") and isinstance(value, list) and len(value) == 2:
        remedy = "if its comma is a decimal comma, write a decimal point, without brackets"
    elif kind == "missing":
        what = "entry" if isinstance(issue["loc"][-1], int) else "key"
        problem, remedy, value = f"a required {what} is missing", "add it", None
    if isinstance(value, Mapping | BaseModel):
        value = None
    return InputError(problem, field=field or None, value=shown(value), limit=limit, remedy=remedy)


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
