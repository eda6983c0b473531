"""Tables, figures, film and section of the page."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from figure_files import (
    save,
    workpiece_force_table,
    write_process_run,
)
from networks import R
from peak_runs import findings
from PIL import Image

from dragchain.errors import TableError
from dragchain.figures.network_picture import cylinder_radii
from dragchain.report.page import page_environment
from evidence.validation.peaks import film
from evidence.validation.peaks.findings import Findings
from evidence.validation.peaks.report import report_peaks
from evidence.validation.peaks.runs import read_run
from evidence.validation.peaks.settings import SETTINGS


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a made process run with one peak, with tables and chains."""
    return write_process_run(tmp_path_factory.mktemp("made"))


@pytest.fixture(scope="module")
def written(made: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the report on that run."""
    folder = tmp_path_factory.mktemp("peaks")
    report_peaks([made], pictures=4).write(folder)
    return folder


@pytest.mark.slow
def test_tables_figures_and_film_are_written(written: Path) -> None:
    found = Findings.read(written / "peaks.json")
    assert [row.peaks for row in found.runs] == [1]
    assert len(pd.read_parquet(written / "chain_peaks.parquet")) == len(SETTINGS)
    tests = pd.read_csv(written / "chain_tests.csv")
    assert len(tests) == len(pd.read_parquet(written / "chain_tests.parquet")) == len(found.tests)
    for name in ("chains_around_peaks", "chain_effects", "chain_geometry",
                 "peak_and_quiet_xy", "peak_and_quiet_xz"):  # fmt: skip
        with Image.open(written / "figures" / f"{name}.png") as picture:
            picture.load()
            assert min(picture.size) > 400
    with Image.open(written / "figures" / film.FILM) as moving:
        assert moving.n_frames == 4
        assert moving.info["duration"] == film.PICTURE_MS


def section(found: Findings) -> str:
    template = page_environment(package="evidence").get_template("validation/peaks/peaks.html.j2")
    content = json.loads(found.as_text())
    return template.render(found=content, picture=lambda name: f"data:{name}")


@pytest.mark.parametrize(("seed", "pull", "answer"), [(11, 3.0, "yes"), (12, 0.0, "no")])
def test_the_section_answers_by_the_verdicts(seed: int, pull: float, answer: str) -> None:
    found = findings(seed, pull)
    page = section(found)
    assert f'data-answer="{answer}"' in page and page.count("<img") == 6
    shown = next(
        test for test in found.tests
        if test.in_family and (test.definition, test.descriptor) == ("free_path", "coverage")
    )  # fmt: skip
    assert f"of {100 * shown.effect:.0f} % of the peaks" in page


def test_a_drag_without_a_peak_is_refused(made: Path, tmp_path: Path) -> None:
    for name in ("case.json", "columns.json"):
        (tmp_path / name).write_bytes((made / name).read_bytes())
    for name in ("contacts", "particles", "network"):
        table = pd.read_parquet(made / "tables" / f"{name}.parquet")
        save(table, tmp_path, name)
    save(workpiece_force_table().assign(drag_n=-2.0), tmp_path, "workpiece_force")
    with pytest.raises(TableError, match="no peak"):
        read_run(tmp_path)


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
