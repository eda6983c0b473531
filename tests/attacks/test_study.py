"""Hostile studies: no input becomes code, and a mistake is named as what it is."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from attack.calls import main_of, refused
from attack.checked import ACCEPTED, ANSWERED_IN_S, HARMLESS, REFUSED, WARNED, checked
from attack.ground import STUDY, TINY_STUDY, new_project, tiny_study, write_study
from made_study import put

pytestmark = [pytest.mark.engine, pytest.mark.slow]

_SHELL = "shell touch pwned"
_INJECTIONS = {
    "a newline": f"a\n{_SHELL}",
    "a carriage return": f"a\r{_SHELL}",
    "a line separator": f"a\u2028{_SHELL}",
    "a form feed": f"a\x0c{_SHELL}",
    "a continued line": "a &",
    "a quote": f'a" & {_SHELL} "',
    "a dollar": "a ${part} $(touch pwned)",
    "a backquote": "a `touch pwned`",
    "a NUL": "a\x00b",
    "an escape sequence": "a\x1b[2J",
    "Jinja": "{{ 7 * 7 }}{% raw %}",
    "100,000 letters": "a" * 100_000,
}

Change = Mapping[str, Any] | Callable[[dict[str, Any]], None]
"""Fields by their dotted names, or what is done to the study."""


def _renamed(old: str, new: str) -> Callable[[dict[str, Any]], None]:
    """A material of another name, wherever it stands."""

    def change(data: dict[str, Any]) -> None:
        data["materials"][new] = data["materials"].pop(old)
        data["pairs"] = {
            "-".join(new if part == old else part for part in key.split("-")): value
            for key, value in data["pairs"].items()
        }
        for owner in ("media", "bowl", "workpiece"):
            if data[owner]["material"] == old:
                data[owner]["material"] = new

    return change


Study = tuple[Change, tuple[str, ...], tuple[str, ...], str]
"""A change of the tiny study, what a message must name, what is wanted, and the study's name."""

_SETTINGS = {"youngs_modulus_scale": 1e-3, "timestep_fraction": 0.6, "ranks": 1}


def _injected(what: str, text: str) -> dict[str, Study]:
    """Text in every place of a study that takes some."""
    chosen = {"fidelities": {text: _SETTINGS}, "fidelity": text}
    swept = {"sweep": {"title": ["b", text]}}
    found: dict[str, Study] = {
        f"title with {what}": ({"title": text}, ("title",), (REFUSED, HARMLESS), STUDY),
        f"material with {what}": (_renamed("steel", text), ("material",), (REFUSED,), STUDY),
        f"fidelity with {what}": (chosen, ("fidelit",), (REFUSED,), STUDY),
        f"swept title with {what}": (swept, ("title",), (REFUSED, HARMLESS), STUDY),
    }
    if "\x00" not in text and len(text) < 250:
        folder = text.replace("/", "")
        found[f"study folder with {what}"] = ({}, ("name|study",), (REFUSED,), folder)
    return found


_MATERIALS = ("a material", "a/b", "../b", "-", "a;b", "#", "!include", "\N{GREEK SMALL LETTER MU}")
_NAMES = ("../studies/tiny", "tiny/../tiny", "./tiny", "tiny/", "tiny/.", ".", "")
_FOLDERS = ("a b", "--help-me", "x" * 250, "#", ".hidden")

_LEAVES = {
    "a list": "[1, 2]", "a mapping": "{a: 1}", "null": "null", "text": "'word'", "NaN": ".nan",
    "infinity": ".inf", "1e999": "1e999", "a date": "2020-01-01", "bytes": "!!binary aGVsbG8=",
    "a truth value": "true", "5000 digits": "9" * 5000, "1:30": "1:30", "0300": "0300",
    "0x10": "0x10", "-1": "-1", "zero": "0", "1_000": "1_000",
}  # fmt: skip
_FIELDS = {
    "media.count": "count: 140",
    "bowl.radius_m": "radius_m: 0.024",
    "motion.speed_m_s": "speed_m_s: 0.04",
    "outputs.network_hz": "network_hz: 100",
    "fidelities.quick.ranks": "ranks: 1",
}


_TEXTS: dict[str, bytes] = {
    "empty file": b"",
    "only a remark": b"# nothing\n",
    "random bytes": bytes(range(256)) * 20,
    "a NUL": b"title: a\x00b\n",
    "50,000 brackets": b"title: " + b"[" * 50_000,
    "50,000 braces": b"{a: " * 50_000,
    "a tag of Python": b"title: !!python/object/apply:os.system ['touch pwned']\n",
    "another tag": b"title: !thing 3\n",
    "aliases that multiply": b"a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
    + b"".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n".encode() for n in range(1, 12)),
    "an alias to itself": b"title: &a [*a]\n",
    "two documents": b"title: a\n---\ntitle: b\n",
    "a list as key": b"? [a, b]\n: c\n",
    "null as key": b"~: 1\n",
    "a date as key": b"2020-01-01: 1\n",
    "a tab": b"title:\n\t- a\n",
    "a set": b"title: !!set {a, b}\n",
    "an ordered map": b"title: !!omap [a: 1]\n",
    "a time of day": b"title: 12:30:45\nmedia: 3\n",
}


_SHAPE = "workpiece.shape"
_REFUSED_FIELDS: tuple[tuple[str, Change, tuple[str, ...]], ...] = (
    ("a key that is unknown", {"speeed": 1}, ("speeed",)),
    ("a near miss of a key", {"motion.speed_ms": 1}, ("speed_ms", "speed_m_s")),
    ("a pair twice", {"pairs.steel-ceramic": {"restitution": 0.1, "friction": 0.9}},
     ("steel-ceramic", "ceramic-steel")),
    ("the transient is the path", {"motion.transient_m": 0.005026548245743669}, ("transient_m",)),
    ("the transient is beyond the path", {"motion.transient_m": 1.0}, ("transient_m",)),
    ("an energy ratio of a bed that moves", {"filling.energy_ratio": 1}, ("energy_ratio",)),
    ("a sweep of a sweep", {"sweep": {"sweep": [{"seed": [1, 2]}]}}, ("sweep",)),
    ("a sweep into a sweep", {"sweep": {"sweep.seed": [[1, 2]]}}, ("sweep",)),
    ("a sweep of nothing", {"sweep": {"": [1]}}, ("sweep",)),
    ("a sweep of dots", {"sweep": {"motion..speed_m_s": [1]}}, ("motion..speed_m_s",)),
    ("a sweep of __class__", {"sweep": {"__class__": [1]}}, ("__class__",)),
    ("a sweep value twice", {"sweep": {"seed": [1, 1]}}, ("sweep|seed",)),
    ("a sweep value twice, written otherwise", {"sweep": {"seed": [1, 1.0]}}, ("sweep|seed",)),
    ("no sweep value", {"sweep": {"seed": []}}, ("seed",)),
    ("1,000,000 cases", {"sweep": {"seed": list(range(1000)), "motion.speed_m_s":
                                   [0.01 + 1e-6 * n for n in range(1000)]}}, ("cases",)),
    ("5000 ranks", {"fidelities.quick.ranks": 5000}, ("ranks",)),
    ("a truth value as direction", {"motion.path.direction": True}, ("direction",)),
    ("a time step of twice the Rayleigh time", {"fidelities.quick.timestep_fraction": 2.0},
     ("timestep_fraction",)),
    ("a step in which a particle crosses its radius", {"motion.speed_m_s": 500.0}, ("speed",)),
    ("a workpiece shorter than its immersion",
     {"bowl.height_m": 0.03, "motion.immersion_depth_m": 0.029}, ("immersion|height|floor",)),
    ("a gap below a diameter", {"motion.path.radius_m": 0.017}, (r"gap|motion\.path",)),
    ("a path out of the bowl", {"motion.path.radius_m": 0.1}, ("radius_m|bowl|wall",)),
    ("more particles than the bowl takes", {"media.count": 1_000_000}, ("count|height",)),
    ("1e15 particles", {"media.count": 10**15}, ("count",)),
    ("particles of no size", {"media.radius_mean_m": 1e-300}, ("radius_mean_m",)),
    ("facets of 1 nm", {"workpiece.shape.facet_size_m": 1e-9}, ("facet_size_m",)),
    ("facets of 1 nm in the bowl", {"bowl.facet_size_m": 1e-9}, ("facet_size_m",)),
    ("a path of 1e9 revolutions", {"motion.path.revolutions": 1e9}, ("revolutions|steps",)),
    ("a speed of 1e-12 m/s", {"motion.speed_m_s": 1e-12}, ("speed_m_s|steps",)),
    ("a force sampled at 1e30 Hz", {"outputs.workpiece_force_hz": 1e30}, ("workpiece_force_hz",)),
    ("1e18 checkpoints", {"outputs.n_checkpoints": 10**18}, ("n_checkpoints",)),
    ("a mesh out of the project", {_SHAPE: {"kind": "mesh", "unit": "mm",
     "file": "../../../../../../etc/passwd"}}, ("passwd|file",)),
    ("a mesh that is /dev/zero", {_SHAPE: {"kind": "mesh", "unit": "mm",
     "file": "/dev/zero"}}, ("zero|file",)),
    ("a mesh that is a folder", {_SHAPE: {"kind": "mesh", "unit": "mm", "file": "."}},
     ("file",)),
    ("three mistakes", {"bowl.radius_m": -1, "media.count": "many", "motion.speed_m_s": 0},
     ("radius_m", "count", "speed_m_s", r"line \d|yaml:\d")),
)  # fmt: skip

_SLIPS: tuple[tuple[str, Change, tuple[str, ...]], ...] = (
    ("immersion 50 for mm", {"motion.immersion_depth_m": 50}, ("immersion_depth_m", r"\bmm\b")),
    ("workpiece of radius 5 for mm", {"workpiece.shape.radius_m": 5}, ("radius_m", r"\bmm\b")),
    ("bowl of radius 40 for mm", {"bowl.radius_m": 40}, ("radius_m", r"\bmm\b")),
    ("bowl 100 high for mm", {"bowl.height_m": 100}, ("height_m", r"\bmm\b")),
    ("particles of radius 3.27 for mm", {"media.radius_mean_m": 3.27},
     ("radius_mean_m", r"\bmm\b")),
    ("modulus 77 for GPa", {"materials.ceramic.youngs_modulus_pa": 77},
     ("youngs_modulus_pa", "GPa")),
    ("density 2.656 for g/cm3", {"materials.ceramic.density_kg_m3": 2.656},
     ("density_kg_m3", "g/cm")),
    ("a speed of 10 m/s", {"motion.speed_m_s": 10}, ("speed_m_s", "m/s|mm")),
    ("network at 1e-9 Hz", {"outputs.network_hz": 1e-9}, ("network_hz",)),
    ("gravity of 9810 mm/s2", {"gravity_m_s2": 9810}, ("gravity_m_s2", "mm")),
    ("a path of radius 8 mm", {"motion.path.radius_m": 8}, ("radius_m", r"\bmm\b")),
)  # fmt: skip


_CHANGED: dict[str, Study] = {
    **{name: row for item in _INJECTIONS.items() for name, row in _injected(*item).items()},
    **{f"material {name!a}": (_renamed("steel", name), ("material",), (REFUSED,), STUDY)
       for name in _MATERIALS},
    **{f"study name {name!a}": ({}, ("name|study",), (REFUSED,), name) for name in _NAMES},
    **{f"study folder {name[:20]!a}": ({}, ("name|study|usage",), (REFUSED,), name)
       for name in _FOLDERS},
    **{what: (change, named, (REFUSED,), STUDY) for what, change, named in _REFUSED_FIELDS},
    **{f"unit slip: {what}": (change, named, (REFUSED, WARNED), STUDY)
       for what, change, named in _SLIPS},
}  # fmt: skip


@pytest.mark.attack(rows=_CHANGED, sample=2)
def test_a_hostile_study_is_refused(attack: Study, tmp_path: Path) -> None:
    change, named, wanted, name = attack
    project = new_project(tmp_path / "project")
    data = tiny_study()
    if callable(change):
        change(data)
    else:
        put(data, change)
    write_study(project, data)
    if name not in ("", ".") and "/" not in name:
        (project / "studies" / STUDY).rename(project / "studies" / name)
    assert checked(project, named, name) in wanted


_SPELT = {
    f"{field} is {what}": (stands, value)
    for field, stands in _FIELDS.items()
    for what, value in _LEAVES.items()
}


@pytest.mark.attack(rows=_SPELT, sample=1)
def test_a_value_of_another_kind_is_refused(attack: tuple[str, str], tmp_path: Path) -> None:
    stands, value = attack
    key = stands.partition(":")[0]
    text = TINY_STUDY.read_text(encoding="utf-8")
    assert stands in text
    project = new_project(tmp_path / "project")
    write_study(project, text.replace(stands, f"{key}: {value}", 1))
    if value in ("0x10", "1_000"):  # they are numbers, if odd ones
        refused(main_of("dragdeck", ["check", STUDY], project, ANSWERED_IN_S))
    else:
        assert checked(project, (rf"{re.escape(key)}|line \d|yaml:\d",)) == REFUSED


@pytest.mark.attack(rows=_TEXTS, sample=1)
def test_a_file_that_is_no_study_is_refused(attack: bytes, tmp_path: Path) -> None:
    project = new_project(tmp_path / "project")
    write_study(project, "").write_bytes(attack)
    assert checked(project, ("study.yaml",)) == REFUSED


_ENCODINGS = {
    **{f"in {name}": (name, REFUSED) for name in ("utf-16", "utf-32", "latin-1", "cp037")},
    **{f"in {name}": (name, ACCEPTED) for name in ("utf-8-sig", "utf-8")},
}


@pytest.mark.attack(rows=_ENCODINGS, sample=1)
def test_another_encoding_is_refused(attack: tuple[str, str], tmp_path: Path) -> None:
    encoding, wanted = attack
    project = new_project(tmp_path / "project")
    file = write_study(project, {**tiny_study(), "title": "Gef\u00e4\u00df"})
    text = "\n".join(["# Gef\u00e4\u00df", file.read_text(encoding="utf-8")])
    file.write_bytes(text.encode(encoding))
    assert checked(project, ("study.yaml", "utf-8|encoding")) == wanted
