"""Hostile studies: no input becomes code, and a mistake is named as what it is."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from attack.calls import REFUSED, UNNAMED, Said, judged, main_of
from attack.case import Attack, Got
from attack.ground import STUDY, new_project, tiny_study, write_study

HARMLESS = "harmless: the same commands"
WARNED = "warned, and named"
CODE = "an input became code"
ANSWERED_IN_S = 5.0
"""A study is answered in 5 s; processor time that is allowed."""

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

Change = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class Hostile:
    """A change of the tiny study, and what a message must name."""

    name: str
    change: Change | str | bytes
    named: tuple[str, ...]
    expected: tuple[str, ...] = (REFUSED,)
    study: str = STUDY


def put(**values: object) -> Change:
    """Set fields: dots are double underscores."""

    def change(data: dict[str, Any]) -> None:
        for path, value in values.items():
            *above, name = path.split("__")
            place = data
            for part in above:
                place = place.setdefault(part, {})
            place[name] = value

    return change


def _text(old: str, new: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        assert old in text, old
        return text.replace(old, new, 1)

    return change


def _renamed(old: str, new: str) -> Change:
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


def _injections() -> Iterator[Hostile]:
    for what, text in _INJECTIONS.items():
        expected = (REFUSED, HARMLESS)
        yield Hostile(f"title with {what}", put(title=text), ("title",), expected)
        yield Hostile(f"material with {what}", _renamed("steel", text), ("material",))
        fidelity = {"youngs_modulus_scale": 1e-3, "timestep_fraction": 0.6, "ranks": 1}
        named = put(fidelities={text: fidelity}, fidelity=text)
        yield Hostile(f"fidelity with {what}", named, ("fidelit",))
        swept = put(sweep={"title": ["b", text]})
        yield Hostile(f"swept title with {what}", swept, ("title",), expected)
        if "\x00" not in text and len(text) < 250:
            yield Hostile(
                f"study folder with {what}", put(), ("name|study",), study=text.replace("/", "")
            )
    for name in (
        "a material",
        "a/b",
        "../b",
        "-",
        "a;b",
        "#",
        "!include",
        "\N{GREEK SMALL LETTER MU}",
    ):
        yield Hostile(f"material {name!a}", _renamed("steel", name), ("material",))
    for name in ("../studies/tiny", "tiny/../tiny", "./tiny", "tiny/", "tiny/.", ".", ""):
        yield Hostile(f"study name {name!a}", put(), ("name|study",), study=name)
    for name in ("a b", "--help-me", "x" * 250, "#", ".hidden"):
        yield Hostile(f"study folder {name[:20]!a}", put(), ("name|study|usage",), study=name)


_LEAVES = {
    "a list": "[1, 2]",
    "a mapping": "{a: 1}",
    "null": "null",
    "text": "'word'",
    "NaN": ".nan",
    "infinity": ".inf",
    "1e999": "1e999",
    "a date": "2020-01-01",
    "bytes": "!!binary aGVsbG8=",
    "a truth value": "true",
    "5000 digits": "9" * 5000,
    "1:30": "1:30",
    "0300": "0300",
    "0x10": "0x10",
    "-1": "-1",
    "zero": "0",
    "1_000": "1_000",
}
_FIELDS = {
    "media.count": "count: 140",
    "bowl.radius_m": "radius_m: 0.024",
    "motion.speed_m_s": "speed_m_s: 0.04",
    "outputs.network_hz": "network_hz: 100",
    "fidelities.quick.ranks": "ranks: 1",
}


def _leaves() -> Iterator[Hostile | tuple[str, Callable[[str], str], str]]:
    for field, stands in _FIELDS.items():
        key = stands.partition(":")[0]
        for what, value in _LEAVES.items():
            named = rf"{re.escape(key)}|line \d|yaml:\d"
            yield f"{field} is {what}", _text(stands, f"{key}: {value}"), named


_TEXTS: dict[str, tuple[str | bytes, tuple[str, ...]]] = {
    "empty file": (b"", ("study.yaml",)),
    "only a remark": (b"# nothing\n", ("study.yaml",)),
    "random bytes": (bytes(range(256)) * 20, ("study.yaml",)),
    "a NUL": (b"title: a\x00b\n", ("study.yaml",)),
    "50,000 brackets": (b"title: " + b"[" * 50_000, ("study.yaml",)),
    "50,000 braces": (b"{a: " * 50_000, ("study.yaml",)),
    "a tag of Python": (
        b"title: !!python/object/apply:os.system ['touch pwned']\n",
        ("study.yaml",),
    ),
    "another tag": (b"title: !thing 3\n", ("study.yaml",)),
    "aliases that multiply": (
        b"a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
        + b"".join(
            f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n".encode() for n in range(1, 12)
        ),
        ("study.yaml",),
    ),
    "an alias to itself": (b"title: &a [*a]\n", ("study.yaml",)),
    "two documents": (b"title: a\n---\ntitle: b\n", ("study.yaml",)),
    "a list as key": (b"? [a, b]\n: c\n", ("study.yaml",)),
    "null as key": (b"~: 1\n", ("study.yaml",)),
    "a date as key": (b"2020-01-01: 1\n", ("study.yaml",)),
    "a tab": (b"title:\n\t- a\n", ("study.yaml",)),
    "a set": (b"title: !!set {a, b}\n", ("study.yaml",)),
    "an ordered map": (b"title: !!omap [a: 1]\n", ("study.yaml",)),
    "a time of day": (b"title: 12:30:45\nmedia: 3\n", ("study.yaml",)),
}


def _merge(*changes: Change) -> Change:
    def change(data: dict[str, Any]) -> None:
        for each in changes:
            each(data)

    return change


_SHAPE = "workpiece__shape"
_REFUSED_FIELDS: tuple[tuple[str, Change, tuple[str, ...]], ...] = (
    ("a key that is unknown", put(speeed=1), ("speeed",)),
    ("a near miss of a key", put(motion__speed_ms=1), ("speed_ms", "speed_m_s")),
    ("a pair twice", put(**{"pairs__steel-ceramic": {"restitution": 0.1, "friction": 0.9}}),
     ("steel-ceramic", "ceramic-steel")),
    ("the transient is the path", put(motion__transient_m=0.005026548245743669), ("transient_m",)),
    ("the transient is beyond the path", put(motion__transient_m=1.0), ("transient_m",)),
    ("an energy ratio of a bed that moves", put(filling__energy_ratio=1), ("energy_ratio",)),
    ("a sweep of a sweep", put(sweep={"sweep": [{"seed": [1, 2]}]}), ("sweep",)),
    ("a sweep into a sweep", put(sweep={"sweep.seed": [[1, 2]]}), ("sweep",)),
    ("a sweep of nothing", put(sweep={"": [1]}), ("sweep",)),
    ("a sweep of dots", put(sweep={"motion..speed_m_s": [1]}), ("motion..speed_m_s",)),
    ("a sweep of __class__", put(sweep={"__class__": [1]}), ("__class__",)),
    ("a sweep value twice", put(sweep={"seed": [1, 1]}), ("sweep|seed",)),
    ("a sweep value twice, written otherwise", put(sweep={"seed": [1, 1.0]}), ("sweep|seed",)),
    ("no sweep value", put(sweep={"seed": []}), ("seed",)),
    ("1,000,000 cases", put(sweep={"seed": list(range(1000)), "motion.speed_m_s":
                                   [0.01 + 1e-6 * n for n in range(1000)]}), ("cases",)),
    ("5000 ranks", put(fidelities__quick__ranks=5000), ("ranks",)),
    ("a truth value as direction", put(motion__path__direction=True), ("direction",)),
    ("a time step of twice the Rayleigh time", put(fidelities__quick__timestep_fraction=2.0),
     ("timestep_fraction",)),
    ("a step in which a particle crosses its radius", put(motion__speed_m_s=500.0), ("speed",)),
    ("a workpiece shorter than its immersion",
     put(bowl__height_m=0.03, motion__immersion_depth_m=0.029), ("immersion|height|floor",)),
    ("a gap below a diameter", put(motion__path__radius_m=0.017), (r"gap|motion\.path",)),
    ("a path out of the bowl", put(motion__path__radius_m=0.1), ("radius_m|bowl|wall",)),
    ("more particles than the bowl takes", put(media__count=1_000_000), ("count|height",)),
    ("1e15 particles", put(media__count=10**15), ("count",)),
    ("particles of no size", put(media__radius_mean_m=1e-300), ("radius_mean_m",)),
    ("facets of 1 nm", put(workpiece__shape__facet_size_m=1e-9), ("facet_size_m",)),
    ("facets of 1 nm in the bowl", put(bowl__facet_size_m=1e-9), ("facet_size_m",)),
    ("a path of 1e9 revolutions", put(motion__path__revolutions=1e9), ("revolutions|steps",)),
    ("a speed of 1e-12 m/s", put(motion__speed_m_s=1e-12), ("speed_m_s|steps",)),
    ("a force sampled at 1e30 Hz", put(outputs__workpiece_force_hz=1e30), ("workpiece_force_hz",)),
    ("1e18 checkpoints", put(outputs__n_checkpoints=10**18), ("n_checkpoints",)),
    ("a mesh out of the project", put(**{_SHAPE: {"kind": "mesh", "unit": "mm",
     "file": "../../../../../../etc/passwd"}}), ("passwd|file",)),
    ("a mesh that is /dev/zero", put(**{_SHAPE: {"kind": "mesh", "unit": "mm",
     "file": "/dev/zero"}}), ("zero|file",)),
    ("a mesh that is a folder", put(**{_SHAPE: {"kind": "mesh", "unit": "mm", "file": "."}}),
     ("file",)),
    ("three mistakes", _merge(put(bowl__radius_m=-1), put(media__count="many"),
     put(motion__speed_m_s=0)), ("radius_m", "count", "speed_m_s", r"line \d|yaml:\d")),
)  # fmt: skip

_SLIPS: tuple[tuple[str, Change, tuple[str, ...]], ...] = (
    ("immersion 50 for mm", put(motion__immersion_depth_m=50), ("immersion_depth_m", r"\bmm\b")),
    ("workpiece of radius 5 for mm", put(workpiece__shape__radius_m=5), ("radius_m", r"\bmm\b")),
    ("bowl of radius 40 for mm", put(bowl__radius_m=40), ("radius_m", r"\bmm\b")),
    ("bowl 100 high for mm", put(bowl__height_m=100), ("height_m", r"\bmm\b")),
    ("particles of radius 3.27 for mm", put(media__radius_mean_m=3.27),
     ("radius_mean_m", r"\bmm\b")),
    ("modulus 77 for GPa", put(materials__ceramic__youngs_modulus_pa=77),
     ("youngs_modulus_pa", "GPa")),
    ("density 2.656 for g/cm3", put(materials__ceramic__density_kg_m3=2.656),
     ("density_kg_m3", "g/cm")),
    ("a speed of 10 m/s", put(motion__speed_m_s=10), ("speed_m_s", "m/s|mm")),
    ("network at 1e-9 Hz", put(outputs__network_hz=1e-9), ("network_hz",)),
    ("gravity of 9810 mm/s2", put(gravity_m_s2=9810), ("gravity_m_s2", "mm")),
    ("a path of radius 8 mm", put(motion__path__radius_m=8), ("radius_m", r"\bmm\b")),
)  # fmt: skip


def study_attacks(seed: int) -> Iterator[Attack]:
    """Every hostile study; the seed changes nothing."""
    for hostile in _injections():
        act = partial(_study, hostile)
        yield Attack("study", hostile.name, act, hostile.expected, 1.5)
    for what, change, named in _REFUSED_FIELDS:
        act = partial(_study, Hostile(what, change, named))
        yield Attack("study", what, act, (REFUSED,), 1.5)
    for what, change, named in _SLIPS:
        act = partial(_study, Hostile(what, change, named))
        yield Attack("study", f"unit slip: {what}", act, (REFUSED, WARNED), 1.5)
    for what, change_text, key in _leaves():
        act = partial(_text_study, change_text, key)
        plain = what.endswith((" is 0x10", " is 1_000"))
        numbers = (REFUSED, UNNAMED, WARNED, "accepted")  # they are numbers, if odd ones
        yield Attack("study", what, act, numbers if plain else (REFUSED,), 1.5)
    for what, (content, named) in _TEXTS.items():
        yield Attack("study", what, partial(_bytes_study, content, named), (REFUSED,), 1.5)
    for encoding in ("utf-16", "utf-32", "latin-1", "cp037"):
        act = partial(_encoded, encoding)
        yield Attack("study", f"in {encoding}", act, (REFUSED,), 1.5)
    for encoding in ("utf-8-sig", "utf-8"):
        act = partial(_encoded, encoding)
        yield Attack("study", f"in {encoding}", act, ("accepted",), 1.5)


def _study(hostile: Hostile, folder: Path) -> Got:
    project = new_project(folder / "project")
    data = tiny_study()
    assert callable(hostile.change)
    hostile.change(data)
    write_study(project, data)
    if hostile.study not in ("", ".") and "/" not in hostile.study:
        (project / "studies" / STUDY).rename(project / "studies" / hostile.study)
    return checked(project, hostile.named, hostile.study)


def _text_study(change: Callable[[str], str], key: str, folder: Path) -> Got:
    project = new_project(folder / "project")
    text = change((Path(__file__).parents[2] / "data/tiny_study.yaml").read_text(encoding="utf-8"))
    write_study(project, text)
    return checked(project, (key,))


def _bytes_study(content: bytes, named: tuple[str, ...], folder: Path) -> Got:
    project = new_project(folder / "project")
    write_study(project, "").write_bytes(content)
    return checked(project, named)


def _encoded(encoding: str, folder: Path) -> Got:
    project = new_project(folder / "project")
    data = {**tiny_study(), "title": "Gef\u00e4\u00df"}
    file = write_study(project, data)
    text = "\n".join(["# Gef\u00e4\u00df", file.read_text(encoding="utf-8")])
    file.write_bytes(text.encode(encoding))
    return checked(project, ("study.yaml", "utf-8|encoding"))


def checked(
    project: Path, named: tuple[str, ...], study: str = STUDY, patience_s: float = ANSWERED_IN_S
) -> Got:
    """What `dragdeck check` says of a study, and what becomes of its input scripts."""
    said = main_of("dragdeck", ["check", study], project, patience_s)
    if list(project.rglob("pwned")):
        return Got(CODE, said.tail)
    if said.status == 0:
        return _decks_of(project, study) or _warned(said, named)
    if said.status == 2 and "usage:" in said.text:  # argparse refuses what looks like an option
        return Got(REFUSED, said.tail)
    return judged(said, *named)


def _warned(said: Said, named: tuple[str, ...]) -> Got:
    warnings = " ".join(re.findall(r"(?ims)^warning:.*", said.text))
    if warnings and all(re.search(name, warnings, re.IGNORECASE) for name in named):
        return Got(WARNED, said.tail)
    return Got("accepted", said.tail)


def _decks_of(project: Path, study: str) -> Got | None:
    """Whether the input scripts hold the commands of the harmless study; None: nothing to tell."""
    data = project / "studies" / study / "study.yaml"
    text = data.read_text(encoding="utf-8", errors="replace") if data.is_file() else ""
    if "pwned" not in text and "{{" not in text and "a &" not in text and "aaaaaaaa" not in text:
        return None
    unknown = main_of("dragdeck", ["step", "render", study, "drop_test", "?"], project)
    for run in sorted(set(re.findall(r"[A-Za-z0-9._-]{4,}", unknown.text))):
        main_of("dragdeck", ["step", "render", study, "drop_test", run], project)
    decks = list(project.rglob("in.liggghts"))
    if not decks:
        return Got(UNNAMED, unknown.tail)
    for deck in decks:
        for line in commands(deck.read_text(encoding="utf-8")):
            if "pwned" in line or "49" in line.split()[:1] or line.split()[:1] == ["b"]:
                return Got(CODE, line)
    return Got(HARMLESS)


def commands(deck: str) -> list[str]:
    """Commands of an input script as LIGGGHTS reads them: lines joined, then remarks removed."""
    joined = re.sub(r"&[ \t]*\n", "", deck.replace("\r", "\n"))
    lines = [re.sub(r"#.*", "", line).strip() for line in joined.split("\n")]
    return [line for line in lines if line]
