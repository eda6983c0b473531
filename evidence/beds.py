"""Settled beds that the runs of a campaign start from, and drags through them."""

from dataclasses import replace
from pathlib import Path

from dragchain.tables.write import write_tables
from dragdeck.cases.case import Case
from dragdeck.decks import PACKING_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import read_bed


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
    bed = FILLING.run_id(case)
    scene = process_scene(case, read_bed(settled(batch, bed, FILLING.build(case, None))))
    deck = replace(scene.deck, source=f"../{bed}/{PACKING_FILE}")
    batch.result(name, replace(scene, deck=deck))
    write_tables(batch.folder / name)
    say(f"dragged: {name}")
    return batch.folder / name
