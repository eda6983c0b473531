"""Timing of the cost variants: the rounds and the result."""

import os
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path

from cost_decks import Beds, CostTemplates, TimedDecks, text_hash, with_own_blocks
from cost_file import RoundsFile, TimedCosts, TimedVariant, Timing, base_cost, cost
from cost_variants import BASES, Variant, standard_case, variant_case, variants
from dragdeck import __version__
from dragdeck.cases.case import Case
from dragdeck.decks import CASE_FILE, DECK_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.render import deck_text, write_run
from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.engine.log import engine_errors, loops, reached_end
from dragdeck.engine.process import Engine, command, execute, find_engine
from dragdeck.engine.reports import Report
from dragdeck.engine.run_folder import fingerprint
from dragdeck.errors import EngineError, InputError, choices
from dragdeck.files import write_text
from dragdeck.project import study_templates
from dragdeck.records.run import CaseFile
from dragdeck.records.tradeoff import Machine, processor
from dragdeck.scenes.process import process_scene

SECONDS = 0.15
"""Drag that the standard deck is timed over, s of process time; the others go as many steps."""

BLOCK = 5
"""Variants that share one timing of their base, so that the two are close in time."""

_QUIET = 0.3
"""Load average above which the machine counts as busy: half a process and more."""

_START_FILE = "start.liggghts"
_ROUNDS_FILE = "rounds.json"


def time_variants(
    case: Case,
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
    DumpError, TableError
        The tables of a settled bed could not be made.
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
    if load > _QUIET:
        report(f"warning: the machine is busy (load average {load:.2f}); CPU times will scatter")
    base = standard_case(case)
    bench = _Bench(
        base=base,
        variants=_chosen(variants(base), only),
        templates=with_own_blocks(environment(templates, study_templates(case))),
        engine=find_engine(),
        folder=out.resolve().parent / "costs",
        seconds=seconds,
        load=load,
        report=report,
    )
    _result(bench, bench.rounds(rounds)).write(out)
    return out


def _chosen(known: Sequence[Variant], names: Sequence[str]) -> list[Variant]:
    by_name = {variant.name: variant for variant in known}
    for name in names:
        if name not in by_name:
            raise InputError(
                "no such variant",
                field="--only",
                value=name,
                limit=choices(name, by_name),
            )
    return [by_name[name] for name in names] or list(known)


def _time(engine: Engine, folder: Path, deck: str, ranks: int) -> Timing:
    """Run a deck to its end and remove what it wrote but its screen.

    Raises
    ------
    EngineError
        It did not get there.
    """
    screen, before = folder / f"screen.{deck.partition('.')[0]}.txt", set(folder.iterdir())
    try:
        ending = execute(command(engine, deck, ranks, 1, None), folder, screen, lambda _: None)
    finally:
        for file in set(folder.iterdir()) - before - {screen}:
            file.unlink()
    text = screen.read_text(errors="replace")
    if ending.exit_status != 0 or not reached_end(text):
        why = "; ".join(engine_errors(text)) or f"exit status {ending.exit_status}"
        raise EngineError(
            f"{folder / deck}: did not run to its end: {why}\n  log:    {screen}\n"
            "  remedy: measure the costs again to go on"
        )
    timed = loops(text)
    return Timing(
        cpu_time_s=ending.cpu_time_s,
        wall_time_s=sum(loop.wall_time_s for loop in timed),
        steps=sum(loop.steps for loop in timed),
    )


@dataclass(frozen=True)
class _Deck:
    """A deck to be timed, and the same deck cut short after its start."""

    whole: AnyScene
    start: AnyScene
    ranks: int


@dataclass(frozen=True)
class _Bench:
    """Times decks in rounds, each block of variants beside its base."""

    base: Case
    variants: Sequence[Variant]
    templates: CostTemplates
    engine: Engine
    folder: Path
    seconds: float
    load: float
    report: Report

    @cached_property
    def bases(self) -> list[Variant]:
        """The bases that the variants need."""
        return [BASES[name] for name in dict.fromkeys(variant.base for variant in self.variants)]

    @cached_property
    def decks(self) -> Mapping[str, _Deck]:
        """Every deck by the name of its variant, with its bed."""
        batch = Batch(self.folder / "beds", self.templates.environment, self.report)
        beds = Beds(batch, self.templates)
        steps = round(self.seconds / process_scene(self.base).deck.timestep_s)
        timed = TimedDecks(self.base, self.templates, steps)
        found = {}
        for variant in [*self.bases, *self.variants]:
            bed = None if variant.scene == "drop_test" else beds.of(self.base, variant)
            whole, start = (timed.scene(variant, bed, start=cut) for cut in (False, True))
            ranks = variant_case(self.base, variant).ranks if variant.scene == "process" else 1
            found[variant.name] = _Deck(whole, start, ranks)
        return found

    @property
    def timesteps_s(self) -> Mapping[str, float]:
        """Time step of every deck, s."""
        return {name: deck.whole.deck.timestep_s for name, deck in self.decks.items()}

    @cached_property
    def inputs(self) -> Mapping[str, str]:
        """Hash of what a timing depends on: decks of variant and base, engine, processor."""
        own = {name: f"{self._write(name, deck)} {deck.ranks}" for name, deck in self.decks.items()}
        where = f"{self.engine.version} {processor()}"
        return {
            variant.name: text_hash(f"{where} {own[variant.name]} {own[variant.base]}")
            for variant in self.variants
        }

    def _write(self, name: str, deck: _Deck) -> str:
        """Write the files of a deck in place of older ones; their hash."""
        place, templates = self._place(name), self.templates.environment
        place.mkdir(parents=True, exist_ok=True)
        for old in place.iterdir():
            old.unlink()
        write_run(deck.whole, place, templates)
        write_text(place / _START_FILE, deck_text(deck.start, templates))
        return fingerprint(place, CaseFile.read(place / CASE_FILE))

    def rounds(self, count: int) -> list[TimedVariant]:
        """Time what was not timed yet; the rows of all rounds."""
        file = self.folder / _ROUNDS_FILE
        rows = _known_rows(file, self.inputs, self.report)
        for number in range(count):
            there = {row.name for row in rows if row.round == number}
            for block in blocks(self.variants, number):
                missing = [variant for variant in block if variant.name not in there]
                if missing:
                    rows += self._block(missing, number)
                    RoundsFile(rows=rows).write(file)
            self.report(f"round {number + 1} of {count} is timed")
        return [row for row in rows if row.round < count]

    def _block(self, block: Sequence[Variant], number: int) -> list[TimedVariant]:
        """Time a base and then the variants that are compared with it."""
        base = self._timing(block[0].base)
        return [self._row(variant, number, base) for variant in block]

    def _row(self, variant: Variant, number: int, base: Timing) -> TimedVariant:
        own = self._timing(variant.name)
        self.report(
            f"round {number + 1}: {variant.name}: {own.cpu_time_s:.3g} s for {own.steps:,} steps,"
            f" {variant.base}: {base.cpu_time_s:.3g} s for {base.steps:,}"
        )
        return TimedVariant(
            **dict(own),
            name=variant.name,
            round=number,
            inputs=self.inputs[variant.name],
            measured=datetime.now(UTC).date().isoformat(),
            load_average_before=round(self.load, 2),
            base=base,
        )

    def _timing(self, name: str) -> Timing:
        """Time of a deck's steps, its start taken out."""
        place, ranks = self._place(name), self.decks[name].ranks
        whole, start = (_time(self.engine, place, file, ranks) for file in (DECK_FILE, _START_FILE))
        return whole - start

    def _place(self, name: str) -> Path:
        return self.folder / "runs" / name


def blocks(chosen: Sequence[Variant], number: int) -> Iterator[list[Variant]]:
    """The variants of a round in blocks of one base each; every round begins elsewhere."""
    for base in dict.fromkeys(variant.base for variant in chosen):
        own = [variant for variant in chosen if variant.base == base]
        first = number * (BLOCK - 2) % len(own)
        turned = own[first:] + own[:first]
        for begin in range(0, len(turned), BLOCK):
            yield turned[begin : begin + BLOCK]


def _known_rows(file: Path, inputs: Mapping[str, str], report: Report) -> list[TimedVariant]:
    """Rows that were timed before; those of other decks are moved to ``archive/``."""
    if not file.is_file():
        return []
    known = RoundsFile.read(file)
    same = [row for row in known.rows if inputs.get(row.name) == row.inputs]
    if len(same) < len(known.rows):
        kept = file.parent / "archive"
        known.write(kept / f"rounds-{text_hash(known.as_text())}.json")
        report(f"timings of other decks were moved to {kept}")
    return same


def _result(bench: _Bench, rows: Sequence[TimedVariant]) -> TimedCosts:
    """Content of ``costs.json``."""
    study, steps_s = bench.base.study, bench.timesteps_s
    base_of = {variant.name: variant.base for variant in bench.variants}
    of_base = {
        base.name: [row.base for row in rows if base_of.get(row.name) == base.name]
        for base in bench.bases
    }
    return TimedCosts(
        study=bench.base.study_name,
        fidelity=study.chosen_fidelity(),
        particles=study.particle_count,
        seconds=bench.seconds,
        measured=max(row.measured for row in rows),
        command=shlex.join(["python", "benchmarks/costs", *sys.argv[1:]]),
        versions={"dragdeck": __version__, "engine": bench.engine.version},
        machine=Machine.here(),
        load_average_before=max(row.load_average_before for row in rows),
        bases=[base_cost(base, of_base[base.name], steps_s[base.name]) for base in bench.bases],
        costs=[cost(variant, rows, steps_s) for variant in bench.variants],
    )
