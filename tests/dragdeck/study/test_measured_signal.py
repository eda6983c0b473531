"""A measured force signal beside a study: what is read, and what is refused before any run."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dragdeck.errors import InputError, RecordError
from dragdeck.study import force_record
from dragdeck.study.force_record import low_passed, measured_signal
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
             "starts_at_s": START, "ends_at_s": END}  # fmt: skip
    return Signal.model_validate(usual | fields)


def read(folder: Path, content: str, **fields: Any) -> force_record.MeasuredSignal:
    file = folder / "force.csv"
    file.write_text(content)
    return measured_signal(file, signal(**fields), 0.5)


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
        ({"low_pass_hz": 201}, "sampled too slowly", "reference.signal.low_pass_hz"),
    ],
)
def test_check_names_the_field_of_a_study(
    fields: dict[str, Any], problem: str | None, field: str | None, tmp_path: Path
) -> None:
    from dragdeck.study.check import validate

    (tmp_path / "force.csv").write_text(text(resistance()))
    data = dict(read_study(Path("studies/uhlmann2015/study.yaml")))
    own = {"file": "force.csv", "column": "fx_n", "starts_at_s": START}
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
