"""Settled beds that the runs of a campaign start from."""

from pathlib import Path

from dragchain.tables.write import write_tables
from dragdeck.decks.deck import AnyScene
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say


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
