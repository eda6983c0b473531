"""A measured force signal beside a study: what is read, and what is refused before any run."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dragdeck.errors import InputError, RecordError
from dragdeck.study.check import validate
from dragdeck.study.driven import directions
from dragdeck.study.force_record import in_words
from dragdeck.study.motion import Motion
from dragdeck.study.process_signal import MeasuredSignal, low_passed, measured_signal
from dragdeck.study.reference import Signal
from dragdeck.study.yaml import read_study

Floats = NDArray[np.float64]
RATE, START, END = 500.0, 2.0, 14.0
TIME = np.arange(0.0, 16.0, 1 / RATE)
DRAG = (TIME >= START) & (TIME <= END)


def resistance(seed: int = 1) -> Floats:
    """Noise of 20 Hz about 3 N during the drag, zero before and after."""
    noise = np.random.default_rng(seed).normal(0.0, 3.0, len(TIME))
    return np.where(DRAG, 3.0 + low_passed(TIME, noise, 20.0)[1][: len(TIME)].mean(), 0.0) + (
        DRAG * np.convolve(noise, np.ones(25) / 25, "same")
    )


def text(force: Floats, time: Floats = TIME, header: str = "time_s,fx_n") -> str:
    rows = (f"{t:.6f},{f:.5f}" for t, f in zip(time, force, strict=True))
    return "\n".join([header, *rows]) + "\n"


def signal(**fields: Any) -> Signal:
    usual = {"file": "force.csv", "column": "fx_n", "sign": -1, "low_pass_hz": 20,
             "starts_at_s": START, "ends_at_s": END, "orientation": "follow_path"}  # fmt: skip
    return Signal.model_validate(usual | fields)


CIRCLE = {"kind": "circle", "radius_m": 0.02, "revolutions": 1, "start_deg": 30}
MOTION = {"path": CIRCLE, "speed_m_s": 0.01, "immersion_depth_m": 0.05, "transient_m": 0.005}
"""Of 12.6 s: the drag of these signals is nearly one revolution."""


def read(
    folder: Path, content: str, motion: dict[str, Any] = MOTION, **fields: Any
) -> MeasuredSignal:
    file = folder / "force.csv"
    file.write_text(content)
    heading = partial(directions, Motion.model_validate(motion))
    return measured_signal(file, signal(**fields), heading, 0.5)


def test_offset_drift_sign_and_unit_are_undone(tmp_path: Path) -> None:
    plain = read(tmp_path, text(resistance()))
    drifting = 1e3 * (resistance() + 5.0 - 0.3 * TIME)
    rest = {"rest_s": [[0.0, 1.8], [14.2, 15.9]]}
    other = read(tmp_path, text(drifting, header="time_s,fx_mn"), column="fx_mn", **rest)
    assert len(plain.force_n) == pytest.approx((END - START) * 100, abs=1)
    assert plain.force_n.mean() == pytest.approx(-3.0, abs=0.2)
    np.testing.assert_allclose(other.force_n, plain.force_n, atol=1e-3)
    by_rate = read(tmp_path, text(resistance(), header="n,fx_n"), rate_hz=RATE)
    np.testing.assert_allclose(by_rate.force_n, plain.force_n, atol=1e-9)


def test_nothing_is_extrapolated(tmp_path: Path) -> None:
    """A file that begins and ends with the drag, and within a sampling interval of it."""
    inside = (TIME > START) & (TIME < END)
    cut = read(tmp_path, text(resistance()[inside], TIME[inside]))
    assert np.isnan(cut.force_n[0])
    assert np.isfinite(cut.force_n[1:]).all()
    assert cut.time_s[-1] <= END - START
    late, force = low_passed(TIME[7:], resistance()[7:], 20.0)
    np.testing.assert_array_equal(np.isnan(force), late < TIME[7])


@pytest.mark.parametrize("low_pass_hz", [0.001, 0.01, 0.08, 0.2, 1.0, 99.0])
def test_every_bandwidth_is_used_or_refused(low_pass_hz: float, tmp_path: Path) -> None:
    """Down to the lowest that a study accepts."""
    try:
        found = read(tmp_path, text(resistance()), low_pass_hz=low_pass_hz)
    except RecordError as error:
        assert low_pass_hz < 5.0
        assert error.reason == "short"
        return
    assert len(found.force_n) >= 20


def test_the_start_is_found_where_the_force_leaves_the_noise(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.02, len(TIME))
    found = read(tmp_path, text(resistance() + noise), starts_at_s=None, rest_s=[[0.0, 1.8]])
    assert abs(found.start_s - START) <= found.start_error_s <= 0.02


def test_low_pass_shifts_nothing_and_removes_what_is_beyond() -> None:
    slow, fast = np.sin(2 * np.pi * 3 * TIME), np.sin(2 * np.pi * 80 * TIME)
    grid, found = low_passed(TIME, slow + fast, 20.0)
    inside = (grid > 1) & (grid < 15)
    np.testing.assert_allclose(found[inside], np.sin(2 * np.pi * 3 * grid[inside]), atol=1e-3)


def clipped(force: Floats) -> Floats:
    return np.minimum(force, np.quantile(force[DRAG], 0.9))


def halted(time: Floats) -> Floats:
    return np.where(np.arange(len(time)) == 500, time[499], time)


WRONG: dict[str, tuple[Callable[[Floats], str], dict[str, Any], str, str]] = {
    "no unit": (lambda f: text(f, header="time_s,fx"), {"column": "fx"}, "columns", "no unit"),
    "a column twice": (lambda f: text(f), {"column": ["fx", "Fx [N]"]}, "columns", "named twice"),
    "time stands still": (lambda f: text(f, halted(TIME)), {}, "time", "lines 501 and 502"),
    "time runs backwards": (lambda f: text(f, TIME[::-1]), {}, "time", "lines 2 and 3"),
    "clipped": (lambda f: text(clipped(f)), {}, "clipped", "wider range"),
    "uneven": (
        lambda f: text(f, TIME + 0.0009 * (np.arange(len(TIME)) % 7 == 0)),
        {}, "uneven", "not constant",
    ),
    "too slow": (lambda f: text(f), {"low_pass_hz": 101}, "slow", "505 Hz"),
    "too short": (lambda f: text(f), {"ends_at_s": 2.9}, "short", "own correlation"),
    "constant drift": (lambda f: text(f + 4 * TIME), {}, "short", "own correlation"),
    "begins late": (
        lambda f: text(f[1500:], TIME[1500:]), {}, "short", "from 3 to 15.998",
    ),
    "ends early": (lambda f: text(f[:6900], TIME[:6900]), {}, "short", "from 0 to 13.798"),
    "rest not recorded": (lambda f: text(f), {"rest_s": [[-1, 1]]}, "short", "rest_s"),
    "rest in the drag": (lambda f: text(f), {"rest_s": [[0, 2.5]]}, "start", "without load"),
    "no such time": (lambda f: text(f), {"starts_at_s": 20, "ends_at_s": 21}, "short", "15.998"),
    "start unknown": (lambda f: text(f), {"starts_at_s": None}, "start", "starts_at_s"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_signal_that_no_comparison_can_use_is_refused(name: str, tmp_path: Path) -> None:
    made, fields, reason, words = WRONG[name]
    with pytest.raises(RecordError) as caught:
        read(tmp_path, made(resistance()), **fields)
    assert caught.value.reason == reason
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("fields", "problem", "field"),
    [
        ({}, None, ""),
        ({"file": "none.csv"}, "no such file", "reference.signal.file"),
        ({"file": "../force.csv"}, "leaves the folder", "reference.signal.file"),
        ({"column": "fz_n"}, "force.csv:1: no column(s)", None),
        ({"starts_at_s": -1}, "(short)", "reference.signal.file"),
        ({"orientation": None}, "(axes) it is not stated", "reference.signal.file"),
        ({"orientation": "fixed"}, "(axes) the path turns", "reference.signal.file"),
        ({"column": ["fx_n", "fy_n"]}, "force.csv:1: no column(s)", None),
        ({"column": ["fx_n"]}, "1 entries", "reference.signal.column"),
        ({"angle_column": "a_deg"}, "two or three columns", "reference.signal"),
        ({"low_pass_hz": 201}, "sampled too slowly", "reference.signal.low_pass_hz"),
    ],
)
def test_check_names_the_field_of_a_study(
    fields: dict[str, Any], problem: str | None, field: str | None, tmp_path: Path
) -> None:
    (tmp_path / "force.csv").write_text(text(resistance()))
    data = dict(read_study(Path("studies/uhlmann2015/study.yaml")))
    own = {"file": "force.csv", "column": "fx_n", "starts_at_s": START}
    own |= {"orientation": "follow_path"}
    own |= {"ends_at_s": END, "low_pass_hz": 20}
    data["reference"] = {"source": "SYNTHETIC", "signal": {**own, **fields}}
    file = tmp_path / "study.yaml"
    file.write_text("title: a study\n")
    if problem is None:
        study = validate(data, file)
        assert study.reference is not None and study.reference.signal is not None
        return
    with pytest.raises(InputError) as caught:
        validate(data, file)
    assert problem in str(caught.value)
    assert caught.value.field == field


# --- a fixed sensor --------------------------------------------------------------------------


def fixed(x_axis_deg: float, turn: int, lateral: float = 0.7) -> tuple[Floats, list[Floats]]:
    """Direction of motion, rad, and forces of a resistance along the axes of a fixed sensor, N."""
    since = np.clip(TIME - START, 0, None)
    motion = np.radians(30) + turn * (np.pi / 2 + 0.01 / 0.02 * since)
    away = motion - np.radians(x_axis_deg)
    drag, left, up = -resistance(), lateral * DRAG, 0.3 * resistance(2)
    x = drag * np.cos(away) - left * np.sin(away)
    return motion, [x, drag * np.sin(away) + left * np.cos(away), up]


def columns(offset: float, *values: Floats, header: str = "time_s,fx_n,fy_n,fz_n") -> str:
    rows = zip(TIME, *(value + offset for value in values), strict=True)
    return "\n".join([header, *(",".join(f"{value:.6f}" for value in row) for row in rows), ""])


@pytest.mark.parametrize(
    ("direction", "x_axis_deg", "by_column"),
    [("ccw", 0, False), ("cw", 75, False), ("ccw", 75, True), ("cw", 0, True)],
)
def test_a_fixed_sensor_is_turned_into_the_frame_of_the_path(
    direction: str, x_axis_deg: float, by_column: bool, tmp_path: Path
) -> None:
    motion, forces = fixed(x_axis_deg, 1 if direction == "ccw" else -1)
    of_study = {**MOTION, "path": {**CIRCLE, "direction": direction}}
    content, names = columns(5.0, *forces), ["fx_n", "fy_n", "fz_n"]
    usual = {"column": names, "orientation": None, "x_axis_deg": x_axis_deg, "sign": 1}
    usual["rest_s"] = [[0.0, 1.8]]
    if by_column:
        angle = np.degrees(motion) % 360 + 12 - 5.0
        header = "time_s,fx_n,fy_n,fz_n,angle_deg"
        content = columns(5.0, *forces, angle, header=header)
        usual |= {"angle_column": "angle_deg", "x_axis_deg": x_axis_deg + 12}
    wanted = read(tmp_path, text(-resistance()), sign=1).force_n
    for component, expected, near in (
        ("drag", wanted, 0.02),
        ("lateral", np.full(len(wanted), 0.7), 0.02),
        ("vertical", read(tmp_path, text(0.3 * resistance(2)), sign=1).force_n, 1e-3),
    ):
        found = read(tmp_path, content, of_study, **usual, component=component).force_n
        np.testing.assert_allclose(found[20:-20], expected[20:-20], atol=near)


def test_an_angle_that_turns_otherwise_is_refused(tmp_path: Path) -> None:
    motion, forces = fixed(0, 1)
    content = columns(0.0, *forces, -motion, header="time_s,fx_n,fy_n,fz_n,angle_rad")
    with pytest.raises(RecordError, match="turn otherwise") as caught:
        read(tmp_path, content, column=["fx_n", "fy_n"], orientation=None, angle_column="angle_rad")
    assert caught.value.reason == "angle"


def test_a_single_axis_suffices_on_a_straight_path(tmp_path: Path) -> None:
    line = {**MOTION, "path": {"kind": "line", "length_m": 0.126, "start_m": [-0.06, 0]}}
    for orientation in (None, "fixed", "follow_path"):
        assert len(read(tmp_path, text(resistance()), line, orientation=orientation).force_n)


# --- missing samples -------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["nan", "", "rows"])
def test_missing_samples_are_left_out(how: str, tmp_path: Path) -> None:
    """Single ones, and a tenth of a second: their neighbours have the values of a whole record."""
    whole = read(tmp_path, text(resistance())).force_n
    gaps = [1800, 2301, 4000, *range(5000, 5050)]
    head, *rows = text(resistance()).splitlines()
    left = {n: f"{rows[n].split(',')[0]},{how}" for n in gaps}
    lines = [left.get(n, row) for n, row in enumerate(rows) if how != "rows" or n not in gaps]
    found = read(tmp_path, "\n".join([head, *lines, ""])).force_n
    known = np.isfinite(found)
    assert 8 <= np.count_nonzero(~known) <= 20
    assert not known[round((5025 / RATE - START) * 100)]
    np.testing.assert_allclose(found[known], whole[known], atol=0.12 * resistance().std())
    assert "; 53 of 8,000 samples missing, left out" in in_words(tmp_path / "force.csv", signal())


def test_too_many_missing_samples_are_refused_with_their_lines(tmp_path: Path) -> None:
    rows = text(resistance()).splitlines()
    rows[3001:3082] = [row.split(",")[0] + "," for row in rows[3001:3082]]
    with pytest.raises(InputError, match="the value is missing") as caught:
        read(tmp_path, "\n".join(rows))
    assert caught.value.line == 3002
    with pytest.raises(RecordError, match="not constant"):
        read(tmp_path, "\n".join(row for row in rows if not row.endswith(",")))
