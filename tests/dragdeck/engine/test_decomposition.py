"""How many ranks a run gets, and what each of them gets."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_study import Load, Made

from dragdeck.cases.ranks import CORES_VARIABLE, FEWEST_PARTICLES_A_RANK, auto_ranks
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.engine.acceptance import ranks_check
from dragdeck.engine.log import decomposition
from dragdeck.errors import InputError
from dragdeck.outlook.process import bed_notes
from dragdeck.physics.domain_split import FilledBowl, rank_warnings, split
from dragdeck.physics.walls import round_container
from dragdeck.project import Project
from dragdeck.records.run import Decomposition, ParticlesPerRank
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import PROCESS
from dragdeck.sweep.cases import load_cases

WriteStudy = Callable[..., Path]

BOWL = FilledBowl(
    particles=1000, bowl=round_container(0.3), height_m=0.09, half_widths_m=(0.31, 0.31),
    bottom_m=0.0, top_m=0.35, reach_m=0.008,
)  # fmt: skip
COLUMN = FilledBowl(
    particles=1000, bowl=round_container(0.02), height_m=0.5, half_widths_m=(0.02, 0.02),
    bottom_m=0.0, top_m=0.5, reach_m=0.008,
)  # fmt: skip


@pytest.mark.parametrize("ranks", [1, 2, 3, 4, 6, 7, 12, 60])
def test_every_particle_has_one_rank(ranks: int) -> None:
    for filled in (BOWL, COLUMN):
        found = split(ranks, filled)
        assert np.prod(found.grid) == ranks == len(found.particles)
        assert sum(found.particles) == pytest.approx(1000, rel=1e-4)
        assert found.largest >= max(found.particles)


@pytest.mark.parametrize("ranks", [2, 4, 6, 8, 9, 25])
def test_a_wide_bowl_is_split_along_the_floor_as_the_engine_does_it(ranks: int) -> None:
    found = split(ranks, BOWL)
    assert found.grid[2] == 1
    assert found.line == "* * 1"


def test_sixteen_ranks_do_better_than_the_square_that_the_engine_would_choose() -> None:
    found = split(16, BOWL)
    assert found.line == "8 2 1"
    square = (0.31 / 2) ** 2 / (np.pi * 0.3**2)  # a cell at the centre, all within the bowl
    assert max(found.particles) < 1000 * square


def test_a_strip_of_a_disc_holds_what_geometry_says() -> None:
    found = split(3, BOWL)
    edge = 0.31 / 3 / 0.3  # of the middle strip, over the radius
    middle = 2 * (np.arcsin(edge) + edge * np.sqrt(1 - edge**2)) / np.pi
    assert sorted(found.particles)[-1] == pytest.approx(1000 * middle, rel=1e-4)


def test_a_tall_column_is_split_along_its_height() -> None:
    found = split(4, COLUMN)
    assert found.grid == (1, 1, 4)
    assert found.line == "1 1 4"
    assert found.particles == pytest.approx([250] * 4)
    ends, inner = 0.5 / 4 + 0.008, 0.5 / 4 + 2 * 0.008
    assert ends < inner
    assert found.largest == pytest.approx(1000 * inner / 0.5)


def test_room_above_the_bed_speaks_against_a_split_along_the_height() -> None:
    roomy = FilledBowl(**{**vars(COLUMN), "top_m": 2.0})
    assert split(2, roomy).grid == (2, 1, 1)


def test_a_rank_without_particles_gets_a_warning() -> None:
    roomy = FilledBowl(**{**vars(BOWL), "half_widths_m": (0.9, 0.9)})
    (caution,) = rank_warnings(split(36, roomy))
    assert "ranks would have no particle" in caution.text and "fidelity.ranks" in caution.text


def test_an_uneven_split_gets_a_warning() -> None:
    roomy = FilledBowl(**{**vars(BOWL), "half_widths_m": (0.38, 0.38)})
    found = split(6, roomy)
    assert found.idle == 0
    (caution,) = rank_warnings(found)
    assert f"{found.most_over_mean:.2g} times the mean" in caution.text
    for ranks in (4, caution.settings["ranks"]):
        assert rank_warnings(split(ranks, roomy)) == []


def test_many_cases_get_a_core_each_and_one_big_case_gets_them_all() -> None:
    enough = 100 * FEWEST_PARTICLES_A_RANK
    assert auto_ranks(enough, cases=1, cores=16) == 16
    assert auto_ranks(enough, cases=5, cores=16) == 3
    assert auto_ranks(enough, cases=200, cores=16) == 1
    assert auto_ranks(FEWEST_PARTICLES_A_RANK - 1, cases=1, cores=16) == 1
    assert auto_ranks(3 * FEWEST_PARTICLES_A_RANK, cases=1, cores=16) == 3


def test_auto_depends_on_the_study_and_the_machine_but_run_ids_do_not(
    small: dict[str, Any], write_study: WriteStudy, monkeypatch: pytest.MonkeyPatch, load: Load
) -> None:
    small["media"]["count"] = 4 * FEWEST_PARTICLES_A_RANK
    small["bowl"] |= {"radius_m": 0.3}
    small["fidelity"] = {"youngs_modulus_scale": 1e-3, "ranks": "auto"}
    file = write_study(small)
    ids = set()
    for cores in (1, 2, 4):
        monkeypatch.setenv(CORES_VARIABLE, str(cores))
        (case,) = load_cases(file)
        assert case.ranks == cores
        assert filling_scene(case).case.fidelity.ranks == cores
        assert f"{cores} (auto: 1 case on {cores} cores)" in dict(bed_notes(case))["ranks"]
        ids.add(PROCESS.run_id(case))
    assert len(ids) == 1
    monkeypatch.setenv(CORES_VARIABLE, "4")
    assert [case.ranks for case in load({"sweep": {"seed": [1, 2]}})] == [2, 2]


@pytest.mark.parametrize("value", ["0", "two", "-1", "1.5", ""])
def test_a_strange_number_of_cores_is_refused(
    monkeypatch: pytest.MonkeyPatch, value: str, made: Made
) -> None:
    case = made({"fidelity": {"ranks": "auto"}})
    monkeypatch.setenv(CORES_VARIABLE, value)
    with pytest.raises(InputError, match="not a number of cores"):
        _ = case.ranks


@pytest.mark.parametrize("value", [0, -1, 1.5, "all", True])
def test_other_ranks_are_refused(value: object, load: Load) -> None:
    with pytest.raises(InputError, match=r"fidelity\.ranks"):
        load({"fidelity": {"ranks": value}})


@pytest.mark.parametrize("ranks", [1, 2, 4, "auto"])
def test_an_upright_bowl_leaves_the_split_to_the_engine(
    project: Project, ranks: object, made: Made
) -> None:
    case = made({"fidelity": {"youngs_modulus_scale": 1e-3, "ranks": ranks}})
    text = deck_text(filling_scene(case), environment(project.templates))
    assert "\nprocessors * * 1\n" in text


SCREEN = """Created orthogonal box = (-0.3 -0.3 0) to (0.3 0.3 0.35)
  2 by 1 by 1 MPI processor grid
Nlocal:    500 ave 510 max 490 min
Nghost:    40 ave 40 max 40 min
Nlocal:    500 ave 505 max 495 min
"""


def test_the_split_is_read_from_what_the_engine_printed() -> None:
    found = decomposition(SCREEN)
    assert found == Decomposition(
        grid=(2, 1, 1), particles=ParticlesPerRank(mean=500.0, most=505, least=495)
    )
    check = ranks_check(found, 2)
    assert check.passed and check.seen == "2 by 1 by 1, 495 to 505 particles per rank"


def test_an_engine_that_runs_once_a_rank_is_found_out() -> None:
    alone = decomposition(SCREEN.replace("2 by 1 by 1", "1 by 1 by 1"))
    assert not ranks_check(alone, 2).passed
    assert decomposition("nothing of it") is None
    assert not ranks_check(None, 1).passed


def test_particles_too_soft_for_their_bed_get_a_warning_with_a_way_out(
    small: dict[str, Any], made: Made
) -> None:
    small["media"]["count"], small["bowl"]["height_m"] = 3000, 1.0
    case = made({"fidelity": {"youngs_modulus_scale": 1e-4}})
    (caution,) = [one for one in filling_scene(case).warnings if one.code == "overlap"]
    assert "ABOVE" in dict(bed_notes(case))["overlap"]
    small["fidelity"] |= caution.settings
    assert f"at least {small['fidelity']['youngs_modulus_scale']:g}" in caution.text
    case = made()
    assert "overlap" not in [one.code for one in filling_scene(case).warnings]
