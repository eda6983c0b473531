"""Damaged checkpoints, inputs and results."""

import json
import os
import random
import re
import shutil
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from attack.calls import (
    LARGEST_FILE,
    REFUSED,
    Call,
    Said,
    call,
    engines,
    gone_within,
    judged,
    kill,
    main_of,
)
from attack.case import Attack, Got
from attack.disks import small_disk
from attack.ground import PLACES, STUDY, Phase, differences, locked
from attack.kills import MOST_TRIES, SAME, Arena, finish, same_tables

Damage = Callable[[Path, random.Random], None]


def _cut(file: Path, chance: random.Random) -> None:
    os.truncate(file, int(file.stat().st_size * chance.uniform(0.05, 0.95)))


def _empty(file: Path, chance: random.Random) -> None:
    os.truncate(file, 0)


def _flipped(file: Path, chance: random.Random, count: int = 1) -> None:
    content = bytearray(file.read_bytes())
    for _ in range(count):
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    file.write_bytes(content)


def _zeroed(file: Path, chance: random.Random) -> None:
    file.write_bytes(bytes(file.stat().st_size))


def _garbled(file: Path, chance: random.Random) -> None:
    file.write_bytes(chance.randbytes(max(64, file.stat().st_size)))


def _missing(file: Path, chance: random.Random) -> None:
    file.unlink()


def _in_the_way(file: Path, chance: random.Random) -> None:
    file.unlink()
    file.mkdir()


# --- checkpoints ----------------------------------------------------------------------

_CHECKPOINT_DAMAGE: dict[str, Damage] = {
    "cut": _cut,
    "empty": _empty,
    "a bit flipped": _flipped,
    "100 bits flipped": partial(_flipped, count=100),
    "zeros": _zeroed,
    "random bytes": _garbled,
    "missing": _missing,
}
_WHICH: dict[str, slice] = {"newest": slice(-1, None), "older": slice(0, -1), "both": slice(None)}
RESUMED = ("filling", "process")


def checkpoint_attacks(seed: int) -> Iterator[Attack]:
    """Every damage to the newest, the older and both checkpoints, and clocks that lie."""
    for place in RESUMED:
        for what, damage in _CHECKPOINT_DAMAGE.items():
            for which, chosen in _WHICH.items():
                act = partial(_resume, place, partial(_damage_checkpoints, damage, chosen, seed))
                yield Attack("checkpoint", f"{place}: {which} {what}", act, (SAME,), 8.0)
        for what, spoil in _SPOILED_FOLDERS.items():
            act = partial(_resume, place, spoil)
            yield Attack("checkpoint", f"{place}: {what}", act, (SAME,), 8.0)


def checkpoints(folder: Path) -> list[Path]:
    """Checkpoints of a run folder, oldest first."""
    found = [file for file in folder.glob("checkpoint.*.restart") if file.is_file()]
    return sorted(found, key=lambda file: int(file.name.split(".")[1]))


def _damage_checkpoints(damage: Damage, chosen: slice, seed: int, folder: Path) -> None:
    chance = random.Random(f"checkpoints {seed} {folder.parent.name}")
    for file in checkpoints(folder)[chosen]:
        damage(file, chance)


def _clock_back(folder: Path) -> None:
    for file in folder.iterdir():
        os.utime(file, (1, 1))


def _newest_looks_old(folder: Path) -> None:
    os.utime(checkpoints(folder)[-1], (1, 1))


def _newest_looks_last(folder: Path) -> None:
    os.utime(checkpoints(folder)[-1], (4e9, 4e9))


def _one_of_the_future(folder: Path) -> None:
    """What an engine that was killed while it wrote may leave, later than any other."""
    last = checkpoints(folder)[-1]
    step = 2 * int(last.name.split(".")[1])
    (folder / f"checkpoint.{step}.restart").write_bytes(last.read_bytes()[:1000])


def _half_a_state(folder: Path) -> None:
    for file in folder.glob("*checkpoint*"):
        if file.suffix != ".restart" and file.is_file():
            os.truncate(file, file.stat().st_size // 2)


_SPOILED_FOLDERS: dict[str, Callable[[Path], None]] = {
    "all files of 1970": _clock_back,
    "newest of 1970": _newest_looks_old,
    "newest of 2096": _newest_looks_last,
    "a cut one of a later step": _one_of_the_future,
    "what lists the checkpoints is cut": _half_a_state,
}


@contextmanager
def stopped(arena: Arena, place: str) -> Iterator[tuple[Phase, Path]]:
    """A copy of a run that was stopped half-way, on a small disk where one can be mounted."""
    phase = arena.ground.phases[place.replace("_", " ")]
    source = _stopped_once(arena, place, phase)
    with small_disk(arena.folder) as disk:
        project = (disk.folder if disk else arena.folder) / "project"
        shutil.copytree(source, project, symlinks=True)
        yield phase, project


def _stopped_once(arena: Arena, place: str, phase: Phase) -> Path:
    source = arena.clean.cache / f"{place}-stopped"
    with locked(arena.clean.cache / f"{place}-stopped.lock"):
        if not (source / "done").is_file():
            said = [_stop(source, arena, phase, 0.6)]
            while said[-1].status == 0:  # it was quicker than it was undisturbed: earlier, then
                assert len(said) < MOST_TRIES, said[-1].text
                said.append(_stop(source, arena, phase, 0.6 * 0.5 ** len(said)))
            assert said[-1].status is not None, said[-1].text
            assert len(checkpoints(source / phase.run)) > 1
            (source / "done").touch()
    return source


def _stop(source: Path, arena: Arena, phase: Phase, share: float) -> Said:
    """What a run said that was asked to stop after a share of its time."""
    shutil.rmtree(source, ignore_errors=True)
    project = arena.ground.copy_before(phase, source)
    running = Call(phase.words, project, source.with_suffix(".log"))
    folder = project / phase.run
    running.wait_until(
        lambda: len(checkpoints(folder)) > 2 and running.spent_s() > share * phase.cpu_s
    )
    running.process.send_signal(signal.SIGTERM)
    return running.wait()


def _resume(place: str, spoil: Callable[[Path], None], arena: Arena) -> Got:
    with stopped(arena, place) as (phase, project):
        spoil(project / phase.run)
        got = finish(arena, phase, project)
        return endless(project) or got


def endless(project: Path) -> Got | None:
    """What wrote without end until the limit of a file's size."""
    for file in project.rglob("*"):
        if file.is_file() and file.stat().st_size >= 0.9 * LARGEST_FILE:
            return Got("endless output", f"{file.name}: {file.stat().st_size:,} bytes")
    return None


# --- inputs ---------------------------------------------------------------------------


def _cut_to_a_tenth(file: Path, chance: random.Random) -> None:
    os.truncate(file, file.stat().st_size // 10)


def _one_digit(file: Path, chance: random.Random) -> None:
    """Another digit after a decimal point, past the first 40 % of the file."""
    text = file.read_text(encoding="ascii")
    start = int(0.4 * len(text))
    place = re.compile(r"(?<=\d\.\d)\d").search(text, start)
    assert place is not None
    digit = str((int(place.group()) + 5) % 10)
    file.write_text(text[: place.start()] + digit + text[place.end() :], encoding="ascii")


_INPUT_DAMAGE: dict[str, Damage] = {
    "cut to a tenth": _cut_to_a_tenth,
    "empty": _empty,
    "another digit": _one_digit,
    "missing": _missing,
}


def input_attacks(seed: int) -> Iterator[Attack]:
    """Inputs that change after they were rendered, before a start or a resume."""
    for place, name in (("filling", "particles.data"), ("process", "workpiece.stl")):
        for what, damage in _INPUT_DAMAGE.items():
            for when, act in (("start", _start), ("resume", _resume_with_input)):
                named = partial(act, place, name, damage, seed)
                yield Attack("input", f"{name} {what} before a {when}", named, (REFUSED,), 4.0)
    for what in ("cut", "empty", "a bit flipped", "missing"):
        for when, act in (("start", _start), ("resume", _resume_with_input)):
            damage = _CHECKPOINT_DAMAGE[what]
            named = partial(act, "process", "packing.restart", damage, seed)
            title = f"packing.restart of the filling {what} before a {when}"
            yield Attack("input", title, named, (REFUSED,), 4.0)
    for what in ("cut to a tenth", "empty", "missing"):
        named = partial(_start, "drop_test", "in.liggghts", _INPUT_DAMAGE[what], seed)
        yield Attack("input", f"in.liggghts {what} before a start", named, (REFUSED,), 4.0)


def _input_file(project: Path, phase: Phase, name: str) -> Path:
    if name == "packing.restart":
        (folder,) = (project / "results" / STUDY / "filling").iterdir()
        return folder / name
    return project / phase.run / name


_NAMED_AS = {"in.liggghts": r"in\.liggghts|input script"}


def _start(place: str, name: str, damage: Damage, seed: int, arena: Arena) -> Got:
    phase = arena.ground.phases[place.replace("_", " ")]
    with small_disk(arena.folder) as disk:
        project = (disk.folder if disk else arena.folder) / "project"
        arena.ground.copy_before(phase, project)
        return _called(arena, phase, project, name, damage, seed)


def _resume_with_input(place: str, name: str, damage: Damage, seed: int, arena: Arena) -> Got:
    with stopped(arena, place) as (phase, project):
        return _called(arena, phase, project, name, damage, seed)


def _called(
    arena: Arena, phase: Phase, project: Path, name: str, damage: Damage, seed: int
) -> Got:  # fmt: skip
    damage(_input_file(project, phase, name), random.Random(f"inputs {seed} {name}"))
    said = call(phase.words, project, arena.folder / "run.log", 60.0)
    leftover = not gone_within(project, 1.0)
    kill(engines(project))
    if leftover:
        return Got("an engine is left over", said.tail)
    named = _NAMED_AS.get(name, re.escape(name))
    return endless(project) or judged(said, named, accepted="accepted: a complete run")


# --- results --------------------------------------------------------------------------


def _json(change: Callable[[Any], Any]) -> Damage:
    def damage(file: Path, chance: random.Random) -> None:
        file.write_text(json.dumps(change(json.loads(file.read_text()))), encoding="utf-8")

    return damage


def _text(text: str | bytes) -> Damage:
    content = text.encode() if isinstance(text, str) else text

    def damage(file: Path, chance: random.Random) -> None:
        file.write_bytes(content)

    return damage


def _spoilt_leaf(value: Any, leaf: object, depth: int = 0) -> Any:
    """The same document with its numbers replaced."""
    if isinstance(value, dict):
        kept = {"schema"} if depth == 0 else set()
        return {
            name: item if name in kept else _spoilt_leaf(item, leaf, depth + 1)
            for name, item in value.items()
        }
    if isinstance(value, list):
        return [_spoilt_leaf(item, leaf, depth + 1) for item in value]
    return leaf if isinstance(value, int | float) and not isinstance(value, bool) else value


_ANY: dict[str, Damage] = {
    "cut": _cut,
    "empty": _empty,
    "random bytes": _garbled,
    "zeros": _zeroed,
    "a folder in its place": _in_the_way,
    "missing": _missing,
}
_JSON: dict[str, Damage] = {
    **_ANY,
    "a list": _text("[]"),
    "no keys": _text("{}"),
    "null": _text("null"),
    "of another version": _json(lambda value: {**value, "schema": 99}),
    "100,000 brackets": _text("[" * 100_000),
    "UTF-16": _text("{}".encode("utf-16")),
    "its numbers are text": _json(lambda value: _spoilt_leaf(value, "text")),
    "its numbers are NaN": _json(lambda value: _spoilt_leaf(value, float("nan"))),
    "its numbers are 1e300": _json(lambda value: _spoilt_leaf(value, 1e300)),
    "its numbers have 5000 digits": _text(b'{"schema": ' + b"9" * 5000 + b"}"),
}


def _fewer_columns(file: Path, chance: random.Random) -> None:
    table = pq.read_table(file)
    pq.write_table(table.select(table.schema.names[: table.num_columns // 2]), file)


def _no_rows(file: Path, chance: random.Random) -> None:
    pq.write_table(pq.read_table(file).slice(0, 0), file)


def _words_for_numbers(file: Path, chance: random.Random) -> None:
    table = pq.read_table(file)
    words = pa.array(["word"] * table.num_rows)
    names = table.schema.names
    pq.write_table(pa.table([words] * len(names), names=names), file)


_PARQUET: dict[str, Damage] = {
    **_ANY,
    "half its columns": _fewer_columns,
    "no rows": _no_rows,
    "words for numbers": _words_for_numbers,
}


def _absurd_count(file: Path, chance: random.Random) -> None:
    content = file.read_bytes()
    changed = re.sub(rb"(NUMBER OF \w+\n)\d+", rb"\g<1>99999999999999", content, count=1)
    if changed == content:  # a binary dump: the number of rows stands after the step
        changed = content[:8] + (2**62).to_bytes(8, "little") + content[16:]
    file.write_bytes(changed)


def _doubled(file: Path, chance: random.Random) -> None:
    content = file.read_bytes()
    file.write_bytes(content + content)


_RAW: dict[str, Damage] = {**_ANY, "written twice": _doubled, "an absurd count": _absurd_count}

_OF_RUN = ("state.json", "case.json", "columns.json", "run.json")
_READERS: dict[str, tuple[str, ...]] = {
    "state.json": ("run",),
    "case.json": ("run", "tables", "chains", "loading", "figures", "report"),
    "columns.json": ("run", "tables"),
    "run.json": ("run", "tables", "chains", "loading", "figures", "report"),
    "tables/workpiece_force.parquet": ("figures", "report"),
    "tables/workpiece_contacts.parquet": ("chains", "loading", "figures"),
    "tables/particles.parquet": ("chains", "figures"),
    "tables/contacts.parquet": ("chains", "figures"),
    "tables/network.parquet": ("figures", "report"),
    "tables/chains.parquet": ("figures", "report"),
    "tables/clusters.parquet": ("figures", "report"),
    "tables/closure.json": ("figures", "report"),
    "tables/loading.json": ("report",),
    "tables/figures.json": ("report",),
}
"""Results of the process, and who reads them, or might."""


def result_attacks(seed: int) -> Iterator[Attack]:
    """Every damage to every result, each read by one of its readers."""
    chance = random.Random(f"results {seed}")
    wanted = (REFUSED, SAME)
    for name, readers in _READERS.items():
        kinds = _JSON if name.endswith(".json") else _PARQUET
        for what, damage in kinds.items():
            reader = chance.choice(readers)
            if (what, name) == ("no rows", "tables/chains.parquet"):
                continue  # there may be none
            act = partial(_read, "process", name, damage, reader, seed)
            seconds = 2.0 if reader in ("tables", "run") else 4.0
            yield Attack("result", f"process {name}: {what}, then {reader}", act, wanted, seconds)
    for place in PLACES:
        for name in _raw_names(place):
            for what, damage in _RAW.items():
                act = partial(_read, place, name, damage, "tables", seed)
                if what == "an absurd count" and name.endswith(".txt"):
                    continue
                yield Attack("result", f"{place} {name}: {what}, then tables", act, wanted, 2.0)
    for place in ("drop_test", "filling"):
        for name in (*_OF_RUN, "tables/packing.json"):
            if (place, name) == ("drop_test", "tables/packing.json"):
                continue
            for what in ("cut", "empty", "random bytes", "100,000 brackets", "a list"):
                reader = "run" if name == "state.json" else "tables"
                if "packing" in name:
                    reader = "render"
                act = partial(_read, place, name, _JSON[what], reader, seed)
                yield Attack("result", f"{place} {name}: {what}, then {reader}", act, wanted, 2.0)


def _raw_names(place: str) -> Sequence[str]:
    return {
        "drop_test": ("impacts.1.txt",),
        "filling": ("thermo.1.txt", "particles.1.bin"),
        "process": (
            *("thermo.1.txt", "workpiece_force.1.txt", "workpiece_particles.1.bin"),
            *("workpiece_contacts.1.dump", "contacts.1.dump", "particles.1.bin"),
        ),
    }[place]


def _read(place: str, name: str, damage: Damage, reader: str, seed: int, arena: Arena) -> Got:
    project = arena.ground.copy(arena.folder / "project")
    run = arena.ground.run(place)
    file = project / run / name
    damage(file, random.Random(f"results {seed} {name}"))
    said = _call_reader(arena, reader, place, project)
    kill(engines(project))
    named = re.escape(Path(name).name).replace(r"\.1\.", r"\.(1|\{part\})\.")
    got = endless(project) or judged(said, named, accepted=SAME)
    if got.outcome != SAME:
        return got
    if reader == "run":
        return same_tables(arena, arena.ground.phases[place.replace("_", " ")], project)
    wanted = arena.ground.root / run
    problems = differences(project / run, wanted, but=name)
    return Got("accepted: other tables", "\n".join(problems)) if problems else got


def _call_reader(arena: Arena, reader: str, place: str, project: Path) -> Said:
    run = arena.ground.run(place)
    if reader == "run":
        words = arena.ground.phases[place.replace("_", " ")].words
        return call(words, project, arena.folder / "run.log", 60.0)
    if reader == "render":
        packing = f"{run}/tables/packing.json"
        process = Path(arena.ground.run("process")).name
        words = ["step", "render", STUDY, "process", process, "--packing", packing]
        return main_of("dragdeck", words, project)
    if reader == "report":
        out = ["--out", f"results/{STUDY}/report"]
        return main_of("dragchain", ["report", *out, run], project)
    return main_of("dragchain", [reader, run], project)
