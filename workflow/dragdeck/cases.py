"""Cases of a study and the names of its engine runs.

A case is one combination of the matrix at one fidelity. Each scene of a case
is an engine run, named by what it depends on and nothing more: cases that
share a fill share its run.
"""

from __future__ import annotations

import copy
import hashlib
import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from dragdeck.errors import InputError
from dragdeck.ranks import auto_ranks, cores_here
from dragdeck.study import (
    STUDY_FILE,
    MeshShape,
    Scaling,
    Study,
    Tolerance,
    read_yaml,
    validate,
)

SceneName = Literal["drop", "fill", "process"]
SCENES: tuple[SceneName, ...] = ("drop", "fill", "process")

SAID_BY_NAME = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
"""The settings that the name of a fidelity without a name says."""


@dataclass(frozen=True)
class Case:
    """One combination of a study's matrix.

    Attributes
    ----------
    file : Path
        The study file.
    settings : mapping
        The matrix fields and their values in this case.
    study : Study
        With those values in place; its matrix is empty.
    asked : Tolerance or None
        What the settings in `study` were found for, if they were.
    advised : mapping or None
        What is expected of them then; ``asked`` of the process's ``case.json``.
    beside : int
        Cases that can run beside each other, this one among them.
    """

    file: Path
    settings: Mapping[str, Any]
    study: Study
    asked: Tolerance | None = None
    advised: Mapping[str, Any] | None = None
    beside: int = 1

    @property
    def ranks(self) -> int:
        """Engine processes of a run of the fill or the process.

        What ``ranks: auto`` comes to is no part of a run's name: a study has the same runs
        on every machine.
        """
        asked = self.study.chosen_fidelity().ranks
        if asked == "auto":
            return auto_ranks(self.study.media.count, self.beside, cores_here())
        return asked

    @property
    def study_name(self) -> str:
        """Name of the study: its folder's."""
        return self.file.parent.name

    @property
    def name(self) -> str:
        """Readable name: the fidelity and the matrix values."""
        parts = [f"{field.rsplit('.', 1)[-1]}-{value}" for field, value in self.settings.items()]
        return _slug("_".join([self.fidelity_name, *parts]))

    @property
    def fidelity_name(self) -> str:
        """Name of the fidelity; settings without a name are called by what they say or hold."""
        if self.asked is not None:
            name = f"tolerance-{self.asked.tolerance:g}"
            default = self.asked.quantity == Tolerance.model_fields["quantity"].default
            return name if default else f"{name}-{self.asked.quantity}"
        fidelity = self.study.fidelity
        if isinstance(fidelity, str):
            return fidelity
        chosen = self.study.chosen_fidelity()
        name = f"E{chosen.youngs_modulus_scale:g}_dt{chosen.timestep_fraction:g}"
        return name if chosen.speed_factor == 1 else f"{name}_v{chosen.speed_factor:g}"

    @cached_property
    def run_ids(self) -> Mapping[SceneName, str]:
        """Run id of each scene: a readable slug and 8 hex digits of what the run depends on."""
        study = self.study
        slugs: dict[SceneName, str] = {
            "drop": f"{study.media.material}-on-{study.workpiece.material}",
            "fill": f"{study.media.count}-balls",
            "process": self.name,
        }
        return {scene: f"{_slug(slugs[scene])}-{_digest(self.content(scene))}" for scene in SCENES}

    def content(self, scene: SceneName) -> dict[str, Any]:
        """The plain values that one scene of this case depends on."""
        builders = {"drop": _drop_content, "fill": _fill_content, "process": self._process_content}
        return builders[scene](self.study)

    def digest(self, scene: SceneName) -> str:
        """Hash of all that a scene's files say, remarks included.

        Two cases that share a run of this scene have the same digest, and a
        study's edit that does not concern the scene does not change it.
        """
        study = self.study.model_dump(mode="json", include={"title", "assumptions", "reference"})
        return _digest({"study": study, "content": self.content(scene), **self.asked_of(scene)})

    def asked_of(self, scene: SceneName) -> dict[str, Any]:
        """The entry ``asked`` of a scene's ``case.json``: a process's, if a tolerance was asked."""
        return {} if self.advised is None or scene != "process" else {"asked": dict(self.advised)}

    def _process_content(self, study: Study) -> dict[str, Any]:
        fidelity = study.chosen_fidelity().model_dump(mode="json")
        content: dict[str, Any] = {
            "fill": _fill_content(study),
            "materials": _materials(study, study.workpiece.material),
            "pair": study.pair(study.media.material, study.workpiece.material).model_dump(),
            "facet_size_m": study.bowl.facet_size_m,
            "workpiece": study.workpiece.model_dump(mode="json"),
            "motion": study.motion.model_dump(mode="json"),
            "outputs": study.outputs.model_dump(mode="json"),
            "fidelity": fidelity,
        }
        if isinstance(study.workpiece.shape, MeshShape):
            content["mesh"] = _file_digest(mesh_file(self, study.workpiece.shape))
        return content


def load_cases(file: Path, fidelity: str | None = None) -> list[Case]:
    """All cases of a study file.

    Parameters
    ----------
    file : Path
        The study file.
    fidelity : str, optional
        Instead of the study's own.

    Raises
    ------
    InputError
        The file cannot be used; the message names field, value and limit.
    """
    data = read_yaml(file)
    if fidelity is not None:
        data["fidelity"] = fidelity
    validate({**data, "matrix": {}}, file)
    study = validate(data, file)
    matrix = study.matrix
    if study.scaling is not None:
        _check_scaling(study.scaling, matrix, file)
    plain = {**data, "matrix": {}}
    return beside_each_other(
        [settle_case(file, plain, settings) for settings in _combinations(matrix, file)]
    )


def beside_each_other(cases: Iterable[Case]) -> list[Case]:
    """The same cases, each knowing how many there are."""
    known = list(cases)
    return [replace(case, beside=len(known)) for case in known]


LEAST_LEVELS = 3
"""Levels that a power law is fitted to: two would fit any."""


def _check_scaling(scaling: Scaling, matrix: Mapping[str, list[Any]], file: Path) -> None:
    """Refuse a scaling that the matrix cannot tell.

    Raises
    ------
    InputError
        Its field is not in the matrix, is not alone there but for the seed, or has
        a level that is no number above zero; or too few levels are within its range.
    """
    field = scaling.field
    if field not in matrix:
        raise InputError(
            "not a field of matrix",
            file=file,
            field="scaling.field",
            value=field,
            limit=f"one of: {', '.join(name for name in matrix if name != 'seed') or 'none here'}",
            remedy="add its levels to matrix, or name a field that is there",
        )
    others = [name for name in matrix if name not in (field, "seed")]
    if others:
        raise InputError(
            "another field varies too, so that the drag is no function of one",
            file=file,
            field="matrix",
            value=", ".join(others),
            limit=f"{field} and seed",
            remedy="give each field a study of its own, or leave out scaling",
        )
    levels = [_level(value, field, file) for value in matrix[field]]
    low, high = scaling.within or (min(levels), max(levels))
    if sum(low <= level <= high for level in levels) < LEAST_LEVELS:
        raise InputError(
            f"too few levels from {low:g} to {high:g} for a power law",
            file=file,
            field=f"matrix.{field}",
            value=matrix[field],
            limit=f"{LEAST_LEVELS} levels or more",
            remedy="add levels" + (", or widen scaling.within" if scaling.within else ""),
        )


def _level(value: Any, field: str, file: Path) -> float:
    """A level of a scaling as a number."""
    try:
        level = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        level = math.nan
    if not (math.isfinite(level) and level > 0):
        raise InputError(
            "a power law needs numbers above 0",
            file=file,
            field=f"matrix.{field}",
            value=value,
            remedy="remove this level, or leave out scaling",
        )
    return level


def settle_case(
    file: Path,
    data: Mapping[str, Any],
    values: Mapping[str, Any],
    shown: Mapping[str, Any] | None = None,
    named_in: Path | None = None,
) -> Case:
    """A case from a study's plain data with some of its values replaced.

    Parameters
    ----------
    file : Path
        The study file.
    data : mapping
        Its content.
    values : mapping
        Dotted field: value.
    shown : mapping, optional
        The values that name the case, if not all of them.
    named_in : Path, optional
        The file that names the values, for error messages, if not `file`.

    Raises
    ------
    InputError
        A value leads nowhere or breaks the study; or a tolerance is asked that
        nothing measured can resolve.
    """
    combined = copy.deepcopy(dict(data))
    for field, value in values.items():
        _set(combined, field, value, named_in or file)
    study = validate(combined, named_in or file)
    case = Case(file, values if shown is None else shown, study)
    if not isinstance(study.fidelity, Tolerance):
        return case
    from dragdeck.advice import resolve  # needs cases itself

    return resolve(case, study.fidelity)


def study_file(studies: Path, name: str) -> Path:
    """The file of a study by name.

    Raises
    ------
    InputError
        No such study; lists those there are.
    """
    file = studies / name / STUDY_FILE
    if not file.is_file():
        known = sorted(found.parent.name for found in studies.glob(f"*/{STUDY_FILE}"))
        raise InputError(
            f"unknown study {name!r}",
            file=studies,
            limit=f"one of: {', '.join(known) or 'none here'}",
            remedy=f"choose one of these, or make {file}",
        )
    return file


def mesh_file(case: Case, shape: MeshShape) -> Path:
    """The file of a mesh: beside the study, in its meshes/, or in the project's meshes/.

    Raises
    ------
    InputError
        No such file in any of these places.
    """
    folder = case.file.parent
    places = (folder, folder / "meshes", folder.parent.parent / "meshes")
    for place in places:
        if (place / shape.file).is_file():
            return place / shape.file
    raise InputError(
        "no such mesh file",
        file=case.file,
        field="workpiece.shape.file",
        value=shape.file,
        limit="a file in " + ", ".join(str(place) for place in places),
        remedy="put the mesh there, or correct the name",
    )


def _combinations(matrix: Mapping[str, list[Any]], file: Path) -> Iterator[dict[str, Any]]:
    for field, values in matrix.items():
        if not values:
            raise InputError("no values", file=file, field=f"matrix.{field}", remedy="give some")
        if len({json.dumps(value, sort_keys=True) for value in values}) < len(values):
            raise InputError(
                "a value is given twice",
                file=file,
                field=f"matrix.{field}",
                value=values,
                remedy="remove one",
            )
    for combination in itertools.product(*matrix.values()):
        yield dict(zip(matrix, combination, strict=True))


def _set(data: dict[str, Any], field: str, value: Any, file: Path) -> None:
    *parents, last = field.split(".")
    place = data
    for name in parents:
        place = place.setdefault(name, {})
        if not isinstance(place, dict):
            raise InputError(
                "leads through a value",
                file=file,
                field=field,
                remedy="give the dotted name of one field",
            )
    place[last] = value


def _drop_content(study: Study) -> dict[str, Any]:
    ball, plate = study.media.material, study.workpiece.material
    return {
        "materials": _materials(study, ball, plate),
        "pair": study.pair(ball, plate).model_dump(mode="json"),
        "radius_m": study.media.radius_mean_m,
        "gravity_m_s2": study.gravity_m_s2,
        "contact": study.contact.model_dump(mode="json"),
        "drop": study.drop.model_dump(mode="json"),
    }


def _fill_content(study: Study) -> dict[str, Any]:
    ball, bowl = study.media.material, study.bowl.material
    fidelity = study.chosen_fidelity()
    return {
        "materials": _materials(study, ball, bowl),
        "pairs": [study.pair(ball, other).model_dump(mode="json") for other in (ball, bowl)],
        "types": len(study.type_names()),
        "media": study.media.model_dump(mode="json"),
        "bowl": study.bowl.model_dump(mode="json", exclude={"facet_size_m"}),
        "gravity_m_s2": study.gravity_m_s2,
        "contact": study.contact.model_dump(mode="json"),
        "fill": study.fill.model_dump(mode="json"),
        "seed": study.seed,
        "fidelity": fidelity.model_dump(
            mode="json",
            include={"youngs_modulus_scale", "fill_timestep_fraction", "skin_m", "ranks"},
        ),
    }


def _materials(study: Study, *names: str) -> dict[str, Any]:
    return {name: study.materials[name].model_dump(mode="json") for name in sorted(set(names))}


def _digest(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def _file_digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _slug(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip("-.")
