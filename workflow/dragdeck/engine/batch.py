"""Many runs in one folder: written, run, and not run again."""

from collections.abc import Callable, Mapping
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

    def run(self, name: str, scene: AnyScene) -> RunRecord:
        """Write a run and bring it to its end, good or bad.

        Returns
        -------
        RunRecord
            Its `state` is ``failed`` if an acceptance check did not pass.

        Raises
        ------
        InputError
            The scene's template cannot be used.
        EngineError
            No LIGGGHTS, or it was interrupted.
        """
        try:
            return self.result(name, scene)
        except RejectedRunError:
            return RunRecord.read(self.folder / name / STATE_FILE)

    def result(self, name: str, scene: AnyScene) -> RunRecord:
        """Write a run and bring it to a result.

        Raises
        ------
        InputError, EngineError
            As `run`.
        RejectedRunError
            An acceptance check did not pass.
        """
        deck = replace(scene.deck, run=name)
        case = scene.case.model_copy(update={"run": name})
        write_run(replace(scene, deck=deck, case=case), self.folder / name, self.templates)
        return run(self.folder / name, self.report)

    def each(self, scenes: Mapping[str, Callable[[], AnyScene]], report: Report) -> dict[str, str]:
        """Bring many runs to their ends; a run that fails or cannot be written is a finding.

        Parameters
        ----------
        scenes : mapping of str to callable
            Name of a run: what makes its scene.
        report : callable
            Gets a line for each run.

        Returns
        -------
        dict of str to str
            Why a run could not be written, by its name.

        Raises
        ------
        EngineError
            No LIGGGHTS, or it was interrupted.
        """
        refused = {}
        for number, (name, make) in enumerate(scenes.items(), 1):
            try:
                scene = make()
            except InputError as error:
                state, refused[name] = "refused", str(error)
            else:
                state = self.run(name, scene).state
            report(f"{self.folder.name} {number} of {len(scenes)}: {name}: {state}")
        return refused
