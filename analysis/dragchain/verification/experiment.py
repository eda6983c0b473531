"""What a run of the `collide` scene models: its ``case.json``."""

from typing import ClassVar, Literal

from pydantic import PositiveFloat, PositiveInt

from dragchain.contact_law.hertz import Elastic
from dragchain.documents import Document, Part


class Material(Part):
    """The material of a type."""

    youngs_modulus_pa: PositiveFloat
    poissons_ratio: float
    density_kg_m3: PositiveFloat

    @property
    def elastic(self) -> Elastic:
        """Its elastic constants."""
        return Elastic(self.youngs_modulus_pa, self.poissons_ratio)


class Pair(Part):
    """What two types, the smaller first, do to each other."""

    types: tuple[PositiveInt, PositiveInt]
    restitution: PositiveFloat
    friction: float


class Body(Part):
    """A particle: its type, from 1, and its radius."""

    type: PositiveInt
    radius_m: PositiveFloat


class Wall(Part):
    """A plane: its name and its type, from 1."""

    name: str
    type: PositiveInt


class Meeting(Part):
    """A contact: particles by number, from 1, or a wall by name; the value that is varied."""

    particle: PositiveInt
    partner: int | str
    value: float


class Experiment(Document):
    """The content of ``case.json``.

    Attributes
    ----------
    test, number, heading, series : str, int, str, str
        Name, number and title of the test, and the materials that meet.
    vary : str
        What differs from contact to contact.
    steps_per_contact : int
        Time steps in the shortest contact of the run.
    impacts, angle_deg : int, float
        Of a bouncing particle and of an incline alone.
    """

    made_by: ClassVar[str] = "snakemake verify"

    scene: Literal["collide"]
    run: str
    test: str
    number: int
    heading: str
    series: str
    vary: str
    steps_per_contact: PositiveInt
    impacts: int | None = None
    angle_deg: float | None = None
    timestep_s: PositiveFloat
    rayleigh_time_s: PositiveFloat
    gravity_m_s2: tuple[float, float, float]
    limit_force: bool
    types: tuple[Material, ...]
    pairs: tuple[Pair, ...]
    bodies: tuple[Body, ...]
    walls: tuple[Wall, ...]
    contacts: tuple[Meeting, ...]

    def type_of(self, body: int | str) -> int:
        """Type of a particle, by its number, or of a wall, by its name."""
        if isinstance(body, int):
            return self.bodies[body - 1].type
        return next(wall.type for wall in self.walls if wall.name == body)
