from __future__ import annotations

import html
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import pyvista as pv
from figure_files import (
    case_json,
    columns_json,
    network_tables,
    printed,
    save,
    workpiece_contacts_table,
    workpiece_force_table,
)
from networks import R, make_frame, row
from PIL import Image
from scipy.stats import binom, false_discovery_control

from dragchain.drag.peaks import find_drag_peaks
from dragchain.errors import TableError
from dragchain.figures.network_picture import cylinder_radii
from dragchain.network.chain_table import chain_table
from dragchain.network.chains import dominant_path, peters_chains, widest_paths
from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, NetworkFrame
from dragchain.network.write import write_chains
from dragchain.report.page import page_environment
from dragchain.statistics.shift_test import (
    Window,
    band,
    draw_shifts,
    holm,
    joint,
    shift_test,
    shifted_means,
    standardised,
)
from dragchain.tables.write import write_tables
from dragchain.validation.peaks import film
from dragchain.validation.peaks import tests as peaks
from dragchain.validation.peaks.dominant_chain import (
    FORCE_FACTORS,
    SETTINGS,
    around_workpiece,
    describe,
    frame_rows,
    frame_table,
    lives,
    overlap,
    path_chain,
)
from dragchain.validation.peaks.report import write_peaks
from dragchain.validation.peaks.tests import (
    RunSeries,
    judge,
    peak_rows,
    peak_table,
    study,
    study_of,
)

FRAMES = 400
INTERVAL_S = 0.01

# --- circular shifts -------------------------------------------------------------------------


def test_shifted_means_are_means_around_moved_events() -> None:
    rng = np.random.default_rng(3)
    series = rng.normal(size=50)
    series[[3, 4, 20]] = np.nan
    events = np.array([0, 10, 48])
    found = shifted_means(series, events, Window(-1, 2))
    for shift in range(50):
        near = (events[:, None] + shift + np.arange(-1, 3)).ravel() % 50
        assert found[shift] == pytest.approx(np.nanmean(series[near]))


def test_a_frame_without_a_value_counts_in_no_mean() -> None:
    series = np.array([np.nan, 2.0, np.nan, 4.0])
    found = shifted_means(series, np.array([0]), Window(0, 0))
    assert np.isnan(found[[0, 2]]).all()
    assert found[[1, 3]].tolist() == pytest.approx([2.0, 4.0])


def test_shifts_of_one_run_give_the_exact_p_value() -> None:
    series = np.zeros(100)
    series[[7, 40]] = [1.0, 2.0]
    by_shift = [shifted_means(series, np.array([7]), Window(0, 0))]
    every = np.arange(100)[:, None]
    found = shift_test(by_shift, every)
    # two shifts of a hundred reach the value, and the true position counts once more
    assert found.value == pytest.approx(1.0)
    assert found.p_greater == pytest.approx(3 / 101)
    assert found.p_less == pytest.approx(100 / 101)


def test_runs_are_shifted_independently_and_averaged() -> None:
    first, second = np.arange(4.0), np.array([10.0, 20.0])
    found = joint([first, second], np.array([[0, 0], [3, 1], [1, 2]]))
    assert found.tolist() == [5.0, 11.5, 5.5]
    shifts = draw_shifts([4, 2], 500)
    assert shifts.max(axis=0).tolist() == [3, 1]
    assert abs(np.corrcoef(shifts.T)[0, 1]) < 0.15


def test_a_run_without_a_value_is_left_out() -> None:
    found = joint([np.array([np.nan, 1.0]), np.array([2.0, 4.0])], np.array([[0, 0], [1, 1]]))
    assert found.tolist() == [2.0, 2.5]


def test_a_constant_series_has_no_standardised_mean() -> None:
    assert np.isnan(standardised(np.ones(5), np.ones(5))).all()


def test_holm_steps_down() -> None:
    found = holm([0.01, 0.04, 0.03, np.nan, 0.5])
    assert found[[0, 1, 2, 4]].tolist() == pytest.approx([0.04, 0.09, 0.09, 0.5])
    assert np.isnan(found[3])
    # never below the adjustment of Benjamini and Hochberg, which controls less
    values = np.array([0.001, 0.2, 0.03, 0.012])
    assert (holm(values) >= false_discovery_control(values)).all()


def test_the_band_holds_for_95_percent_of_shifts() -> None:
    rng = np.random.default_rng(8)
    series = np.convolve(rng.normal(size=FRAMES + 9), np.ones(10), "valid")
    by_shift = [standardised(series, shifted_means(series, np.arange(5) * 70, Window(0, 0)))]
    lags = np.arange(-30, 31)
    width = band(by_shift, np.arange(FRAMES)[:, None], lags)
    largest = [np.abs(by_shift[0][(s + lags) % FRAMES]).max() for s in range(FRAMES)]
    # several shifts share one maximum, so that more than 95 % can be inside
    assert np.mean(np.array(largest) <= width) >= 0.95
    assert np.mean(np.array(largest) < 0.999 * width) < 0.95


# --- chains that cause peaks, and chains that do not -----------------------------------------


def wander(rng: np.random.Generator, count: int = FRAMES) -> np.ndarray:
    """Return a series with memory: an autoregressive process of first order."""
    steps = rng.normal(size=count + 100)
    for at in range(1, len(steps)):
        steps[at] += 0.9 * steps[at - 1]
    return steps[100:]


def made_run(rng: np.random.Generator, pull: float, name: str = "made") -> RunSeries:
    """Return a run whose drag follows the strength of its chain by `pull`."""
    strength = np.exp(0.2 * wander(rng))
    noise = wander(rng)
    resistance = pull * np.log(strength) / 0.2 + noise
    time_s = np.arange(FRAMES) * INTERVAL_S
    particles = [[1, 2, 3 + at // 20] for at in range(FRAMES)]
    azimuth = rng.uniform(-1.0, 1.0, FRAMES)
    columns: dict[str, Any] = {
        "particle_ids": np.array(particles), "time_s": time_s, "resistance_n": resistance,
        "exists": np.ones(FRAMES), "azimuth_rad": azimuth, "angle_rad": np.abs(azimuth),
        "inclination_rad": azimuth, "altitude_m": 0.03 + 0.01 * azimuth,
        "bottleneck_n": strength, "bottleneck_over_mean": strength, "outer_over_mean": strength,
        "bottleneck_over_drag": wander(rng), "workpiece_fraction": wander(rng),
        "stands_out": strength, "particles": wander(rng), "straightness": wander(rng),
        **vars(lives(particles, time_s)),
    }  # fmt: skip
    table = peak_table(time_s, -resistance, time_s, 0.1)
    return RunSeries(
        name, name, time_s, resistance, table, table, 0.1, 1, (columns,) * len(SETTINGS)
    )


def verdicts(found: dict[str, Any]) -> dict[str, str]:
    return {row["statement"]: row["verdict"] for row in found["statements"]}


def test_chains_that_make_the_peaks_are_found() -> None:
    rng = np.random.default_rng(11)
    made = study_of([made_run(rng, 3.0, str(number)) for number in range(4)])
    found = verdicts(made.found)
    assert found["presence"] == found["dominance"] == "proved"
    assert found["coverage"] in ("supported", "proved")
    assert found["reverse"] in ("supported", "proved")
    assert found["orientation"] == "not supported" or found["orientation"] == "refuted"
    assert made.found["answer"][0].startswith("Yes, as far")
    json.dumps(made.found, allow_nan=False)


def test_chains_that_have_nothing_to_do_with_the_peaks_are_not_found() -> None:
    rng = np.random.default_rng(12)
    made = study_of([made_run(rng, 0.0, str(number)) for number in range(4)])
    for verdict in verdicts(made.found).values():
        assert verdict in ("not supported", "refuted")
    assert made.found["answer"][0].startswith("These runs do not show it")


def test_chains_that_weaken_at_peaks_refute_their_presence() -> None:
    rng = np.random.default_rng(13)
    made = study_of([made_run(rng, -3.0, str(number)) for number in range(4)])
    assert verdicts(made.found)["presence"] == "refuted"


def test_false_positives_are_as_many_as_the_level_says() -> None:
    sets, level = 200, 0.05
    hits, p_values = 0, []
    for seed in range(sets):
        rng = np.random.default_rng(1000 + seed)
        by_shift = []
        for _ in range(2):
            series, drag = wander(rng), wander(rng)
            events = find_drag_peaks(np.arange(FRAMES) * INTERVAL_S, drag, min_separation_s=0.1)
            means = shifted_means(series, events.index, Window(-2, 2))
            by_shift.append(standardised(series, means))
        p_values.append(shift_test(by_shift, draw_shifts([FRAMES] * 2, 999)).p_greater)
        hits += p_values[-1] < level
    assert binom.ppf(0.005, sets, level) <= hits <= binom.ppf(0.995, sets, level)
    assert np.mean(p_values) == pytest.approx(0.5, abs=2.6 / math.sqrt(12 * sets))


def test_a_chain_that_follows_the_peak_does_not_lead_it() -> None:
    rng = np.random.default_rng(14)
    runs = []
    for _ in range(4):
        run = made_run(rng, 3.0)
        late = tuple(
            {**columns, "bottleneck_over_mean": np.roll(columns["bottleneck_over_mean"], 10)}
            for columns in run.columns
        )
        runs.append(RunSeries(**{**vars(run), "columns": late}))
    made = study_of(runs)
    order = next(
        row for row in made.found["tests"] if row["descriptor"] == "order" and row["default"]
    )
    assert order["effect"] < 0.0 and order["p_claimed"] > 0.95
    lag = made.found["lags"]["free_path"]["bottleneck_over_mean"]["peak_lag_s"]
    assert lag == pytest.approx(0.1, abs=0.03)


def test_slow_peaks_are_not_those_of_a_vibration() -> None:
    time_s = np.arange(0.0, 10.0, 1e-3)
    slow = np.sin(2 * np.pi * time_s / 2.0)
    shaken = slow + 0.8 * np.sin(2 * np.pi * time_s / 3.3e-3)
    found = peak_table(time_s, -peaks.averaged(time_s, shaken), time_s[::10], 0.3)
    # what is left of the vibration, 2 %, moves the top of so slow a wave by less than 0.1 s
    assert found["process_time_s"].to_numpy() == pytest.approx([0.5, 2.5, 4.5, 6.5, 8.5], abs=0.1)
    inside = slice(25, -25)
    assert peaks.averaged(time_s, slow)[inside] == pytest.approx(slow[inside], abs=0.002)


def test_holm_counts_only_the_claims_at_the_default_thresholds() -> None:
    made = study_of([made_run(np.random.default_rng(15), 1.0)])
    family = made.tests[made.tests["p_holm"].notna()]
    assert family["default"].all() and (family["claim"] != 0).all()
    assert (family["peaks"] == "all").all()
    assert made.found["limits"]["family"] == len(family)
    # one fill has no interval over fills
    assert made.tests["ci95_low"].isna().all()


def test_a_built_in_test_alone_proves_nothing() -> None:
    rows = []
    for definition in ("widest_path", "free_path"):
        for at in range(3):
            rows.append(
                {
                    "peaks": "all", "definition": definition, "thresholds": str(at),
                    "default": at == 0, "statement": "dominance",
                    "descriptor": "workpiece_fraction",
                    "label": "fraction", "built_in": "value", "claim": 1, "effect": 2.0,
                    "ci95_low": 1.8, "ci95_high": 2.2, "expected": 0.0, "p_claimed": 1e-4, "p_holm": 1e-3,
                }
            )  # fmt: skip
    free = {"descriptor": "stands_out", "built_in": "none", "effect": 0.0, "ci95_low": -0.1,
            "ci95_high": 0.1, "p_claimed": 0.5, "p_holm": 1.0}  # fmt: skip
    table = pd.DataFrame([*rows, *({**one, **free} for one in rows[3:])])
    row = next(one for one in judge(table) if one["statement"] == "dominance")
    assert row["by_definition"]["widest_path"]["verdict"] == "supported"
    assert row["by_definition"]["widest_path"]["built_in"] == "value"
    assert row["verdict"] == "refuted"


def test_a_peak_row_ranks_its_chain() -> None:
    run = made_run(np.random.default_rng(16), 3.0)
    table = peak_rows([run])
    assert len(table) == len(run.peaks) * len(SETTINGS)
    first = table.iloc[0]
    strength = run.columns[0]["bottleneck_over_mean"]
    assert first["rank"] == pytest.approx((strength < strength[first["frame"]]).mean())


# --- lifetimes -------------------------------------------------------------------------------


def test_overlap_is_shared_over_all() -> None:
    assert overlap([1, 2, 3], [2, 3, 4]) == 0.5
    assert overlap([1, 2], [3]) == 0.0
    assert overlap([], []) == 0.0


def test_lives_of_a_sequence_made_by_hand() -> None:
    sequence = [[1, 2, 3], [2, 3, 4], [], [7, 8], [7, 8], [9, 8, 6], [9, 8, 6]]
    found = lives(sequence, 0.01 * np.arange(7))
    assert found.life.tolist() == [0, 0, -1, 1, 1, 2, 2]
    assert found.life_s[[0, 1, 3, 4, 5, 6]] == pytest.approx(np.full(6, 0.02))
    assert np.isnan(found.life_s[2]) and np.isnan(found.age_s[2])
    assert found.age_s[[0, 1, 3, 4]] == pytest.approx([0.0, 0.01, 0.0, 0.01])
    assert found.left_s[[0, 1, 3, 4]] == pytest.approx([0.01, 0.0, 0.01, 0.0])
    assert found.cut.tolist() == [True, True, False, False, False, True, True]


def test_lives_that_are_cut_off_count_as_longer_than_seen() -> None:
    run = made_run(np.random.default_rng(17), 1.0)
    particles = [[1]] * 100 + [[2]] * 20 + [[3]] * 280
    columns = {**run.columns[0], **vars(lives(particles, run.time_s))}
    cut = RunSeries(**{**vars(run), "columns": (columns,) * len(SETTINGS)})
    found = peaks.lifetimes([cut], 0)
    assert found["lives"] == 3 and found["cut"] == 2
    # one known end of three lives: 2/3 last longer, and no median can be told
    assert found["survival"]["fraction"][0] == pytest.approx(2 / 3)
    assert found["median_s"] is None


def test_frames_without_a_chain_have_no_life() -> None:
    found = lives([[], [], []], 0.01 * np.arange(3))
    assert found.life.tolist() == [-1, -1, -1] and np.isnan(found.life_s).all()
    assert not found.cut.any()


# --- descriptors -----------------------------------------------------------------------------


def straight_chain(first: float = 4.0) -> NetworkFrame:
    """Return a chain along x from the workpiece to the side, and weak contacts."""
    contacts = [(1, WORKPIECE, first), (1, 2, 3.0), (2, 3, 5.0), (3, SIDE, 6.0)]
    return make_frame(row(3) | {9: (0.5, 0.5, R)}, [*contacts, (9, FLOOR, 0.01)])


def test_numbers_of_a_straight_chain() -> None:
    frame = straight_chain()
    around = around_workpiece(frame)
    assert around.resistance_n == pytest.approx(4.0)
    assert around.mean_n == pytest.approx(18.01 / 5)
    assert around.shell_n == pytest.approx(3.0)
    found = describe(frame, around, path_chain(frame, with_workpiece=True))
    assert found["bottleneck_n"] == 3.0
    assert found["outer_over_mean"] == pytest.approx(5.0 / around.mean_n)
    assert found["bottleneck_over_drag"] == pytest.approx(0.75)
    assert found["workpiece_fraction"] == pytest.approx(1.0)
    assert found["stands_out"] == pytest.approx(1.0)
    assert found["particles"] == 3.0 and found["straightness"] == pytest.approx(1.0)
    assert found["angle_rad"] == pytest.approx(0.0)
    assert found["altitude_m"] == pytest.approx(0.03)


def test_the_force_on_the_workpiece_plays_no_part_in_the_free_path() -> None:
    numbers = []
    for first in (2.0, 40.0):
        frame = straight_chain(first)
        chain = path_chain(frame, with_workpiece=False)
        assert chain is not None
        numbers.append(frame.normal_force[chain.contacts].min())
    assert numbers == [3.0, 3.0]
    weakened = path_chain(straight_chain(2.0), with_workpiece=True)
    assert weakened is not None and weakened.contacts[0] == 0


def tangle(seed: int) -> NetworkFrame:
    """Return particles at random with contacts and forces at random."""
    rng = np.random.default_rng(seed)
    count = 40
    centres = {particle: tuple(rng.uniform(0, 0.05, 3)) for particle in range(1, count + 1)}
    force = lambda: float(rng.lognormal(0.0, 1.2))  # noqa: E731
    pairs = {tuple(sorted(rng.choice(count, 2, replace=False) + 1)) for _ in range(120)}
    contacts = [(int(a), int(b), force()) for a, b in sorted(pairs)]
    contacts += [(particle, WORKPIECE, force()) for particle in range(1, 7)]
    contacts += [(particle, SIDE, force()) for particle in range(30, 36)]
    contacts += [(particle, FLOOR, force()) for particle in range(36, 41)]
    return make_frame(centres, contacts)


def lattice(seed: int) -> NetworkFrame:
    """Return 6 x 6 particles in contact with their neighbours, forces at random, workpiece on the
    left."""
    rng = np.random.default_rng(seed)
    ids = np.arange(1, 37).reshape(6, 6)
    centres = {int(ids[i, j]): (2 * R * i, 2 * R * j, 0.03) for i in range(6) for j in range(6)}
    pairs = [*zip(ids[:-1].ravel(), ids[1:].ravel(), strict=True)]
    pairs += zip(ids[:, :-1].ravel(), ids[:, 1:].ravel(), strict=True)
    pairs += [(particle, WORKPIECE) for particle in ids[0]] + [
        (particle, SIDE) for particle in ids[-1]
    ]
    return make_frame(centres, [(int(a), int(b), float(rng.lognormal())) for a, b in pairs])


@pytest.mark.parametrize("seed", range(12))
def test_every_threshold_has_the_path_that_the_search_at_it_finds(seed: int) -> None:
    frame = tangle(seed)
    rows = {SETTINGS[int(row["setting"])]: row for row in frame_rows(frame)}  # type: ignore[call-overload]
    for setting, found in rows.items():
        if not setting.is_path:
            continue
        with_workpiece = setting.definition == "widest_path"
        paths = widest_paths(frame, setting.force_factor, with_workpiece=with_workpiece)
        path = dominant_path(frame, paths, with_workpiece=with_workpiece)
        expected = [] if path is None else frame.particle_id[list(path.particles)].tolist()
        assert found["particle_ids"] == expected
        assert found["exists"] == float(path is not None)
    factors = [setting.force_factor for setting in SETTINGS if setting.definition == "widest_path"]
    assert factors == list(FORCE_FACTORS)


def test_the_default_chain_by_peters_is_the_strongest_of_the_table() -> None:
    seen = 0
    for seed in range(80):
        frame = lattice(seed)
        table = chain_table(frame)
        pushed = set(frame.particle_id[frame.a[frame.other == WORKPIECE]].tolist())
        touching = np.array(
            [not pushed.isdisjoint(ids) for ids in table["particle_ids"]], dtype=bool
        )
        peters = table[(table["definition"] == "peters") & touching]
        rows = {SETTINGS[int(row["setting"])]: row for row in frame_rows(frame)}  # type: ignore[call-overload]
        for setting, ours in rows.items():
            if not setting.default or setting.is_path:
                continue
            chains = (
                peters
                if setting.definition == "peters_workpiece"
                else peters[peters["reaches_bowl"]]
            )
            assert ours["exists"] == float(len(chains) > 0)
            if len(chains):
                best = chains.loc[chains["bottleneck_n"].idxmax()]
                assert set(ours["particle_ids"]) == set(best["particle_ids"])
                assert ours["bottleneck_n"] == best["bottleneck_n"]
                seen += 1
    assert seen > 10


def test_chains_on_the_workpiece_alone_are_told_from_chains_on_workpiece_and_bowl() -> None:
    contacts = [(1, WORKPIECE, 5.0), (1, 2, 5.0), (2, 3, 5.0), (3, 4, 5.0), (4, 5, 0.1)]
    weak = {91: (0.5, 0.5, R), 92: (0.5, 0.6, R)}
    frame = make_frame(row(5) | weak, [*contacts, (91, FLOOR, 0.01), (92, FLOOR, 0.01)])
    assert peters_chains(frame)
    found = {SETTINGS[int(row["setting"])]: row for row in frame_rows(frame)}  # type: ignore[call-overload]
    of_default = {setting.definition: row for setting, row in found.items() if setting.default}
    assert of_default["peters"]["exists"] == 0.0
    # stresses go as the sums of forces: 10, 10, 10, 5.1, 0.1, 0.01 and 0.01, with a mean of 5.03
    assert of_default["peters_workpiece"]["particle_ids"] == [1, 2, 3, 4]


def test_the_defaults_reproduce_the_table_of_chains(tiny_run: Path) -> None:
    write_tables(tiny_run)
    write_chains(tiny_run)
    chains = pd.read_parquet(tiny_run / "tables" / "chains.parquet")
    dominant = chains[chains["dominant"]].reset_index(drop=True)
    default = SETTINGS.index(
        next(s for s in SETTINGS if s.definition == "widest_path" and s.default)
    )
    table = frame_table(tiny_run)
    ours = table[(table["setting"] == default) & (table["exists"] > 0)].reset_index(drop=True)
    assert len(ours) > 1
    assert ours["step"].tolist() == dominant["step"].tolist()
    assert [list(ids) for ids in ours["particle_ids"]] == [
        list(ids) for ids in dominant["particle_ids"]
    ]
    for name in ("bottleneck_n", "azimuth_rad", "inclination_rad", "altitude_m"):
        assert ours[name].tolist() == dominant[name].tolist()


# --- pictures, film, command -----------------------------------------------------------------


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a made process run with one peak, with tables and chains."""
    run_dir = tmp_path_factory.mktemp("made")
    (run_dir / "case.json").write_text(json.dumps(case_json("process")))
    columns_json(run_dir, {"workpiece_contacts": printed(["step"], 10)})
    contacts, particles = network_tables()
    save(workpiece_force_table(), run_dir, "workpiece_force")
    save(contacts, run_dir, "contacts")
    save(particles, run_dir, "particles")
    save(workpiece_contacts_table(), run_dir, "workpiece_contacts")
    workpiece = pv.Cylinder(center=(0, 0, 0.025), direction=(0, 0, 1), radius=0.002, height=0.05)
    workpiece.triangulate().save(run_dir / "workpiece.stl")
    write_chains(run_dir)
    return run_dir


def test_the_command_writes_tables_figures_and_film(
    made: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(film, "PICTURES", 4)
    statements = write_peaks(tmp_path, [made])["statements"]
    assert "stronger chain from workpiece to bowl" in statements[0]["text"]
    found = json.loads((tmp_path / "peaks.json").read_text())
    assert found["runs"][0]["peaks"] == 1
    assert len(pd.read_parquet(tmp_path / "chain_peaks.parquet")) == len(SETTINGS)
    tests = pd.read_csv(tmp_path / "chain_tests.csv")
    assert len(tests) == len(pd.read_parquet(tmp_path / "chain_tests.parquet"))
    for name in ("chains_around_peaks", "chain_effects", "chain_geometry",
                 "peak_and_quiet_xy", "peak_and_quiet_xz"):  # fmt: skip
        with Image.open(tmp_path / "figures" / f"{name}.png") as picture:
            picture.load()
            assert min(picture.size) > 400
    with Image.open(tmp_path / "figures" / "peak_film.gif") as moving:
        assert moving.n_frames == 4
        assert moving.info["duration"] == film.PICTURE_MS
    page = section(found)
    assert html.escape(found["answer"][0]) in page and page.count("<img") == 6


def section(found: dict[str, Any]) -> str:
    template = page_environment().get_template("validation/peaks/peaks.html.j2")
    return template.render(found=found, picture=lambda name: f"data:{name}")


def test_no_run_is_refused() -> None:
    with pytest.raises(TableError, match="no folder of a run"):
        study([])


def test_a_drag_without_a_peak_is_refused(made: Path, tmp_path: Path) -> None:
    for name in ("case.json", "columns.json"):
        (tmp_path / name).write_bytes((made / name).read_bytes())
    for name in ("contacts", "particles", "network"):
        table = pd.read_parquet(made / "tables" / f"{name}.parquet")
        save(table, tmp_path, name)
    save(workpiece_force_table().assign(drag_n=-2.0), tmp_path, "workpiece_force")
    with pytest.raises(TableError, match="no peak"):
        study([tmp_path])


def test_the_film_shows_the_peak_itself() -> None:
    steps = np.arange(0, 3000, 10)
    chosen = film.film_steps(steps, steps * 1e-3, 1.5)
    assert 1500 in chosen and len(chosen) <= film.PICTURES
    assert np.ptp(np.diff(chosen)) == 0
    assert film.film_steps(steps, steps * 1e-3, 99.0).size == 0


def test_pictures_that_are_compared_share_one_scale() -> None:
    alone = cylinder_radii(np.array([1.0, 2.0]), R)
    shared = cylinder_radii(np.array([1.0, 2.0]), R, 4.0)
    assert alone.tolist() == [R / 2, R]
    assert shared.tolist() == [R / 4, R / 2]
