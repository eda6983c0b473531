"""Hostile studies: no input becomes code, and a mistake is named as what it is."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from attack.calls import main_of, refused
from attack.ground import STUDY, new_project, tiny_study, write_study
from made_study import put

pytestmark = [pytest.mark.engine, pytest.mark.slow]

REFUSED, ACCEPTED = "refused, and named", "accepted"
HARMLESS = "harmless: the same commands"

ANSWERED_IN_S = 5.0
"""A study is answered in 5 s; processor time that is allowed."""


def checked(project: Path, named: tuple[str, ...], study: str) -> str:
    """What `dragdeck check` says of a study; no input may become code.

    Parameters
    ----------
    named : tuple of str
        Regular expressions, all of which a message that refuses matches.
    """
    said = main_of("dragdeck", ["check", study], project, ANSWERED_IN_S)
    assert not list(project.rglob("pwned")), f"an input became code: {said.tail}"
    if said.status == 2 and "usage:" in said.text:  # argparse refuses what looks like an option
        return REFUSED
    if refused(said, *named):
        return REFUSED
    return HARMLESS if _made_same_commands(project, study) else ACCEPTED


def _made_same_commands(project: Path, study: str) -> bool:
    """Whether input scripts with foreign text hold the commands of the harmless study.

    False: no foreign text to tell by.
    """
    data = project / "studies" / study / "study.yaml"
    text = data.read_text(encoding="utf-8", errors="replace") if data.is_file() else ""
    if not any(part in text for part in ("pwned", "{{", "a &", "aaaaaaaa")):
        return False
    unknown = main_of("dragdeck", ["step", "render", study, "drop_test", "?"], project)
    for run in sorted(set(re.findall(r"[A-Za-z0-9._-]{4,}", unknown.text))):
        main_of("dragdeck", ["step", "render", study, "drop_test", run], project)
    decks = list(project.rglob("in.liggghts"))
    assert decks, f"no input script: {unknown.tail}"
    for deck in decks:
        for line in commands(deck.read_text(encoding="utf-8")):
            foreign = "pwned" in line or "49" in line.split()[:1] or line.split()[:1] == ["b"]
            assert not foreign, f"an input became code: {line}"
    return True


def commands(deck: str) -> list[str]:
    """Commands of an input script as LIGGGHTS reads them: lines joined, then remarks removed."""
    joined = re.sub(r"&[ \t]*\n", "", deck.replace("\r", "\n"))
    lines = [re.sub(r"#.*", "", line).strip() for line in joined.split("\n")]
    return [line for line in lines if line]


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

_SHAPE = "workpiece.shape"
_REFUSED_FIELDS: tuple[tuple[str, Change, tuple[str, ...]], ...] = (
    ("the transient is the path", {"motion.transient_m": 0.005026548245743669}, ("transient_m",)),
    ("a sweep of nothing", {"sweep": {"": [1]}}, ("sweep",)),
    ("a sweep of dots", {"sweep": {"motion..speed_m_s": [1]}}, ("motion..speed_m_s",)),
    ("a sweep of __class__", {"sweep": {"__class__": [1]}}, ("__class__",)),
    ("1,000,000 cases", {"sweep": {"seed": list(range(1000)), "motion.speed_m_s":
                                   [0.01 + 1e-6 * n for n in range(1000)]}}, ("cases",)),
    ("5000 ranks", {"fidelities.quick.ranks": 5000}, ("ranks",)),
    ("a time step of twice the Rayleigh time", {"fidelities.quick.timestep_fraction": 2.0},
     ("timestep_fraction",)),
    ("a workpiece shorter than its immersion",
     {"bowl.height_m": 0.03, "motion.immersion_depth_m": 0.029}, ("immersion|height|floor",)),
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
    ("three mistakes", {"bowl.radius_m": -1, "media.count": "many", "motion.speed_m_s": 0},
     ("radius_m", "count", "speed_m_s", r"line \d|yaml:\d")),
)  # fmt: skip

_CHANGED: dict[str, Study] = {
    **{name: row for item in _INJECTIONS.items() for name, row in _injected(*item).items()},
    **{f"material {name!a}": (_renamed("steel", name), ("material",), (REFUSED,), STUDY)
       for name in _MATERIALS},
    **{f"study name {name!a}": ({}, ("name|study",), (REFUSED,), name) for name in _NAMES},
    **{f"study folder {name[:20]!a}": ({}, ("name|study|usage",), (REFUSED,), name)
       for name in _FOLDERS},
    **{what: (change, named, (REFUSED,), STUDY) for what, change, named in _REFUSED_FIELDS},
}  # fmt: skip


@pytest.mark.attack(sample=2)
@pytest.mark.parametrize("attack", _CHANGED.values(), ids=_CHANGED)
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
