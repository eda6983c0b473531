"""A study's results as an RO-Crate (https://w3id.org/ro/crate/1.1), to archive and to cite."""

import mimetypes
import os
import platform
import re
import shutil
from collections.abc import Mapping, Sequence
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from dragchain.errors import ExportError
from dragdeck.files import file_checksum, write_text
from dragdeck.records.case import CaseOfRun, load_case
from dragdeck.records.run import changed_in_words, read_accepted
from dragdeck.shipped import SHIPPED

LEFT_OUT = "left_out.csv"
PACKAGES = "python-packages.txt"

LARGEST_BYTES = 20_000_000
"""Larger files are left out."""

_SPECIFICATION = "1.1"
_LICENCES, _SPDX_NAME = "https://spdx.org/licenses/", re.compile(r"[A-Za-z0-9][A-Za-z0-9.+-]*")
_INPUTS = (".liggghts", ".data", ".stl", "case.json", "columns.json")
_RESULTS = (".json", ".png", ".svg", ".pdf", ".vtp", ".parquet")
_NO_RESULT = {"logs", "benchmarks", "as_run", "archive", "damaged", "export", "state.json"}
_TYPES = {".parquet": "application/vnd.apache.parquet", ".vtp": "application/xml"}


def write_crate(
    out_dir: Path,
    run_dirs: Sequence[Path],
    report_dir: Path,
    inputs: Sequence[Path] = (),
    licence: str | None = None,
) -> None:
    """Write a study's inputs, runs and report as an RO-Crate.

    Paths in the crate are those below the present folder. Each file has its size in bytes and its
    SHA-256. Raw outputs and larger files (`LARGEST_BYTES`) are left out; ``left_out.csv`` lists
    them.

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
        Licence of the results, SPDX name or address; the crate states none if None.

    Raises
    ------
    ExportError
        If a file is not below the present folder, `out_dir` contains other files, or rocrate is
        not installed.
    RejectedRunError, DocumentError
        If a run is not complete, or a document cannot be used.
    """
    if out_dir.is_dir() and any(out_dir.iterdir()) and not (out_dir / LEFT_OUT).is_file():
        remedy = "name another folder, or move this one away"
        raise ExportError(f"{out_dir} contains files that are not a crate\n  remedy: {remedy}")
    report = sorted(file for file in _below_here(report_dir).iterdir() if file.is_file())
    draft = out_dir.with_name(f".{out_dir.name}.{os.getpid()}.part")
    draft.mkdir(parents=True)
    try:
        crate = _Crate(draft, load_case(run_dirs[0]), licence)
        crate.add([*inputs, *(file for file in report if file.name != "complete")])
        for folder in run_dirs:
            crate.add_run(_below_here(folder))
        crate.close()
        shutil.rmtree(out_dir, ignore_errors=True)
        os.replace(draft, out_dir)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _below_here(path: Path) -> Path:
    """The path of a file or folder from the present folder."""
    relative = Path(os.path.relpath(path))
    if ".." in relative.parts:
        remedy = "call this in the project's folder, and put the file there"
        raise ExportError(f"{path} is not below {Path.cwd()}\n  remedy: {remedy}")
    return relative


def _in_crate(file: Path) -> Path:
    """The path of a file in the crate: from the present folder, or from the files of dragdeck."""
    if file.is_absolute() and file.is_relative_to(SHIPPED):
        return file.relative_to(SHIPPED)
    return _below_here(file)


class _Crate:
    """An RO-Crate that grows file by file."""

    def __init__(self, folder: Path, case: CaseOfRun, licence: str | None) -> None:
        try:
            from rocrate.rocrate import ROCrate
        except ModuleNotFoundError as error:
            remedy = "./run setup crate; or pip install 'dragdeck[crate]'"
            raise ExportError(f"{error}\n  remedy: {remedy}") from None
        self._folder = folder
        self._crate = ROCrate(version=_SPECIFICATION)
        self._crate.metadata.extra_terms["sha256"] = "https://schema.org/sha256"
        self._files: dict[Path, Any] = {}
        self._left_out: list[Path] = []
        root = self._crate.root_dataset
        root["name"] = f"{case.study_name}: {case.title}" if case.title else case.study_name
        root["description"] = (
            f"Inputs, input scripts, results and report of the study {case.study_name}: drag"
            " finishing, simulated with the discrete element method (LIGGGHTS) through dragdeck."
            f" Paths are those of the project; {LEFT_OUT} lists the files that were left out."
        )
        if licence:
            address = f"{_LICENCES}{licence}" if _SPDX_NAME.fullmatch(licence) else licence
            linked = re.match("https?://", address)
            about = {"@type": "CreativeWork", "name": licence}
            root["license"] = self._named(address, about) if linked else licence
        root["keywords"] = "discrete element method, drag finishing, LIGGGHTS"

    def add(self, files: Sequence[Path]) -> list[Any]:
        """Copy files into the crate under their own paths, each once."""
        paths = {_in_crate(file): file for file in files}
        for path, file in paths.items():
            if path not in self._files:
                self._files[path] = self._add(file, path)
        return [self._files[path] for path in paths]

    def _add(self, source: Path, file: Path) -> Any:
        guessed = _TYPES.get(file.suffix) or mimetypes.guess_type(file.name)[0]
        about = {
            "name": file.name,
            "contentSize": str(source.stat().st_size),
            "sha256": file_checksum(source),
            "encodingFormat": guessed or "text/plain",
        }
        return self._crate.add_file(source, str(file), properties=about)

    def add_run(self, folder: Path) -> None:
        """Add the files of a run, and how LIGGGHTS made one from the other."""
        case, record = load_case(folder), read_accepted(folder)
        inputs: list[Path] = []
        results: list[Path] = []
        for file in sorted(file for file in folder.rglob("*") if file.is_file()):
            parts = file.relative_to(folder).parts
            if parts[0] in _NO_RESULT or any(part.startswith(".") for part in parts):
                continue
            if not file.name.endswith((*_INPUTS, *_RESULTS)) or file.stat().st_size > LARGEST_BYTES:
                self._left_out.append(file)
            else:
                (inputs if file.name.endswith(_INPUTS) else results).append(file)
        versions = {"LIGGGHTS": record.engine_version, **case.versions}
        about = {
            "@type": "CreateAction",
            "name": f"{case.scene} {case.run}",
            "startTime": record.started,
            "instrument": [self._software(*version) for version in versions.items()],
            "object": self.add(inputs),
            "result": self.add(results),
        }
        if changed := changed_in_words(case.changed_scripts):
            about["description"] = changed
        self._mention(f"#{case.scene}-{case.run}", about)

    def close(self) -> None:
        """Add the versions and the list of what was left out, and write the metadata."""
        self._software("Python", platform.python_version())
        packages = sorted(
            {f"{dist.name}=={dist.version}" for dist in distributions()}, key=str.lower
        )
        rows = [f"{file},{file.stat().st_size},{file_checksum(file)}" for file in self._left_out]
        for name, lines in ((PACKAGES, packages), (LEFT_OUT, ["file,bytes,sha256", *rows])):
            write_text(self._folder / name, "".join(f"{line}\n" for line in lines))
            self._add(self._folder / name, Path(name))
        self._crate.write(self._folder)

    def _software(self, name: str, version: str) -> Any:
        about = {"@type": "SoftwareApplication", "name": name, "version": version}
        return self._mention(f"#{name.lower()}-{version}", about)

    def _mention(self, identity: str, about: Mapping[str, object]) -> Any:
        """Something that is no file, listed under ``mentions`` of the whole crate."""
        if (known := self._crate.get(identity)) is not None:
            return known
        entity = self._named(identity, about)
        self._crate.root_dataset.append_to("mentions", entity)
        return entity

    def _named(self, identity: str, about: Mapping[str, object]) -> Any:
        """Something that is no file and that another entry names."""
        from rocrate.model import ContextEntity

        return self._crate.add(ContextEntity(self._crate, identity, dict(about)))
