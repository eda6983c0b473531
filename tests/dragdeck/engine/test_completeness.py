"""Which steps the parts of a run hold."""

import math
from pathlib import Path

import pytest

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.engine.completeness import coverage, cut_outputs, first_gap
from dragdeck.engine.record import RunPart

FORCE = OutputOfRun(
    kind="print",
    binary=False,
    pattern="force.{part}.txt",
    columns=["step", "force_n"],
    engine_columns=None,
    period_steps=10,
    first_step=10,
    last_step=60,
    rows_per_particle=0.0,
)
HEAD = "step force_n\n"


def rows(*steps: int) -> str:
    return HEAD + "".join(f"{step} 1.5\n" for step in steps)


def parts(*from_steps: int) -> list[RunPart]:
    return [
        RunPart(part=number, checkpoint=None, from_step=step)
        for number, step in enumerate(from_steps, 1)
    ]


@pytest.mark.parametrize(
    ("texts", "starts", "gap"),
    [
        ([rows(10, 20, 30, 40, 50, 60)], [0], None),
        ([rows(10, 20, 30)], [0], 40),
        ([rows(10, 30, 40, 50, 60)], [0], 20),
        ([rows(10, 20, 30), rows(40, 50, 60)], [0, 30], None),
        ([rows(10, 20, 30, 40), rows(30, 40, 50, 60)], [0, 25], None),
        ([rows(10, 20), rows(40, 50, 60)], [0, 30], 30),
        # what a later part begins before does not count: it must write it again
        ([rows(10, 20, 30, 40), rows(40, 50, 60)], [0, 20], 30),
        ([HEAD + "10 1.5\n2" + rows(30, 40, 50, 60)], [0], 20),
        ([HEAD + "10 1.5\n20 1.5\n30 1." + rows()], [0], 30),
    ],
)
def test_the_first_missing_step_is_found(
    tmp_path: Path, texts: list[str], starts: list[int], gap: int | None
) -> None:
    for number, text in enumerate(texts, 1):
        (tmp_path / f"force.{number}.txt").write_text(text)
    assert coverage(tmp_path, FORCE, parts(*starts)).gap == gap
    wanted = math.inf if gap is None else gap
    assert first_gap(tmp_path, {"force": FORCE}, parts(*starts)) == wanted


def test_what_follows_a_hole_is_cut(tmp_path: Path) -> None:
    file = tmp_path / "force.1.txt"
    file.write_text(rows(10, 20) + "30 1.\x00\x00\n40 1.5\n")
    assert cut_outputs(tmp_path, {"force": FORCE}, parts(0), 60) == [file.name]
    assert file.read_text() == rows(10, 20)
    assert cut_outputs(tmp_path, {"force": FORCE}, parts(0), 60) == []


def test_what_the_next_part_writes_again_is_cut(tmp_path: Path) -> None:
    file = tmp_path / "force.1.txt"
    file.write_text(rows(10, 20) + rows(30))
    assert cut_outputs(tmp_path, {"force": FORCE}, parts(0), 20) == []
    assert file.read_text() == rows(10, 20) + HEAD
    cut_outputs(tmp_path, {"force": FORCE}, parts(0), -1)
    assert file.read_text() == HEAD


def test_an_output_that_the_engine_decides_on_has_no_gap(tmp_path: Path) -> None:
    decided = FORCE.model_copy(update={"last_step": None, "period_steps": 1})
    (tmp_path / "force.1.txt").write_text(rows(17, 18, 40))
    assert coverage(tmp_path, decided, parts(0)).gap is None
