"""What the rules of rounds wait for: windows of a run, and the settings of a search.

Each round is a checkpoint: what it says decides which runs the next one has.
"""

import json
from collections.abc import Callable
from functools import partial
from itertools import count
from pathlib import Path
from shlex import quote
from typing import Any

from dragdeck import project as projects
from dragdeck.calls import _stop, or_stop
from dragdeck.cases.case import Case, digest
from dragdeck.decks import RUN_FILE
from dragdeck.errors import InputError
from dragdeck.rules import Wildcards, Workflow
from dragdeck.scenes.lead import counted_blocks, whole_drag, whole_lengths, windows_of
from dragdeck.scenes.process import PROCESS, SCENES
from dragdeck.study.search import RECORD, SearchRecord, SearchRound
from dragdeck.study.yaml import read_study

_READ_OF_RUN = ("findings", "quantities", "extrapolated")
"""Documents that a search reads of a run."""


class WorkflowInRounds(Workflow):
    """What a call of Snakemake works on, with its rounds."""

    search: SearchRecord | None = None

    # --- windows ---------------------------------------------------------------------------

    def windows_of_run(self, wildcards: Wildcards) -> list[Case]:
        """All windows that a run may have."""
        return windows_of(self.case_of("process", wildcards))

    def _judged(self, wildcards: Wildcards, number: int) -> str:
        """The file of a round of windows, which is judged first."""
        return self.made("judge_windows", study=wildcards.study, run=wildcards.run, round=number)

    def round_before(self, wildcards: Wildcards) -> list[str]:
        """The file of the round before, if there is one; it is judged first."""
        number = int(wildcards.round)
        return [self._judged(wildcards, number - 1)] if number > 1 else []

    def windows_of_round(self, wildcards: Wildcards) -> list[str]:
        """The folders of the windows that a round judges: those that the one before wanted."""
        wanted = self._said_before(wildcards).get("wanted", 0)
        return self._window_folders(wildcards, self.windows_of_run(wildcards)[:wanted])

    def drag_of_round(self, wildcards: Wildcards) -> list[str]:
        """The folder of the whole drag, if the round before wanted it instead of more windows."""
        if not self._said_before(wildcards).get("whole"):
            return []
        return self._window_folders(wildcards, whole_drag(self.case_of("process", wildcards)))

    def _said_before(self, wildcards: Wildcards) -> dict[str, Any]:
        """The content of the round before; nothing before the first."""
        before = self.round_before(wildcards)
        said: dict[str, Any] = json.loads(Path(before[0]).read_text()) if before else {}
        return said

    def _window_folders(self, wildcards: Wildcards, windows: list[Case]) -> list[str]:
        runs = map(PROCESS.run_id, windows)
        return [projects.run_path(wildcards.study, projects.WINDOWS, run) for run in runs]

    def measured_of_round(self, wildcards: Wildcards) -> list[str]:
        """The quantities of the runs that a round judges."""
        folders = [*self.windows_of_round(wildcards), *self.drag_of_round(wildcards)]
        return [f"{folder}/tables/quantities.json" for folder in folders]

    def last_round(self, wildcards: Wildcards) -> str | list[str]:
        """The last round of windows of a run, if it has any."""
        if not self.windows_of_run(wildcards):
            return []
        return _last(partial(self._judged, wildcards))

    def windows_options(self, wildcards: Wildcards) -> str:
        """What the windows of a run are asked for, as options of the command line."""
        study = self.case_of("process", wildcards).study
        asked = study.chosen_fidelity().windows
        assert asked is not None
        quantities = " ".join(map(quote, asked.quantities))
        drag = "".join(f" --drag {quote(folder)}" for folder in self.drag_of_round(wildcards))
        return (
            f"--tolerance {asked.tolerance} --quantities {quantities}"
            f" --most {len(self.windows_of_run(wildcards))}"
            f" --lengths {whole_lengths(study):.6g} --sample {counted_blocks(study)[1]:.6g}"
            f" {self.packings_option(wildcards)}{drag}"
        )

    # --- searches --------------------------------------------------------------------------

    def asked_of_search(self, wildcards: Wildcards) -> str:
        """Hash of the study with its search."""
        return digest(read_study(self.of(wildcards.study).cases[0].file))

    def _chosen(self, study: str, number: int) -> str:
        """The file of a round of settings, which are chosen first: cases of the study from then."""
        file = self.made("choose_settings", study=study, round=number)
        record = or_stop(SearchRecord.read, self.project.results(study) / RECORD)
        work = self.of(study)
        if record != work.search:
            work.search = record
            work.read_cases()
        return file

    def _runs_of_settings(self, study: str, number: int) -> list[str]:
        """The folders of the runs of the settings of a round."""
        runs = SearchRound.read(Path(self._chosen(study, number))).runs
        return [projects.run_path(study, "process", run) for run in runs]

    def ended_of_round(self, wildcards: Wildcards) -> list[str]:
        """How the runs of the settings of a round have ended."""
        folders = self._runs_of_settings(wildcards.study, int(wildcards.round))
        return [f"{folder}/{projects.ENDED}" for folder in folders]

    def known_of_search(self, wildcards: Wildcards) -> list[str]:
        """What is read of the runs before a round, which end first: of those that are complete."""
        study, files = wildcards.study, list(self.of(wildcards.study).needed_advice)
        for number in range(1, int(wildcards.round)):
            self.made("try_settings", study=study, round=number)
            for folder in self._runs_of_settings(study, number):
                if Path(folder, RUN_FILE).is_file():
                    files += [f"{folder}/tables/{name}.json" for name in _READ_OF_RUN]
                    case = self.of(study).runs_of("process")[Path(folder).name]
                    bed = projects.run_path(study, "filling", SCENES["filling"].run_id(case))
                    files.append(f"{bed}/tables/findings.json")
        return files

    def last_settings(self, _: object) -> str:
        """The last round of the study's search."""
        or_stop(self.project.searched, self.study)
        if self.fidelity:
            problem, remedy = "a search has the fidelity of its study", "set fidelity in the study"
            _stop(InputError(problem, value=f"fidelity={self.fidelity}", remedy=remedy))
        return _last(partial(self._chosen, self.study))


def _last(made: Callable[[int], str]) -> str:
    """The file of the last round; each round is made first."""
    return next(file for file in map(made, count(1)) if json.loads(Path(file).read_text())["last"])
