"""A study's results as an RO-Crate (https://w3id.org/ro/crate/1.1), to archive and to cite."""

import hashlib
import mimetypes
import os
import platform
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from dragchain.errors import ExportError
from dragchain.files import write_text
from dragchain.run.case import Case, load_case
from dragchain.run.completeness import RunRecord, read_accepted

METADATA = "ro-crate-metadata.json"
LEFT_OUT = "left_out.csv"
PACKAGES = "python-packages.txt"

_SPECIFICATION = "1.1"
_NO_LICENCE = "unknown: the study states none; ask its authors before you use it"
_INPUTS = {".liggghts", ".data", ".stl"}
_RESULTS = {".json", ".png", ".vtp", ".parquet"}
_LARGEST_BYTES = 20_000_000
_NO_RESULT = {"logs", "benchmarks", "as_run", "archive", "damaged", "export", "state.json"}
_TYPES = {
    ".parquet": "application/vnd.apache.parquet", ".stl": "model/stl", ".vtp": "application/xml",
    ".liggghts": "text/plain", ".data": "text/plain", ".j2": "text/plain",
    ".yaml": "application/yaml",
}  # fmt: skip


@dataclass(frozen=True)
class _Run:
    """A run with its files: those that a crate gets, and those that are too large for it."""

    folder: Path
    case: Case
    record: RunRecord
    kept: tuple[Path, ...]
    left_out: tuple[Path, ...]

    @classmethod
    def read(cls, folder: Path, everything: bool) -> "_Run":
        files = [
            file
            for file in sorted(folder.rglob("*"))
            if file.is_file() and not _is_internal(file.relative_to(folder))
        ]
        kept = [file for file in files if everything or _belongs(file)]
        left_out = [file for file in files if file not in kept]
        case, record = load_case(folder), read_accepted(folder)
        return cls(folder, case, record, tuple(kept), tuple(left_out))

    def is_input(self, file: Path) -> bool:
        """Whether LIGGGHTS or the analysis read the file before the run."""
        return file.suffix in _INPUTS or file.name in ("case.json", "columns.json")


def _is_internal(file: Path) -> bool:
    return file.parts[0] in _NO_RESULT or any(part.startswith(".") for part in file.parts)


def _belongs(file: Path) -> bool:
    return file.suffix in _INPUTS | _RESULTS and file.stat().st_size <= _LARGEST_BYTES


def write_crate(
    out_dir: Path,
    run_dirs: Sequence[Path],
    report_dir: Path,
    inputs: Sequence[Path] = (),
    licence: str | None = None,
    *,
    everything: bool = False,
) -> Path:
    """Write a study's inputs, runs and report as an RO-Crate.

    Paths in the crate are those below the present folder. Each file has its size in bytes and its
    SHA-256. Raw outputs and files above 20 MB are left out; ``left_out.csv`` lists them.

    Parameters
    ----------
    out_dir : Path
        Folder of the crate. An earlier crate in it is replaced.
    run_dirs : sequence of Path
        Folders of the study's runs, all complete and accepted.
    report_dir : Path
        Folder of the study's report.
    inputs : sequence of Path
        What the runs were made from: study files, templates, meshes.
    licence : str, optional
        Licence of the results; unknown if None.
    everything : bool
        Whether nothing is left out.

    Returns
    -------
    Path
        The metadata file.

    Raises
    ------
    ExportError
        If a file is not below the present folder, `out_dir` contains other files, or rocrate is
        not installed.
    RejectedRunError, DocumentError
        If a run is not complete, or a document cannot be used.
    """
    runs = [_Run.read(_below_here(folder), everything) for folder in run_dirs]
    report = [file for file in sorted(_below_here(report_dir).iterdir()) if file.is_file()]
    draft = out_dir.with_name(f".{out_dir.name}.{os.getpid()}.part")
    _check_free(out_dir)
    try:
        draft.mkdir(parents=True)
        crate = _Crate(draft, runs[0].case, licence)
        crate.add([*map(_below_here, inputs), *(one for one in report if one.name != "complete")])
        crate.add_runs(runs)
        crate.close([file for run in runs for file in run.left_out])
        shutil.rmtree(out_dir, ignore_errors=True)
        os.replace(draft, out_dir)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return out_dir / METADATA


def crate_command(
    out_dir: Path,
    run_dirs: Sequence[Path],
    report_dir: Path,
    inputs: Sequence[Path],
    licence: str | None,
    everything: bool,
) -> str:
    """Write a crate as the command line asks for; what to say at the end."""
    done = write_crate(out_dir, run_dirs, report_dir, inputs, licence, everything=everything)
    return f"{done}: fill in the authors before you publish it"


def _below_here(path: Path) -> Path:
    """The path of a file or folder from the present folder."""
    found = Path(os.path.relpath(path))
    if ".." in found.parts:
        raise ExportError(
            f"{path} is not below {Path.cwd()}, so it has no place in a crate\n"
            "  remedy: call this in the project's folder, and put the file there"
        )
    return found


def _check_free(folder: Path) -> None:
    """Refuse a folder with files that are no crate's."""
    if folder.is_dir() and any(folder.iterdir()) and not (folder / LEFT_OUT).is_file():
        raise ExportError(
            f"{folder} contains files that are no crate of dragchain\n"
            "  remedy: name another folder, or move this one away"
        )


class _Crate:
    """An RO-Crate that grows file by file."""

    def __init__(self, folder: Path, case: Case, licence: str | None) -> None:
        try:
            from rocrate.rocrate import ROCrate
        except ModuleNotFoundError as error:
            raise ExportError(
                f"{error}\n  remedy: ./run setup; or pip install 'dragdeck[crate]'"
            ) from None
        self._folder = folder
        self._crate = ROCrate(version=_SPECIFICATION)
        self._crate.metadata.extra_terms["sha256"] = "https://schema.org/sha256"
        self._files: dict[Path, Any] = {}
        root = self._crate.root_dataset
        root["name"] = f"{case.study}: {case.title}" if case.title else case.study
        root["description"] = (
            f"Inputs, input scripts, results and report of the study {case.study}: drag finishing,"
            " simulated with the discrete element method (LIGGGHTS) through dragdeck. Paths are"
            f" those of the project; {LEFT_OUT} lists the files that were left out."
        )
        root["license"] = licence or _NO_LICENCE
        root["keywords"] = "discrete element method, drag finishing, LIGGGHTS"

    def add(self, files: Sequence[Path]) -> None:
        """Copy files into the crate under their own paths, each once."""
        for file in files:
            if file not in self._files:
                self._files[file] = self._add(file, file)

    def _add(self, source: Path, file: Path) -> Any:
        about = {
            "name": file.name,
            "contentSize": str(source.stat().st_size),
            "sha256": sha256(source),
            "encodingFormat": _TYPES.get(file.suffix)
            or mimetypes.guess_type(file.name)[0]
            or "application/octet-stream",
        }
        return self._crate.add_file(source, str(file), properties=about)

    def add_runs(self, runs: Sequence[_Run]) -> None:
        """Add the files of runs, and how LIGGGHTS made one from the other."""
        for run in runs:
            self.add(run.kept)
            software = [self._software("LIGGGHTS", run.record.engine_version)]
            software += [self._software(*version) for version in run.case.versions.items()]
            self._entity(
                f"#{run.case.scene}-{run.case.run}",
                "CreateAction",
                name=f"{run.case.scene} {run.case.run}",
                startTime=run.record.started,
                instrument=software,
                object=[self._files[file] for file in run.kept if run.is_input(file)],
                result=[self._files[file] for file in run.kept if not run.is_input(file)],
            )

    def close(self, left_out: Sequence[Path]) -> None:
        """Add the versions and the list of what was left out, and write the metadata."""
        self._software("Python", platform.python_version())
        rows = [f"{file},{file.stat().st_size},{sha256(file)}" for file in left_out]
        for name, lines in ((PACKAGES, _packages()), (LEFT_OUT, ["file,bytes,sha256", *rows])):
            write_text(self._folder / name, "".join(f"{line}\n" for line in lines))
            self._add(self._folder / name, Path(name))
        self._crate.write(self._folder)

    def _software(self, name: str, version: str) -> Any:
        return self._entity(
            f"#{name.lower()}-{version}", "SoftwareApplication", name=name, version=version
        )

    def _entity(self, identity: str, kind: str, **properties: Any) -> Any:
        """A contextual entity, listed under ``mentions`` of the whole crate."""
        from rocrate.model import ContextEntity

        if (known := self._crate.get(identity)) is not None:
            return known
        found = self._crate.add(ContextEntity(self._crate, identity, {"@type": kind, **properties}))
        self._crate.root_dataset.append_to("mentions", found)
        return found


def sha256(file: Path) -> str:
    """The SHA-256 of a file, as hexadecimal digits."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _packages() -> list[str]:
    """The Python packages of this environment, with their versions."""
    found = {f"{one.name}=={one.version}" for one in distributions()}
    return sorted(found, key=str.lower)
