"""A measured drop test: what is read, what is found, what is refused."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from dragchain.calibration.measured_impacts import MeasuredImpacts, measure_impacts
from dragdeck.errors import InputError, RecordError
from dragdeck.study.force_record import check_samples, read_record, read_samples

Floats = NDArray[np.float64]

FALL_S = 0.045
STARTS_S = (0.0200, 0.0850, 0.1320)
PEAKS_N = (23.5, 15.8, 10.7)
CONTACT_S = 200e-6
"""Longer than a ceramic particle's, so that slow rates can be tried."""


def half_sines(time_s: Floats, power: float = 1.0, starts_s: Sequence[float] = STARTS_S) -> Floats:
    """Impacts of known start, duration and peak: sin^power over the contact."""
    force = np.zeros_like(time_s)
    for start, peak in zip(starts_s, PEAKS_N, strict=True):
        phase = (time_s - start) / CONTACT_S
        inside = (phase > 0) & (phase < 1)
        force[inside] += peak * np.sin(np.pi * phase[inside]) ** power
    return force


def samples(
    rate_hz: float = 500e3, *, noise_n: float = 0.05, offset_n: float = 0.0,
    drift_n_per_s: float = 0.0, power: float = 1.0, phase: float = 0.3, seed: int = 1,
) -> tuple[Floats, Floats]:  # fmt: skip
    time = (np.arange(int(0.15 * rate_hz)) + phase) / rate_hz
    noise = np.random.default_rng(seed).normal(0.0, noise_n, len(time))
    return time, half_sines(time, power) + offset_n + drift_n_per_s * time + noise


def found(time_s: Floats, force_n: Floats) -> MeasuredImpacts:
    return measure_impacts(check_samples(time_s, force_n), fall_time_s=FALL_S)


# --- what is found ---------------------------------------------------------------------------


@pytest.mark.parametrize("power", [1.0, 1.5])
def test_known_pulses_are_found(power: float) -> None:
    """Half sines, and sin^1.5, which a Hertz impact nearly is: middle, peak, width."""
    got = found(*samples(offset_n=3.0, drift_n_per_s=0.5, power=power))
    step = got.interval_s
    for impact, start, peak in zip(got.impacts, STARTS_S, PEAKS_N, strict=True):
        assert impact.centroid_s == pytest.approx(start + CONTACT_S / 2, abs=0.2 * step)
        assert impact.peak_time_s == pytest.approx(start + CONTACT_S / 2, abs=10 * step)
        assert impact.peak_n == pytest.approx(peak, abs=5 * 0.05)
    first = got.impacts[0]
    half = 2 * np.arccos(0.5 ** (1 / power)) / np.pi * CONTACT_S
    assert first.width_s == pytest.approx(half, rel=0.03)


def test_baseline_and_noise_are_found() -> None:
    got = found(*samples(noise_n=0.08, offset_n=-7.0, drift_n_per_s=2.0))
    count = 0.15 * 500e3
    assert got.offset_n == pytest.approx(-7.0, abs=6 * 2 * 0.08 / np.sqrt(count))
    assert got.drift_n_per_s == pytest.approx(
        2.0, abs=6 * np.sqrt(12) / 0.15 * 0.08 / np.sqrt(count)
    )
    assert got.noise_n == pytest.approx(0.08, rel=0.03)  # a median deviation of 7e4: 0.4 %


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("share", [0.3, 0.45, 0.6, 1.0, 5.0, 40.0])
def test_drift_changes_nothing_but_the_baseline(share: float, sign: int) -> None:
    """Drift over the record, up to many peaks, upwards or downwards: the same impacts."""
    slope = sign * share * PEAKS_N[0] / 0.15
    still, drifting = found(*samples(offset_n=2.0)), found(*samples(drift_n_per_s=slope))
    assert drifting.notes == ()
    assert drifting.drift_n_per_s - still.drift_n_per_s == pytest.approx(slope, rel=1e-4)
    assert drifting.noise_n == pytest.approx(still.noise_n, rel=1e-3)
    for one, other in zip(drifting.impacts, still.impacts, strict=True):
        assert one.centroid_s == pytest.approx(other.centroid_s, abs=1e-9)
        assert one.peak_n == pytest.approx(other.peak_n, rel=1e-4)
        assert one.width_s == pytest.approx(other.width_s, rel=1e-3)


def test_a_ringing_sensor_makes_no_more_impacts() -> None:
    time, force = samples()
    for start in STARTS_S:
        since = time - start - CONTACT_S
        ring = 4.0 * np.exp(-since / 3e-4) * np.sin(2 * np.pi * 2e4 * since)
        force += np.where(since > 0, ring, 0.0)
    got = found(time, force)
    tops = [impact.peak_time_s - CONTACT_S / 2 for impact in got.impacts]
    assert tops == pytest.approx(list(STARTS_S), abs=1e-5)


def test_a_negative_force_is_turned_and_said() -> None:
    time, force = samples(offset_n=1.0)
    upright, turned = found(time, force), found(time, -force)
    assert turned.impacts == upright.impacts
    assert turned.notes == ("sign_turned",)
    assert not upright.notes


def test_two_impacts_are_enough_but_it_is_said() -> None:
    time, force = samples()
    got = found(time[time < 0.12], force[time < 0.12])
    assert len(got.impacts) == 2
    assert got.notes == ("two_impacts",)


def test_only_the_first_three_count() -> None:
    time, force = samples()
    late = (time - 0.146) / CONTACT_S
    force += np.where((late > 0) & (late < 1), 7 * np.sin(np.pi * np.clip(late, 0, 1)), 0)
    assert len(found(time, force).impacts) == 3


@settings(max_examples=25)
@given(
    rate=st.floats(40e3, 1.5e6),
    phase=st.floats(0, 1, exclude_max=True),
    offset=st.floats(-50, 50),
    seed=st.integers(0, 10**6),
)
def test_any_rate_gives_the_same_times(rate: float, phase: float, offset: float, seed: int) -> None:
    """From 8 samples an impact up, the times since the first are right to a quarter interval."""
    got = found(*samples(rate, phase=phase, offset_n=offset, seed=seed))
    since = np.array([impact.centroid_s for impact in got.impacts]) - got.impacts[0].centroid_s
    wanted = np.array(STARTS_S) - STARTS_S[0]
    assert np.abs(since - wanted).max() < 0.25 * got.interval_s + 1e-7


# --- reading ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "time_unit", "force_unit"),
    [
        ("time_s,force_n", 1.0, 1.0),
        ("time_ms;force_kn", 1e-3, 1e3),
        ("force_mn\ttime_us", 1e-6, 1e-3),
        ("Channel,TIME_S , Force_N", 1.0, 1.0),
    ],
)
def test_columns_say_their_unit(
    header: str, time_unit: float, force_unit: float, tmp_path: Path
) -> None:
    mark = next(mark for mark in (";", "\t", ",") if mark in header)
    names = [name.strip().lower() for name in header.split(mark)]
    rows = [
        mark.join(str({"t": k, "f": 2 * k, "c": 9}[name[0]]) for name in names) for k in range(3)
    ]
    file = tmp_path / "record.csv"
    file.write_text("\n".join(["# a comment", header, *rows]))
    time, force, _ = read_samples(file)
    assert time == pytest.approx(np.arange(3) * time_unit)
    assert force == pytest.approx(2 * np.arange(3) * force_unit)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t,f\n0,1\n", "record.csv:1: no column"),
        ("time_s,time_ms,force_n\n0,0,1\n", "record.csv:1: 2 column"),
        ("time_s,force_n\n0,0,2,5\n", "record.csv:2: the row has 4 values"),
        ("time_s,force_n\n0,high\n", "record.csv:2: force_n: 'high' is text"),
        ("time_s;force_n\n0,1;2,5\n1e-5;2\n", "too few samples"),
    ],
)
def test_a_file_that_is_none_is_refused(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "record.csv"
    file.write_text(text)
    with pytest.raises((InputError, RecordError), match=words):
        read_record(file)


# --- refusals --------------------------------------------------------------------------------

Change = Callable[[Floats, Floats], tuple[Floats, Floats]]

LATE_S, HOLE, SLOW = STARTS_S[0] - 1e-5, slice(30_000, 30_100), slice(12, None, 125)
"""After the first impact has begun; samples that are missing; 4 kHz, with one in that impact."""

REFUSALS: dict[str, tuple[Change, str]] = {
    "time runs backwards": (lambda t, f: (np.r_[t[:500], t[501], t[500], t[502:]], f), "time"),
    "a time given twice": (lambda t, f: (np.r_[t[:501], t[500], t[502:]], f), "time"),
    "samples are missing": (lambda t, f: (np.delete(t, HOLE), np.delete(f, HOLE)), "uneven"),
    "not a number": (lambda t, f: (t, np.r_[f[:77], np.nan, f[78:]]), "numbers"),
    "the trigger came late": (lambda t, f: (t[t > LATE_S], f[t > LATE_S]), "baseline"),
    "noise as high as the impacts": (
        lambda t, f: (t, f + np.random.default_rng(2).normal(0, 3.5, len(t))), "baseline"),
    "no impact": (lambda t, f: (t, f - half_sines(t)), "impacts"),
    "one impact": (lambda t, f: (t[t < 0.08], f[t < 0.08]), "impacts"),
    "sampling rate is too low": (lambda t, f: (t[SLOW], f[SLOW]), "coarse"),
    # a second particle, or a hand: the last impact is later than a rebound can be
    "not one particle's impacts": (
        lambda t, f: (t, f - half_sines(t) + half_sines(t, starts_s=(0.02, 0.05, 0.13))), "order"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSALS)
def test_what_cannot_be_used_is_refused(name: str) -> None:
    change, reason = REFUSALS[name]
    found(*samples())  # without the change it can be used
    with pytest.raises(RecordError) as refused:
        found(*change(*samples()))
    assert refused.value.reason == reason
    assert refused.value.limit or refused.value.remedy


@pytest.mark.parametrize("rate", [50e3, 200e3, 1e6, 5e6])
@pytest.mark.parametrize("level", [6.0, 12.0, 20.0])
def test_a_clipped_converter_is_refused(rate: float, level: float) -> None:
    """Clipped at one, two or all three impacts, as a converter does: after the noise."""
    time, force = samples(rate, offset_n=2.0)
    with pytest.raises(RecordError) as refused:
        found(time, np.minimum(force, level + 2.0))
    assert refused.value.reason == "clipped"


@pytest.mark.parametrize("rate", [200e3, 1e6, 5e6])
def test_a_clipped_amplifier_is_refused(rate: float) -> None:
    """Noise on top of the flat part, so that no two samples are equal."""
    time, force = samples(rate, noise_n=0.0)
    noise = np.random.default_rng(3).normal(0.0, 0.02, len(time))
    with pytest.raises(RecordError) as refused:
        found(time, np.minimum(force, 12.0) + noise)
    assert refused.value.reason == "clipped"


def test_a_fast_impact_that_is_clipped_has_three_samples_at_its_top() -> None:
    """As many as a stiff particle's impact has at 250 kHz."""
    time, force = samples(28e3, phase=0.4)
    found(time, force)
    with pytest.raises(RecordError, match="clipped"):
        found(time, np.minimum(force, 16.5))


@settings(max_examples=25)
@example(rate=122453.0, phase=0.0, bits=10, noise=0.015, seed=742)  # noise of two steps
@given(
    rate=st.floats(40e3, 1.5e6),
    phase=st.floats(0, 1, exclude_max=True),
    bits=st.integers(10, 16),
    noise=st.floats(0.002, 0.3),
    seed=st.integers(0, 10**6),
)
def test_a_whole_record_is_never_called_clipped(
    rate: float, phase: float, bits: int, noise: float, seed: int
) -> None:
    """Whatever rate and resolution: Hertz-like impacts are not flat."""
    time, force = samples(rate, phase=phase, noise_n=noise, power=1.5, seed=seed)
    quantum = 50.0 / 2**bits
    assert len(found(time, np.round(force / quantum) * quantum).impacts) == 3


@pytest.mark.parametrize(
    ("names", "force"),
    [("Zeit [s],Kraft [N]", 1), ("t / s,F / N", 1), ("time_s,fz_kn", 1e3),
     ("time_s,fz_n,force_n", 2), ("time_s,fx_n,fz_n", None), ("time_s,fz", None)],
)  # fmt: skip
def test_the_only_column_with_a_unit_of_force_is_the_force(
    tmp_path: Path, names: str, force: float | None
) -> None:
    file = tmp_path / "record.csv"
    file.write_text(
        f"{names}\n" + "".join(f"0.{n},1,2\n"[: 2 * names.count(",") + 4] + "\n" for n in (1, 2))
    )
    if force is None:
        with pytest.raises(InputError, match="recognised name"):
            read_samples(file)
    else:
        assert read_samples(file)[1].tolist() == [force, force]
