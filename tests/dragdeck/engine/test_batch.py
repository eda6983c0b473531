"""Runs side by side: each in a folder of its name, rejected ones with a record."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.errors import InputError, RejectedRunError
from dragdeck.project import Project
from dragdeck.records.run import RunRecord
from dragdeck.scenes.drop_test import drop_scene

pytestmark = pytest.mark.engine


@pytest.fixture
def batch(project: Project, tmp_path: Path) -> Batch:
    return Batch(tmp_path / "runs", environment(project.templates))


def test_a_run_has_the_name_of_its_folder_and_is_not_repeated(case: Case, batch: Batch) -> None:
    first, again = (batch.result("one", drop_scene(case)) for _ in range(2))
    assert first == again and first.state == "complete"
    assert json.loads((batch.folder / "one" / "case.json").read_text())["run"] == "one"
    assert "Run:         one\n" in (batch.folder / "one" / "in.liggghts").read_text()


def test_a_rejected_run_has_a_record_but_is_no_result(case: Case, batch: Batch) -> None:
    scene = drop_scene(case)
    many = scene.case.model_copy(update={"fidelity": scene.case.fidelity.model_copy(
        update={"ranks": 2})})  # fmt: skip
    wrong = replace(scene, case=many, deck=replace(scene.deck, processors="1 1 1"))
    lines: list[str] = []
    assert batch.each({"two": lambda: wrong, "three": lambda: scene}, lines.append, cores=2) == {}
    assert lines == ["runs 1 of 2: two: failed", "runs 2 of 2: three: complete"]
    assert RunRecord.read(batch.folder / "two" / "state.json").state == "failed"
    with pytest.raises(RejectedRunError):
        batch.result("two", wrong)
    assert not (batch.folder / "two" / "run.json").exists()


def test_a_run_of_many_that_cannot_be_written_is_a_finding(case: Case, batch: Batch) -> None:
    def refuse() -> AnyScene:
        raise InputError("too soft")

    lines: list[str] = []
    refused = batch.each({"one": lambda: drop_scene(case), "two": refuse}, lines.append)
    assert list(refused) == ["two"] and "too soft" in refused["two"]
    assert lines == ["runs 1 of 2: one: complete", "runs 2 of 2: two: refused"]
