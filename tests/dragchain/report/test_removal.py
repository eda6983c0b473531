"""Removal that loads and a coefficient predict, and its section of the report."""

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import trimesh
from loading_files import PLATE, made_contacts, write_run, write_without_picture
from loading_files import case_json as contact_case
from report_files import (
    PICTURES,
    case_json,
    make_run,
    page_of,
    process_findings,
    write_measured,
    write_quantities,
)

from dragchain.errors import TableError
from dragchain.loading.contact_events import POINT
from dragchain.loading.document import LOADING_FILE, Loading
from dragchain.loading.edges import EdgeBands, edge_bands
from dragchain.loading.samples import Sampled
from dragchain.loading.wear import Wear
from dragchain.report.removal import (
    Parted,
    edge_rows,
    joined_half_width,
    patch_means,
    predict,
    touches_per_s,
)
from dragchain.report.study_report import write_study_report
from dragchain.run.workpiece import Surface
from dragchain.statistics.estimate import Estimate, EstimateColumns, student_quantile
from dragdeck.study.removal import Removal, disagreements, fit_trials

GIVEN = {"coefficient_m2_n": 2e-11, "sd_m2_n": 1e-12, "target_depth_m": 1e-6}
TRIAL = {"mass_loss_kg": 2e-5, "time_s": 3600.0, "sd_kg": 1e-6}
LOAD = Estimate(4e-3, 3e-3, 5e-3)
Z = 1.959964


def test_a_given_coefficient_and_the_load_share_the_uncertainty_of_the_volume() -> None:
    coefficient, rate = predict(Removal.model_validate(GIVEN), LOAD, 7800.0)
    assert rate == Parted(pytest.approx(8e-14), pytest.approx(0.25), pytest.approx(0.05 * Z))
    assert coefficient == Parted(2e-11, 0.0, pytest.approx(0.05 * Z))
    half = math.hypot(0.25, 0.05 * Z)
    assert rate.combined.ci95_high == pytest.approx(8e-14 * (1 + half))


def test_a_trial_gives_the_volume_and_with_the_load_the_coefficient() -> None:
    coefficient, rate = predict(Removal(calibrate=[TRIAL]), LOAD, 7800.0)
    volume = 2e-5 / 3600 / 7800
    assert rate == Parted(pytest.approx(volume), 0.0, pytest.approx(0.05 * Z))
    assert coefficient.value == pytest.approx(volume / 4e-3)
    assert (coefficient.scatter, coefficient.coefficient) == pytest.approx((0.25, 0.05 * Z))


def test_intervals_join_by_welch_and_satterthwaite() -> None:
    """The smaller standard error has 2 degrees of freedom: 200 in all."""
    halves = student_quantile(2) * 0.1, Z * 0.3
    assert joined_half_width(*halves, 2) == pytest.approx(
        student_quantile(200) * 0.1 * math.sqrt(10), rel=1e-6
    )
    assert joined_half_width(halves[0], 0.0, 2) == pytest.approx(halves[0])
    assert joined_half_width(0.0, halves[1], 2) == pytest.approx(halves[1])
    np.testing.assert_allclose(joined_half_width([0.3, 0.0], [0.4, 0.4], math.inf), [0.5, 0.4])


@pytest.mark.parametrize("packings", [2, 3])
def test_the_joint_interval_of_few_packings_covers(packings: int) -> None:
    random, degrees = np.random.default_rng(7), packings - 1
    loads = random.normal(0.0, 1.0, (4000, packings))
    scatter = student_quantile(degrees) * loads.std(axis=1, ddof=1) / packings**0.5
    known = 0.3 / packings**0.5
    off = np.abs(loads.mean(axis=1) + random.normal(0.0, known, 4000))
    assert (off < joined_half_width(scatter, Z * known, degrees)).mean() > 0.94


@pytest.mark.parametrize(("off", "birge"), [(0.01, 0.6745), (0.5, 0.5), (6.0, 6.0)])
def test_several_trials_are_fitted_through_the_origin(off: float, birge: float) -> None:
    """Of two equal trials that are off by as many standard uncertainties, up and down."""
    sd, t = 1e-6, 12.706205
    trials = [TRIAL | {"mass_loss_kg": 2e-5 + sign * off * sd / math.sqrt(2)} for sign in (1, -1)]
    removal = Removal(calibrate=trials)
    fit = fit_trials(removal)
    assert fit is not None
    assert fit.rate_kg_s == pytest.approx(2e-5 / 3600)
    assert fit.residuals == pytest.approx([off / math.sqrt(2), -off / math.sqrt(2)])
    quantile = 1.0 if off == 0.01 else t  # at least the 50 % interval by the uncertainties
    _, rate = predict(removal, LOAD, 7800.0)
    assert rate.coefficient == pytest.approx(quantile * birge * 0.05 / math.sqrt(2))
    assert (fit.degrees, rate.coefficient_degrees) == (1, 1)
    said = " ".join(disagreements(removal))
    assert "trial 1 is +4.24 sd_kg off the fit" in said if off > 2 else not said


def test_longer_and_better_trials_count_more() -> None:
    fit = fit_trials(Removal(calibrate=[
        {"mass_loss_kg": 1e-5, "time_s": 1000, "sd_kg": 1e-6},
        {"mass_loss_kg": 4e-5, "time_s": 2000, "sd_kg": 2e-6},
    ]))  # fmt: skip
    assert fit is not None
    weights = np.array([1000 / 1e-12, 2000 / 4e-12])
    expected = weights @ [1e-5, 4e-5] / (weights @ [1000, 2000])
    assert fit.rate_kg_s == pytest.approx(expected)


def test_patches_have_the_scatter_between_packings_or_else_over_time() -> None:
    values, errors = np.array([[1.0, 5.0], [3.0, 5.0]]), np.array([[0.1, 0.2]] * 2)
    mean, error, degrees = patch_means(values, errors)
    np.testing.assert_allclose([mean, error], [[2.0, 5.0], [1.0, 0.0]])
    assert degrees == 1
    mean, error, degrees = patch_means(values[:1], errors[:1])
    np.testing.assert_allclose([mean, error], [[1.0, 5.0], [0.1, 0.2]])
    assert degrees == 8


def bands(area: list[float], action: list[float], excess: list[Estimate], angle: float) -> Wear:
    """Bands of 1 mm along 80 mm of edges."""
    edges = EdgeBands(
        length_m=0.08, angle_rad=angle, area_m2=tuple(area),
        distance_m=tuple(1e-3 * at for at in range(len(area) + 1)),
        action_w=EstimateColumns.of([Estimate.around(one, 0.1 * one) for one in action]),
        excess_w=EstimateColumns.of(excess),
    )  # fmt: skip
    return Wear.model_construct(edges=edges)


COEFFICIENT = Parted(math.nan, 0.0, 0.2)


@pytest.mark.parametrize("degrees", [60.0, 90.0, 140.0])
def test_what_an_edge_loses_beyond_its_faces_rounds_it(degrees: float) -> None:
    """An arc that is tangent to both faces lacks as much as was removed in half an hour."""
    angle, length, k = math.radians(degrees), 0.08, 1e-12
    excess = [Estimate(1.5, 1.2, 1.8), Estimate(2.0, 1.7, 2.3)]
    wear = bands([1e-4, 1e-4, 2e-4], [3.0, 2.0, 3.0], excess, angle)
    rows = edge_rows([wear], k, COEFFICIENT)
    assert [name for name, _, _ in rows] == ["0 to 1", "1 to 2"]
    for (_, depth, radius), action, beyond in zip(rows, (3, 2), (1.5, 2), strict=True):
        assert depth is not None and radius is not None
        assert depth.value == pytest.approx(3600e6 * k * action / 1e-4)
        assert depth.relative_half_width == pytest.approx(math.hypot(0.1, 0.2), rel=1e-5)
        r, half = 1e-6 * radius.value, (math.pi - angle) / 2
        at = np.linspace(-half, half, 20_001)
        x = np.r_[0.0, r / math.sin(angle / 2) - r * np.cos(at)]  # the corner, and the arc
        y = np.r_[0.0, r * np.sin(at)]
        lacks = abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2
        assert lacks * length == pytest.approx(k * beyond * 1800, rel=1e-6)
        low, high = ((1 + side * math.hypot(0.3 / beyond, 0.2)) ** 0.5 for side in (-1, 1))
        found = (radius.ci95_low / radius.value, radius.ci95_high / radius.value)
        assert found == pytest.approx((low, high), rel=1e-5)


def test_an_edge_that_loses_no_more_than_its_faces_has_an_upper_limit() -> None:
    excess = [Estimate(0.1, -0.2, 0.4), Estimate(-0.5, -0.7, -0.3), Estimate(*[math.nan] * 3)]
    wear = bands([1e-4] * 3 + [0.0], [1.0] * 3 + [0.0], excess, math.pi / 2)
    slight, less, unknown = (radius for *_, radius in edge_rows([wear], 1e-12, COEFFICIENT))
    assert slight is not None and less is not None and unknown is None
    assert 0.0 == slight.ci95_low < slight.value < slight.ci95_high
    assert (less.value, less.ci95_low, less.ci95_high) == (0.0, 0.0, 0.0)


def test_even_removal_leaves_an_edge_sharp() -> None:
    """Contacts strewn evenly over a cube; then as many again on a line near its edges."""
    random, even, line = np.random.default_rng(5), list[Wear](), list[Wear]()
    cube = trimesh.creation.box((0.02,) * 3).subdivide().triangles
    for wears, extra, packings in ((even, 0, 2), (line, 3000, 1)):
        for _ in range(packings):
            face, side, at = random.integers(3, size=8000), random.choice([-0.01, 0.01], 8000), 8000
            points = random.uniform(-0.01, 0.01, (8000, 3))
            points[np.arange(at), face] = side
            points[:extra, :] = 0.01 * random.choice([-1, 1], (extra, 3))
            points[np.arange(extra), face[:extra]] = random.uniform(-0.01, 0.01, extra)
            rows = pd.DataFrame(points, columns=POINT).assign(
                frame=random.integers(200, size=8000), force_slide_n_m=random.exponential(size=8000)
            )
            sampled = Sampled(rows, 200, 1e-3, 1.0, np.zeros(3))
            edges = edge_bands(sampled, Surface(cube), 1.0, 3e-3, 1e-3)
            wears.append(Wear.model_construct(edges=edges))
    coefficient = 1e-12
    for wears, total in ((even, 0.0), (line, 3000.0)):
        for _, _, radius in edge_rows(wears, coefficient, Parted(1.0, 0.0, 0.0)):
            volume = coefficient * total / 0.2 * 1800
            true = 1e6 * math.sqrt(volume / (0.24 * (1 - math.pi / 4)))
            assert radius is not None
            assert radius.ci95_low <= true <= radius.ci95_high
            assert (radius.ci95_low == 0.0) == (total == 0.0)


# --- report --------------------------------------------------------------------------------------


def slide_per_m(run: Path) -> float:
    """Normal force times sliding distance, for each metre of the run's path, N m/m."""
    load = Loading.read(run / LOADING_FILE)
    return load.totals["force_slide_n_m"] / load.path_m


def report(
    tmp_path: Path, removal: dict[str, Any], seeds: int = 1, wear: bool = True,
    corrected: float | None = None, told: dict[str, Any] | None = None,
    roughness: dict[str, Any] | None = None,
) -> Path:  # fmt: skip
    """The report on runs whose contacts are those made by hand, 50 % more with each seed."""
    runs = []
    for seed in range(seeds):
        rows = made_contacts()
        for row in rows:
            row["normal_force_n"] *= 1 + 0.5 * seed
            row["tangential_force_n"] *= 1 + 0.5 * seed
        made = write_run(tmp_path / f"made-{seed}", rows)
        (made / "case.json").write_text(json.dumps(contact_case({"removal": removal})))
        write_without_picture(made)
        study = {"materials.steel.density_kg_m3": 7800.0, "seed": seed, "removal": removal}
        study |= {"roughness": roughness} if roughness else {}
        case = case_json("process", f"run-{seed}", study)
        run = make_run(tmp_path / "results", case, process_findings(), PICTURES)
        for file in ("tables/loading.json", *(["tables/wear.json"] if wear else [])):
            (run / file).write_bytes((made / file).read_bytes())
        write_measured(run, force_slide=Estimate.around(slide_per_m(run), 0.1 * slide_per_m(run)))
        if told:
            whole = json.loads((run / file).read_text())
            (run / file).write_text(json.dumps(whole | told))
        (run / "workpiece.stl").write_text(PLATE)
        if corrected:
            write_quantities(run, corrected)
        runs.append(run)
    write_study_report(tmp_path / "out", runs)
    return tmp_path / "out"


def test_the_report_has_depth_mass_and_minutes(tmp_path: Path) -> None:
    out = report(tmp_path, GIVEN)
    load = slide_per_m(tmp_path / "made-0")
    speed, area = 0.01, 4e-4
    depth_m_s = 2e-11 * load * speed / area
    facets = pd.read_csv(out / "run-0-removal.csv")
    seen = facets["depth_m_s"] @ facets["area_m2"] / area
    assert seen == pytest.approx(2e-11 * load * 0.1 / area)  # of a run ten times as fast
    page = page_of(out)
    assert page.open == []
    assert f"{3600e6 * depth_m_s:#.3g} " in page.words
    assert "law ignores" in page.words
    assert " min (" in page.words and ") (mean depth)" in page.words
    assert "Young's modulus \N{MULTIPLICATION SIGN} 0.01" in page.words
    assert "not corrected" in page.words


TRIANGLE = {"form": {"shape": "triangle", "ra_m": 1e-6}}


def test_the_roughness_falls_as_the_peaks_are_removed(tmp_path: Path) -> None:
    """Of a triangle of height 4 um, Ra is m^2 / 4 um with the mean height m that is left."""
    out = report(tmp_path, GIVEN, roughness=TRIANGLE | {"target_ra_m": 0.25e-6})
    facets, page = pd.read_csv(out / "run-0-removal.csv"), page_of(out)
    mean = facets["depth_m_s"].mean()  # after 1 um / mean, a facet with all the load is flat
    depth = facets["depth_m_s"] / mean * 1e-6
    assert facets["ra_m"].to_numpy() == pytest.approx((2e-6 - depth) ** 2 / 4e-6, abs=1e-9)
    assert (facets["ra_ci95_low_m"] <= facets["ra_m"]).all()
    per_s = 2e-11 * slide_per_m(tmp_path / "made-0") * 0.01 / 4e-4
    assert mean == pytest.approx(10 * per_s)  # the run is ten times as fast
    assert f"is reached after {1e-6 / per_s / 60:.3g} min (" in page.words
    assert "Ra falls from 1.00 µm to 0.063 µm (" in page.words  # 1.5 um of 2 um are removed
    assert "No steady roughness is given" in page.words and "smearing" in page.words


def test_measured_roughness_gives_the_depth_per_time(tmp_path: Path) -> None:
    times = [600.0, 1200.0, 2400.0, 3600.0]
    rows = [{"time_s": time, "ra_m": (2e-6 - 3e-10 * time) ** 2 / 4e-6} for time in times]
    out = report(tmp_path, GIVEN, roughness=TRIANGLE | {"measured": rows, "steady_ra_m": 1e-12})
    assert f"fitted to the measured Ra: {3600e6 * 3e-10:#.4g} µm/h" in page_of(out).words


def test_the_mean_depth_is_without_what_is_removed_above_the_bed(tmp_path: Path) -> None:
    """Of two equal facets one is in the bed, and two thirds of the action are on it."""
    out = report(tmp_path, GIVEN, told={"immersed": [True, False], "patch_w_m2": [2.0, 1.0]})
    load = slide_per_m(tmp_path / "made-0")
    depth_m_s = 2 / 3 * 2e-11 * load * 0.01 / 2e-4
    assert f"over the immersed surface: {3600e6 * depth_m_s:#.3g} " in page_of(out).words


def test_windows_correct_the_load_of_a_soft_run(tmp_path: Path) -> None:
    """To half of it, with the interval of the windows: 10 %, beside 5 % of the coefficient."""
    out = report(tmp_path, GIVEN, corrected=0.5)
    plain = report(tmp_path / "plain", GIVEN)
    facets, soft = (pd.read_csv(one / "run-0-removal.csv") for one in (out, plain))
    np.testing.assert_allclose(facets["depth_m_s"], 0.5 * soft["depth_m_s"])
    assert facets["corrected"].all()
    assert not soft["corrected"].any()
    words = page_of(out).words
    assert "sliding load is from 3 windows at the physical Young's modulus" in words
    half = math.hypot(0.2, 0.05 * Z)
    load = 0.5 * 2.0 * 0.01  # N m per metre of path, times the speed
    assert f"{3600e6 * 2e-11 * load / 4e-4 * (1 + half):.3g}" in words


def test_packings_are_one_removal_with_the_scatter_between_them(tmp_path: Path) -> None:
    out = report(tmp_path, {"calibrate": TRIAL}, seeds=3)
    assert len(list(out.glob("*-removal.csv"))) == 1
    facets = pd.read_csv(out / "run-0-removal.csv")
    loaded = facets[facets["depth_m_s"] > 0]
    np.testing.assert_allclose(loaded["depth_m_s_se"] / loaded["depth_m_s"], 0.5 / 1.5 / 3**0.5)
    assert "fitted to 1 weighed trial of this process" in page_of(out).words


def test_a_run_without_its_wear_is_named(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"no wear\.json: make it with: ./run dragchain loading"):
        report(tmp_path, GIVEN, wear=False)


def test_first_touches_of_several_packings_are_those_of_all() -> None:
    """The sum of the events, and the mean of the rates with Student's t between packings."""
    rates = (90.0, 110.0, 100.0)
    touches = [
        SimpleNamespace(events=int(rate), per_s=Estimate.around(rate, 3.0)) for rate in rates
    ]
    packings = [SimpleNamespace(wear=SimpleNamespace(touches=one)) for one in touches]
    several: Any = SimpleNamespace(studies=packings)
    events, rate = touches_per_s(several)
    assert (events, rate.value) == (300, pytest.approx(100.0))
    assert rate.half_width == pytest.approx(4.302652730 * 10.0 / math.sqrt(3))
    single: Any = SimpleNamespace(studies=packings[:1])
    assert touches_per_s(single) == (90, touches[0].per_s)
