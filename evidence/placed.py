"""Particles and plane walls that are placed one by one: the deck of ``collide.in.j2``."""

from collections.abc import Sequence
from dataclasses import dataclass

from dragdeck.decks.deck import Deck


@dataclass(frozen=True)
class ExactPlane:
    """An exact plane.

    Attributes
    ----------
    name : str
        Of the engine's fix, and of its force columns.
    type : int
        Material type, from 1.
    shape : str
        As the engine wants it, for example ``zplane 0.0``.
    """

    name: str
    type: int
    shape: str


@dataclass(frozen=True, kw_only=True)
class CollideDeck(Deck):
    """What the template sees."""

    walls: Sequence[ExactPlane]
    steps: int


COLLIDE = "collide.in.j2"
