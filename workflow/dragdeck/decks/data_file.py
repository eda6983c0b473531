"""LIGGGHTS's data file: the particles that a run starts with, one by one."""

from collections.abc import Sequence
from dataclasses import dataclass

Vector = tuple[float, float, float]
Box = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Body:
    """A particle: type from 1, radius m, density kg/m3, place m, velocity m/s, spin rad/s."""

    type: int
    radius_m: float
    density_kg_m3: float
    position_m: Vector
    velocity_m_s: Vector = (0.0, 0.0, 0.0)
    spin_rad_s: Vector = (0.0, 0.0, 0.0)


def data_file(title: str, types: int, box: Box, bodies: Sequence[Body]) -> str:
    """The text of a data file; its numbers read back exactly.

    Parameters
    ----------
    title : str
        First line.
    types : int
        Number of material types.
    box : three pairs of float
        Lower and upper bound along x, y and z, m.
    bodies : sequence of Body
        Numbered from 1. Velocities are written if one of them moves.
    """
    bounds = [
        f"{low!r} {high!r} {axis}lo {axis}hi" for axis, (low, high) in zip("xyz", box, strict=True)
    ]
    lines = [title, "", f"{len(bodies)} atoms", f"{types} atom types", "", *bounds]
    lines += ["", "Atoms", ""]
    lines += [
        f"{number} {body.type} {2 * body.radius_m!r} {body.density_kg_m3!r} "
        + _numbers(body.position_m)
        for number, body in enumerate(bodies, start=1)
    ]
    if any(any(body.velocity_m_s) or any(body.spin_rad_s) for body in bodies):
        lines += ["", "Velocities", ""]
        lines += [
            f"{number} {_numbers((*body.velocity_m_s, *body.spin_rad_s))}"
            for number, body in enumerate(bodies, start=1)
        ]
    return "\n".join([*lines, ""])


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
