"""What a run models (``case.json``) and what its outputs hold (``columns.json``)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, cast

from dragchain.errors import CaseError

SCHEMA = 1
"""The version of both files that this package understands."""

Scene = Literal["drop", "fill", "process"]
OutputKind = Literal["print", "custom", "local"]

_NOT_OURS = "render the run again with the dragdeck that belongs to this dragchain"


@dataclass(frozen=True)
class Fidelity:
    """How much accuracy a run spends on speed."""

    name: str
    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    skin_m: float
    ranks: int


@dataclass(frozen=True)
class Media:
    """The balls, as asked for in the study."""

    count: int
    radius_mean_m: float
    radius_sd_m: float
    density_kg_m3: float


@dataclass(frozen=True)
class Bowl:
    """The container: a cylinder about the z axis that stands on z = 0."""

    radius_m: float
    walls: Literal["primitive", "mesh"]


@dataclass(frozen=True)
class Tool:
    """The body that is dragged through the balls."""

    kind: Literal["cylinder", "mesh"]
    radius_m: float
    length_m: float
    mesh: str
    submersion_m: float


@dataclass(frozen=True)
class Circle:
    """A drag on a circle about the bowl's axis.

    ``sense`` is +1 for counter-clockwise seen from above; ``start_heading_rad``
    is the direction of motion when the drag begins, from x towards y;
    ``turns_with_path`` says whether the tool turns with it or keeps its
    orientation.
    """

    speed_m_s: float
    radius_m: float
    sense: int
    start_heading_rad: float
    turns_with_path: bool


@dataclass(frozen=True)
class Line:
    """A drag along a straight line that leaves ``start_m`` along ``heading_rad``."""

    speed_m_s: float
    start_m: tuple[float, ...]
    heading_rad: float


@dataclass(frozen=True)
class Phase:
    """A stretch of the run: the steps after ``start_step`` up to ``end_step``."""

    name: str
    start_step: int
    end_step: int


@dataclass(frozen=True)
class Assumption:
    """A value that the study's source does not give."""

    field: str
    value: object
    why: str


@dataclass(frozen=True)
class Case:
    """The content of ``case.json``.

    ``bowl`` is None in a drop; ``case``, ``tool``, ``motion``, ``surface_m``
    and ``run_in_s`` are None outside a process; ``restitution`` is None
    outside a drop. ``numbers`` are the dimensionless numbers of a process;
    ``asked`` is the tolerance that its settings were chosen for, if any.
    """

    study: str
    scene: Scene
    run: str
    case: str | None
    upstream: Mapping[str, str]
    timestep_s: float
    rayleigh_time_s: float
    gravity_m_s2: float
    fidelity: Fidelity
    inputs: Mapping[str, object]
    numbers: Mapping[str, float]
    media: Media
    bowl: Bowl | None
    tool: Tool | None
    surface_m: float | None
    motion: Circle | Line | None
    phases: tuple[Phase, ...]
    run_in_s: float | None
    restitution: float | None
    assumptions: tuple[Assumption, ...]
    reference: Mapping[str, object] | None
    versions: Mapping[str, str]
    asked: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Output:
    """One raw output of the engine, as ``columns.json`` describes it.

    Frames are expected at ``first_step`` and every ``period_steps`` after it up
    to ``last_step``. Where that is None the engine decides during the run: any
    of these steps may be left out, and there is no known last one.
    """

    name: str
    kind: OutputKind
    binary: bool
    pattern: str
    columns: tuple[str, ...]
    engine_columns: tuple[str, ...] | None
    period_steps: int
    first_step: int
    last_step: int | None

    @property
    def header(self) -> tuple[str, ...]:
        """What the engine writes in the header of a text file."""
        return self.columns if self.engine_columns is None else self.engine_columns


class _Fields:
    """Typed access to one JSON object that names file and key when it fails."""

    def __init__(self, file: Path, values: object, prefix: str = "") -> None:
        self.file = file
        self.prefix = prefix
        if not isinstance(values, dict):
            raise self.error(None, f"is {type(values).__name__}, not an object")
        self.values: dict[str, Any] = values

    def error(self, key: str | None, problem: str) -> CaseError:
        dotted = ".".join(part for part in (self.prefix, key) if part)
        return CaseError(self.file, dotted or None, problem, remedy=_NOT_OURS)

    def has(self, key: str) -> bool:
        return self.values.get(key) is not None

    def get(self, key: str) -> Any:
        if key not in self.values:
            raise self.error(key, "is missing")
        return self.values[key]

    def text(self, key: str) -> str:
        value = self.get(key)
        if not isinstance(value, str):
            raise self.error(key, f"is {value!r}, not a text")
        return value

    def choice(self, key: str, allowed: tuple[str, ...]) -> str:
        value = self.text(key)
        if value not in allowed:
            raise self.error(key, f"is {value!r}, not one of {', '.join(allowed)}")
        return value

    def number(self, key: str) -> float:
        value = self.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(key, f"is {value!r}, not a number")
        if not math.isfinite(value):
            raise self.error(key, f"is {value!r}, not a finite number")
        return float(value)

    def positive(self, key: str) -> float:
        value = self.number(key)
        if value <= 0.0:
            raise self.error(key, f"is {value!r}, not above zero")
        return value

    def integer(self, key: str) -> int:
        value = self.get(key)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(key, f"is {value!r}, not a whole number")
        return value

    def boolean(self, key: str) -> bool:
        value = self.get(key)
        if not isinstance(value, bool):
            raise self.error(key, f"is {value!r}, not true or false")
        return value

    def items(self, key: str) -> list[Any]:
        value = self.get(key)
        if not isinstance(value, list):
            raise self.error(key, f"is {type(value).__name__}, not a list")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        values = self.items(key)
        if not all(isinstance(value, str) for value in values):
            raise self.error(key, "is not a list of texts")
        return tuple(values)

    def numbers(self, key: str) -> tuple[float, ...]:
        values = self.items(key)
        if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
            raise self.error(key, "is not a list of numbers")
        return tuple(float(value) for value in values)

    def mapping(self, key: str) -> Mapping[str, Any]:
        return self.child(key).values

    def child(self, key: str) -> _Fields:
        return _Fields(self.file, self.get(key), ".".join(p for p in (self.prefix, key) if p))

    def children(self, key: str) -> list[_Fields]:
        prefix = ".".join(p for p in (self.prefix, key) if p)
        return [
            _Fields(self.file, item, f"{prefix}[{i}]") for i, item in enumerate(self.items(key))
        ]


def load_case(run_dir: Path | str) -> Case:
    """Read ``case.json`` of a run folder.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    Case
        Its content, checked for the keys that its scene needs.

    Raises
    ------
    CaseError
        If the file is absent, is not JSON, has another schema number, or lacks
        a key or has a value of the wrong type.
    """
    return parse_case(Path(run_dir) / "case.json")


def parse_case(file: Path) -> Case:
    """Read one ``case.json``; see `load_case`."""
    top = _open(file)
    scene = cast(Scene, top.choice("scene", ("drop", "fill", "process")))
    process = scene == "process"
    return Case(
        study=top.text("study"),
        scene=scene,
        run=top.text("run"),
        case=top.text("case") if process else None,
        upstream=top.mapping("upstream") if top.has("upstream") else {},
        timestep_s=top.positive("timestep_s"),
        rayleigh_time_s=top.positive("rayleigh_time_s"),
        gravity_m_s2=top.number("gravity_m_s2"),
        fidelity=_fidelity(top.child("fidelity")),
        inputs=top.mapping("inputs"),
        numbers=top.mapping("numbers") if top.has("numbers") else {},
        media=_media(top.child("media")),
        bowl=None if scene == "drop" else _bowl(top.child("bowl")),
        tool=_tool(top.child("tool")) if process else None,
        surface_m=top.positive("surface_m") if process else None,
        motion=_motion(top.child("motion")) if process else None,
        phases=_phases(top),
        run_in_s=top.child("statistics").number("run_in_s") if process else None,
        restitution=top.number("restitution") if scene == "drop" else None,
        assumptions=tuple(_assumption(item) for item in top.children("assumptions")),
        reference=top.mapping("reference") if top.has("reference") else None,
        versions=top.mapping("versions"),
        asked=top.mapping("asked") if top.has("asked") else None,
    )


def load_outputs(run_dir: Path | str) -> dict[str, Output]:
    """Read ``columns.json`` of a run folder.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    dict of str to Output
        The raw outputs by name. An output that is not in it was not written.

    Raises
    ------
    CaseError
        If the file is absent, is not JSON, has another schema number, or lacks
        a key or has a value of the wrong type.
    """
    top = _open(Path(run_dir) / "columns.json")
    outputs = top.child("outputs")
    return {name: _output(name, outputs.child(name)) for name in outputs.values}


def _open(file: Path) -> _Fields:
    try:
        values = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        remedy = "give the folder of a run, and render the run before analysing it"
        raise CaseError(file, None, "there is no such file", remedy=remedy) from error
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise CaseError(file, None, f"is not JSON: {error}", remedy=_NOT_OURS) from error
    fields = _Fields(file, values)
    if (schema := fields.integer("schema")) != SCHEMA:
        raise fields.error("schema", f"is {schema}, this dragchain reads {SCHEMA}")
    return fields


def _fidelity(fields: _Fields) -> Fidelity:
    return Fidelity(
        name=fields.text("name"),
        youngs_modulus_scale=fields.positive("youngs_modulus_scale"),
        timestep_fraction=fields.positive("timestep_fraction"),
        speed_factor=fields.positive("speed_factor"),
        skin_m=fields.positive("skin_m"),
        ranks=fields.integer("ranks"),
    )


def _media(fields: _Fields) -> Media:
    return Media(
        count=fields.integer("count"),
        radius_mean_m=fields.positive("radius_mean_m"),
        radius_sd_m=fields.number("radius_sd_m"),
        density_kg_m3=fields.positive("density_kg_m3"),
    )


def _bowl(fields: _Fields) -> Bowl:
    walls = fields.choice("walls", ("primitive", "mesh"))
    return Bowl(fields.positive("radius_m"), cast(Literal["primitive", "mesh"], walls))


def _tool(fields: _Fields) -> Tool:
    return Tool(
        kind=cast(Literal["cylinder", "mesh"], fields.choice("kind", ("cylinder", "mesh"))),
        radius_m=fields.positive("radius_m"),
        length_m=fields.positive("length_m"),
        mesh=fields.text("mesh"),
        submersion_m=fields.number("submersion_m"),
    )


def _motion(fields: _Fields) -> Circle | Line:
    speed = fields.positive("speed_m_s")
    if fields.choice("kind", ("circle", "line")) == "line":
        return Line(speed, fields.numbers("start_m"), fields.number("heading_rad"))
    if (sense := fields.integer("sense")) not in (-1, 1):
        raise fields.error("sense", f"is {sense}, not +1 or -1")
    return Circle(
        speed,
        fields.positive("radius_m"),
        sense,
        fields.number("start_heading_rad"),
        fields.boolean("turns_with_path"),
    )


def _phases(top: _Fields) -> tuple[Phase, ...]:
    phases = tuple(
        Phase(item.text("name"), item.integer("start_step"), item.integer("end_step"))
        for item in top.children("phases")
    )
    for before, after in pairwise(phases):
        if before.end_step != after.start_step:
            raise top.error("phases", f"{after.name} does not start where {before.name} ends")
    return phases


def _assumption(fields: _Fields) -> Assumption:
    return Assumption(fields.text("field"), fields.get("value"), fields.text("why"))


def _output(name: str, fields: _Fields) -> Output:
    kind = cast(OutputKind, fields.choice("kind", ("print", "custom", "local")))
    output = Output(
        name=name,
        kind=kind,
        binary=fields.boolean("binary"),
        pattern=fields.text("pattern"),
        columns=fields.texts("columns"),
        engine_columns=fields.texts("engine_columns") if fields.has("engine_columns") else None,
        period_steps=fields.integer("period_steps"),
        first_step=fields.integer("first_step"),
        last_step=None if fields.get("last_step") is None else fields.integer("last_step"),
    )
    _check_output(output, fields)
    return output


def _check_output(output: Output, fields: _Fields) -> None:
    if output.pattern.count("{part}") != 1:
        raise fields.error("pattern", f"is {output.pattern!r}, without {{part}} once")
    if output.binary and output.kind != "custom":
        raise fields.error("binary", f"is true, but a {output.kind} output is always text")
    if output.period_steps < 1:
        raise fields.error("period_steps", f"is {output.period_steps}, not at least 1")
    if len(set(output.columns)) != len(output.columns) or not output.columns:
        raise fields.error("columns", "is empty or names a column twice")
    if len(output.header) != len(output.columns):
        raise fields.error("engine_columns", "has another length than columns")
    if output.kind == "print" and output.columns[0] != "step":
        raise fields.error("columns", "does not begin with step, as a print output must")
