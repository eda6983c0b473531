"""What a script sets up: fixes, contact laws, properties, templates, regions and box."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

from dragdeck.physics.rounding import is_prime
from dragdeck.script.commands import EngineCommand
from dragdeck.script.flow import Script

Bounds = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


def number(word: str) -> float | None:
    """The number that a word is; None for another word, or one with an unknown value."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def numbers(words: Sequence[str]) -> list[float] | None:
    """The numbers that all words are."""
    values = [number(word) for word in words]
    return None if None in values else [value for value in values if value is not None]


@dataclass(frozen=True)
class Fix:
    """A fix: its words from the style on, where it is set and, as places in the script, until when.

    Attributes
    ----------
    id : str
    words : sequence of str
    command : EngineCommand
    begin, end : float
        Places among the commands; infinite if it stays.
    """

    id: str
    words: Sequence[str]
    command: EngineCommand
    begin: float
    end: float = math.inf

    def after(self, word: str, count: int = 1) -> Sequence[str]:
        """So many words after a keyword; none without it."""
        at = self.words.index(word) + 1 if word in self.words else len(self.words)
        return self.words[at : at + count]


@dataclass(frozen=True)
class Law:
    """The contact law of the particles, or of a wall."""

    wall: Fix | None
    normal: str
    models: dict[str, str]
    command: EngineCommand

    def has(self, keyword: str) -> str:
        """The model or setting of this keyword; empty where it is off."""
        model = self.models.get(keyword, "off")
        return "" if model in ("off", "no", "none") else model


@dataclass(frozen=True)
class Facts:
    """What is known of a script."""

    script: Script

    @cached_property
    def fixes(self) -> list[Fix]:
        """Every fix, one that is set again in a loop once."""
        fixes: dict[tuple[str, ...], Fix] = {}
        active: dict[str, tuple[str, ...]] = {}
        cleared = 0
        for place, command in enumerate(self.script.commands):
            words = command.words
            ended = active if words[0] == "clear" else words[1:2] if words[0] == "unfix" else ()
            for key in filter(None, [active.pop(name, None) for name in list(ended)]):
                fixes[key] = replace(fixes[key], end=place)
            cleared += words[0] == "clear"
            if words[0] == "fix" and len(words) > 3:
                key = (str(cleared), *words)
                active[words[1]] = key
                fixes.setdefault(key, Fix(words[1], words[3:], command, place))
        return list(fixes.values())

    def styled(self, *styles: str) -> list[Fix]:
        """Fixes whose style begins with one of these."""
        return [fix for fix in self.fixes if fix.words[0].startswith(styles)]

    def present(self, *styles: str) -> list[Fix]:
        """Those that are set after the last ``clear``."""
        cleared = [at for at, c in enumerate(self.script.commands) if c.words[0] == "clear"]
        return [fix for fix in self.styled(*styles) if fix.begin > max(cleared, default=-1)]

    def named(self, *names: str) -> Iterator[EngineCommand]:
        """Commands of these names."""
        return (command for command in self.script.commands if command.words[0] in names)

    def last(self, name: str) -> list[str]:
        """The words after the last command of this name."""
        return next((c.words[1:] for c in reversed(self.script.commands) if c.words[0] == name), [])

    @cached_property
    def laws(self) -> list[Law]:
        """Contact laws that are written as ``model ...``; those of the particles are first."""
        laws = []
        for command in self.named("pair_style"):
            if command.words[1:2] == ["gran"] and "model" in command.words[:-1]:
                laws.append(_law(None, command.words, command))
        for wall in self.styled("wall/gran"):
            if wall.words[0] == "wall/gran" and "model" in wall.words[:-1]:
                laws.append(_law(wall, wall.words, wall.command))
        return laws

    def properties(self, name: str) -> list[Fix]:
        """The fixes that set a property."""
        return [fix for fix in self.styled("property/global") if fix.words[1:2] == [name]]

    def values(self, name: str) -> list[float]:
        """The values of a property at last, by type or by pair of types; none if not known."""
        every = self.properties(name)
        if not every:
            return []
        words = every[-1].words
        return numbers(words[4 if words[2:3] == ["peratomtypepair"] else 3 :]) or []

    def of_pair(self, name: str, first: int, second: int) -> float | None:
        """A property of a pair of types, counted from 1."""
        values = self.values(name)
        types = math.isqrt(len(values))
        known = types**2 == len(values) and 0 < min(first, second) <= max(first, second) <= types
        return values[(first - 1) * types + second - 1] if known else None

    def wall_types(self, wall: Fix) -> list[int]:
        """The types of a wall's materials."""
        fixes = {fix.id: fix for fix in self.styled("mesh/surface")}
        meshes = [fixes[name] for name in self.meshes_of(wall) if name in fixes]
        words = [word for fix in meshes or [wall] for word in fix.after("type")]
        return [int(word) for word in words if word.isdigit()]

    def meshes_of(self, wall: Fix) -> Sequence[str]:
        """Names of the meshes of a wall."""
        (count,) = wall.after("n_meshes") or ("0",)
        return wall.after("meshes", int(count) if count.isdigit() else 0)

    @cached_property
    def radii(self) -> list[float] | None:
        """Radii of all templates, m; None if one is not known, or particles come from a file."""
        templates = self.styled("particletemplate/")
        words = [fix.after("radius", 2) for fix in templates]
        values = [number(w[1]) if len(w) == 2 and w[0] == "constant" else None for w in words]
        others = [*self.named("read_restart", "read_data", "create_atoms"), *self.styled("adapt")]
        if not values or others or any(v is None for v in values):
            return None
        return [value for value in values if value is not None]

    def region(self, name: str) -> Bounds | None:
        """The bounds of a block, cylinder or sphere, m."""
        shape = self._shape(name)
        return shape and shape[1]

    def volume(self, name: str) -> float | None:
        """Volume of a block, cylinder or sphere, m3."""
        shape = self._shape(name)
        return shape and shape[0]

    def _shape(self, name: str) -> tuple[float, Bounds] | None:
        words = next((c.words[2:] for c in self.named("region") if c.words[1:2] == [name]), [])
        begin, end = {"block": (1, 7), "cylinder": (2, 7), "sphere": (1, 5)}.get(
            words[0] if words else "", (0, 0)
        )
        values = numbers(words[begin:end])
        if not values or len(values) < end - begin or {"side", "lattice", "move"} & set(words):
            return None
        if words[0] == "block":
            sides = [(values[0], values[1]), (values[2], values[3]), (values[4], values[5])]
            return math.prod(high - low for low, high in sides), (sides[0], sides[1], sides[2])
        *centre, radius = values[: 3 + (words[0] == "sphere")]
        sides = [(place - radius, place + radius) for place in centre]
        if words[0] == "sphere":
            return 4 / 3 * math.pi * radius**3, (sides[0], sides[1], sides[2])
        sides.insert("xyz".index(words[1]), (values[3], values[4]))
        return math.pi * radius**2 * (values[4] - values[3]), (sides[0], sides[1], sides[2])

    @cached_property
    def box(self) -> Bounds | None:
        """The simulation box, m, if the script creates it."""
        words = self.last("create_box")
        return self.region(words[1]) if len(words) > 1 else None

    @cached_property
    def timestep_s(self) -> float | None:
        """The last time step, s."""
        words = self.last("timestep")
        return number(words[0]) if words else None

    @cached_property
    def gravity(self) -> list[float] | None:
        """The acceleration of gravity at last, m/s2; zero without, None if not known."""
        gravity = [fix for fix in self.styled("gravity") if fix.end == math.inf]
        if not gravity:
            return [0.0, 0.0, 0.0]
        size, vector = number(gravity[-1].words[1]), numbers(gravity[-1].after("vector", 3))
        length = math.hypot(*vector) if vector else 0.0
        if size is None or not vector or not length:
            return None
        return [size * part / length for part in vector]

    @cached_property
    def dialect(self) -> str:
        """Which LIGGGHTS the script is for, as far as it shows: empty for the public 3.8."""
        seeds = [seed for _, seed in self.seeds]
        if any(
            c.words[1:2] == ["gran"] and "model" not in c.words for c in self.named("pair_style")
        ):
            return "a fork, or a version before 3.0: a contact law without `model`"
        if any(c.words[1].startswith("gran/") for c in self.named("pair_style") if c.words[1:]):
            return "a version before 3.0: contact laws as styles of their own"
        for command in self.script.commands:
            for word in _ELSEWHERE & set(command.words):
                return f"PFM or a commercial or bonded fork: {word}"
        if seeds and not any(_accepted(seed) for seed in seeds):
            return "PFM, or a version before 3.4: seeds that the public 3.8 refuses"
        return ""

    @cached_property
    def seeds(self) -> list[tuple[Fix, int]]:
        """Seeds of templates, distributions and insertions."""
        seeds = []
        for fix in self.styled("particletemplate/", "particledistribution/", "insert/"):
            words = fix.after("seed") or fix.words[1:2]
            if words and words[0].isdigit():
                seeds.append((fix, int(words[0])))
        return seeds

    def refused_seeds(self) -> list[tuple[Fix, int]]:
        """Seeds that the public 3.8 refuses."""
        return [(fix, seed) for fix, seed in self.seeds if not _accepted(seed)]


_ELSEWHERE = {
    "nve/nonspherical", "check/timestep/bond", "hybrid/gran", "nve/sphere/omp", "gran/omp",
    "mesh/surface/deform", "cfd/coupling/force/implicit/accumulated", "bond/gran",
}  # fmt: skip


def _accepted(seed: int) -> bool:
    return seed > 10_000 and is_prime(seed)


def _law(wall: Fix | None, words: Sequence[str], command: EngineCommand) -> Law:
    at = words.index("model") + 1
    return Law(wall, words[at], dict(pairwise(words[at + 1 :])), command)
