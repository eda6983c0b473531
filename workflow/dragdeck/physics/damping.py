"""The damping of a contact in LIGGGHTS."""

import math


def damping_ratio(restitution: float) -> float:
    """Damping ratio ``|ln e| / sqrt(ln^2 e + pi^2)`` of a contact with restitution e.

    LIGGGHTS multiplies it with ``sqrt(5/6)`` in its Hertz law (Tsuji, Tanaka and Ishida 1992,
    Powder Technology 71, 239-250).
    """
    log = math.log(restitution)
    return -log / math.hypot(log, math.pi)
