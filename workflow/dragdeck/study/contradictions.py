"""Values of a study that contradict each other, and names that do not exist.

No single field shows these errors. A check yields field, problem and limit.
"""

import math
from collections.abc import Iterable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from typing import get_args

from dragdeck.errors import InputError, RecordError, choices, near
from dragdeck.physics.rounding import limit_of
from dragdeck.study.base import flat
from dragdeck.study.driven import directions
from dragdeck.study.fidelity import BUILT_IN_FIDELITIES, Tolerance
from dragdeck.study.model import OF_NO_RUN, AnyBowl, Scaling, Study
from dragdeck.study.motion import AnyPath
from dragdeck.study.plausible import plausible_range
from dragdeck.study.recorded import recorded_file
from dragdeck.study.reduction import RADIAL
from dragdeck.study.search import Search
from dragdeck.study.workpiece import CylinderShape, Shape
from dragdeck.study.yaml import comma_lists

_LEAST_LEVELS = 3
"""Levels that a power law is fitted to: two would fit any."""


_Found = Iterator[tuple[str, str, str]]
"""Field, what is wrong with it, and what would be accepted."""


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
    known = {*study.pairs}
    for first, other in product(study.media.materials, study.type_names()):
        key, back = f"{first}-{other}", f"{other}-{first}"
        if key in every and not {key, back} & known:
            known.add(key)
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
        counted = max(length - motion.transient_m, 0.0) or length
        limit = f"at least {limit_of(speed / counted, up=True)} Hz; or use a longer path"
        yield "outputs.network_hz", problem, limit
        return
    most = (length - frame) * (1 + 1e-9)
    if motion.transient_m > most:
        limit = (
            f"at most {limit_of(most)} m: the length of the path, {length:.4g} m, minus that "
            "between two frames of the contact network (outputs.network_hz)"
        )
        yield "motion.transient_m", problem, limit
    ramps = {"": motion.ramp_s} if motion.ramp_s else {}
    moving = {
        f"{name}.": superposed_motion.ramp_s
        for name, superposed_motion in motion.superposed().items()
    }
    for name, ramp in {**ramps, **moving, "bowl.": motion.bowl_ramp_s}.items():
        if motion.passed_m(ramp) > most:
            longest = most / speed + motion.ramp_s / 2 if name else 2 * most / speed
            limit = f"at most {limit_of(longest)} s; or use a longer path"
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
    values = flat(study.model_dump(mode="json"))
    parts = (name.split(".") for name in (*values, *_OF_OTHER_KINDS))
    known = {".".join(words[:count]) for words in parts for count in range(1, len(words) + 1)}
    for number, entry in enumerate(study.assumptions):
        if entry.field not in known:
            limit = f"{near(entry.field, known)}the dotted name of a field, such as media.count"
            yield f"assumptions.{number}.field", f"no such field {entry.field!r}", limit
        value = values.get(entry.field)
        if entry.std is not None and (
            isinstance(value, bool) or not isinstance(value, int | float)
        ):
            limit = "a field with a number"
            yield f"assumptions.{number}.std", f"{entry.field} is no number", limit


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


def signal_problems(study: Study, file: Path) -> Iterator[InputError]:
    """What keeps the measured force signal from being compared with that of a run."""
    signal = study.reference.signal if study.reference else None
    if signal is None:
        return
    from dragdeck.study.process_signal import RATES_PER_BANDWIDTH, measured_signal

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
        yield error.of_field(field, signal.file)
    except InputError as error:
        yield error


def decimal_commas(study: Study, file: Path) -> Iterator[InputError]:
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
