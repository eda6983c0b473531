"""Edge radii after half an hour at other speeds of rotation, from the radius at 60 rpm.

    python benchmarks/edge_prediction.py RUN... docs/data/prediction

RUN are runs of `planetary_cutter` with `removal`, at several speeds of spin, all with
the same packings. By the volume balance of `dragchain.report.removal.edge_rows`, with the removal
of each case along the edges, W, the square of the radius grows in proportion to W from its start.
"""

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import chi2

from dragchain.loading.wear import FILE, Wear
from dragchain.statistics.estimate import NORMAL_QUANTILE
from dragdeck.records.case import load_case

R60_UM, R60_HALF_UM = 22.5, 2.0
"""Measured at 60 rpm; the half-width of its interval is not in the abstract: assumed."""
START_UM, BAND = 8.0, 2
"""Radius of a ground edge, and band (1/4 of a particle's radius): assumed."""
TURNS = (90, 120)


def actions(runs: Sequence[Path]) -> pd.DataFrame:
    """Of each run and band along the edges: the action up to its far side, W, and its half-width.

    The half-width of the 95 % interval is that of a single run, relative.
    """
    rows = []
    for run in runs:
        given, edges = load_case(run).inputs, Wear.read(run / FILE).edges
        assert edges is not None
        for band, far_m in enumerate(edges.distance_m[1:]):
            own = edges.within_w.at(band)
            rows.append(
                {
                    "spin_rpm": given["motion.spin.rpm"],
                    "seed": given["seed"],
                    "within_mm": 1e3 * far_m,
                    "action_w": own.value,
                    "relative_half_width": own.relative_half_width,
                }
            )
    return pd.DataFrame(rows).sort_values(["within_mm", "spin_rpm", "seed"])


def ratios(found: pd.DataFrame, band: int = BAND) -> pd.DataFrame:
    """The action over that at 60 rpm, by spin, and what the packings say of its interval.

    Sums over the packings; their half-widths are those of the runs, joined as independent. In
    ``packings_p`` the probability of packings as different as these or more (chi squared).
    """
    own = found[found["within_mm"] == sorted(found["within_mm"].unique())[band]]
    own = own.assign(square=(own["action_w"] * own["relative_half_width"]) ** 2)
    sums = own.groupby("spin_rpm")[["action_w", "square"]].agg(["sum", "count"])
    mean = sums["action_w", "sum"] / sums["action_w", "count"]
    half = np.sqrt(sums["square", "sum"]) / sums["action_w", "sum"]
    deviation = np.log(own["action_w"]) - np.log(own["spin_rpm"].map(mean))
    errors = own["relative_half_width"] / NORMAL_QUANTILE
    degrees = len(own) - len(sums)
    table = pd.DataFrame({"ratio": mean / mean[60], "packings": sums["action_w", "count"]})
    for end, sign in (("low", -1), ("high", 1)):
        table[f"ratio_ci95_{end}"] = table["ratio"] * np.exp(sign * np.hypot(half, half[60]))
    table["packings_p"] = chi2.sf(((deviation / errors) ** 2).sum(), degrees)
    return table.drop(index=60)


def radii(growth: Iterable[float], start: float = START_UM, r60: float = R60_UM) -> list[float]:
    """Radii in um where the removal along the edges is so many times that at 60 rpm."""
    return [float(np.sqrt(start**2 + (r60**2 - start**2) * one)) for one in growth]


def budget(found: pd.DataFrame) -> pd.DataFrame:
    """The predicted radii, and what each assumption alone makes of them.

    The first row has the 95 % interval of the ratios of the actions. The
    last one joins the shifts of all to each side: the root of the sum of their squares.
    """
    free = ratios(found).loc[[*TURNS]]
    base, low, high = (free[f"ratio{end}"].tolist() for end in ("", "_ci95_low", "_ci95_high"))
    middle, geared = np.array(radii(base)), radii([n / 60 for n in TURNS])
    faster = [
        [one * (n / 60) ** power for one, n in zip(base, TURNS, strict=True)]
        for power in (-0.2, 0.2)
    ]
    bands = [radii(ratios(found, band)["ratio"].loc[[*TURNS]]) for band in (0, 4)]
    errors = [radii(base, r60=R60_UM + error) for error in (-R60_HALF_UM, R60_HALF_UM)]
    linear = [START_UM + (R60_UM - START_UM) * one for one in base]
    rows: list[tuple[str, str, Sequence[Sequence[float]]]] = [
        ("load along the edges", "95 % CI of the runs", [radii(low), radii(high)]),
        ("initial radius 8 µm", "5 to 12 µm", [radii(base, start) for start in (5.0, 12.0)]),
        ("exactly 22.5 µm at 60 rpm", "± 2 µm", errors),
        ("band of 1/4 particle radius", "1/16 to 1", bands),
        ("carousel at one speed", "geared to the spindle: W proportional to n", [geared]),
        ("k independent of the speed", "k proportional to n^±0.2", [*map(radii, faster)]),
        ("arc by volume balance", "radius proportional to the removal", [linear]),
    ]
    table = [(name, given, _sides(middle, each)) for name, given, each in rows]
    joined = np.linalg.norm([sides for *_, sides in table], axis=0) * [[-1.0], [1.0]]
    table.append(("all of these", "root of the sum of squares", joined))
    table.append(("geometry, media, immersion", "W from constant to proportional to n",
                  _sides(middle, [radii([1.0, 1.0]), geared])))  # fmt: skip
    return pd.DataFrame([
        {"assumption": name, "range": given,
         **{f"r{n}_um{end}": middle[k] + shift[k] for k, n in enumerate(TURNS)
            for end, shift in (("", 0 * sides[0]), ("_low", sides[0]), ("_high", sides[1]))}}
        for name, given, sides in table
    ])  # fmt: skip


def _sides(middle: np.ndarray, each: Sequence[Sequence[float]]) -> np.ndarray:
    """The largest shifts down and up, (2, 2)."""
    shifts = np.array(each) - middle
    return np.array([shifts.min(axis=0, initial=0.0), shifts.max(axis=0, initial=0.0)])


if __name__ == "__main__":
    *runs, out = map(Path, sys.argv[1:])
    out.mkdir(exist_ok=True)
    found = actions(runs)
    found.to_csv(out / "edge_action.csv", index=False, float_format="%.5g")
    ratios(found).to_csv(out / "edge_ratios.csv", float_format="%.4g")
    budget(found).to_csv(out / "edge_radius.csv", index=False, float_format="%.4g")
