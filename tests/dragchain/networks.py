"""Network frames for tests: a real one, and random ones with and without equal forces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.frames import FLOOR, ROD, SIDE, NetworkFrame, frame_of

REAL = Path(__file__).parent / "data" / "real_frame"
RADIUS_M = 0.003


def real_frame() -> NetworkFrame:
    """A frame of the study `uhlmann2015`: 1422 balls, 3442 contacts, 37 of them on the rod."""
    contacts, balls = (pd.read_parquet(REAL / f"{name}.parquet") for name in ("contacts", "balls"))
    return frame_of(contacts, balls, int(balls["step"][0]), float(balls["time_s"][0]), 0.7)


def random_frame(
    seed: int, *, edge: int = 6, levels: int | None = None, jitter: float = 0.3
) -> NetworkFrame:
    """A lattice of balls, out of place by `jitter` radii at the most, with random forces.

    The rod is on the low end of x, the side on the high one, the floor below. Every near pair
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
        (ROD, np.argsort(x)[:edge], (-1.0, 0.0, 0.0)),
        (SIDE, np.argsort(-np.hypot(x, y))[: 3 * edge], (1.0, 0.0, 0.0)),
        (FLOOR, np.argsort(z)[: edge * edge // 2], (0.0, 0.0, -1.0)),
    ]
    away = np.concatenate(
        [grid[b] - grid[a], *(np.tile(way, (len(on), 1)) for _, on, way in walls)]
    )
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    ball = np.concatenate([a, *(on for _, on, _ in walls)])
    other = np.concatenate([1 + b, *(np.full(len(on), body) for body, on, _ in walls)])
    order = random.permutation(len(ball))
    count = len(ball)
    size = random.integers(1, levels + 1, count) if levels else random.exponential(size=count)
    force = -size[:, None] * away + 0.2 * random.normal(size=(count, 3))
    point = grid[ball] + RADIUS_M * away
    contacts = pd.DataFrame(
        {
            "a_id": 1 + ball,
            "b_id": other,
            **{f"point_{axis}_m": point[:, k] for k, axis in enumerate("xyz")},
            **{f"force_{axis}_n": force[:, k] for k, axis in enumerate("xyz")},
            "normal_force_n": size.astype(np.float64),
        }
    ).iloc[order]
    balls = pd.DataFrame({"ball_id": np.arange(1, len(grid) + 1), "radius_m": RADIUS_M})
    balls[["x_m", "y_m", "z_m"]] = grid
    return frame_of(contacts, balls, seed, 0.5, float(random.uniform(-3.0, 3.0)))
