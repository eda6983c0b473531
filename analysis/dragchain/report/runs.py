"""The runs that a report is of, read once."""

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Generic, TypeVar

from dragchain.loading.document import FILE as LOADING
from dragchain.loading.document import Loading
from dragchain.report.extrapolated import FILE as EXTRAPOLATED
from dragchain.report.extrapolated import Extrapolated, ExtrapolatedQuantity
from dragchain.report.findings import (
    FILE,
    DropFindings,
    FillingFindings,
    Findings,
    ProcessFindings,
)
from dragchain.report.values import Values, values_of
from dragchain.run.case import Case, load_case
from dragchain.run.completeness import RunRecord, read_accepted
from dragdeck.errors import DocumentError, RejectedRunError

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
    """A process run with the filling and the drop test it belongs to, None where it names none.

    `loading`: load, sliding and friction work on the workpiece; `extrapolated`: its quantities at
    the physical Young's modulus. Both are None where they were not computed.
    """

    process: ReportedRun[ProcessFindings]
    filling: ReportedRun[FillingFindings] | None
    drop_test: ReportedRun[DropFindings] | None
    loading: Loading | None = None
    extrapolated: Extrapolated | None = None

    @cached_property
    def values(self) -> Values:
        """The quantities of the process run, each with what it says of the process."""
        process = self.process
        return values_of(process.case, process.findings, self.loading, self.extrapolated)

    def physical(self, name: str) -> ExtrapolatedQuantity | None:
        """A quantity with its value at the physical modulus, None if that is not known."""
        one = self.extrapolated.of(name) if self.extrapolated else None
        return one if one and one.value else None

    @property
    def runs(self) -> list[ReportedRun[Findings]]:
        """The runs that there are, the process first."""
        runs: list[ReportedRun[Findings] | None] = [self.process, self.filling, self.drop_test]
        return [run for run in runs if run is not None]


def read_study(run_dir: Path) -> StudyRuns:
    """Read a process run with its filling and drop test.

    A drop test without a result is left out: the process does not start from it.

    Raises
    ------
    RejectedRunError
        If the process or its filling is not complete, or did not pass an acceptance check.
    DocumentError
        If a document of one of them is missing or cannot be used.
    """
    process = _read(run_dir, ProcessFindings)
    upstream = upstream_folders(run_dir, process.case)
    filling = drop_test = None
    if "filling" in upstream:
        filling = _read(upstream["filling"], FillingFindings)
    with suppress(RejectedRunError, DocumentError):
        if "drop_test" in upstream:
            drop_test = _read(upstream["drop_test"], DropFindings)
    return StudyRuns(process, filling, drop_test, *read_optional(run_dir))


def read_optional(run_dir: Path) -> tuple[Loading | None, Extrapolated | None]:
    """Read ``loading.json`` and ``extrapolated.json`` of a process run, None where there is none.

    Raises
    ------
    DocumentError
        If one of them cannot be used.
    """
    loading, extrapolated = run_dir / LOADING, run_dir / EXTRAPOLATED
    return (
        Loading.read(loading) if loading.is_file() else None,
        Extrapolated.read(extrapolated) if extrapolated.is_file() else None,
    )


def read_upstream(run_dir: Path) -> ReportedRun[Findings]:
    """Read a filling or a drop test; errors are those of `read_study`."""
    return _read(run_dir, Findings)


def upstream_folders(run_dir: Path, case: Case) -> dict[str, Path]:
    """Folders of the filling and the drop test that a process run names, by scene."""
    results = run_dir.resolve().parent.parent
    return {scene: results / scene / run for scene, run in case.upstream.items()}


def _read(run_dir: Path, findings: type[F]) -> ReportedRun[F]:
    record = read_accepted(run_dir)
    return ReportedRun(run_dir, load_case(run_dir), findings.read(run_dir / FILE), record)
