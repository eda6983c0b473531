"""The damping of a contact in LIGGGHTS."""

import math


def damping_ratio(restitution: float) -> float:
    """Damping ratio ``|ln e| / sqrt(ln^2 e + pi^2)`` of a contact with restitution e.

    LIGGGHTS multiplies it with ``sqrt(5/6)`` in its Hertz law (Tsuji, Tanaka and Ishida 1992,
    Powder Technology 71, 239-250).
    """
    log = math.log(restitution)
    return -log / math.hypot(log, math.pi)


def tangential_damping_ratio(poissons_ratio: float) -> float:
    """Tangential damping constant over the normal one, for two bodies of one material.

    The engine's law takes both from the stiffnesses, ``sqrt(k_t / k_n)`` with
    ``k_n = 2 E* sqrt(R* d)`` and ``k_t = 8 G* sqrt(R* d)``.
    """
    return math.sqrt(2 * (1 - poissons_ratio) / (2 - poissons_ratio))
