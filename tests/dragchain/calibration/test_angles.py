"""Angles of surfaces from positions, and the coefficients that measured angles ask for."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dragchain.arrays import Floats
from dragchain.calibration.angle_runs import AngleSet
from dragchain.calibration.angles import drum_angle, exposed, heap_angle
from dragchain.calibration.friction import AngleModel, Posterior, find_friction
from dragchain.calibration.report import write_calibration_report
from dragchain.errors import TableError
from dragdeck.study.calibration import Rig

R = 0.003
RANGES = np.array([(0.05, 1.0), (0.005, 0.4)])


def particles(inside: Callable[[Floats], Floats], reach: float, seed: int) -> tuple[Floats, Floats]:
    """Particles on a jittered lattice, as far as they are inside of something."""
    random = np.random.default_rng(seed)
    line = np.arange(-reach, reach, 1.9 * R)
    centre = np.stack(np.meshgrid(line, line, line)).reshape(3, -1).T + random.uniform(-R, R, 3)
    centre = centre + random.uniform(-0.6 * R, 0.6 * R, centre.shape)
    centre = centre[inside(centre)]
    return centre, np.full(len(centre), R) * random.uniform(0.95, 1.05, len(centre))


def test_what_lies_under_another_particle_is_not_exposed() -> None:
    flat = np.array([[0, 0], [0.5 * R, 0], [1.5 * R, 0], [9 * R, 0]])
    height = np.array([1.0, 2.0, 1.5, 0.0]) * R
    assert exposed(flat, height, np.full(4, R)).tolist() == [False, True, True, True]
    assert not exposed(flat, height, np.array([1, 1.2, 2, 1]) * R)[0]


@pytest.mark.parametrize(("degrees", "bias"), [(15.0, 1.3), (25.0, 0.7), (38.0, 0.4)])
def test_the_slope_of_a_cone(degrees: float, bias: float) -> None:
    """Within its error, without its tip; a flat heap of few layers looks a little flatter."""
    slope, base = np.tan(np.radians(degrees)), 30 * R

    def cone(at: Floats) -> Floats:
        height = slope * (base - np.linalg.norm(at[:, :2], axis=1))
        return (at[:, 2] > 0) & (at[:, 2] < np.minimum(height, slope * 0.9 * base))

    found = np.array([heap_angle(*particles(cone, 32 * R, seed)) for seed in range(8)])
    assert found[:, 0].mean() == pytest.approx(degrees, abs=bias)
    scatter = found[:, 0].std(ddof=1)
    assert 0.4 * scatter < found[:, 1].mean() < 2.5 * scatter


@pytest.mark.parametrize(("degrees", "level"), [(20.0, 0.0), (35.0, -0.3), (45.0, -0.1)])
def test_the_slope_in_a_drum(degrees: float, level: float) -> None:
    """Of the middle of the surface, whatever its level; near the wall it bends down."""
    angle, drum = np.radians(degrees), 16 * R

    def bed(at: Floats) -> Floats:
        along = at[:, 0] * np.cos(angle) + at[:, 1] * np.sin(angle)
        above = at[:, 1] * np.cos(angle) - at[:, 0] * np.sin(angle)
        bent = np.maximum(np.abs(along) - 0.7 * drum, 0) * np.sign(along)
        inside = (np.hypot(at[:, 0], at[:, 1]) < drum) & (np.abs(at[:, 2]) < 8 * R)
        return inside & (above < level * drum - bent)

    found = [drum_angle(*particles(bed, 17 * R, seed), drum) for seed in range(16)]
    assert np.mean(found) == pytest.approx(degrees, abs=1.3)


def test_a_handful_of_particles_has_no_slope() -> None:
    with pytest.raises(TableError, match="particles on the surface, not 12"):
        heap_angle(*particles(lambda at: np.linalg.norm(at, axis=1) < 3 * R, 4 * R, 1))


# --- coefficients --------------------------------------------------------------------------------

_PARTS: dict[Rig, tuple[float, float, float]] = {"repose": (8, 12, 14), "drum": (12, 24, 7)}
"""Angles grow with both coefficients and saturate; rolling resists only where friction does."""


def law(rig: Rig, pairs: Floats) -> Floats:
    base, by_friction, by_rolling = _PARTS[rig]
    friction, rolling = pairs.T
    both = (1 - np.exp(-rolling / 0.1)) * (1 - np.exp(-friction / 0.4))
    return np.asarray(base + by_friction * (1 - np.exp(-friction / 0.3)) + by_rolling * both)


def design() -> Floats:
    part = (0.5 + np.arange(1, 21)[:, None] * np.array([0.75487767, 0.56984029])) % 1
    pairs = RANGES[:, 0] + np.ptp(RANGES, axis=1) * part**2
    return np.concatenate([pairs, pairs[3::4]])


def posterior(truth: Floats, random: np.random.Generator, std: float) -> Posterior:
    models, measured = dict[Rig, AngleModel](), dict[Rig, tuple[float, float]]()
    for rig in _PARTS:
        angles = law(rig, design()) + random.normal(0, 1.0, len(design()))
        models[rig] = AngleModel.through(design(), angles, RANGES)
        measured[rig] = (float(law(rig, truth[None])[0] + random.normal(0, std)), std)
    return Posterior.of(models, measured)


@pytest.mark.parametrize("std", [0.3, 0.7])
def test_intervals_contain_planted_coefficients(std: float) -> None:
    """About as often as they say, although the polynomial does not fit the law exactly."""
    random, trials, hits, widths = np.random.default_rng(7), 200, {}, []
    for truth in RANGES[:, 0] + np.ptp(RANGES, axis=1) * random.random((trials, 2)):
        whole = posterior(truth, random, std)
        for name in whole.weights:
            found = whole.coefficients(name)
            ends = zip((found.friction, found.rolling_friction), truth, strict=True)
            hits[name] = hits.get(name, 0) + np.array([one.contains(value) for one, value in ends])
        widths.append(found.narrowed)
    share = np.array([*hits.values()]) / trials
    assert share.shape == (3, 2) and share.min() > 0.88
    assert np.mean(widths, axis=0)[0] < 0.5  # and they are not just wide


def test_one_angle_alone_cannot_tell_the_coefficients_apart() -> None:
    found = posterior(np.array([0.4, 0.1]), np.random.default_rng(1), 0.5)
    repose, drum, both = (found.coefficients(name) for name in ("repose", "drum", "both"))
    assert repose.correlation < -0.3 and repose.narrowed[1] > 0.8
    assert max(both.narrowed) < min(max(repose.narrowed), max(drum.narrowed))
    assert found.weights["both"].sum() == pytest.approx(1.0)


def test_the_report_states_the_most_likely_pair(tmp_path: Path) -> None:
    truth, rows = np.array([[0.4, 0.1]]), []
    for rig in _PARTS:
        angles = law(rig, design())
        rows += [(rig, *pair, angle) for pair, angle in zip(design(), angles, strict=True)]
    runs = pd.DataFrame(rows, columns=["rig", "friction", "rolling_friction", "angle_deg"])
    measured = {rig: (float(law(rig, truth)[0]), 0.1) for rig in _PARTS}
    known = AngleSet(
        study="s", title="t", pair="a-a", friction=RANGES[0], rolling_friction=RANGES[1],
        measured=measured, runs=("x",),
    )  # fmt: skip
    found = find_friction(known, runs)
    assert found.best == pytest.approx((0.4, 0.1), rel=0.25)
    (tmp_path / "result.json").touch()
    write_calibration_report(tmp_path, None, (found, runs))
    assert not (tmp_path / "result.json").exists(), "of an earlier calibration"
    page = (tmp_path / "report.html").read_text()
    assert f"friction: {found.best[0]:.3g}, rolling_friction: {found.best[1]:.3g}" in page
    assert "standard uncertainties" not in page  # no warning
    beyond = known.model_copy(update={"measured": {**measured, "repose": (60.0, 1.0)}})
    assert find_friction(beyond, runs).misfit["repose"] > 3
    with pytest.raises(TableError, match="13 runs of a measured angle succeeded, not 14"):
        find_friction(known, runs.groupby("rig").head(13))
