"""What a particle costs in small and big bowls: engine and analysis, one rank and two.

The scene of ``studies/pilot`` with 1,422, 10,000 and 100,000 particles, about equally deep:
the bed is filled, the workpiece dragged along the same arc, and every step of the analysis run
in a process of its own. Runs that are complete are not run again, nor commands and rounds
that were measured: they are kept in ``benchmarks/results/pilot``. The drag's deck with its
workpiece left above the bed is timed on one rank and on two, in turns, less the same deck without
a step: what is left is the steps alone. All cost is processor time, of all ranks together.

    python benchmarks/pilot.py [--particles 1422 10000 100000] [--rounds 3] [--particle-steps 2e7]
"""

import argparse
import contextlib
import json
import os
import re
import statistics
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
from machine import machine

from dragdeck.cases.case import Case
from dragdeck.decks.render import write_run
from dragdeck.decks.templates import environment
from dragdeck.documents import Part
from dragdeck.engine.log import decomposition
from dragdeck.engine.process import Ending, command, execute, find_engine
from dragdeck.engine.record import ParticlesPerRank, RunRecord
from dragdeck.engine.run_folder import run
from dragdeck.files import write_text
from dragdeck.physics.packing import Bed
from dragdeck.project import Project, find_project, study_templates
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.scene import SceneType, read_bed
from dragdeck.study.paths.circle import CirclePath
from dragdeck.study.yaml import read_study
from dragdeck.sweep.cases import settle_case

ROOT = Path(__file__).resolve().parent.parent
TIMED = ROOT / "benchmarks" / "results" / "pilot"
STUDY = "pilot"
SMALL_BOWL_M = 0.040
LEAST_STEPS = 50
ANALYSIS = ("tables", "chains", "loading", "figures")


@dataclass(frozen=True)
class Command:
    """What one command took: CPU time (s) and the most memory in MB."""

    cpu_time_s: float
    peak_mb: float


@dataclass(frozen=True)
class Size:
    """All that was measured with one number of particles."""

    particles: int
    filling: RunRecord
    drag: RunRecord
    frames: int
    contacts: int
    bytes_: int
    commands: Mapping[str, Command]


# --- the runs -----------------------------------------------------------------------------


def case_of(project: Project, particles: int) -> Case:
    """The pilot's scene with another number of particles at the same depth, on the same arc."""
    (pilot,) = project.cases(STUDY)
    study = pilot.study
    path = study.motion.path
    assert isinstance(path, CirclePath)
    bowl = max(SMALL_BOWL_M, study.bowl.radius_m * (particles / study.media.count) ** 0.5)
    ratio = bowl / study.bowl.radius_m
    values = {
        "media.count": particles,
        "bowl.radius_m": round(bowl, 4),
        "motion.path.radius_m": round(ratio * path.radius_m, 4),
        "motion.path.revolutions": round(path.revolutions / ratio, 4),
        "motion.plunge_at_m": [round(ratio * path.radius_m, 4), 0.0],
    }
    return settle_case(pilot.file, read_study(pilot.file), values, shown={})


def made(project: Project, case: Case, kind: SceneType, bed: Bed | None) -> Path:
    """The folder of a complete run."""
    folder = project.run_folder(case, kind)
    if not (folder / "run.json").is_file():
        write_run(
            kind.build(case, bed), folder, environment(project.templates, study_templates(case))
        )
        run(folder, say)
    return folder


def dragchain(*words: object) -> Command:
    """Run the analysis in a process of its own."""
    begun = time.monotonic()
    line = [sys.executable, "-m", "dragchain.cli", *map(str, words)]
    pid = os.posix_spawn(sys.executable, line, os.environ)
    _, status, usage = os.wait4(pid, 0)
    if os.waitstatus_to_exitcode(status):
        raise SystemExit(f"failed: {' '.join(line)}")
    found = Command(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3)
    say(f"{words[0]}: {found.cpu_time_s:.1f} s, {found.peak_mb:.0f} MB, "
        f"{time.monotonic() - begun:.0f} s by the clock")  # fmt: skip
    return found


def kept(name: str, folder: Path) -> Command:
    """What a command took on a run, measured now if it was not before."""
    file = TIMED / "commands.json"
    known = json.loads(file.read_text()) if file.is_file() else {}
    key = f"{name} {folder.name}"
    if key not in known:
        known[key] = vars(dragchain(name, folder))
        write(file, known)
    return Command(**known[key])


def write(file: Path, content: object) -> None:
    """Write a JSON file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    write_text(file, json.dumps(content, indent=1) + "\n")


def bed_of(filling: Path) -> Bed:
    """The settled bed of a fill whose tables are made."""
    return read_bed(filling / "tables" / "packing.json")


def measure(project: Project, particles: int) -> tuple[Size, Case, Path]:
    """Fill, drag, analyse."""
    case = case_of(project, particles)
    filling = made(project, case, FILLING, None)
    commands = {"tables of the filling": kept("tables", filling)}
    drag = made(project, case, PROCESS, bed_of(filling))
    commands |= {name: kept(name, drag) for name in ANALYSIS}
    return size_of(particles, filling, drag, commands), case, filling


def size_of(particles: int, filling: Path, drag: Path, commands: Mapping[str, Command]) -> Size:
    """Gather what the run folders say."""
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    steps = pq.read_table(drag / "tables" / "contacts.parquet", columns=["step"])["step"]
    raw = [file for file in drag.iterdir() if re.search(r"\.\d+\.(dump|bin|txt)$", file.name)]
    records = [RunRecord.read(folder / "run.json") for folder in (filling, drag)]
    return Size(
        particles=particles,
        filling=records[0],
        drag=records[1],
        frames=len(pc.unique(steps)),
        contacts=len(steps),
        bytes_=sum(file.stat().st_size for file in raw),
        commands=commands,
    )


# --- one rank and two ---------------------------------------------------------------------


class Timing(Part):
    """A timed deck: time of the steps alone, s; memory of a rank, MB; the ranks' particles."""

    cpu_time_s: float
    wall_time_s: float
    peak_mb: float
    split: ParticlesPerRank


def at_rest(deck: str, steps: int) -> str:
    """The deck up to its first leg: steps of the settled bed with the workpiece above it."""
    head, found, _ = deck.partition("\nfix move_plunge ")
    if not found:
        raise SystemExit("the deck has no plunge")
    return f'{head}\nrun {steps}\nprint "DRAGDECK END"\n'


def timed_folder(case: Case, filling: Path, project: Project) -> Path:
    """A folder with the drag's deck and the bed that it starts from."""
    folder = TIMED / str(case.study.media.count) / "process" / "deck"
    write_run(process_scene(case, bed_of(filling)), folder, environment(project.templates))
    bed = folder.parent.parent / "filling" / filling.name
    bed.mkdir(parents=True, exist_ok=True)
    (bed / "packing.restart").unlink(missing_ok=True)
    os.link(filling / "packing.restart", bed / "packing.restart")
    return folder


def time_once(folder: Path, steps: int, ranks: int) -> tuple[Ending, str, float]:
    """Run the cut deck; what the engine printed, and the most memory of a rank in MB."""
    seen = [0.0]

    def watch(_: float) -> None:
        for process in psutil.Process().children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                seen.append(process.memory_info().rss / 1e6)

    deck = at_rest((folder / "in.liggghts").read_text(), steps)
    (folder / "in.timed").write_text(deck)
    screen = folder / "screen.txt"
    ending = execute(command(find_engine(), "in.timed", ranks, 1, None), folder, screen, watch)
    text = screen.read_text(errors="replace")
    if ending.exit_status != 0 or "DRAGDECK END" not in text:
        raise SystemExit(f"the timed deck failed: {screen}")
    return ending, text, max(seen)


def time_steps(folder: Path, steps: int, ranks: int) -> Timing:
    """Time the steps of the deck at rest, less what it takes to start."""
    start, _, _ = time_once(folder, 0, ranks)
    whole, text, peak_mb = time_once(folder, steps, ranks)
    split = decomposition(text)
    if split is None or split.particles is None:
        raise SystemExit("LIGGGHTS does not say how it split the box")
    return Timing(
        cpu_time_s=whole.cpu_time_s - start.cpu_time_s,
        wall_time_s=whole.wall_time_s - start.wall_time_s,
        peak_mb=peak_mb,
        split=split.particles,
    )


def rounds(folder: Path, steps: int, count: int) -> list[dict[int, Timing]]:
    """Time one rank and two in turns, each first every other round; known rounds count."""
    file = folder.parent / f"rounds-{steps}.json"
    known = json.loads(file.read_text()) if file.is_file() else []
    for number in range(len(known), count):
        order = (1, 2) if number % 2 == 0 else (2, 1)
        found = {ranks: time_steps(folder, steps, ranks) for ranks in order}
        say(f"{steps} steps, " + ", ".join(
            f"{ranks} rank(s): {t.cpu_time_s:.2f} s, {t.wall_time_s:.2f} s by the clock"
            for ranks, t in sorted(found.items())))  # fmt: skip
        known.append({ranks: timing.model_dump() for ranks, timing in found.items()})
        write(file, known)
    known = json.loads(file.read_text())
    return [{int(ranks): Timing(**timing) for ranks, timing in one.items()} for one in known]


# --- the page -----------------------------------------------------------------------------


def engine_table(sizes: Sequence[Size]) -> str:
    """Cost of a particle and step, and bytes."""
    lines = [
        "| particles | steps of the filling | ranks | ns per particle and step | steps of the "
        "drag | ranks "
        "| ns per particle and step | contacts per particle | raw bytes per particle and frame |",
        "| ---: " * 9 + "|",
    ]
    for size in sizes:
        cost = [1e9 * r.cpu_time_s / r.steps / size.particles for r in (size.filling, size.drag)]
        lines.append(
            f"| {size.particles:,} | {size.filling.steps:,} | {size.filling.ranks} | "
            f"{cost[0]:.0f} "
            f"| {size.drag.steps:,} | {size.drag.ranks} | {cost[1]:.0f} "
            f"| {size.contacts / size.frames / size.particles:.2f} "
            f"| {size.bytes_ / size.frames / size.particles:.0f} |"
        )
    return "\n".join(lines)


def analysis_table(sizes: Sequence[Size]) -> str:
    """Cost of each command, of a particle and frame, and memory."""
    lines = [
        "| command | particles | frames | CPU time (s) | µs per particle and frame | peak MB |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for name in sizes[0].commands:
        for size in sizes:
            found, frames = size.commands[name], 1 if "filling" in name else size.frames
            each = 1e6 * found.cpu_time_s / frames / size.particles
            lines.append(
                f"| {name} | {size.particles:,} | {frames} | {found.cpu_time_s:.1f} | {each:.1f} "
                f"| {found.peak_mb:.0f} |"
            )
    return "\n".join(lines)


def ranks_table(timed: Mapping[int, tuple[int, list[dict[int, Timing]]]]) -> str:
    """Two ranks against one."""
    lines = [
        "| particles | steps | ns per particle and step, one rank | two ranks | CPU time, "
        "2 ranks / 1 rank "
        "| wall-clock time, 2 ranks / 1 rank | particles of the two ranks | MB of one rank, of "
        "each of two |",
        "| ---: | ---: | ---: | ---: | ---: | ---: | --- | --- |",
    ]
    for particles, (steps, found) in timed.items():
        each = [
            spread([1e9 * one[ranks].cpu_time_s / steps / particles for one in found], ".0f")
            for ranks in (1, 2)
        ]
        cpu = spread([one[2].cpu_time_s / one[1].cpu_time_s for one in found])
        wall = spread([one[2].wall_time_s / one[1].wall_time_s for one in found])
        split = found[-1][2].split
        lines.append(
            f"| {particles:,} | {steps:,} | {each[0]} | {each[1]} | {cpu} | {wall} "
            f"| {split.least:,} and {split.most:,} "
            f"| {found[-1][1].peak_mb:.0f}, {found[-1][2].peak_mb:.0f} |"
        )
    return "\n".join(lines)


def spread(values: Sequence[float], form: str = ".2f") -> str:
    """Median with the least and the largest."""
    middle, low, high = statistics.median(values), min(values), max(values)
    return f"{middle:{form}} ({low:{form}} to {high:{form}})"


def say(line: str) -> None:
    """Report progress."""
    print(line, file=sys.stderr, flush=True)


def main() -> None:
    """Measure, print, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--particles", type=int, nargs="+", default=[1422, 10_000, 100_000])
    parser.add_argument("--rounds", type=int, default=3, help="of one rank against two; 0: none")
    parser.add_argument("--particle-steps", type=float, default=2e7, help="timed in each, or more")
    options = parser.parse_args()
    project = find_project(ROOT)
    sizes, timed = [], {}
    for particles in options.particles:
        say(f"{particles:,} particles")
        size, case, filling = measure(project, particles)
        sizes.append(size)
        if options.rounds:
            steps = max(LEAST_STEPS, round(options.particle_steps / particles))
            folder = timed_folder(case, filling, project)
            timed[particles] = steps, rounds(folder, steps, options.rounds)
    parts = [
        f"{machine()}, LIGGGHTS {find_engine().version}."
        f" {options.rounds} rounds of one rank against two.",
        "### LIGGGHTS: whole runs",
        engine_table(sizes),
        "### Analysis",
        analysis_table(sizes),
    ]
    if timed:
        parts += [
            "### Two ranks and one: bed at rest, workpiece above it",
            ranks_table(timed),
        ]
    output = "\n\n".join(parts)
    print(output)


if __name__ == "__main__":
    main()
