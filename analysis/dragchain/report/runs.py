"""The runs that a report is of, read once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from dragchain.report.findings import (
    FILE,
    DropFindings,
    FillingFindings,
    Findings,
    ProcessFindings,
)
from dragchain.run.case import Case, load_case
from dragchain.run.completeness import RunRecord, read_accepted

F = TypeVar("F", bound=Findings, covariant=True)


@dataclass(frozen=True)
class ReportedRun(Generic[F]):
    """A run that counts: its folder, case, findings and ``run.json``."""

    folder: Path
    case: Case
    findings: F
    record: RunRecord


@dataclass(frozen=True)
class StudyRuns:
    """A process run with the filling and the drop test it belongs to, None where it names none."""

    process: ReportedRun[ProcessFindings]
    filling: ReportedRun[FillingFindings] | None
    drop_test: ReportedRun[DropFindings] | None

    @property
    def runs(self) -> list[ReportedRun[Findings]]:
        """The runs that there are, the process first."""
        runs: list[ReportedRun[Findings] | None] = [self.process, self.filling, self.drop_test]
        return [run for run in runs if run is not None]


def read_study(run_dir: Path) -> StudyRuns:
    """Read a process run with its filling and drop test.

    Raises
    ------
    RejectedRunError
        If a run is not complete, or did not pass an acceptance check.
    DocumentError
        If a document of a run is missing or cannot be used.
    """
    process = _read(run_dir, ProcessFindings)
    upstream, results = process.case.upstream, run_dir.resolve().parent.parent
    return StudyRuns(
        process,
        _read(results / "filling" / upstream["filling"], FillingFindings)
        if "filling" in upstream
        else None,
        _read(results / "drop_test" / upstream["drop_test"], DropFindings)
        if "drop_test" in upstream
        else None,
    )


def _read(run_dir: Path, findings: type[F]) -> ReportedRun[F]:
    record = read_accepted(run_dir)
    return ReportedRun(run_dir, load_case(run_dir), findings.read(run_dir / FILE), record)
