"""Memory and processor time of the analysis on a run and on one several times as long.

The drag of a real run is repeated with its steps going on, best a whole number of
revolutions, so that the workpiece goes on where it was. Every command goes through the short
run and through the long one, each in a process of its own. Memory is the most that this
process held; processor time is that of all its threads.

    python benchmarks/memory.py RUN_DIR [--times 4] [--commands tables chains ...]

``RUN_DIR`` is a complete process run with its raw outputs; the table of its bed is looked
for beside it. Nothing is written there.
"""

import argparse
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from machine import machine
from reading import PACKAGES, peak_bytes

ROOT = Path(__file__).resolve().parent.parent
MORE_BYTES = 500e6
"""The process time is given for which a command needs this much more."""

Frame = tuple[int, bytes]


# --- a longer run -------------------------------------------------------------------------


@dataclass(frozen=True)
class Drag:
    """The steps that are repeated: those after `start` up to `end`."""

    start: int
    end: int
    timestep_s: float
    times: int

    @property
    def steps(self) -> int:
        """Number of steps."""
        return self.end - self.start

    @property
    def seconds(self) -> float:
        """Process time of one repetition."""
        return self.steps * self.timestep_s


def lengthen(run: Path, target: Path, drag: Drag) -> None:
    """Copy a run with its drag repeated."""
    target.mkdir(parents=True)
    for name in ("workpiece.stl", "run.json", "outcome.json", "state.json"):
        if (run / name).is_file():
            shutil.copyfile(run / name, target / name)
    case = json.loads((run / "case.json").read_text())
    outputs = json.loads((run / "columns.json").read_text())
    last = drag.end + (drag.times - 1) * drag.steps
    case["phases"][-1]["end_step"] = last
    for output in outputs["outputs"].values():
        output["last_step"] = last
        file = output["pattern"].replace("{part}", "1")
        write = lengthen_prints if output["kind"] == "print" else lengthen_frames
        with (run / file).open("rb") as source, (target / file).open("wb") as out:
            write(source, out, drag)
    (target / "case.json").write_text(json.dumps(case, indent=1))
    (target / "columns.json").write_text(json.dumps(outputs, indent=1))


def lengthen_prints(source: BinaryIO, out: BinaryIO, drag: Drag) -> None:
    """Repeat the rows of a ``fix print`` whose steps are in the drag."""
    out.write(source.readline())
    dragged = []
    for line in source:
        first, _, rest = line.split(b" ", 2)
        if int(first) <= drag.start:
            out.write(line)
        else:
            dragged.append((int(first), rest))
    for turn in range(drag.times):
        for step, rest in dragged:
            later = step + turn * drag.steps
            out.write(b"%d %.15g " % (later, later * drag.timestep_s) + rest)


def lengthen_frames(source: BinaryIO, out: BinaryIO, drag: Drag) -> None:
    """Repeat the frames of a dump whose steps are in the drag."""
    text = source.read(5) == b"ITEM:"
    for turn in range(drag.times):
        source.seek(0)
        for step, rest in text_frames(source) if text else binary_frames(source):
            if turn == 0 or step > drag.start:
                later = step + turn * drag.steps
                first = b"ITEM: TIMESTEP\n%d\n" % later if text else struct.pack("<q", later)
                out.write(first + rest)


def text_frames(source: BinaryIO) -> Iterator[Frame]:
    """Steps of a text dump, and what follows each."""
    while source.readline():
        step = int(source.readline())
        lines = list(islice(source, 7))
        yield step, b"".join([*lines, *islice(source, int(lines[1]))])


def binary_frames(source: BinaryIO) -> Iterator[Frame]:
    """Steps of a binary dump, and what follows each."""
    while first := source.read(8):
        parts = [source.read(92)]
        for _ in range(struct.unpack_from("<i", parts[0], 88)[0]):
            parts.append(source.read(4))
            parts.append(source.read(8 * struct.unpack("<i", parts[-1])[0]))
        yield struct.unpack("<q", first)[0], b"".join(parts)


# --- the commands -------------------------------------------------------------------------


def copy_upstream(run: Path, folder: Path) -> None:
    """Put the fill and the drop test that belong to a run beside the made runs, with figures."""
    upstream = json.loads((run / "case.json").read_text())["upstream"]
    for scene, name in upstream.items():
        source, copy = (root / scene / name for root in (run.resolve().parent.parent, folder))
        if not copy.is_dir():
            shutil.copytree(source, copy)
            for command in ("tables", "figures"):
                words = [sys.executable, __file__, "--measure", command, str(copy)]
                subprocess.run(words, check=True, stdout=subprocess.DEVNULL)


def packing_table(run: Path) -> Path:
    """The table of the bed from which a run started."""
    name = json.loads((run / "case.json").read_text())["upstream"]["filling"]
    return run.parent.parent / "filling" / str(name) / "tables" / "packing.json"


def other_filling(run: Path) -> Path:
    """A run of the same frames that says it had another bed, which `validate` needs."""
    other = run.with_name(run.name + "-other")
    if not other.is_dir():
        shutil.copytree(run, other, copy_function=os.link)
        measures = json.loads((run / "measures.json").read_text())
        measures["inputs"]["seed"] += 1
        (other / "measures.json").unlink()
        (other / "measures.json").write_text(json.dumps(measures))
    return other


Arguments = Callable[[Path, Path], list[Path | str]]

COMMANDS: dict[str, Arguments] = {
    "tables": lambda run, _: ["tables", run],
    "chains": lambda run, _: ["chains", run],
    "measure": lambda run, bed: ["step", "measure", run, "--packing", bed],
    "loading": lambda run, _: ["loading", run],
    "figures": lambda run, _: ["figures", run],
    "report": lambda run, _: ["report", "--out", run / "report", run],
    "validate": lambda run, _: [
        *("validate", "--command", "benchmark"),
        *("--out", run / "validation", run, other_filling(run)),
    ],
}
"""Commands in the order in which each finds what it needs, and their arguments."""


def measure(arguments: list[str]) -> dict[str, float]:
    """Run one command; this happens in a process of its own."""
    package = "evidence.__main__" if arguments[0] == "validate" else "dragchain.cli"
    main = import_module(package).main
    wall, processor = time.perf_counter(), time.process_time()
    if main(arguments):
        sys.exit(1)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    return {"wall_s": wall, "processor_s": processor, "peak_bytes": peak_bytes()}


def run_command(command: str, run: Path, bed: Path) -> dict[str, float]:
    """Measure one command on one run."""
    words = [sys.executable, __file__, "--measure", *COMMANDS[command](run, bed)]
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{command} failed on {run}:\n{done.stderr}")
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    print(command, run.name, found, flush=True)
    return found


def kept(command: str, run: Path, bed: Path) -> dict[str, float]:
    """Measure one command on one run, or say what was measured in this folder before."""
    file = run.parent / f"{run.name}-{command}.json"
    if not file.is_file():
        file.write_text(json.dumps(run_command(command, run, bed)))
    found: dict[str, float] = json.loads(file.read_text())
    return found


def table(found: dict[str, list[dict[str, float]]], drag: Drag) -> str:
    """What was measured, as a Markdown table."""
    lines = [
        f"| command | peak MB, {drag.seconds:.1f} s | peak MB, {drag.times * drag.seconds:.1f} s"
        " | kB per second | seconds in 500 MB more | CPU time (s) | CPU time, long run (s) |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    more_s = (drag.times - 1) * drag.seconds
    for command, (short, long) in found.items():
        slope = (long["peak_bytes"] - short["peak_bytes"]) / more_s
        longest = f"{MORE_BYTES / slope:,.0f}" if slope > 0.0 else "any"
        lines.append(
            f"| {command} | {short['peak_bytes'] / 1e6:.0f} | {long['peak_bytes'] / 1e6:.0f} |"
            f" {slope / 1e3:,.0f} | {longest} | {short['processor_s']:.1f} |"
            f" {long['processor_s']:.1f} |"
        )
    return "\n".join(lines)


def rates(run: Path, drag: Drag) -> str:
    """How often the run wrote what is read."""
    outputs = json.loads((run / "columns.json").read_text())["outputs"]
    names = {
        "workpiece_force": "force on the workpiece",
        "workpiece_contacts": "its contacts",
        "contacts": "network",
    }
    return ", ".join(
        f"{what} {1.0 / (outputs[name]['period_steps'] * drag.timestep_s):.0f} Hz"
        for name, what in names.items()
    )


def main() -> None:
    """Measure, print, and write the page."""
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(sys.argv[2:])))
        return
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="a complete process run")
    parser.add_argument("--times", type=int, default=4, help="length of the long run")
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    parser.add_argument("--folder", type=Path, help="where runs and measurements are made and kept")
    options = parser.parse_args()
    case = json.loads((options.run / "case.json").read_text())
    phase = case["phases"][-1]
    drag = Drag(phase["start_step"], phase["end_step"], case["timestep_s"], options.times)
    with tempfile.TemporaryDirectory() as name:
        folder = options.folder or Path(name)
        runs = {times: folder / "runs" / f"{times}-times" for times in (1, options.times)}
        if "report" in options.commands:
            copy_upstream(options.run, folder)
        for times, run in runs.items():
            if not run.is_dir():
                lengthen(options.run, run, Drag(drag.start, drag.end, drag.timestep_s, times))
        bed = packing_table(options.run)
        found = {}
        for command in options.commands:
            found[command] = [kept(command, run, bed) for run in runs.values()]
    head = f"{machine(*PACKAGES)}. {case['media']['count']} particles; {rates(options.run, drag)}."
    output = f"{head}\n\n{table(found, drag)}"
    print(output)


if __name__ == "__main__":
    main()
