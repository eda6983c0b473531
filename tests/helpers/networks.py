"""Network frames for tests: a real one, and random ones with and without equal forces."""

import numpy as np
import pandas as pd
from paths import DATA

from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, NetworkFrame, frame_of

REAL = DATA / "real_frame"
RADIUS_M = 0.003


def real_frame() -> NetworkFrame:
    """A frame of the study `uhlmann2015`: 1422 particles, 3442 contacts, 37 of them on the
    workpiece."""
    contacts, particles = (
        pd.read_parquet(REAL / f"{name}.parquet") for name in ("contacts", "particles")
    )
    return frame_of(
        contacts, particles, int(particles["step"][0]), float(particles["time_s"][0]), 0.7
    )


def random_frame(
    seed: int, *, edge: int = 6, levels: int | None = None, jitter: float = 0.3
) -> NetworkFrame:
    """A lattice of particles, out of place by `jitter` radii at the most, with random forces.

    The workpiece is on the low end of x, the side on the high one, the floor below. Every near pair
    touches with a chance of 0.6; normal forces are whole numbers up to `levels`, so that many
    are equal, or else exponentially distributed.
    """
    random = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(edge)] * 3), axis=-1).reshape(-1, 3) * 2.0 * RADIUS_M
    grid += random.uniform(-jitter, jitter, grid.shape) * RADIUS_M - edge * RADIUS_M
    gaps = np.linalg.norm(grid[:, None] - grid[None], axis=-1)
    first, second = np.nonzero(np.triu(gaps < 3.2 * RADIUS_M, 1))
    kept = random.random(first.size) < 0.6
    first, second = first[kept], second[kept]
    swap = random.random(first.size) < 0.5
    a, b = np.where(swap, second, first), np.where(swap, first, second)
    x, y, z = grid.T
    walls = [
        (WORKPIECE, np.argsort(x)[:edge], (-1.0, 0.0, 0.0)),
        (SIDE, np.argsort(-np.hypot(x, y))[: 3 * edge], (1.0, 0.0, 0.0)),
        (FLOOR, np.argsort(z)[: edge * edge // 2], (0.0, 0.0, -1.0)),
    ]
    away = np.concatenate(
        [grid[b] - grid[a], *(np.tile(way, (len(on), 1)) for _, on, way in walls)]
    )
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    particle = np.concatenate([a, *(on for _, on, _ in walls)])
    other = np.concatenate([1 + b, *(np.full(len(on), body) for body, on, _ in walls)])
    order = random.permutation(len(particle))
    count = len(particle)
    size = random.integers(1, levels + 1, count) if levels else random.exponential(size=count)
    force = -size[:, None] * away + 0.2 * random.normal(size=(count, 3))
    point = grid[particle] + RADIUS_M * away
    contacts = pd.DataFrame(
        {
            "a_id": 1 + particle,
            "b_id": other,
            **{f"point_{axis}_m": point[:, k] for k, axis in enumerate("xyz")},
            **{f"force_{axis}_n": force[:, k] for k, axis in enumerate("xyz")},
            "normal_force_n": size.astype(np.float64),
        }
    ).iloc[order]
    particles = pd.DataFrame({"particle_id": np.arange(1, len(grid) + 1), "radius_m": RADIUS_M})
    particles[["x_m", "y_m", "z_m"]] = grid
    return frame_of(contacts, particles, seed, 0.5, float(random.uniform(-3.0, 3.0)))


R = 0.003


def make_frame(
    centres: dict[int, tuple[float, float, float]], contacts: list[tuple[int, int, float]],
    direction_rad: float = 0.0, walls: dict[int, tuple[float, float, float]] | None = None,
) -> NetworkFrame:  # fmt: skip
    """Build a frame of particles of radius R from (particle, other, normal force) rows.

    Forces between particles act along the line of centres; those of walls along the direction in
    `walls` from the particle's centre to the wall.
    """
    towards = {FLOOR: (0.0, 0.0, -1.0), SIDE: (1.0, 0.0, 0.0), WORKPIECE: (-1.0, 0.0, 0.0)} | (
        walls or {}
    )
    rows = []
    for a, b, normal in contacts:
        line = np.subtract(centres[b], centres[a]) if b > 0 else np.array(towards[b])
        unit = line / np.linalg.norm(line)
        reach = np.linalg.norm(line) / 2 if b > 0 else R
        point = np.array(centres[a]) + reach * unit
        rows.append([1, 0.5, a, b, *point, *(-normal * unit), normal])
    columns = ["step", "time_s", "a_id", "b_id", "point_x_m", "point_y_m", "point_z_m"]
    columns += ["force_x_n", "force_y_n", "force_z_n", "normal_force_n"]
    table = pd.DataFrame(rows, columns=columns)
    particles = pd.DataFrame(
        [[1, particle, *centre, R] for particle, centre in centres.items()],
        columns=["step", "particle_id", "x_m", "y_m", "z_m", "radius_m"],
    )
    return frame_of(table, particles, 1, 0.5, direction_rad)


def row(count: int, first: int = 1, y: float = 0.0) -> dict[int, tuple[float, float, float]]:
    """Return touching particles along x at height 0.03 m."""
    return {first + k: (2 * R * k, y, 0.03) for k in range(count)}
