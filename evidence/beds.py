"""Designed cases of this project, settled beds that runs start from, and drags through them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from dragchain.tables.write import write_tables
from dragdeck.cases.case import Case
from dragdeck.decks import PACKING_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.project import find_project
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import read_bed
from dragdeck.study.yaml import read_yaml
from dragdeck.sweep.cases import settle_case
from dragdeck.sweep.design import Design, Variation


class Repeated(Variation):
    """Points of a design and the number of their packings: seeds 1, 2, ... if they set none."""

    packings: int = 1


Block = TypeVar("Block", bound=Repeated)


def designed(kind: type[Design[Block]], file: Path, name: str) -> Iterator[tuple[Block, Case]]:
    """The cases of a design, packing by packing of each point, of the study in its file."""
    data: Any = read_yaml(file)
    for block, values in kind.read(file, name).settings():
        for seed in range(1, block.packings + 1):
            numbered = {**values, "seed": values.get("seed", seed)}
            yield block, settle_case(file, data["study"], numbered)


def batch_here(name: str) -> Batch:
    """The runs of this name in the results of this project."""
    project = find_project(Path.cwd())
    return Batch(project.results(name), environment(project.templates))


def settled(batch: Batch, name: str, filling: AnyScene) -> Path:
    """Settle a bed if it is not there yet; its ``packing.json``.

    Raises
    ------
    EngineError
        No LIGGGHTS, or it was interrupted.
    RejectedRunError
        The bed did not come to rest.
    """
    batch.result(name, filling)
    write_tables(batch.folder / name)
    say(f"bed settled: {name}")
    return batch.folder / name / "tables" / "packing.json"


def filled(batch: Batch, case: Case) -> Path:
    """Settle the bed of a case if it is not there yet; see `settled`."""
    return settled(batch, FILLING.run_id(case), FILLING.build(case, None))


def dragged(batch: Batch, name: str, case: Case) -> Path:
    """Drag through the bed of a case, which is settled first; the folder of the run.

    Raises
    ------
    InputError
        The workpiece does not fit, or its mesh cannot be used.
    EngineError
        No LIGGGHTS, or it was interrupted.
    RejectedRunError
        A check of the run or of its filling did not pass.
    """
    scene = process_scene(case, read_bed(filled(batch, case)))
    deck = replace(scene.deck, source=f"../{FILLING.run_id(case)}/{PACKING_FILE}")
    batch.result(name, replace(scene, deck=deck))
    write_tables(batch.folder / name)
    say(f"dragged: {name}")
    return batch.folder / name
