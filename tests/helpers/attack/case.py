"""An attack, what came of it, and which attacks are tried when time is short."""

import random
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

SEED = 13
"""Of every random choice of the suite, unless --attack-seed says otherwise."""

NOT_RUN = "not run"
"""How an outcome begins that says why an attack was not made."""


@dataclass(frozen=True)
class Got:
    """What came of an attack: one of the outcomes that a row compares, and what was seen."""

    outcome: str
    seen: str = ""

    @property
    def was_run(self) -> bool:
        return not self.outcome.startswith(NOT_RUN)


@dataclass(frozen=True)
class Attack:
    """One way to break dragdeck or dragchain.

    Attributes
    ----------
    kind, name : str
    act : callable
        Attacks, and returns what came of it; takes what the kind's test gives.
    expected : sequence of str
        The outcomes of which any one is wanted.
    seconds : float
        About how long it takes, so that a sample fits into the time that there is.
    """

    kind: str
    name: str
    act: Callable[..., Got]
    expected: Sequence[str]
    seconds: float = 1.0

    def __str__(self) -> str:
        return f"{self.kind}: {self.name}"


@dataclass(frozen=True)
class Row:
    """A line of the table in which the suite ends."""

    kind: str
    name: str
    expected: str
    got: str
    seen: str
    state: str = field(default="as expected")

    @classmethod
    def of(cls, attack: Attack, got: Got) -> "Row":
        if not got.was_run:
            state = NOT_RUN
        else:
            state = "as expected" if got.outcome in attack.expected else "unexpected"
        wanted = " | ".join(attack.expected)
        return cls(attack.kind, attack.name, wanted, got.outcome, got.seen, state)


SECONDS = {
    "kill": 24.0,
    "disk": 17.0,
    "checkpoint": 8.0,
    "input": 4.0,
    "result": 8.0,
    "study": 6.0,
    "template": 4.0,
    "dump": 6.0,
    "mesh": 6.0,
    "workflow": 0.0,
}
"""Of each kind, how long the part may take that belongs to every test of the project."""


def sample(attacks: Iterable[Attack], seed: int) -> list[Attack]:
    """Attacks of one kind that together take no longer than `SECONDS` says, by chance."""
    waiting = list(attacks)
    random.Random(seed).shuffle(waiting)
    left = {kind: seconds for kind, seconds in SECONDS.items()}
    chosen = []
    for attack in waiting:
        if attack.seconds <= left[attack.kind]:
            left[attack.kind] -= attack.seconds
            chosen.append(attack)
    return chosen
