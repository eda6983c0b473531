"""Damaged checkpoints, inputs and results: named, or made good; never taken for whole."""

import json
import os
import random
import re
import shutil
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from attack.calls import Call, Said, call, engines, kill, main_of, refused
from attack.ground import SEED, STUDY, Phase, Undisturbed, differences, made_once
from attack.judge import MOST_TRIES, assert_bounded, assert_no_engine, assert_same_tables, finish

pytestmark = [pytest.mark.engine, pytest.mark.slow]

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
_WHICH = {"newest": slice(-1, None), "older": slice(0, -1), "both": slice(None)}
Spoil = Callable[[Path], None]


def checkpoints(folder: Path) -> list[Path]:
    """Checkpoints of a run folder, oldest first."""
    found = [file for file in folder.glob("checkpoint.*.restart") if file.is_file()]
    return sorted(found, key=lambda file: int(file.name.split(".")[1]))


def _damaged(damage: Damage, chosen: slice) -> Spoil:
    def spoil(folder: Path) -> None:
        chance = random.Random(f"checkpoints {SEED} {folder.parent.name}")
        for file in checkpoints(folder)[chosen]:
            damage(file, chance)

    return spoil


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


_SPOILED_FOLDERS: dict[str, Spoil] = {
    **{
        f"{which} {what}": _damaged(damage, chosen)
        for what, damage in _CHECKPOINT_DAMAGE.items()
        for which, chosen in _WHICH.items()
    },
    "all files of 1970": _clock_back,
    "newest of 1970": _newest_looks_old,
    "newest of 2096": _newest_looks_last,
    "a cut one of a later step": _one_of_the_future,
    "what lists the checkpoints is cut": _half_a_state,
}
_CHECKPOINTS = {
    f"{place}: {what}": (place, spoil)
    for place in ("filling", "process")
    for what, spoil in _SPOILED_FOLDERS.items()
}


@pytest.mark.attack(sample=1)
@pytest.mark.parametrize(("place", "spoil"), _CHECKPOINTS.values(), ids=_CHECKPOINTS)
def test_a_damaged_checkpoint_costs_nothing_but_time(
    place: str, spoil: Spoil, study: Undisturbed, target: Path
) -> None:
    phase = study.phase(place)
    copy_stopped(study, place, target)
    spoil(target / phase.run)
    finish(study, phase, target)


def copy_stopped(study: Undisturbed, place: str, target: Path) -> None:
    """Copy a project in which a run was stopped half-way."""
    phase, source = study.phase(place), study.cache / f"{place}-stopped"
    with made_once(source) as project:
        if project is not None:
            said = [_stop(project, study, phase, 0.6)]
            while said[-1].status == 0:  # it was quicker than it was undisturbed: earlier, then
                assert len(said) < MOST_TRIES, said[-1].text
                said.append(_stop(project, study, phase, 0.6 * 0.5 ** len(said)))
            assert said[-1].status is not None, said[-1].text
            assert len(checkpoints(project / phase.run)) > 1
    shutil.copytree(source, target, symlinks=True)


def _stop(source: Path, study: Undisturbed, phase: Phase, share: float) -> Said:
    """What a run said that was asked to stop after a share of its time."""
    shutil.rmtree(source, ignore_errors=True)
    project = study.copy_before(phase, source)
    running = Call(phase.words, project, source.with_suffix(".log"))
    folder = project / phase.run
    running.wait_until(
        lambda: len(checkpoints(folder)) > 2 and running.spent_s() > share * phase.cpu_s
    )
    running.process.send_signal(signal.SIGTERM)
    return running.wait()


# --- inputs ---------------------------------------------------------------------------


_OF_INPUT = {
    what: _CHECKPOINT_DAMAGE[what] for what in ("cut", "empty", "missing", "a bit flipped")
}
_INPUTS = {
    f"{name} {what} before a {when}": (place, name, _CHECKPOINT_DAMAGE[what], when)
    for place, name, moments in (
        ("filling", "particles.data", ("start", "resume")),
        ("process", "workpiece.stl", ("start", "resume")),
        ("process", "packing.restart", ("start", "resume")),
        ("drop_test", "in.liggghts", ("start",)),
    )
    for what in _OF_INPUT
    for when in moments
    if (name, what) != ("in.liggghts", "a bit flipped")  # it may be one of a remark
}


@pytest.mark.attack(sample=1)
@pytest.mark.parametrize(("place", "name", "damage", "when"), _INPUTS.values(), ids=_INPUTS)
def test_an_input_that_changed_is_refused(
    place: str, name: str, damage: Damage, when: str, study: Undisturbed, target: Path
) -> None:
    phase = study.phase(place)
    if when == "start":
        study.copy_before(phase, target)
    else:
        copy_stopped(study, place, target)
    # the settled packing stays in the folder of the filling
    owner = study.run("filling") if name == "packing.restart" else phase.run
    damage(target / owner / name, random.Random(f"inputs {SEED} {name}"))
    said = call(phase.words, target, target.with_suffix(".log"), 60.0)
    assert_no_engine(target, 1.0)
    assert_bounded(target)
    script = r"in\.liggghts|input script"
    named = script if name == "in.liggghts" else re.escape(name)
    assert refused(said, named), f"a complete run: {said.tail}"


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
_ANALYSES = ("tables", "chains", "loading", "quantities", "figures")
_READERS: dict[str, tuple[str, ...]] = {
    "state.json": ("run",),
    "case.json": ("run", *_ANALYSES, "report"),
    "columns.json": ("run", "tables"),
    "run.json": ("run", *_ANALYSES, "report"),
    "tables/workpiece_force.parquet": ("quantities", "figures", "report"),
    "tables/workpiece_contacts.parquet": ("chains", "loading", "quantities", "figures"),
    "tables/particles.parquet": ("chains", "figures"),
    "tables/contacts.parquet": ("chains", "quantities", "figures"),
    "tables/network.parquet": ("quantities", "figures", "report"),
    "tables/chains.parquet": ("quantities", "figures", "report"),
    "tables/quantities.json": ("figures", "report"),
    "tables/clusters.parquet": ("figures", "report"),
    "tables/closure.json": ("figures", "report"),
    "tables/loading.json": ("report",),
    "tables/findings.json": ("report",),
}
"""Results of the process, and who reads them, or might."""


_RAW_NAMES = {
    "drop_test": ("impacts.1.txt",),
    "filling": ("thermo.1.txt", "particles.1.bin"),
    "process": (
        *("thermo.1.txt", "workpiece_force.1.txt", "workpiece_particles.1.bin"),
        *("workpiece_contacts.1.dump", "contacts.1.dump", "particles.1.bin"),
    ),
}


def _is_damage(name: str, what: str) -> bool:
    """There may be no chains, and a print file holds no count."""
    allowed = what == "an absurd count" and name.endswith(".txt")
    return not allowed and (name, what) != ("tables/chains.parquet", "no rows")


Result = tuple[str, str, Damage, str]


def results() -> dict[str, Result]:
    """Every damage to every result, each read by one of its readers."""
    chance = random.Random(f"results {SEED}")
    made: list[tuple[str, str, str, Damage, str]] = []
    for name, readers in _READERS.items():
        kinds = _JSON if name.endswith(".json") else _PARQUET
        made += [("process", name, *item, chance.choice(readers)) for item in kinds.items()]
    for place, names in _RAW_NAMES.items():
        made += [(place, name, *item, "tables") for name in names for item in _RAW.items()]
    few = ("cut", "empty", "random bytes", "100,000 brackets", "a list")
    others = [(place, name) for place in ("drop_test", "filling") for name in _OF_RUN]
    for place, name in [*others, ("filling", "tables/packing.json")]:
        reader = {"state.json": "run", "tables/packing.json": "render"}.get(name, "tables")
        made += [(place, name, what, _JSON[what], reader) for what in few]
    return {
        f"{place} {name}: {what}, then {reader}": (place, name, damage, reader)
        for place, name, what, damage, reader in made
        if _is_damage(name, what)
    }


_RESULTS = results()


@pytest.mark.attack(sample=2)
@pytest.mark.parametrize(("place", "name", "damage", "reader"), _RESULTS.values(), ids=_RESULTS)
def test_a_damaged_result_is_refused_or_harmless(
    place: str, name: str, damage: Damage, reader: str, study: Undisturbed, tmp_path: Path
) -> None:
    project = study.copy(tmp_path / "project")
    run = study.run(place)
    damage(project / run / name, random.Random(f"results {SEED} {name}"))
    said = _call_reader(study, reader, place, project)
    kill(engines(project))
    assert_bounded(project)
    named = re.escape(Path(name).name).replace(r"\.1\.", r"\.(1|\{part\})\.")
    if refused(said, named):
        return
    if reader == "run":
        assert_same_tables(study, study.phase(place), project)
    else:
        there = study.root / run
        names = {str(file.relative_to(there)) for file in there.rglob("*")} - {name}
        problems = differences(project / run, there, names)
        assert not problems, f"accepted: {problems}"


def _call_reader(study: Undisturbed, reader: str, place: str, project: Path) -> Said:
    run = study.run(place)
    if reader == "run":
        return call(study.phase(place).words, project, project.with_suffix(".log"), 60.0)
    if reader == "render":
        packing = f"{run}/tables/packing.json"
        process = Path(study.run("process")).name
        words = ["step", "render", STUDY, "process", process, "--packing", packing]
        return main_of("dragdeck", words, project)
    if reader == "report":
        out = ["--out", f"results/{STUDY}/report"]
        return main_of("dragchain", ["report", *out, run], project)
    return main_of("dragchain", [reader, run], project)
