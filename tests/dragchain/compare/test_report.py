"""Cases side by side: differences, effects of factors, and the page."""

import json
import math
import shutil
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pages import stands_alone
from report_files import (
    PICTURES,
    case_json,
    change_scripts,
    make_run,
    process_findings,
    write_quantities,
)

from dragchain.cli import main
from dragchain.compare.factors import effects_of
from dragchain.compare.report import read_compared, write_comparison
from dragchain.errors import TableError
from dragchain.quantities.document import EXTRAPOLATED, Extrapolated, LoadMap
from dragchain.quantities.registry import REPORTED
from dragchain.statistics.estimate import Estimate

DEEP, FAST = "bowl.height_m", "media.radius_mean_m"
DEPTH, SPEED, TOGETHER = 0.8, 0.3, 0.1
PACKING = {11: 0.5, 12: -0.2, 13: 0.05}
"""What a packing adds to the drag of every case, N."""


def drag(deep: int, fast: int, seed: int) -> float:
    """Planted: effects from low to high, their interaction, the packing, a bit of scatter."""
    x, y = 2 * deep - 1, 2 * fast - 1
    scatter = 0.01 * math.sin(7 * deep + 3 * fast + seed)
    return (DEPTH * x + SPEED * y + TOGETHER * x * y) / 2 + PACKING[seed] + scatter


def study(results: Path, seeds: tuple[int, ...] = tuple(PACKING)) -> list[Path]:
    """A sweep over two fields with their packings."""
    folders = []
    for deep, fast, seed in product((0, 1), (0, 1), seeds):
        changes = {DEEP: (0.2, 0.4)[deep], FAST: (0.1, 0.3)[fast], "seed": seed}
        name = f"deep-{deep}_fast-{fast}_seed-{seed}"
        case = case_json("process", name, changes, case=name)
        folder = make_run(results, case, process_findings(), PICTURES, drag(deep, fast, seed))
        write_quantities(folder)
        patches = np.full(48, 0.1 + 0.1 * deep) + 0.01 * np.sin(seed * np.arange(48))
        found = LoadMap(soft=patches, value=patches, std=np.zeros(48), soft_error=0.1, error=0.05)
        Extrapolated(load_map=found).write(folder / EXTRAPOLATED)
        (folder / "network.html").write_text("<p>network</p>")
        folders.append(folder)
    return folders


def test_differences_are_taken_packing_by_packing(tmp_path: Path) -> None:
    folders = study(tmp_path)
    write_comparison(tmp_path / "out", folders)
    table = pd.read_csv(tmp_path / "out/differences.csv").set_index(["case", "quantity"])
    row = table.loc[("deep-1_fast-0", "drag_mean")]
    own = [drag(1, 0, seed) - drag(0, 0, seed) for seed in PACKING]
    half = 4.302652730 * np.std(own, ddof=1) / math.sqrt(3)  # Student's t with two degrees
    assert row["paired"]
    assert row["difference"] == pytest.approx(np.mean(own))
    assert row["difference_ci95_high"] - row["difference"] == pytest.approx(half)
    assert row["relative"] == pytest.approx(np.mean(own) / row["first"])


def test_a_case_whose_scripts_templates_changed_is_named(tmp_path: Path) -> None:
    folders = [one for one in study(tmp_path, (11,)) if "fast-0" in one.name]
    change_scripts(folders[1], "base.in.j2 (contact_model)")
    (tmp_path / "out").mkdir()
    (tmp_path / "out/effects.csv").touch()
    write_comparison(tmp_path / "out", folders)
    assert not (tmp_path / "out/effects.csv").exists(), "of an earlier comparison"
    page = (tmp_path / "out/comparison.html").read_text(encoding="utf-8")
    assert "Input scripts changed by templates: base.in.j2 (contact_model). (deep-1_fast-0" in page


def test_different_packings_join_their_intervals(tmp_path: Path) -> None:
    folders = [one for one in study(tmp_path) if "fast-0" in one.name]
    shared = [one for one in folders if "deep-0_fast-0_seed-13" not in one.name]
    write_comparison(tmp_path / "out", shared)
    row = pd.read_csv(tmp_path / "out/differences.csv").set_index("quantity").loc["drag_mean"]
    halves = []
    for deep, seeds, quantile in ((0, (11, 12), 12.706204736), (1, (11, 12, 13), 4.302652730)):
        values = [drag(deep, 0, seed) for seed in seeds]
        halves.append(quantile * np.std(values, ddof=1) / math.sqrt(len(seeds)))
    assert not row["paired"]
    assert row["difference_ci95_high"] - row["difference"] == pytest.approx(math.hypot(*halves))


def test_planted_effects_are_found(tmp_path: Path) -> None:
    write_comparison(tmp_path / "out", study(tmp_path))
    table = pd.read_csv(tmp_path / "out/effects.csv")
    found = table[table["quantity"] == "drag_mean"].set_index("factors")
    for factors, planted in ((DEEP, DEPTH), (FAST, SPEED), (f"{DEEP} x {FAST}", TOGETHER)):
        row = found.loc[factors]
        assert row["effect_ci95_low"] < planted < row["effect_ci95_high"]
        assert row["effect_ci95_high"] - row["effect_ci95_low"] < 0.04


def test_a_packing_of_each_case_leaves_no_interaction(tmp_path: Path) -> None:
    write_comparison(tmp_path / "out", study(tmp_path, seeds=(11,)))
    table = pd.read_csv(tmp_path / "out/effects.csv")
    assert set(table["factors"]) == {DEEP, FAST}


CENTRES = {"flat": 0.0, "angled": 10.0, "rounded": 0.0}
"""Planted means of three words."""


def planted(random: np.random.Generator, levels: list[Any], seeds: int, curved: Any) -> Any:
    """Effects of a factor with these levels and of one with two, with and without packings."""
    seed_effects = random.normal(0, 0.5, seeds)
    cases = {
        (level, fast): {
            seed: SimpleNamespace(
                run=Estimate.around(
                    curved(level) + 0.3 * fast + seed_effects[seed] + random.normal(0, 0.01), 0.0
                )
            )
            for seed in range(seeds)
        }
        for level in levels
        for fast in (0, 1)
    }
    factors = dict(zip(("edge", "fast"), map(list, zip(*cases, strict=True)), strict=True))
    some: Any = [SimpleNamespace(by_seed=one) for one in cases.values()]
    with pytest.MonkeyPatch.context() as patch:
        name = "dragchain.compare.factors.standings_of"
        patch.setattr(name, lambda case, quantity: case.by_seed)
        return effects_of(some, factors, REPORTED[0])


@pytest.mark.parametrize(
    ("levels", "curved"),
    [([*CENTRES], CENTRES.get), ([0.1, 0.2, 0.4], lambda speed: 100 * (speed - 0.25) ** 2)],
)
def test_no_response_is_put_on_a_line(levels: list[Any], curved: Any) -> None:
    """Words, and numbers on a parabola: every level has its effect, others keep their precision."""
    found = planted(np.random.default_rng(3), levels, 3, curved)
    effects = {tuple(zip(one.factors, one.levels, strict=True)): one.effect for one in found}
    first, *others = levels
    for level in others:
        effect = effects[(("edge", f"{first} to {level}"),)]
        assert effect.contains(curved(level) - curved(first))
        assert effect.half_width < 0.02
        both = effects[(("edge", f"{first} to {level}"), ("fast", "0 to 1"))]
        assert abs(both.value) < 0.02
    assert effects[(("fast", "0 to 1"),)].value == pytest.approx(0.3, abs=0.02)
    assert effects[(("fast", "0 to 1"),)].half_width < 0.02


def test_intervals_of_effects_contain_what_was_planted() -> None:
    """In 95 % of draws, from 2 packings, whose differences are blocks."""
    random, inside = np.random.default_rng(5), []
    for _ in range(120):
        for one in planted(random, [*CENTRES], 2, CENTRES.get):
            truth = 10.0 * ("angled" in one.levels[0]) if len(one.factors) == 1 else 0.0
            inside.append(one.effect.contains(0.3 if one.factors == ("fast",) else truth))
    assert np.mean(inside) == pytest.approx(0.95, abs=0.035)


def test_page_and_linked_networks(tmp_path: Path) -> None:
    write_comparison(tmp_path / "out", study(tmp_path))
    text = (tmp_path / "out/comparison.html").read_text(encoding="utf-8")
    page = stands_alone(text, beside=["networks.html"])
    assert len(page.images) == 1
    assert "deep-1_fast-1" in page.words
    linked = (tmp_path / "out/networks.html").read_text(encoding="utf-8")
    assert linked.count("<iframe") == 4
    assert (tmp_path / "out/network-4.html").is_file()


def test_a_packing_named_again_counts_once(tmp_path: Path) -> None:
    """By another path, through a link, as a copy, or within its study: the same comparison."""
    folders = study(tmp_path / "results")
    (tmp_path / "link").symlink_to(tmp_path / "results")
    copied = Path(shutil.copytree(folders[0], tmp_path / "copies" / folders[0].name))
    again = [tmp_path / "link" / one.relative_to(tmp_path / "results") for one in folders[::-1]]
    again += [folders[1] / ".." / folders[1].name, *folders[:3], copied]
    cases = [read_compared(some) for some in (folders, [*folders, *again])]
    one, other = ([(c.name, [*c.by_seed], len(c.case.studies)) for c in some] for some in cases)
    assert one == other
    names = ["compare", *map(str, folders), *map(str, again)]
    assert main([*names, "--out", str(tmp_path / "twice")]) == 0
    write_comparison(tmp_path / "once", folders)
    for file in ("differences.csv", "effects.csv"):
        assert (tmp_path / "twice" / file).read_text() == (tmp_path / "once" / file).read_text()


def test_results_before_and_after_an_edit_of_a_template_are_two_cases(tmp_path: Path) -> None:
    after = [one for one in study(tmp_path / "after", (11,)) if "fast-0" in one.name]
    for folder in after:
        record = json.loads((folder / "run.json").read_text())
        (folder / "run.json").write_text(json.dumps(record | {"inputs": "1e"}))
    before = [one for one in study(tmp_path / "before", (11,)) if one.name == after[0].name]
    names = [case.name for case in read_compared([*before, *after])]
    assert len(names) == len(set(names)) == 3
    assert names[0].startswith("before/") and names[1].startswith("after/")


def test_a_study_is_not_compared_with_itself(tmp_path: Path) -> None:
    packings = [one for one in study(tmp_path) if "deep-0_fast-0" in one.name]
    with pytest.raises(TableError, match="at least two cases"):
        read_compared(packings * 2)
