"""What a script sets up: fixes, contact models, properties, templates, regions and box."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from dragdeck.physics.rounding import is_prime
from dragdeck.script.commands import EngineCommand
from dragdeck.script.flow import Script

_LARGEST = 1e60
"""Numbers beyond it are no lengths, moduli or rates, and their powers overflow."""

_MOST_TYPES = 1000
_SMALLEST_SEED, _LARGEST_SEED = 10_000, 2**31
_ELSEWHERE = {
    "nve/nonspherical", "check/timestep/bond", "hybrid/gran", "nve/sphere/omp", "gran/omp",
    "mesh/surface/deform", "cfd/coupling/force/implicit/accumulated", "bond/gran",
    "incremental_history",
}  # fmt: skip
_SIZES = {"block": slice(1, 7), "cylinder": slice(2, 7), "sphere": slice(1, 5)}
"""Words of a region that are its sizes."""


def as_number(word: str) -> float | None:
    """The number that a word is; None for another word, or one with an unknown value."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if abs(value) < _LARGEST else None


def as_numbers(words: Sequence[str], count: int = 0) -> list[float] | None:
    """The numbers that all words are; None also for fewer than `count` of them."""
    values = [value for word in words if (value := as_number(word)) is not None]
    return values if len(values) == len(words) >= count else None


def certain(commands: Iterable[EngineCommand]) -> list[str]:
    """The words of the last of some commands; none where that depends on what is not known."""
    last: list[str] = []
    for command in reversed([*commands]):
        if last and command.words != last:
            return []
        last = command.words
        if not command.uncertain:
            return last
    return []


@dataclass(eq=False)
class Fix:
    """A fix or a pair style, and where it is set.

    Attributes
    ----------
    command : EngineCommand
    words : sequence of str
        From its style on.
    begin, end : float
        Places in the script; the end is infinite if it stays.
    """

    command: EngineCommand
    words: Sequence[str]
    begin: float = 0
    end: float = math.inf

    @property
    def id(self) -> str:
        """Its name."""
        return self.command.words[1]

    def after(self, word: str, count: int = 1) -> Sequence[str]:
        """So many words after a keyword; none without it."""
        at = self.words.index(word) + 1 if word in self.words else len(self.words)
        return self.words[at : at + count]

    def word(self, keyword: str) -> str:
        """The word after a keyword; empty without."""
        return "".join(self.after(keyword))

    def number(self, keyword: str) -> float | None:
        """The number after a keyword; None if there is none."""
        return as_number(self.word(keyword))

    def vector(self, keyword: str) -> list[float] | None:
        """The three numbers after a keyword; none without it, None if they are not known."""
        return as_numbers(self.after(keyword, 3), 3) if keyword in self.words else []

    def has(self, keyword: str) -> str:
        """Which model of this kind its contact law has; empty where it is off."""
        model = self.word(keyword)
        return "" if model in ("off", "no", "none") else model


class Region(NamedTuple):
    """Volume, m3, and bounds of a region, m."""

    volume: float
    bounds: Sequence[tuple[float, float]]


class Facts:
    """What is known of a script."""

    def __init__(self, script: Script) -> None:
        self.script = script
        cleared = [at for at, c in enumerate(script.commands) if c.words[0] == "clear"]
        self._begin = max(cleared, default=-1)

    @cached_property
    def fixes(self) -> list[Fix]:
        """Every fix, one that is set again in a loop once."""
        fixes: dict[tuple[str, ...], Fix] = {}
        active: dict[str, Fix] = {}
        for place, command in enumerate(self.script.commands):
            words = command.words
            ended = [*active] if words[0] == "clear" else words[1:2] * (words[0] == "unfix")
            for fix in filter(None, [active.pop(name, None) for name in ended]):
                fix.end = place
            if words[0] == "fix" and len(words) > 3:
                key = (str(place > self._begin), *words)
                active[words[1]] = fixes.setdefault(key, Fix(command, words[3:], place))
                active[words[1]].end = math.inf
        return list(fixes.values())

    def styled(self, *styles: str) -> list[Fix]:
        """Fixes whose style begins with one of these."""
        return [fix for fix in self.fixes if fix.words[0].startswith(styles)]

    def present(self, *styles: str) -> list[Fix]:
        """Those that are set after the last ``clear``."""
        return [fix for fix in self.styled(*styles) if fix.begin > self._begin]

    def named(self, *names: str) -> Iterator[EngineCommand]:
        """Commands of these names."""
        return (command for command in self.script.commands if command.words[0] in names)

    def last(self, name: str) -> list[str]:
        """The words after the last command of this name; none without, or if not known."""
        return certain(self.named(name))[1:]

    @cached_property
    def laws(self) -> list[Fix]:
        """Contact laws of particles that are written as ``model ...``."""
        pairs = [Fix(command, command.words[1:]) for command in self.named("pair_style")]
        return [pair for pair in pairs if pair.words[:1] == ["gran"] and pair.word("model")]

    @cached_property
    def walls(self) -> list[Fix]:
        """The same of walls."""
        walls = self.styled("wall/gran")
        return [wall for wall in walls if wall.words[0] == "wall/gran" and wall.word("model")]

    def properties(self, name: str) -> list[Fix]:
        """The fixes that set a property."""
        return [fix for fix in self.styled("property/global") if fix.words[1:2] == [name]]

    def values(self, name: str) -> list[float]:
        """The values of a property at last, by type or by pair of types; none if not known."""
        words = certain(fix.command for fix in self.properties(name))[5:]
        return as_numbers(words[2 if words[:1] == ["peratomtypepair"] else 1 :]) or []

    def matrix(self, name: str) -> list[list[float]]:
        """A property of pairs of types, row by row; none if not known."""
        values = self.values(name)
        types = math.isqrt(len(values))
        rows = [values[begin : begin + types] for begin in range(0, len(values), types or 1)]
        return rows if types**2 == len(values) else []

    @cached_property
    def meshes(self) -> dict[str, Fix]:
        """The meshes by their ids."""
        return {fix.id: fix for fix in self.styled("mesh/surface")}

    def wall_types(self, wall: Fix) -> list[int]:
        """The types of a wall's materials, from 1."""
        meshes = [self.meshes[name] for name in self.meshes_of(wall) if name in self.meshes]
        types = [fix.number("type") for fix in meshes or [wall]]
        return [int(number) for number in types if number and 0 < number < _MOST_TYPES]

    def meshes_of(self, wall: Fix) -> Sequence[str]:
        """Names of the meshes of a wall."""
        return wall.after("meshes", int(wall.number("n_meshes") or 0))

    @cached_property
    def radii(self) -> list[float] | None:
        """Radii of all templates, m; None if one is not known, or particles come from a file."""
        words = [fix.after("radius", 2) for fix in self.styled("particletemplate/")]
        values = as_numbers([w[1] if len(w) == 2 and w[0] == "constant" else "" for w in words])
        others = [*self.named("read_restart", "read_data", "create_atoms"), *self.styled("adapt")]
        return None if others else values or None

    @cached_property
    def sphere_m3(self) -> float:
        """Volume of the smallest template; NaN if not known."""
        return 4 / 3 * math.pi * min(self.radii or [math.nan]) ** 3 or math.nan

    @cached_property
    def density_kg_m3(self) -> float:
        """Smallest density of a template; NaN if not known."""
        words = ["".join(fix.after("density", 2)[1:]) for fix in self.styled("particletemplate/")]
        return min(as_numbers(words) or [math.nan]) or math.nan

    @cached_property
    def regions(self) -> dict[str, Region | None]:
        """Blocks, cylinders and spheres by their names; None for one that is not known."""
        commands: dict[str, list[EngineCommand]] = {}
        for command in self.named("region"):
            commands.setdefault("".join(command.words[1:2]), []).append(command)
        return {name: _region(certain(of_name)[2:]) for name, of_name in commands.items()}

    @cached_property
    def box(self) -> Region | None:
        """The simulation box, if the script creates it."""
        return self.regions.get("".join(self.last("create_box")[1:2]))

    @cached_property
    def timestep_s(self) -> float | None:
        """The last time step, s."""
        return as_number("".join(self.last("timestep")[:1]))

    @cached_property
    def gravity(self) -> list[float] | None:
        """The acceleration of gravity at last, m/s2; zero without, None if not known."""
        fixes = [fix for fix in self.styled("gravity") if fix.end == math.inf]
        if not fixes:
            return [0.0, 0.0, 0.0]
        size, vector = as_number("".join(fixes[-1].words[1:2])), fixes[-1].vector("vector")
        if size is None or not vector or not any(vector) or not certain(f.command for f in fixes):
            return None
        return [size * part / math.hypot(*vector) for part in vector]

    @cached_property
    def dialect(self) -> str:
        """Which LIGGGHTS the script is for, as far as it shows: empty for the public 3.8."""
        for words in (command.words for command in self.named("pair_style")):
            style = "".join(words[1:2])
            if style.startswith("gran/") or (style == "gran" and "model" not in words):
                return "a fork, or a version before 3.0: a contact law without `model`"
        every = {word for command in self.script.commands for word in command.words}
        if elsewhere := _ELSEWHERE & every:
            return f"PFM or a commercial or bonded fork: {min(elsewhere)}"
        refused = sum(refused for *_, refused in self.seeds) > 1  # 3.8 stops at the first
        return "PFM, or a version before 3.4: seeds that 3.8 refuses" if refused else ""

    @cached_property
    def seeds(self) -> list[tuple[Fix, int, bool]]:
        """Seeds of templates, distributions and insertions, and whether 3.8 refuses each."""
        fixes = self.styled("particletemplate/", "particledistribution/", "insert/")
        words = [(fix, fix.word("seed") or "".join(fix.words[1:2])) for fix in fixes]
        seeds = [(fix, int(word)) for fix, word in words if word.isdecimal() and len(word) < 20]
        return [(fix, seed, not _SMALLEST_SEED < seed < _LARGEST_SEED or not is_prime(seed))
                for fix, seed in seeds]  # fmt: skip


def _region(words: Sequence[str]) -> Region | None:
    kind = "".join(words[:1])
    values = as_numbers(words[_SIZES[kind]]) if kind in _SIZES else None
    if not values or {"side", "lattice", "move"} & set(words):
        return None
    match kind, values:
        case "block", [left, right, front, back, low, high]:
            bounds = [(left, right), (front, back), (low, high)]
            return Region((right - left) * (back - front) * (high - low), bounds)
        case "sphere", [*centre, radius] if len(centre) == 3:
            bounds = [(place - radius, place + radius) for place in centre]
            return Region(4 / 3 * math.pi * radius**3, bounds)
        case "cylinder", [*centre, radius, low, high] if len(centre) == 2 and words[1] in "xyz":
            bounds = [(place - radius, place + radius) for place in centre]
            bounds.insert("xyz".index(words[1]), (low, high))
            return Region(math.pi * radius**2 * (high - low), bounds)
    return None
