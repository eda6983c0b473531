"""The beds that timed decks start from, each filled or brought to rest once."""

import hashlib
import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from cost_decks import at_rest, workpiece_in
from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.render import deck_text
from dragdeck.engine.batch import Batch
from dragdeck.errors import DragdeckError
from dragdeck.physics.packing import Bed
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.scene import read_bed
from dragdeck.study.workpiece import Workpiece


@dataclass(frozen=True)
class Settled:
    """A settled bed, and its restart file as a deck sees it."""

    bed: Bed
    source: str


@dataclass(frozen=True)
class Beds:
    """Beds that timed decks start from.

    Attributes
    ----------
    batch : Batch
        Runs that fill a bed, bring the workpiece in or let a bed come to rest.
    """

    batch: Batch
    _settled: dict[str, Settled] = field(default_factory=dict, init=False)

    def settled(self, owner: Case) -> Settled:
        """The settled bed of a case, filled if it is not there yet.

        Raises
        ------
        InputError, EngineError, RejectedRunError
            As `Batch.result`.
        DragdeckError
            Its tables could not be made.
        """
        run = FILLING.run_id(owner)
        if run not in self._settled:
            self.batch.result(run, FILLING.build(owner, None))
            folder = self.batch.folder / run
            make_tables(folder)
            bed = read_bed(folder / "tables" / "packing.json")
            self._settled[run] = Settled(bed, self._seen(folder / "packing.restart"))
        return self._settled[run]

    def with_workpiece(self, case: Case, owner: Case) -> str:
        """Restart file of the bed with the workpiece in it, for a case's modulus and facets."""
        settled = self.settled(owner)
        begun = self._kept("workpiece-in", workpiece_in(owner, settled.bed, settled.source))
        if _walls(case) == _walls(owner):
            return begun
        return self._kept("at-rest", at_rest(case, settled.bed, begun))

    def _kept(self, name: str, scene: AnyScene) -> str:
        run = f"{name}-{digest(deck_text(scene, self.batch.templates))}"
        self.batch.result(run, scene)
        return self._seen(self.batch.folder / run / "bed.restart")

    def _seen(self, file: Path) -> str:
        """Path of a file as a deck sees it, from a folder two below that of the costs."""
        return os.path.relpath(file.resolve(), self.batch.folder.resolve().parent / "any" / "any")


def make_tables(folder: Path) -> None:
    """Have dragchain, as a program of its own, make the tables of a run.

    Raises
    ------
    DragdeckError
        It could not.
    """
    words = [sys.executable, "-m", "dragchain.cli", "tables", str(folder)]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        raise DragdeckError(f"{folder}: no tables were made\n{done.stderr}")


def _walls(case: Case) -> tuple[float, float | None, Workpiece]:
    """What a bed with a workpiece in it has to come to rest with: stiffness and facets."""
    study = case.study
    scale = study.chosen_fidelity().youngs_modulus_scale
    return scale, study.bowl.facet_size_m, study.workpiece


def digest(text: str) -> str:
    """The start of a text's hash."""
    return hashlib.sha256(text.encode()).hexdigest()[:8]
