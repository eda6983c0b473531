"""What ``./run`` shows of a workflow: a line per run of LIGGGHTS, and one for the whole study.

Snakemake finds logger plugins by the names of top-level packages. Its own messages go to its log
only. Of a job that failed, its own last message is shown; other warnings and errors in full.
"""

import atexit
import logging
import re
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text
from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.settings import LogHandlerSettingsBase

from dragdeck.engine.reports import printable, shown_time
from dragdeck.outlook.explain import Cost
from dragdeck.outlook.runs import StudyRun, by_their_speeds, done_fraction, time_left
from dragdeck.snakemake_lock import why_locked

_TOLD = (
    "CalledProcessError in file",
    "Exiting because a job execution failed.",
    "At least one job did not complete",
)
"""What Snakemake says of a failed job beside the message of the job itself."""

_MESSAGE = re.compile(r"^(?:dragdeck|dragchain|evidence): .*", re.MULTILINE | re.DOTALL)
"""The message that a command ended with, and all after it."""

_LOG_BYTES, _LAST_LINES = 20_000, 10
"""How much of a job's log is read, and shown where no command ended with a message."""

_BAR, _SHORTEST_NAME = 20, 12
"""Characters of the bar, and of a run's name that is cut to make room for its numbers."""


@dataclass
class LogHandlerSettings(LogHandlerSettingsBase):
    """Options of the command line, ``--logger-dragdeck-...``."""

    every_s: float = field(
        default=60.0,
        metadata={"help": "seconds between the lines of a run where there is no terminal"},
    )


@dataclass(frozen=True)
class _Job:
    """A job that Snakemake has started.

    Its rule says with the resource ``engine`` that it runs LIGGGHTS in the folder of its output,
    and with ``prints`` that it writes to the terminal itself.
    """

    rule: str
    folder: Path | None
    prints: bool

    @classmethod
    def of(cls, record: logging.LogRecord) -> "_Job":
        values = vars(record)
        resources = values["resources"]
        folder = Path.cwd() / Path(values["output"][0]).parent if resources.get("engine") else None
        return cls(values["rule_name"], folder, bool(resources.get("prints")))


class LogHandler(LogHandlerBase):
    """Shows how far the runs of a workflow are."""

    settings: LogHandlerSettings

    def __post_init__(self) -> None:
        common = self.common_settings
        self._console = Console(
            stderr=not common.stdout, no_color=common.nocolor, highlight=False, markup=False,
            emoji=False, soft_wrap=True,
        )  # fmt: skip
        self._everything = any(
            (common.dryrun, common.printshellcmds, common.verbose, common.debug_dag)
        )
        self._held: list[str] | None = []
        self._jobs: dict[int, _Job] = {}
        self._runs: dict[Path, StudyRun] = {}
        self._cores = 1
        self._done, self._all = 0, 0
        self._live: Live | None = None
        self._ending = threading.Event()
        if not self._console.is_terminal:
            threading.Thread(target=self._say_now_and_then, daemon=True).start()
        atexit.register(self._hide)

    def emit(self, record: logging.LogRecord) -> None:
        """Show a message of Snakemake, or note what it says of a job."""
        try:
            self._heed(record)
        except Exception:
            self.handleError(record)

    def close(self) -> None:
        """Show what was held back, if nothing was run."""
        self._ending.set()
        self._hide()
        for text in self._held or ():
            self._console.print(Text(text))
        self._held = None
        super().close()

    writes_to_stream = True
    writes_to_file = False
    has_filter = False
    has_formatter = False
    needs_rulegraph = False

    def _heed(self, record: logging.LogRecord) -> None:
        values = vars(record)
        event = values.get("event")
        if event == LogEvent.JOB_INFO and not self._everything:
            self._started(values["jobid"], _Job.of(record))
        elif event == LogEvent.JOB_FINISHED:
            self._ended(values["job_id"])
        elif event == LogEvent.JOB_ERROR and not self._everything:
            self._end_with_error(values)
        elif event == LogEvent.PROGRESS:
            self._done, self._all = values["done"], values["total"]
        elif "plan" in values:
            self._runs = {run.folder: run for run in values["plan"]}
            self._cores = values["cores"]
        self._print(record, event)
        self._show_or_hide()

    def _print(self, record: logging.LogRecord, event: LogEvent | None) -> None:
        """Print a message, unless it is one of those that go to the log only."""
        shown = self._everything or record.levelno > logging.INFO or hasattr(record, "shown")
        if event == LogEvent.RUN_INFO:
            self._held = None
        locked = getattr(record, "exception", None) == "LockException"
        said = (why_locked(Path(".snakemake")) if locked else None) or self.format(record)
        told = event == LogEvent.JOB_ERROR or any(words in said for words in _TOLD)
        if told and not self._everything:
            return
        if text := printable(said).strip("\n"):
            if shown or text.startswith("Complete log"):
                style = "red" if record.levelno >= logging.ERROR else ""
                self._console.print(Text(text, style))
            elif event is None and self._held is not None:
                self._held.append(text)

    def _end_with_error(self, values: Mapping[str, Any]) -> None:
        """Say of a job that failed what its command said last, and where the rest is."""
        job = self._jobs.get(values["jobid"])
        self._ended(values["jobid"])
        logs = [Path(name) for name in values["log"] if Path(name).is_file()]
        said = [values["rule_msg"] or "", *(map(_last_words, [] if job and job.prints else logs))]
        name = "" if job and job.folder else f"{values['rule_name']}: failed"
        more = [f"  log of the job: {log}" for log in logs]
        for text in filter(None, (name, *said, *more)):
            self._console.print(Text(printable(text).strip("\n"), "red"))

    def _started(self, number: int, job: _Job) -> None:
        self._jobs[number] = job
        if job.folder and not self._console.is_terminal:
            self._console.print(Text(f"{self._run(job.folder).name}: started"))

    def _ended(self, number: int) -> None:
        job = self._jobs.pop(number, None)
        if job and job.folder:
            run = self._runs[job.folder] = self._run(job.folder)
            self._console.print(Text(str(run)))

    def _run(self, folder: Path) -> StudyRun:
        """A run as it is now."""
        return (self._runs.get(folder) or _unplanned(folder)).now()

    def _active(self) -> list[StudyRun]:
        return [self._run(job.folder) for job in list(self._jobs.values()) if job.folder]

    # --- without a terminal ------------------------------------------------------------

    def _say_now_and_then(self) -> None:
        while not self._ending.wait(self.settings.every_s):
            runs = self._active()
            lines = [*map(str, runs), *([self._overall(runs)] if self._jobs else [])]
            for line in lines:
                self._console.print(Text(line))

    # --- on a terminal -----------------------------------------------------------------

    def _show_or_hide(self) -> None:
        """Show live lines while jobs run, but none while a job prints something itself."""
        jobs = self._jobs.values()
        wanted = self._console.is_terminal and jobs and not any(job.prints for job in jobs)
        if not wanted:
            self._hide()
        elif self._live is None:
            self._live = Live(
                get_renderable=self._screen, console=self._console, transient=True,
                refresh_per_second=1, redirect_stdout=False, redirect_stderr=False,
            )  # fmt: skip
            self._live.start()
        else:
            self._live.refresh()

    def _hide(self) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _screen(self) -> Group:
        active = self._active()
        lines = Table.grid(padding=(0, 1))
        cells = [run.cells for run in active]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        left = max(_SHORTEST_NAME, self._console.width - sum(widths) - 4)
        for run, row in zip(active, cells, strict=True):
            name = Text(run.name, no_wrap=True)
            name.truncate(left, overflow="ellipsis")
            lines.add_row(name, *(Text(text, no_wrap=True) for text in row))
        overall = Table.grid(padding=(0, 1))
        overall.add_column(min_width=_BAR)
        overall.add_column(no_wrap=True, overflow="ellipsis")
        runs = self._together(active)
        done = done_fraction(runs) if runs else self._done / max(1, self._all)
        overall.add_row(ProgressBar(1.0, done, width=_BAR), Text(self._overall(active)))
        slow = [  # wrapped, which the console itself does not do
            Text(f"{run.name}: {run.slow}", overflow="fold", no_wrap=False)
            for run in active
            if run.slow
        ]
        return Group(lines, *slow, overall) if active else Group(overall)

    def _together(self, active: list[StudyRun]) -> list[StudyRun]:
        """All runs of which it is known what to expect."""
        runs = {**self._runs, **{run.folder: run for run in active}}
        return by_their_speeds([run for run in runs.values() if run.cost.steps])

    def _overall(self, active: list[StudyRun]) -> str:
        """How far the whole study is; only of runs of LIGGGHTS is known how long they take."""
        runs, said = self._together(active), []
        if runs:
            left = time_left(runs, self._cores)
            time = f", about {shown_time(left)} left" if left else ""
            said = [f"runs {100 * done_fraction(runs):.0f} %{time}"]
        others = dict.fromkeys(job.rule for job in list(self._jobs.values()) if not job.folder)
        now = f": {', '.join(others)}" if others else ""
        jobs = f"{self._done} of {self._all} jobs done" if self._all else "no job done"
        return "; ".join([*said, f"{jobs}{now}"])


def _last_words(log: Path) -> str:
    """The message that a job ended with, or else the end of its log."""
    with log.open("rb") as stream:
        stream.seek(max(0, log.stat().st_size - _LOG_BYTES))
        text = stream.read().decode("utf-8", "replace").strip()
    said = _MESSAGE.search(text)
    return said.group() if said else "\n".join(text.splitlines()[-_LAST_LINES:])


def _unplanned(folder: Path) -> StudyRun:
    """A run of which nothing is expected, as those of the verification suite."""
    return StudyRun(folder.parent.name, folder, None, 1, Cost(0, 0.0, "assumed"), 0.0)
