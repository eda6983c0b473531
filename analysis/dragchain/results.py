"""The results of a study as Python objects: `load`."""

import os
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Literal

import pandas as pd
import pyarrow.parquet as pq

from dragchain.errors import TableError, UnknownNameError
from dragchain.quantities.basis import Basis, notes
from dragchain.quantities.document import EXTRAPOLATED, Extrapolated
from dragchain.report.cases import read_if_there
from dragchain.report.findings import FINDINGS_FILE, ProcessFindings
from dragchain.report.run_data import RunData, process_findings
from dragchain.report.values import Values, values_of
from dragchain.run.case import upstream_folders
from dragchain.tables.by_step import intact, read_table
from dragchain.tables.columns import descriptions, unit_of
from dragdeck.errors import InputError, RejectedRunError
from dragdeck.project import by_folder, find_project
from dragdeck.records.run import read_accepted
from dragdeck.scenes.lead import with_leads
from dragdeck.scenes.process import PROCESS

_ON_WORKPIECE = (
    *("workpiece_force", "workpiece_contacts", "sphere_contacts", "facets", "contact_events"),
)
_NETWORK = ("particles", "contacts", "network", "clusters", "chains")
_TABLES: Mapping[str, tuple[str, ...]] = {
    "process": (*_ON_WORKPIECE, *_NETWORK, "thermo"),
    "filling": ("particles", "thermo"),
    "drop_test": ("impacts", "thermo"),
}


class _Units(dict[str, str]):
    """Units by column."""

    def __missing__(self, column: str) -> str:
        raise UnknownNameError(f"no table of this run has a column {column!r}", column, self)


def _units(files: Iterable[Path]) -> _Units:
    fields = (field for file in files if file.is_file() for field in pq.read_schema(file))
    return _Units((field.name, unit_of(field)) for field in fields)


def _describe(column: str, units: Mapping[str, str], tables: tuple[str, ...]) -> str:
    """The meanings of a column in these tables and its unit."""
    unit = f" ({units[column]})" if units[column] not in ("", "1") else ""
    texts = {name: text for name, text in descriptions(column).items() if name in tables}
    if len(set(texts.values())) < 2:
        return "".join(f"{text}{unit}" for text in set(texts.values()))
    groups = groupby(sorted(texts, key=texts.__getitem__), texts.__getitem__)
    return "\n".join(f"{', '.join(names)}: {text}{unit}" for text, names in groups)


def _table(name: str, rows: str) -> "cached_property[pd.DataFrame]":
    """A table of a run that is read when it is first used."""

    def read(run: "FinishedRun") -> pd.DataFrame:
        return run.table(name)

    read.__doc__ = f"``{name}.parquet``, one row per {rows}."
    return cached_property(read)


class FinishedRun(RunData):
    """A run with its tables, each of which is read on first use and kept in memory.

    Reading a table that was not made raises `TableError`, which names the command that makes it.

    Attributes
    ----------
    folder : Path
        The run folder.
    case : Case
        Content of ``case.json``: the simulated case and its settings.
    force, workpiece_contacts, facets, events : DataFrame
        Process only: force on the workpiece, contacts on it, its facets, and contact events.
    sphere_contacts : DataFrame
        Process with clumps only: contacts of their spheres on the workpiece.
    particles, contacts, network, clusters, chains : DataFrame
        Process only: the frames of the contact network. A filling also has ``particles``.
    impacts : DataFrame
        Drop test only: one row per impact.
    thermo : DataFrame
        Kinetic energies over time.

    Raises
    ------
    TableError
        When a table is read that does not exist; the message names the command that makes it.
    """

    force = _table("workpiece_force", "sample")
    workpiece_contacts = _table("workpiece_contacts", "contact on the workpiece and sample")
    sphere_contacts = _table("sphere_contacts", "contact of a clump's sphere and sample")
    facets = _table("facets", "facet (mesh element) of the workpiece")
    events = _table("contact_events", "contact event on the workpiece")
    particles = _table("particles", "particle and frame")
    contacts = _table("contacts", "contact and network frame")
    network = _table("network", "network frame in the statistics")
    clusters = _table("clusters", "threshold and network frame in the statistics")
    chains = _table("chains", "chain and network frame in the statistics")
    impacts = _table("impacts", "impact of the drop test")
    thermo = _table("thermo", "output of the whole system")

    @property
    def name(self) -> str:
        """Name of the case; for a filling or a drop test the run id."""
        return self.case.case or self.case.run

    @cached_property
    def units(self) -> Mapping[str, str]:
        """Unit of each column of all tables: ``1`` if dimensionless, empty for text and flags."""
        return _units(self.file(f"{name}.parquet") for name in _TABLES[self.case.scene])

    def describe(self, column: str) -> str:
        """Meaning and unit of a column of the run's tables.

        Parameters
        ----------
        column : str
            Name of the column.

        Returns
        -------
        str
            One line, or one line per meaning if tables use the name differently.

        Raises
        ------
        UnknownNameError
            If no table of the run has this column.
        """
        return _describe(column, self.units, _TABLES[self.case.scene])

    def table(self, name: str, columns: list[str] | None = None) -> pd.DataFrame:
        """Read a table, or some of its columns; `attrs` has study, run, units and basis.

        Parameters
        ----------
        name : str
            Name of the file without ``.parquet``.
        columns : list of str, optional
            Columns to read; all if None.

        Raises
        ------
        UnknownNameError
            If the scene has no such table, or the table no such column.
        TableError
            If the table does not exist; the message names the command that makes it.
        """
        tables = _TABLES[self.case.scene]
        if name not in tables:
            others = "".join(f", a {scene} has" for scene in _TABLES if name in _TABLES[scene])
            problem = f"a {self.case.scene} has no table {name!r}{others}"
            raise UnknownNameError(problem, name, tables)
        file = self.file(f"{name}.parquet")
        with intact(file):
            known = pq.read_schema(file).names
        for column in set(columns or ()) - set(known):
            raise UnknownNameError(f"{file}: no column {column!r}", column, known)
        table = read_table(file, columns)
        process = self.case.scene == "process"
        table.attrs |= {
            "study": self.case.study_name,
            "run": self.case.run,
            "units": {name: self.units[name] for name in table.columns},
            "basis": " ".join(notes(self.case)) if process else str(Basis.SIMULATED),
        }
        return table

    @cached_property
    def values(self) -> Values:
        """Quantities of a process run, each with what it says of the process, as in the report.

        They are read from ``quantities.json``, or computed if it does not exist; errors as in
        `findings`.
        """
        if self.case.scene != "process":
            raise TableError(f"{self.folder}: the scene is {self.case.scene}, not process")
        extrapolated = read_if_there(Extrapolated, self.folder / EXTRAPOLATED)
        return values_of(self.case, self.quantities, extrapolated)

    @cached_property
    def findings(self) -> ProcessFindings:
        """Means, profiles and peaks of a process run, as its report shows them.

        They are read from ``findings.json``, or computed if it does not exist; errors as in
        `write_findings`.
        """
        if self.case.scene != "process":
            raise TableError(f"{self.folder}: the scene is {self.case.scene}, not process")
        file = self.folder / FINDINGS_FILE
        return ProcessFindings.read(file) if file.is_file() else process_findings(self)

    def upstream(self, scene: Literal["filling", "drop_test"]) -> "FinishedRun":
        """Filling or drop test that belongs to a process run.

        Parameters
        ----------
        scene : {"filling", "drop_test"}
            Which of the two.

        Returns
        -------
        FinishedRun
            That run.

        Raises
        ------
        UnknownNameError
            If there is none.
        DocumentError
            If its folder does not exist.
        """
        folders = upstream_folders(self.folder, self.case)
        if scene not in folders:
            raise UnknownNameError(f"run {self.name} has no {scene}", scene, folders)
        return FinishedRun.open(folders[scene])

    def __repr__(self) -> str:
        made = [name for name in _TABLES[self.case.scene] if self.file(f"{name}.parquet").is_file()]
        return f"<{self.case.scene} run {self.name}: {', '.join(made) or 'no tables'}>"


@dataclass(frozen=True, repr=False)
class Study:
    """The finished process runs of a study.

    Attributes
    ----------
    folder : Path
        ``results/<study>``.
    runs : tuple of FinishedRun
        Sorted by name of the case. With several workpieces, each is a separate run.
    """

    folder: Path
    runs: tuple[FinishedRun, ...]

    @property
    def name(self) -> str:
        """Name of the study."""
        return next(iter(self.runs)).case.study_name

    @cached_property
    def summary(self) -> pd.DataFrame:
        """``summary.parquet`` of the report, one row per run; `TableError` without a report."""
        table = read_table(self._summary)
        basis = {run.case.run: " ".join(notes(run.case)) for run in self.runs}
        table.attrs.update(
            study=self.name, run=table["run"].tolist(), units=dict(self.units), basis=basis
        )
        return table

    @cached_property
    def units(self) -> Mapping[str, str]:
        """Units of the columns of `summary`."""
        return _units([self._summary])

    def describe(self, column: str) -> str:
        """Meaning and unit of a column of `summary`; `UnknownNameError` if it does not exist."""
        return _describe(column, self.units, ("summary",))

    def run(self, name: str | None = None) -> FinishedRun:
        """A run by the name of its case or its run id; without a name the only run.

        Raises
        ------
        UnknownNameError
            If there is no such run, or more than one.
        RejectedRunError
            If the run is not complete, or did not pass an acceptance check.
        """
        matching = [run for run in self.runs if name in (None, run.case.case, run.case.run)]
        if len(matching) == 1:
            return matching[0]
        if matching:
            which = "runs" if name is None else f"runs of case {name!r}"
            known = [run.case.run if name else run.name for run in matching]
            raise UnknownNameError(
                f"{self.folder} has {len(matching)} {which}: name one", "", known
            )
        for run in _runs(self.folder, "case.json"):
            if name in (run.case.case, run.case.run):
                read_accepted(run.folder)
        known = [run.name for run in self.runs]
        raise UnknownNameError(f"{self.folder} has no run {name!r}", name or "", known)

    @property
    def _summary(self) -> Path:
        return self.folder / "report" / "summary.parquet"

    def __repr__(self) -> str:
        return "\n  ".join([f"<study {self.name}:", *map(repr, self.runs)]) + ">"


def load(study: Path | str) -> Study:
    """Open the results of a study.

    Parameters
    ----------
    study : Path or str
        Name of a study with results in ``results/`` of the working folder or a folder above it;
        or the path of ``results/<study>``; or the folder of a single run of any scene, finished
        or not.

    Returns
    -------
    Study

    Raises
    ------
    UnknownNameError
        If there are no such results.
    RejectedRunError
        If the study has no finished process run.

    Warns
    -----
    UserWarning
        If some runs, or the report, are not of the study as it is now.
    """
    homes = [home / "results" for home in (Path.cwd(), *Path.cwd().parents)]
    for folder in (*(home / study for home in homes), Path(study)):
        if (folder / "case.json").is_file():
            return Study(folder.resolve().parents[1], (FinishedRun.open(folder),))
        if (folder / "process").is_dir():
            return _finished(folder)
    known = sorted({file.parent.name for home in homes for file in home.glob("*/process")})
    raise UnknownNameError(
        f"no results of a study {str(study)!r} in results/ of {homes[0].parent} or above it, and no"
        " such folder of results",
        str(study),
        known,
        remedy="run the study: ./run all --config study=NAME; or give the path of its results",
    )


def _finished(folder: Path) -> Study:
    runs = sorted(_runs(folder, "run.json"), key=lambda run: (run.name, run.case.run))
    if not runs:
        raise RejectedRunError(f"{folder}: no process run is finished")
    if outdated := _outdated(Path(os.path.abspath(folder)), [run.case.run for run in runs]):
        warnings.warn(f"{folder}: {outdated}", stacklevel=3)
    return Study(folder, tuple(runs))


def _outdated(folder: Path, runs: Sequence[str]) -> str:
    """What of a study's results is not of the study as it stands; empty without its file."""
    study = folder.name
    try:
        project = find_project(folder)
        cases = project.cases(study) if project.results(study) == folder else []
    except InputError:
        return ""
    present = by_folder(with_leads(cases), PROCESS)
    if others := [run for run in runs if present and run not in present]:
        return f"runs of other settings than those of the study now: {', '.join(others)}"
    made = present and project.report(study).is_file()
    if made and not project.report_is_current(study, cases):
        return "the report is of other settings, or not of all runs"
    return ""


def _runs(folder: Path, having: str) -> Iterator[FinishedRun]:
    """The process runs of a study with such a file: all have a case, finished ones a record."""
    return (FinishedRun.open(file.parent) for file in folder.glob(f"process/*/{having}"))
