"""Timing of the variants of `costs`: their beds, the rounds, the result."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import jinja2
from trimesh import Trimesh

from dragdeck import __version__
from dragdeck.campaigns.cost_variants import (
    BASES,
    Ratio,
    TimedDeck,
    Variant,
    at_rest_deck,
    geometric,
    standard_case,
    timed_deck,
    variant_case,
    variants,
    workpiece_in_deck,
)
from dragdeck.campaigns.stability_map import tabulate
from dragdeck.cases.case import Case
from dragdeck.decks.render import DECK_FILE, environment, write_run
from dragdeck.engine.log import engine_errors, loops
from dragdeck.engine.process import Engine, command, execute, find_engine
from dragdeck.engine.run_folder import fingerprint, run
from dragdeck.errors import EngineError, InputError
from dragdeck.files import replace_text
from dragdeck.mesh import write_stl
from dragdeck.project import find_project, study_templates
from dragdeck.scenes.filling import FILLING, filling_scene
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import Bed

Report = Callable[[str], None]
Row = Mapping[str, Any]

SECONDS = 0.15
"""Drag that the standard deck is timed over, s of process time; the others go as many steps."""

BLOCK = 5
"""Variants that share one timing of their base, so that the two are close in time."""

QUIET = 0.3
"""Load average above which the machine counts as busy: half a process and more."""

START_FILE = "start.liggghts"
BED_FILE = "bed.restart"
ROUNDS_FILE = "rounds.json"


@dataclass(frozen=True)
class Timing:
    """What a stretch of steps took.

    Attributes
    ----------
    cpu_time_s : float
        Processor time of all ranks together.
    wall_time_s : float
        Of the engine's loop over steps.
    steps : int
    """

    cpu_time_s: float
    wall_time_s: float
    steps: int

    def __sub__(self, other: Timing) -> Timing:
        return Timing(
            self.cpu_time_s - other.cpu_time_s,
            self.wall_time_s - other.wall_time_s,
            self.steps - other.steps,
        )


def measure(
    case: Case,
    results: Path,
    templates: Path,
    out: Path,
    report: Report,
    *,
    rounds: int = 3,
    seconds: float = SECONDS,
    only: Sequence[str] = (),
) -> Path:
    """Time all variants of a study's standard deck and write their costs.

    Rounds that were timed before with the same decks and engine are kept; those
    of other ones are moved to ``archive/``.

    Parameters
    ----------
    case : Case
        Its fidelity gives modulus and step of the standard deck.
    results : Path
        The study's results: a settled bed that is there is used.
    templates : Path
        The project's templates.
    out : Path
        The result; beds and timings go to ``costs/`` beside it.
    report : callable
        Gets lines.
    rounds : int
    seconds : float
        Process time of the standard deck's drag that is timed, s.
    only : sequence of str
        Names of variants; none: all.

    Returns
    -------
    Path
        The result.

    Raises
    ------
    InputError
        The result is there already, or a deck cannot be made.
    EngineError, RejectedRunError
        A run failed or was interrupted.
    """
    if out.exists():
        raise InputError(
            "this measurement is there already",
            file=out,
            remedy="move it away, or give another --out",
        )
    for name, value in (("--rounds", rounds), ("--seconds", seconds)):
        if not value > 0:
            raise InputError("nothing to time", field=name, value=value, limit="greater than 0")
    load = os.getloadavg()[0]
    if load > QUIET:
        report(f"warning: the machine is busy (load average {load:.2f}); CPU times will scatter")
    base = standard_case(case)
    chosen = _chosen(variants(base), only)
    folder = out.resolve().parent / "costs"
    decks = environment(templates, study_templates(case))
    beds = _Beds(base, results, folder, decks, find_engine(), report)
    bench = _Bench(base, beds, seconds, chosen, load)
    rows = bench.rounds(rounds)
    replace_text(out, _json(_result(bench, rows)))
    return out


def _chosen(known: Sequence[Variant], names: Sequence[str]) -> list[Variant]:
    by_name = {variant.name: variant for variant in known}
    for name in names:
        if name not in by_name:
            raise InputError(
                "no such variant",
                field="--only",
                value=name,
                limit=f"one of: {', '.join(by_name)}",
                remedy="choose among these",
            )
    return [by_name[name] for name in names] or list(known)


@dataclass(frozen=True)
class _Beds:
    """Beds that drags start from, each made once."""

    base: Case
    results: Path
    folder: Path
    templates: jinja2.Environment
    engine: Engine
    report: Report

    def settled(self, case: Case) -> Path:
        """The folder of a fill: the study's own if it is there."""
        run_id = FILLING.run_id(case)
        for place in (self.results / "filling" / run_id, self.folder / "filling" / run_id):
            if (place / "run.json").is_file() and (place / "tables" / "packing.json").is_file():
                return place.resolve()
        self.report(f"filling {run_id}")
        write_run(filling_scene(case), place, self.templates)
        run(place, self.report)
        tabulate(place)
        return place.resolve()

    def measured(self, case: Case) -> Bed:
        """Height of the settled bed."""
        file = self.settled(case) / "tables" / "packing.json"
        found = json.loads(file.read_text(encoding="utf-8"))
        return Bed(surface_m=found["bed_height_m"], top_m=found["top_m"])

    def owner(self, case: Case) -> Case:
        """The case whose settled bed a variant is dragged through: other particles, other bed."""
        return case if case.study.media != self.base.study.media else self.base

    def seen(self, file: Path) -> str:
        """Path of a file as a deck sees it, from a folder two below this one."""
        return os.path.relpath(file, self.folder / "any" / "any")

    def with_workpiece(self, case: Case) -> Path:
        """Restart file of the bed with the workpiece in it, for a case's modulus and facets."""
        owner = self.owner(case)
        bed, source = self.measured(owner), self.seen(self.settled(owner) / "packing.restart")
        text = workpiece_in_deck(owner, bed, source, self.templates)
        begun = self._kept(owner, bed, text, "workpiece-in")
        if _stiffness_and_facets(case) == _stiffness_and_facets(owner):
            return begun
        return self._kept(
            case, bed, at_rest_deck(case, bed, self.seen(begun), self.templates), "at-rest"
        )

    def _kept(self, case: Case, bed: Bed, text: str, name: str) -> Path:
        place = self.folder / "beds" / f"{name}-{_digest(text)}"
        _write(place, {DECK_FILE: text}, process_scene(case, bed).meshes)
        inputs, kept, known = fingerprint(place), place / BED_FILE, place / "inputs.txt"
        if not (kept.is_file() and known.is_file() and known.read_text() == inputs):
            self.report(f"making the bed {place.name}")
            _time(self.engine, place, DECK_FILE, 1)
            replace_text(known, inputs)
        return kept.resolve()


def _stiffness_and_facets(case: Case) -> Mapping[str, Any]:
    study = case.study
    return {
        "scale": study.chosen_fidelity().youngs_modulus_scale,
        "bowl": study.bowl.facet_size_m,
        "workpiece": study.workpiece,
    }


def _write(folder: Path, texts: Mapping[str, str], meshes: Mapping[str, Trimesh]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        replace_text(folder / name, text)
    for name, mesh in meshes.items():
        write_stl(mesh, folder / name)


def _time(engine: Engine, folder: Path, deck: str, ranks: int) -> Timing:
    """Run a deck to its end.

    Raises
    ------
    EngineError
        It did not get there.
    """
    screen = folder / f"screen.{deck.partition('.')[0]}.txt"
    ending = execute(command(engine, deck, ranks, 1, None), folder, screen, lambda seconds: None)
    text = screen.read_text(errors="replace")
    if ending.exit_status != 0 or "DRAGDECK END" not in text:
        why = "; ".join(engine_errors(text)) or f"exit status {ending.exit_status}"
        raise EngineError(
            f"{folder / deck}: did not run to its end: {why}\n  log:    {screen}\n"
            "  remedy: measure the costs again to go on"
        )
    timed = loops(text)
    return Timing(
        ending.cpu_time_s,
        sum(loop.wall_time_s for loop in timed),
        sum(loop.steps for loop in timed),
    )


@dataclass(frozen=True)
class _Bench:
    """Times decks in rounds, each block of variants beside its base."""

    base: Case
    beds: _Beds
    seconds: float
    variants: Sequence[Variant]
    load: float

    @cached_property
    def bases(self) -> list[Variant]:
        """The bases that the variants need."""
        return [BASES[name] for name in dict.fromkeys(variant.base for variant in self.variants)]

    @cached_property
    def decks(self) -> Mapping[str, TimedDeck]:
        """Every deck by the name of its variant, with its bed."""
        return {variant.name: self._deck(variant) for variant in [*self.bases, *self.variants]}

    def _deck(self, variant: Variant) -> TimedDeck:
        case, beds = variant_case(self.base, variant), self.beds
        bed, source, steps = None, "", 1
        if variant.scene != "drop_test":
            steps = round(self.seconds / process_scene(self.base).deck.timestep_s)
            bed = beds.measured(beds.owner(case))
            filling = beds.settled(beds.owner(case)) / "packing.restart"
            source = beds.seen(beds.with_workpiece(case) if variant.scene == "process" else filling)
        return timed_deck(self.base, variant, beds.templates, steps, bed, source)

    @cached_property
    def inputs(self) -> Mapping[str, str]:
        """Hash of what a timing depends on: decks of variant and base, engine, processor."""
        own: dict[str, str] = {}
        for name, deck in self.decks.items():
            folder = self._place(name)
            folder.mkdir(parents=True, exist_ok=True)
            for old in folder.iterdir():
                old.unlink()
            texts = {DECK_FILE: deck.whole, START_FILE: deck.start, **deck.files}
            _write(folder, texts, deck.meshes)
            own[name] = f"{fingerprint(folder)} {deck.ranks}"
        where = f"{self.beds.engine.version} {processor()}"
        return {
            variant.name: _digest(f"{where} {own[variant.name]} {own[variant.base]}")
            for variant in self.variants
        }

    def rounds(self, count: int) -> list[Row]:
        """Time what was not timed yet; the rows of all rounds."""
        file = self.beds.folder / ROUNDS_FILE
        rows = _known_rows(file, self.inputs, self.beds.report)
        for number in range(count):
            for block in blocks(self.variants, number):
                there = {row["name"] for row in rows if row["round"] == number}
                missing = [variant for variant in block if variant.name not in there]
                if missing:
                    rows += self._block(missing, number)
                    _write(file.parent, {file.name: _json({"schema": 2, "rows": rows})}, {})
            self.beds.report(f"round {number + 1} of {count} is timed")
        return [row for row in rows if row["round"] < count]

    def _block(self, block: Sequence[Variant], number: int) -> list[Row]:
        """Time a base and then the variants that are compared with it."""
        base = self._timing(BASES[block[0].base])
        return [self._row(variant, number, base) for variant in block]

    def _row(self, variant: Variant, number: int, base: Timing) -> Row:
        own = self._timing(variant)
        self.beds.report(
            f"round {number + 1}: {variant.name}: {own.cpu_time_s:.3g} s for {own.steps:,} steps,"
            f" {variant.base}: {base.cpu_time_s:.3g} s for {base.steps:,}"
        )
        return {
            "name": variant.name,
            "round": number,
            "inputs": self.inputs[variant.name],
            "measured": datetime.now(UTC).date().isoformat(),
            "load_average_before": round(self.load, 2),
            **asdict(own),
            "base": asdict(base),
        }

    def _timing(self, variant: Variant) -> Timing:
        """Time of a variant's steps, its start taken out."""
        folder, ranks = self._place(variant.name), self.decks[variant.name].ranks
        whole, start = (
            _time_once(self.beds.engine, folder, deck, ranks) for deck in (DECK_FILE, START_FILE)
        )
        return whole - start

    def _place(self, name: str) -> Path:
        return self.beds.folder / "runs" / name


def blocks(chosen: Sequence[Variant], number: int) -> Iterator[list[Variant]]:
    """The variants of a round in blocks of one base each; every round begins elsewhere."""
    for base in dict.fromkeys(variant.base for variant in chosen):
        own = [variant for variant in chosen if variant.base == base]
        first = number * (BLOCK - 2) % len(own)
        turned = own[first:] + own[:first]
        for begin in range(0, len(turned), BLOCK):
            yield turned[begin : begin + BLOCK]


def _time_once(engine: Engine, folder: Path, deck: str, ranks: int) -> Timing:
    """Time a deck and remove what it wrote but its screen."""
    before = set(folder.iterdir())
    try:
        return _time(engine, folder, deck, ranks)
    finally:
        for file in set(folder.iterdir()) - before:
            if not file.name.startswith("screen."):
                file.unlink()


def _known_rows(file: Path, inputs: Mapping[str, str], report: Report) -> list[Row]:
    """Rows that were timed before; those of other decks are moved to ``archive/``."""
    if not file.is_file():
        return []
    rows: list[Row] = json.loads(file.read_text(encoding="utf-8"))["rows"]
    same = [row for row in rows if inputs.get(row["name"]) == row["inputs"]]
    if len(same) < len(rows):
        text = file.read_text(encoding="utf-8")
        kept = file.parent / "archive"
        _write(kept, {f"rounds-{_digest(text)}.json": text}, {})
        report(f"timings of other decks were moved to {kept}")
    return same


def costs(
    chosen: Sequence[Variant], rows: Sequence[Row], steps_s: Mapping[str, float]
) -> list[Row]:
    """The cost of each variant.

    Parameters
    ----------
    chosen : sequence of Variant
    rows : sequence of mapping
        One for each variant and round, with the timing of its base.
    steps_s : mapping of str to float
        Time step of every deck by name, s.

    Returns
    -------
    list of mapping
        `ratio`, `low` and `high` count what `unit` says; `per_step` and
        `per_second` are the same ratio in both units.
    """
    return [_cost(v, [row for row in rows if row["name"] == v.name], steps_s) for v in chosen]


def _cost(variant: Variant, rows: Sequence[Row], steps_s: Mapping[str, float]) -> Row:
    steps_per_second = steps_s[variant.base] / steps_s[variant.name]
    factor = steps_per_second if variant.unit == "per_second" else 1.0
    cpu = geometric([_per_step(row, "cpu_time_s") for row in rows])
    wall = geometric([_per_step(row, "wall_time_s") for row in rows])
    return {
        "name": variant.name,
        "scene": variant.scene,
        "what": variant.what,
        "against": BASES[variant.base].what,
        "unit": variant.unit,
        "parameter": variant.parameter,
        "level": variant.level,
        **_scaled(cpu, factor),
        "per_step": cpu.ratio,
        "per_second": cpu.ratio * steps_per_second,
        "wall_ratio": wall.ratio * factor,
        "rounds": len(rows),
        "steps": rows[0]["steps"],
        "timestep_s": steps_s[variant.name],
    }


def _per_step(row: Row, time: str) -> float:
    """Time of a step over that of the base."""
    base = row["base"]
    return float(row[time] / row["steps"] / (base[time] / base["steps"]))


def _scaled(found: Ratio, factor: float) -> dict[str, float | None]:
    values = asdict(found).items()
    return {name: None if value is None else value * factor for name, value in values}


def _result(bench: _Bench, rows: Sequence[Row]) -> Row:
    """Content of ``costs.json``."""
    study, steps_s = bench.base.study, {n: deck.timestep_s for n, deck in bench.decks.items()}
    return {
        "schema": 2,
        "study": bench.base.study_name,
        "fidelity": study.chosen_fidelity().model_dump(mode="json"),
        "particles": study.media.count,
        "seconds": bench.seconds,
        "measured": max(row["measured"] for row in rows),
        "command": shlex.join(["dragdeck", *sys.argv[1:]]),
        "versions": {"dragdeck": __version__, "engine": bench.beds.engine.version},
        "machine": {"cores": os.cpu_count(), "processor": processor()},
        "load_average_before": max(row["load_average_before"] for row in rows),
        "bases": [_base(base, bench.variants, rows, steps_s) for base in bench.bases],
        "costs": costs(bench.variants, rows, steps_s),
    }


def _base(
    base: Variant, chosen: Sequence[Variant], rows: Sequence[Row], steps_s: Mapping[str, float]
) -> Row:
    own = {variant.name for variant in chosen if variant.base == base.name}
    times = [row["base"] for row in rows if row["name"] in own]
    cpu = geometric([time["cpu_time_s"] / time["steps"] for time in times]).ratio
    wall = geometric([time["wall_time_s"] / time["steps"] for time in times]).ratio
    return {
        "name": base.name,
        "scene": base.scene,
        "what": base.what,
        "timestep_s": steps_s[base.name],
        "steps": times[0]["steps"],
        "cpu_us_per_step": 1e6 * cpu,
        "steps_per_s": 1 / wall,
    }


def processor() -> str:
    """Name of the machine's processor, as far as it is known."""
    known = Path("/proc/cpuinfo")
    text = known.read_text(encoding="utf-8") if known.is_file() else ""
    found = re.search(r"^model name\s*:\s*(.+)$", text, flags=re.MULTILINE)
    return found.group(1).strip() if found else platform.processor() or platform.machine()


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def _json(data: Any) -> str:
    return json.dumps(data, indent=1, allow_nan=False) + "\n"


def costs_command(
    study: str,
    fidelity: str | None,
    rounds: int,
    seconds: float | None,
    only: Sequence[str],
    out: Path,
) -> None:
    """Time what a study's input scripts leave out."""
    project = find_project(Path.cwd())
    case = project.cases(study, fidelity)[0]

    def report(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    measure(
        case,
        project.results(study),
        project.templates,
        out,
        report,
        rounds=rounds,
        seconds=SECONDS if seconds is None else seconds,
        only=only,
    )
