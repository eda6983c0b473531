"""How LIGGGHTS split the simulation box between its ranks."""

import math
import re

from dragdeck.records.run import AcceptanceCheck, Decomposition, ParticlesPerRank


def decomposition(screen: str) -> Decomposition | None:
    """The split that LIGGGHTS printed; None where it printed none."""
    grids = re.findall(r"^ *(\d+) by (\d+) by (\d+) MPI processor grid$", screen, re.MULTILINE)
    if not grids:
        return None
    loads = re.findall(r"^Nlocal: +(\S+) ave (\d+) max (\d+) min$", screen, re.MULTILINE)
    particles = None
    if loads:
        mean, most, least = loads[-1]
        particles = ParticlesPerRank(mean=float(mean), most=int(most), least=int(least))
    x, y, z = (int(count) for count in grids[-1])
    return Decomposition(grid=(x, y, z), particles=particles)


def ranks_check(split: Decomposition | None, ranks: int) -> AcceptanceCheck:
    """Whether LIGGGHTS ran on the ranks that were asked for.

    A LIGGGHTS that was built for another MPI than its launcher's runs once per rank, each
    with all particles, and all write the same files.
    """
    name, limit = "MPI ranks as requested", f"{ranks} rank{'s' if ranks > 1 else ''}"
    if split is None:
        return AcceptanceCheck(
            code="ranks",
            name=name,
            passed=False,
            seen="LIGGGHTS printed no processor grid",
            limit=limit,
        )
    seen = " by ".join(map(str, split.grid))
    if split.particles:
        least, most = split.particles.least, split.particles.most
        seen += f", {least:,} to {most:,} particles per rank"
    passed = math.prod(split.grid) == ranks
    return AcceptanceCheck(code="ranks", name=name, passed=passed, seen=seen, limit=limit)
