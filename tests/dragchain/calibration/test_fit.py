"""The fit of the restitution, on drops whose answer is known on paper."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_drops import BIAS, FALL_S, HEIGHT, G, paper_drop, paper_drops, rebound

from dragchain.calibration.fit import WIDTH_LIMIT, calibrate, observe, sample_impacts
from dragchain.calibration.measured_impacts import MeasuredImpacts, measure_impacts
from dragchain.calibration.results import bias_table, result
from dragchain.calibration.simulated_drops import Drops, emulate, waveform
from dragchain.errors import TableError
from dragdeck.errors import RecordError
from evidence.drop_record import Sensor, record_of


@pytest.fixture(scope="module")
def sweep() -> Drops:
    return paper_drops()


def record(
    e: float, *, rate: float = 500e3, noise: float = 0.05, seed: int = 1, height: float = HEIGHT
) -> MeasuredImpacts:
    sensor = Sensor(rate, noise, offset_n=4.0, drift_n_per_s=1.0, resolution_n=0.005)
    made = record_of(paper_drop(e, height=height), sensor, np.random.default_rng(seed))
    return measure_impacts(made, fall_time_s=FALL_S)


# --- drops -----------------------------------------------------------------------------------


def test_speeds_and_times_at_the_surface_follow_from_free_flight() -> None:
    """A particle falls from h, touches for 20 us, leaves upwards; samples every 7 us."""
    radius, fall, up, contact = 0.003, 0.44, 0.31, 20e-6
    time = np.arange(-50, 60) * 7e-6 + 1e-6
    before = -fall * time - G * time**2 / 2  # height above the surface, touching at t = 0
    after = up * (time - contact) - G * (time - contact) ** 2 / 2
    inside = (time > 0) & (time < contact)
    gap = np.where(time <= 0, before, np.where(inside, -1e-6, after))
    speed = np.where(time <= 0, -fall - G * time, up - G * (time - contact))
    force = np.where(inside, 20.0, 0.0)
    window = {"time_s": time, "z_m": gap + radius, "vz_m_s": speed, "force_n": force}
    shape, fast_in, fast_out = waveform(window, radius, G)
    assert fast_in == pytest.approx(fall, rel=1e-9)
    assert fast_out == pytest.approx(up, rel=1e-9)
    assert shape.down_s == pytest.approx(0.0, abs=1e-12)
    assert shape.up_s == pytest.approx(contact, abs=1e-12)


def test_a_window_that_cuts_an_impact_is_refused() -> None:
    window = {"time_s": np.arange(5.0), "z_m": np.full(5, 0.0029)}
    window |= {"vz_m_s": np.zeros(5), "force_n": np.ones(5)}
    with pytest.raises(TableError, match="not entirely within"):
        waveform(window, 0.003, G)


def test_the_sweep_is_smooth(sweep: Drops) -> None:
    model = sweep.production
    for deck in (0.42, 0.68, 0.93):
        out = rebound(deck, BIAS)
        assert model.rebound(deck) == pytest.approx(out, abs=1e-10)
        assert model.flights_s(deck)[0] == pytest.approx(2 * FALL_S * out, rel=1e-9)
        assert model.flights_s(deck)[1] == pytest.approx(2 * FALL_S * out**2, rel=1e-9)


def test_the_height_of_a_drop_does_not_matter_to_the_sweep() -> None:
    runs = [paper_drop(e, height=h) for e in np.linspace(0.4, 1, 8) for h in (0.0098, 0.0101)]
    model = emulate(runs, HEIGHT, G)
    assert model.flights_s(0.7)[0] == pytest.approx(2 * FALL_S * 0.7, rel=1e-9)
    assert model.errors.max() < 1e-10


def test_a_sweep_of_few_values_is_refused() -> None:
    with pytest.raises(TableError, match="more than 5 values"):
        emulate([paper_drop(e) for e in (0.5, 0.6, 0.7, 0.8)], HEIGHT, G)


# --- sampling --------------------------------------------------------------------------------


def test_fine_sampling_changes_nothing() -> None:
    measured = record(0.7, rate=20e6, noise=1e-4)
    seen = sample_impacts(paper_drop(0.7).impacts[:1], measured)
    assert seen.peak_ratio == pytest.approx(1.0, abs=1e-3)
    assert seen.time_bias_s == pytest.approx(0.0, abs=1e-9)
    assert seen.width_s == pytest.approx(
        2 * math.acos(0.5 ** (1 / 1.5)) / math.pi * 25e-6, rel=1e-3
    )


def test_coarse_sampling_misses_the_peak_by_a_known_share() -> None:
    """The highest of samples d apart is F(x) with |x| < d/2 and x even: mean by quadrature."""
    rate = 200e3
    measured = record(0.7, rate=rate, noise=1e-3)
    off = np.linspace(-0.5, 0.5, 20001) / rate / 25e-6
    wanted = np.cos(np.pi * off) ** 1.5
    seen = sample_impacts(paper_drop(0.7).impacts[:1], measured)
    error = wanted.std() / math.sqrt(200)
    assert seen.peak_ratio == pytest.approx(wanted.mean(), abs=5 * error)
    assert seen.peak_std == pytest.approx(wanted.std(), rel=0.2)


def test_a_rate_that_misses_contacts_is_refused() -> None:
    with pytest.raises(RecordError) as refused:
        measured = record(0.7, rate=30e3, noise=1e-3, seed=4)
        sample_impacts(paper_drop(0.7).impacts, measured)
    assert refused.value.reason in ("coarse", "impacts")


def test_the_first_impact_is_in_every_uncertainty(sweep: Drops) -> None:
    measured = record(0.7)
    sampling = sample_impacts(sweep.select("reference")[5].impacts, measured)
    got = observe(measured, sampling, with_peaks=True)
    first, second = sampling.time_std_s[:2]
    assert got.covariance.shape == (4, 4)
    assert got.covariance[0, 1] == pytest.approx(first**2)
    assert got.covariance[0, 0] == pytest.approx(first**2 + second**2)
    assert not got.covariance[:2, 2:].any()


# --- the fit ---------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [0.5, 0.68, 0.9])
def test_the_bias_of_production_is_corrected(sweep: Drops, e: float) -> None:
    """The particle rebounds with e; production must be given (e - b) / (1 - b)."""
    got = calibrate(record(e), sweep)
    put = (e - BIAS) / (1 - BIAS)
    assert got.fit.ci95_low < put < got.fit.ci95_high
    assert got.fit_reference.ci95_low < e < got.fit_reference.ci95_high
    assert got.fit.ci95_high - got.fit.ci95_low < 1e-3
    assert abs(put - e) > got.fit.ci95_high - got.fit.ci95_low  # what would be wrong without it


def test_a_wrong_height_is_found_out(sweep: Drops) -> None:
    """0.2 mm off, twice its stated uncertainty: the ratio of the flights does not know it."""
    got = calibrate(record(0.68, height=0.0102), sweep)
    assert got.fit.height_m == pytest.approx(0.0102, abs=5e-6)
    assert got.fit.ci95_low < (0.68 - BIAS) / (1 - BIAS) < got.fit.ci95_high


def test_a_particle_that_rebounds_unevenly_widens_the_interval(sweep: Drops) -> None:
    """As a spinning or uneven particle does: chi square tells, and the interval grows."""
    measured = record(0.68)
    third = measured.impacts[2]
    late = third.model_copy(update={"centroid_s": third.centroid_s + 1.5e-3})
    uneven = measured.model_copy(update={"impacts": (*measured.impacts[:2], late)})
    good, bad = calibrate(measured, sweep).fit, calibrate(uneven, sweep).fit
    assert good.p_value is not None and bad.p_value is not None
    assert good.p_value > 0.01 > bad.p_value
    assert bad.inflation == pytest.approx(math.sqrt(bad.chi2 / bad.degrees))
    assert bad.ci95_high - bad.ci95_low > 3 * (good.ci95_high - good.ci95_low)


def test_a_slow_sensor_gives_its_times_only(sweep: Drops) -> None:
    """A low pass of 60 us spreads each impact: peaks then go with the impulse, not the force."""
    made = record_of(paper_drop(0.68), Sensor(1e6, 0.0), np.random.default_rng(1))
    kernel = np.exp(-np.arange(600) / 60.0)
    slow = np.convolve(made.force_n, kernel / kernel.sum())[: len(made.force_n)]
    slow += np.random.default_rng(2).normal(0, 0.01, len(slow))
    measured = measure_impacts(type(made)(made.time_s, slow, made.interval_s), fall_time_s=FALL_S)
    got = calibrate(measured, sweep)
    assert not got.with_peaks
    assert got.width_ratio > WIDTH_LIMIT
    assert got.fit.ci95_low < (0.68 - BIAS) / (1 - BIAS) < got.fit.ci95_high
    forced = calibrate(measured, paper_drops(peaks="yes"))
    assert forced.with_peaks
    assert forced.fit.chi2 > 20 * got.fit.chi2  # what comparing them would have done


def test_two_impacts_cannot_be_tested(sweep: Drops) -> None:
    measured = record(0.68)
    two = measured.model_copy(update={"impacts": measured.impacts[:2]})
    times_only = paper_drops(peaks="no")
    got = calibrate(two, times_only)
    assert (got.fit.degrees, got.fit.p_value, got.fit.inflation) == (0, None, 1.0)
    assert got.fit.ci95_low < (0.68 - BIAS) / (1 - BIAS) < got.fit.ci95_high
    # one flight and a height known to 1 %: the restitution is known to half of that
    half = (got.fit.ci95_high - got.fit.ci95_low) / 2
    assert half == pytest.approx(1.96 * 0.5 * 0.01 * 0.68 / (1 - BIAS), rel=0.02)


@pytest.mark.parametrize("e", [0.3, 0.39])
def test_a_restitution_outside_the_sweep_is_refused(sweep: Drops, e: float) -> None:
    with pytest.raises(RecordError) as refused:
        calibrate(record(e, noise=0.01), sweep)
    assert refused.value.reason == "range"


@settings(max_examples=20)
@given(
    e=st.floats(0.5, 0.9),
    rate=st.floats(250e3, 2e6),
    noise=st.floats(0.01, 0.2),
    seed=st.integers(0, 10**6),
)
def test_any_rate_and_noise_recovers_the_rebound(
    sweep: Drops, e: float, rate: float, noise: float, seed: int
) -> None:
    """Twice the interval's half width: far outside, something is biased, not unlucky."""
    got = calibrate(record(e, rate=rate, noise=noise, seed=seed), sweep).fit_reference
    half = max(got.ci95_high - got.restitution, got.restitution - got.ci95_low)
    assert abs(got.restitution - e) < 2 * half


# --- tables ----------------------------------------------------------------------------------


def test_the_bias_table_is_the_rebound_of_the_drops(sweep: Drops) -> None:
    rows = bias_table(sweep)
    for row in rows.itertuples():
        wanted = rebound(row.restitution_deck, BIAS if row.purpose == "production" else 0.0)
        assert row.restitution_effective == pytest.approx(wanted, abs=1e-9)
    assert len(rows) == 2 * 13


def test_the_result_names_the_field_and_the_value(sweep: Drops) -> None:
    got = result(calibrate(record(0.68), sweep))
    assert got.known.pair == "a-b"
    assert got.put == pytest.approx((0.68 - BIAS) / (1 - BIAS), abs=1e-3)
    assert got.correction == pytest.approx(-BIAS * (1 - 0.68) / (1 - BIAS), abs=1e-3)
