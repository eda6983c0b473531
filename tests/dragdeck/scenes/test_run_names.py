"""Every field of rich studies, changed a little: what changes an input script renames its run."""

import copy
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from bowls import OWN_BOWL
from made_scenes import BED
from made_study import Made, put
from paths import ROOT

from dragdeck.cases import bed
from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.errors import InputError
from dragdeck.mesh import clump
from dragdeck.project import Project
from dragdeck.scenes import filling, lead, workpiece
from dragdeck.scenes.lead import with_leads
from dragdeck.scenes.process import PROCESS, SCENES
from dragdeck.scenes.scene import SceneType
from dragdeck.study.check import validate
from dragdeck.study.model import OF_NO_RUN, Study

SCHEMA = Study.model_json_schema()

MATERIALS = {
    "plastic": {"youngs_modulus_pa": 3e10, "poissons_ratio": 0.35, "density_kg_m3": 1900},
    "liner": {"youngs_modulus_pa": 1e10, "poissons_ratio": 0.45, "density_kg_m3": 1200},
}
PAIR = {"restitution": 0.6, "friction": 0.3, "rolling_friction": 0.1, "cohesion_j_m3": 1000.0}
PAIRS = {
    f"{particle}-{other}": {**PAIR, "friction": 0.2 + 0.01 * number}
    for number, (particle, other) in enumerate(
        (particle, other)
        for particle in ("ceramic", "plastic")
        for other in ("ceramic", "plastic", "liner", "steel")
        if (particle, other) != ("plastic", "ceramic")
    )
}
DAMPED = {name: {**pair, "rolling_damping": 0.2} for name, pair in PAIRS.items()}
SIEVE = [[0.005, 0.0], [0.006, 0.4], [0.007, 1.0]]
OF_REMOVAL = {"law": "archard", "coefficient_m2_n": 1e-15, "target_depth_m": 1e-6}
BOWL = {"material": "liner", "height_m": 0.1, "facet_size_m": 0.008, "lid_m": 0.07}
RING = {"kind": "annulus", "radius_m": 0.04, "core_radius_m": 0.006, **BOWL}
PROFILE = [[0.0, 0.0], [0.024, 0.0], [0.028, 0.01], [0.03, 0.1]]
REST = {"kind": "rest", "radius_m": 0.023, "bowl_rpm": 20, "start_deg": 5, "revolutions": 0.2}
EIGHT = {
    "kind": "figure_eight", "radius_m": 0.004, "middle_m": [0.001, 0.0], "direction_deg": 10,
    "loops": 0.5,
}  # fmt: skip
LINE = {"kind": "line", "start_m": [-0.008, 0.001], "direction_deg": 5, "length_m": 0.012}
WAYPOINTS = {
    "kind": "waypoints", "fraction": 0.9,
    "points": [[0, -0.008, 0, 0, 0, 0, 0], [0.4, 0.004, 0.002, 0.001, 20, 3, 2]],
}  # fmt: skip
SOFT = {
    "youngs_modulus_scale": 0.01, "timestep_fraction": 0.4, "filling_timestep_fraction": 0.2,
    "skin_m": 4e-4, "ranks": 1,
}  # fmt: skip


def grains(material: str, fraction: float, **more: Any) -> dict[str, Any]:
    sizes = {} if "sieve" in more else {"radius_mean_m": 3.1e-3, "radius_std_m": 1e-4}
    return {"material": material, "fraction": fraction, **sizes, **more}


RICH: dict[str, dict[str, Any]] = {
    "bodies": {  # two materials of clumps of different shapes; three workpieces, of two kinds
        "media": {"count": 60, "fractions_of": "number", "classes": {
            "rods": grains("ceramic", 0.5, shape={
                "kind": "cylinder", "aspect": 1.3, "cut_deg": 20, "spheres": 2}),
            "cones": grains("plastic", 0.5, distribution="uniform", shape={
                "kind": "cone", "aspect": 1.2, "spheres": 2})}},
        "workpiece.shape": {
            "kind": "mesh", "file": "hex_bar.stl", "unit": "mm", "axis": "-z",
            "offset_m": [0.0, 0.0005]},
        "workpieces": [{"angle_deg": 0}, {"angle_deg": 120, "shape": {
            "kind": "cylinder", "radius_m": 0.003, "facet_size_m": 0.002}},
            {"angle_deg": 240, "immersion_depth_m": 0.01}],
        "bowl.radius_m": 0.05, "bowl.facet_size_m": 0.008,
        "motion.path": {"kind": "circle", "radius_m": 0.02, "revolutions": 1.5, "start_deg": 3},
        "motion.tilt_deg": 4.0, "motion.spin": {"rpm": 60, "ramp_s": 0.02},
        "motion.counted_from_revolution": 1, "motion.ramp_s": 0.05,
        "motion.plunge_at_m": [0.02, 0.001],
        "fidelity": SOFT,
        "removal": OF_REMOVAL,
        "outputs.first_touch_fraction": 0.1, "accepted": {"unsafe_timestep": "any", "cases": 9},
        "licence": "MIT", "contact.limit_force": False,
    },
    "sieve": {  # two materials of spheres in a compound, one by a sieve analysis; windows
        "media": {"mass_kg": 0.05, "fractions_of": "volume", "classes": {
            "sieved": grains("plastic", 0.3, sieve=SIEVE),
            "coarse": grains("ceramic", 0.7, distribution="log_normal")}},
        "compound": {"density_kg_m3": 1000, "level_m": 0.08},
        "motion.path": {"kind": "circle", "radius_m": 0.01, "revolutions": 4, "direction": "cw"},
        "motion.oscillation": {"amplitude_m": 0.001, "frequency_hz": 2, "ramp_s": 0.1},
        "motion.bowl": {"kind": "rotation", "rpm": 90}, "motion.bed_friction_deg": 5,
        "contact": {"rolling_model": "epsd"}, "pairs": DAMPED,
        "fidelity": {**SOFT, "filling_youngs_modulus_scale": 0.1, "windows": {"tolerance": 0.1}},
        "assumptions": [{"field": "media.mass_kg", "why": "any"}],
        "reference": {"source": "somebody", "experiment": {"drag_mean_n": -1.0}},
    },
    "one class": {
        "media": {"material": "ceramic", "fill_height_m": 0.02, "sieve": SIEVE},
        "bowl": RING,
        "motion.path": REST, "motion.speed_m_s": None,
        "motion.spin": {"schedule": [{"until_s": 0.1, "rpm": 30}, {"until_s": 9, "rpm": 50}]},
        "fidelities": {"quick": {**SOFT, "speed_factor": 2.0}}, "fidelity": "quick",
        "workpieces": {"count": 2},
        "calibration": {"angles": {
            "friction": [0.1, 0.5], "rolling_friction": [0.01, 0.1],
            "repose": {"angle_deg": 25, "angle_std_deg": 1, "cylinder_radius_m": 0.02,
                       "count": 400}}},
    },
    "figure eight": {
        "media": {"count": 60, "classes": {
            "eggs": grains("ceramic", 0.5, shape={
                "kind": "ellipsoid", "axes": [1.0, 1.2, 1.4], "spheres": 2}),
            "pyramids": grains("plastic", 0.5, shape={"kind": "tetrahedron", "spheres": 4})}},
        "motion.path": EIGHT, "motion.orientation": "fixed",
        "motion.bowl": {"kind": "vibration", "amplitude_m": [0.001, 0.0005, 0.0007],
                        "phase_deg": [0, 30, 90], "frequency_hz": 25, "ramp_s": 0.05},
        "bowl": {"kind": "trough", "length_m": 0.06, "width_m": 0.055, **BOWL},
    },
    "waypoints": {
        "media": {"count": 60, "classes": {
            "prisms": grains("ceramic", 0.5, shape={
                "kind": "triangular_prism", "aspect": 1.1, "spheres": 2}),
            "stones": grains("plastic", 0.5, shape={"kind": "mesh", "spheres": 2, "points": [
                [0, 0, 0], [1, 0, 0], [0, 1.2, 0], [0, 0, 1.1], [0.8, 0.8, 0.8]]})}},
        "motion.path": WAYPOINTS, "motion.speed_m_s": None,
        "bowl": {"kind": "revolved", "profile_m": PROFILE, **BOWL},
    },
    "line": {
        "media": {"material": "ceramic", "count": 60, "radius_mean_m": 3e-3},
        "workpiece.shape": {
            "kind": "mesh", "file": "shaft.step", "unit": "mm", "axis": "+x", "facet_size_m": 0.003,
            "edge_facet_size_m": 0.002},
        "motion.path": LINE,
        "motion.bowl": {"kind": "acceleration", "acceleration_m_s2": 2.0, "direction_deg": 30},
        "reduction": {"cut_out": True, "counted_m": 0.01, "coarser": 1.2},
        "bowl.lid_m": 0.07,
        "fidelity": {**SOFT, "soft_start": {"youngs_modulus_scale": 1e-3}},
    },
}  # fmt: skip

OWN = {
    "media": {"material": "ceramic", "count": 60, "radius_mean_m": 3e-3},
    "bowl": {**OWN_BOWL["bowl"], "material": "liner", "lid_m": 0.055},
    "motion.path": LINE, "fidelity": SOFT,
}  # fmt: skip
"""A bowl of many facets, which are not changed one by one here."""

TOLD_APART_BY = ("kind", "file", "law")
"""Fields that are not changed alone: a kind of block has other fields."""

BOUND = (
    *(f"profile_m.{point}" for point in ("0.0", "0.1", "1.1", "3.0", "3.1")),
    "bowl.height_m",
    f"sieve.{len(SIEVE) - 1}.1",
    "contact.rolling_model",
    "fidelity.speed_factor",
    "reduction.cut_out",
)
"""Fields that others bind: a length is of a cut-out, the last sieve passes all, rolling_damping
requires epsd, windows forbid a faster workpiece."""

UNCHANGED = {
    "motion": {"drop_test", "filling"},
    "outputs": {"drop_test", "filling"},
    "workpieces": {"drop_test", "filling"},
    "workpiece.shape": {"drop_test", "filling"},
    "drop_test": {"filling", "process", "lead", "window"},
    "media.count": {"drop_test"},
    "bowl": {"drop_test"},
    "bowl.lid_m": {"drop_test", "filling"},
    "pairs.ceramic-ceramic": {"drop_test"},
    "seed": {"drop_test"},
    "compound": {"drop_test"},
    "fidelity": {"drop_test"},
    "fidelity.timestep_fraction": {"drop_test", "filling"},
    "fidelity.windows.tolerance": {"drop_test", "filling", "process", "window"},
    "fidelity.windows.quantities": {"drop_test", "filling", "process", "window"},
    "reduction": {"drop_test", "filling", "process", "lead", "window"},
    **{block: {"drop_test", "filling", "process", "lead", "window"} for block in OF_NO_RUN},
}
"""Scenes whose runs are found again when a field, or a field of a block, is changed."""


def leaves(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted name and value of each field of plain data, entries of lists by their numbers."""
    entries: dict[str, Any] = {}
    if isinstance(value, Mapping):
        entries = {str(key): inner for key, inner in value.items()}
    elif isinstance(value, list):
        entries = {str(number): inner for number, inner in enumerate(value)}
    elif value is not None:
        yield name, value
    for key, inner in entries.items():
        yield from leaves(inner, f"{name}.{key}".lstrip("."))


def with_value(data: Any, name: str, value: Any) -> Any:
    """A copy of plain data with the field of a dotted name replaced."""
    found = copy.deepcopy(data)
    *above, last = name.split(".")
    block = found
    for key in above:
        block = block[int(key) if isinstance(block, list) else key]
    block[int(last) if isinstance(block, list) else last] = value
    if last == "fraction" and "classes" in above:  # those of all classes sum to 1
        (other,) = found["media"]["classes"].keys() - {above[-1]}
        found["media"]["classes"][other][last] = 1 - value
    return found


def words_of(schema: Any) -> Iterator[list[str]]:
    """Every list of words among which some field has one."""
    if isinstance(schema, Mapping):
        if "enum" in schema:
            yield schema["enum"]
        for part in schema.values():
            yield from words_of(part)
    elif isinstance(schema, list):
        for part in schema:
            yield from words_of(part)


WORDS = [
    *words_of(SCHEMA),
    ["liner", "steel", "ceramic", "plastic"],
    ["quick", "draft"],
    ["media.mass_kg", "seed"],
]


def others(value: Any) -> Iterator[Any]:
    """Values near to that of a field."""
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int):
        yield from (value + 1, value - 1, 2 * value)
    elif isinstance(value, float):
        yield from (1.02 * value, 0.98 * value) if value else (0.01, 0.0001)
    else:
        for words in WORDS:
            yield from (word for word in words if value in words and word != value)
        yield f"{value} and more"


def loaded(file: Path, data: Any) -> dict[str, tuple[SceneType, Case]]:
    """The runs of a study of one case, by what they are: its lead and its first window, too."""
    case = Case(file, {}, validate(data, file))
    found = {name: (kind, case) for name, kind in SCENES.items()}
    for one in with_leads([case]):
        if one is not case:
            found.setdefault("window" if one.rank_of_window else "lead", (PROCESS, one))
    return found


def script(scene: AnyScene) -> str:
    """The commands of an input script, but for the names of folders."""
    text = deck_text(scene, environment(ROOT / "templates"))
    lines = (line for line in text.splitlines() if line and not line.startswith("#"))
    return "\n".join(line for line in lines if not line.startswith("variable from"))


def differs(one: AnyScene, other: AnyScene) -> bool:
    """Whether a script or a file beside it differs."""
    unnamed = {"title": "", "run": "", "source": ""}
    decks = [replace(scene.deck, **unnamed) for scene in (one, other)]
    if decks[0] != decks[1] and script(one) != script(other):
        return True
    return one.texts() != other.texts()


def said(scene: AnyScene) -> Any:
    """What ``case.json`` says, but for the name of the fidelity, by which no run is told apart."""
    fidelity = scene.case.fidelity.model_copy(update={"name": ""})
    return scene.case.model_copy(update={"fidelity": fidelity}).as_text()


@pytest.fixture
def written(project: Project, small: dict[str, Any]) -> tuple[Path, dict[str, Any]]:
    """Folder for rich studies, and what they have in common."""
    small["materials"] |= MATERIALS
    small["pairs"] = PAIRS
    small["bowl"]["material"] = "liner"
    return project.studies / "rich/study.yaml", small


def rich(file: Path, small: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Plain data of a rich study."""
    data = {key: value for key, value in small.items() if key not in ("media", "contact")}
    put(data := copy.deepcopy(data), copy.deepcopy(changes))
    return validate(data, file).model_dump(mode="json")


def remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of what never changes, called once for the same objects."""
    known: dict[tuple[Any, ...], tuple[Any, Any]] = {}

    def call(*arguments: Any) -> Any:
        key = tuple(a if isinstance(a, str | int) else id(a) for a in arguments)
        if key not in known:  # the arguments are kept, so that no other object gets their identity
            known[key] = function(*arguments), arguments
        return known[key][0]

    return call


OF_STUDIES = (
    (Study, "of_runs"),
    (Study, "plain"),
    (bed, "bed_classes"),
    (bed, "bed_density"),
    (bed, "expected_surface"),
    (filling, "primes"),
    (lead, "_marks"),
)
"""What is computed many times of the same study, or of the same seed."""


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let scenes be built quickly, of all the same fields: with fewer fits and postures."""
    for place, name in OF_STUDIES:
        monkeypatch.setattr(place, name, remembered(getattr(place, name)))
    monkeypatch.setattr(clump, "_STARTS", 1)
    monkeypatch.setattr(workpiece, "_LOOKS", 10)


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("name", RICH)
def test_a_run_has_another_name_if_its_script_differs(
    written: tuple[Path, dict[str, Any]], name: str
) -> None:
    """What an earlier study has, too, is changed there."""
    file, data = written
    file.parent.mkdir()
    file.write_text("")
    *earlier, plain = (
        rich(file, data, RICH[other]) for other in [*RICH][: [*RICH].index(name) + 1]
    )
    file.write_text(yaml.safe_dump(plain))
    changed_there = {leaf for study in earlier for leaf in leaves(study)}
    before = loaded(file, plain)
    names = {run: kind.run_id(case) for run, (kind, case) in before.items()}
    digests = {run: kind.digest(case) for run, (kind, case) in before.items()}
    scenes = {run: kind.build(case, BED) for run, (kind, case) in before.items()}
    changes: dict[str, set[str]] = {}
    stuck: dict[str, Any] = {}
    for field, value in leaves(plain):
        if field.rpartition(".")[2] in TOLD_APART_BY or (field, value) in changed_there:
            continue
        for other in others(value):
            try:
                after = loaded(file, with_value(plain, field, other))
                assert set(after) == set(before), field
                renamed = {run for run, (kind, case) in after.items()
                           if kind.run_id(case) != names[run]}  # fmt: skip
                built = {run: kind.build(case, BED) for run, (kind, case) in after.items()
                         if run not in renamed}  # fmt: skip
            except InputError:
                continue
            for run, scene in built.items():
                assert not differs(scenes[run], scene), f"{field} changes the script of {run}"
                kind, case = after[run]
                if kind.digest(case) == digests[run]:
                    assert said(scenes[run]) == said(scene), f"{field} changes case.json of {run}"
            changes[field] = renamed
            break
        else:  # beside the others of the study, a field may have to be at its default
            if value and not field.endswith(BOUND):
                stuck[field] = value
    assert not stuck, f"no other values are accepted of {stuck}"
    print(f"\n{name}")
    for field, renamed in changes.items():
        print(f"  {field}: {', '.join(sorted(renamed)) or 'none'}")
        for block, kept in UNCHANGED.items():
            if f"{field}.".startswith(f"{block}."):
                assert not renamed & kept, f"{field} renames {renamed}"


@pytest.mark.parametrize("block", ["removal", "roughness"])
def test_what_the_report_reads_concerns_no_other_scene(made: Made, block: str) -> None:
    blocks = {
        "removal": {"coefficient_m2_n": 2e-11, "target_depth_m": 1e-6},
        "roughness": {"turned": {"feed_m": 1e-4, "nose_radius_m": 8e-4}, "target_ra_m": 2e-7},
    }
    plain = made(copy.deepcopy(blocks))
    blocks[block][[*blocks[block]][-1]] = 2.5e-7
    other = made(blocks)
    for name, kind in SCENES.items():
        assert kind.run_id(other) == kind.run_id(plain)
        assert (kind.digest(other) != kind.digest(plain)) is (name == "process")


def fields_of(schema: Any, name: str = "", kind: str = "") -> Iterator[tuple[str, str]]:
    """Pattern of the dotted name of each field, with the kind of the block that it is in."""
    if "$ref" in schema:
        schema = SCHEMA["$defs"][schema["$ref"].rpartition("/")[2]]
    for option in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from fields_of(option, name, kind)
    if schema.get("type") not in (None, "object", "array", "null"):
        yield name, kind
    own = schema.get("properties", {})
    kind = own.get("kind", {}).get("const", kind)
    entries = {**own, r"[^.]+": schema.get("additionalProperties"), r"\d+": schema.get("items")}
    entries |= {str(number): item for number, item in enumerate(schema.get("prefixItems", ()))}
    for key, part in entries.items():
        if isinstance(part, Mapping):
            yield from fields_of(part, rf"{name}\.{key}" if name else key, kind)


SAME_FIELDS = {
    r"media\.": r"media\.(classes\.[^.]+\.)?",
    r"workpieces\.each\.\d+\.": r"(workpieces\.each\.\d+|workpiece)\.",
}
"""Patterns of blocks, and of those that may stand for them."""

NOT_OF_A_CASE = {
    r"fidelity\.tolerance", r"fidelity\.quantity", r"fidelity\.quantity\.\d+",
    r"motion\.path\.file", r"bowl\.file", r"bowl\.unit",
}  # fmt: skip
"""Fields that others take the place of before there is a case."""

REFUSED = {r"bowl\.facet_size_m mesh"}
"""Fields that a kind of block refuses."""


def test_the_rich_studies_have_every_field(written: tuple[Path, dict[str, Any]]) -> None:
    """A new field must stand in one of them, unless its default does already."""
    file, small = written
    there = defaultdict(set)
    file.parent.mkdir()
    file.write_text("")
    for changes in (*RICH.values(), OWN):
        plain = rich(file, small, changes)
        values = {"bowl.kind": "cylinder", **dict(leaves(plain))}
        for field in values:
            block = field.rpartition(".")[0]
            kinds = [values.get(f"{'.'.join(block.split('.')[:depth])}.kind", "")
                     for depth in range(len(block.split(".")), 0, -1)]  # fmt: skip
            there[next(filter(None, kinds), "")].add(field)
    missing = set()
    for name, kind in fields_of(SCHEMA):
        if name.split("\\.")[0] in (*OF_NO_RUN, "fidelities") or name in NOT_OF_A_CASE:
            continue
        for block, same in SAME_FIELDS.items():
            if name.startswith(block) and "classes" not in name:
                name = same + name.removeprefix(block)
        if not any(re.fullmatch(name, field) for field in there[kind]):
            missing.add(f"{name} {kind}")
    assert missing <= REFUSED
