"""Many runs in one folder: written, run, and not run again."""

from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import jinja2

from dragdeck.decks.deck import AnyScene
from dragdeck.decks.render import write_run
from dragdeck.engine.part import STATE_FILE
from dragdeck.engine.reports import Report, silent
from dragdeck.engine.run_folder import run
from dragdeck.errors import InputError, RejectedRunError
from dragdeck.records.run import RunRecord


@dataclass(frozen=True)
class Batch:
    """Runs side by side, each in a folder that has its run id as its name.

    A run of the same inputs is left as it is; one that was interrupted is gone on with.

    Attributes
    ----------
    folder : Path
        Gets a folder for each run.
    templates : jinja2.Environment
    report : callable
        Gets lines of each run.
    """

    folder: Path
    templates: jinja2.Environment
    report: Report = silent

    def result(self, name: str, scene: AnyScene) -> RunRecord:
        """Write a run and bring it to a result.

        Raises
        ------
        InputError
            The scene's template cannot be used.
        EngineError
            No LIGGGHTS, or it was interrupted.
        RejectedRunError
            An acceptance check did not pass.
        """
        return run(self._written(name, scene), self.report)

    def each(
        self, scenes: Mapping[str, Callable[[], AnyScene]], report: Report, cores: int = 1
    ) -> dict[str, str]:
        """Bring many runs to their ends; a run that fails or cannot be written is a finding.

        Parameters
        ----------
        scenes : mapping of str to callable
            Name of a run: what makes its scene.
        report : callable
            Gets a line for each run.
        cores : int
            So many run at the same time; nothing but the line of each is said of them.

        Returns
        -------
        dict of str to str
            Why a run could not be written, by its name.

        Raises
        ------
        EngineError
            No LIGGGHTS, or it was interrupted.
        """
        folders, refused = {}, {}
        for name, make in scenes.items():
            try:
                scene = make()
            except InputError as error:
                refused[name] = str(error)
            else:
                folders[name] = self._written(name, scene)
        with ProcessPoolExecutor(cores) as pool:
            records = pool.map(_ended, folders.values())
            for number, name in enumerate(scenes, 1):
                state = "refused" if name in refused else next(records).state
                report(f"{self.folder.name} {number} of {len(scenes)}: {name}: {state}")
        return refused

    def _written(self, name: str, scene: AnyScene) -> Path:
        """Write the input files of a run; its folder."""
        deck = replace(scene.deck, run=name)
        case = scene.case.model_copy(update={"run": name})
        write_run(replace(scene, deck=deck, case=case), self.folder / name, self.templates)
        return self.folder / name


def _ended(folder: Path) -> RunRecord:
    """Bring a run to its end, good or bad: its `state` is ``failed`` if a check did not pass."""
    try:
        return run(folder, silent)
    except RejectedRunError:
        return RunRecord.read(folder / STATE_FILE)
