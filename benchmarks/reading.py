"""Rates of reading dumps side by side: ours, OVITO's and pandas'.

Real frames are repeated to files of 500 MB at least; every reader goes through each file
once a round, the readers taking turns, each in a process of its own. A rate is the
file's size over the time from opening it until every column of every frame has been an
array. What one reader must learn from the file first, such as OVITO where its frames are,
counts; starting Python, importing and compiling do not, the first file being a short one.

    python benchmarks/reading.py [--run RUN_DIR] [--rounds 3] [--megabytes 500]

Without ``--run`` the frames are made: as many particles and contacts as a small bowl has.
"""

import argparse
import io
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from statistics import median

from machine import machine

PACKAGES = ("numpy", "numba", "pyarrow", "pandas", "ovito")
ROOT = Path(__file__).resolve().parent.parent
CONTACTS = [f"c_particle_contacts[{i}]" for i in (1, 2, 4, 5, 6, 7)]
PARTICLES = (
    *("particle_id", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s"),
    *("wx_rad_s", "wy_rad_s", "wz_rad_s", "radius_m"),
    *(f"{wall}_force_{axis}_n" for wall in ("floor", "side") for axis in "xyz"),
)
BOX = (-0.05, 0.05, -0.05, 0.05, 0.0, 0.32)
Rows = int


# --- the readers: each goes through a file and counts its rows ----------------------------


def ours_to_frames(file: Path) -> Rows:
    """Every frame as arrays."""
    from dragchain.dumps.any_dump import read_dump

    columns = PARTICLES if file.suffix == ".bin" else None
    return sum(frame.rows for frame in read_dump(file, columns))


def ours_to_parquet(file: Path) -> Rows:
    """Every frame into a Parquet table."""
    import pyarrow.parquet as pq

    from dragchain.tables.convert import dump_to_parquet

    table = file.with_suffix(".parquet")
    dump_to_parquet(file, table, PARTICLES if file.suffix == ".bin" else None)
    rows = pq.ParquetFile(table).metadata.num_rows
    table.unlink()
    return int(rows)


def pandas_by_frame(file: Path) -> Rows:
    """``read_csv`` on the rows of each text frame; of a binary one a DataFrame of its rows."""
    return sum(_pandas_binary(file) if file.suffix == ".bin" else _pandas_text(file))


def _pandas_text(file: Path) -> Iterator[Rows]:
    import pandas as pd

    with file.open("rb") as stream:
        while head := list(islice(stream, 9)):
            rows = int(head[3])
            names = head[8].decode().split()[2:]
            body = io.BytesIO(b"".join(islice(stream, rows)))
            frame = pd.read_csv(body, sep=" ", header=None, names=names, usecols=range(len(names)))
            yield len(frame)


def _pandas_binary(file: Path) -> Iterator[Rows]:
    import numpy as np
    import pandas as pd

    head = np.dtype([("step", "<i8"), ("rows", "<i8"), ("rest", "V84")])
    with file.open("rb") as stream:
        while data := stream.read(100):
            rows, ranks = (
                int(np.frombuffer(data, head)["rows"][0]),
                int.from_bytes(data[96:], "little"),
            )
            parts = [
                np.fromfile(stream, "<f8", int.from_bytes(stream.read(4), "little"))
                for _ in range(ranks)
            ]
            frame = pd.DataFrame(np.concatenate(parts).reshape(rows, -1), columns=PARTICLES)
            yield len(frame.copy())


def ovito_by_frame(file: Path) -> Rows:
    """Every frame of OVITO's file source, its properties as arrays."""
    from ovito.io import import_file

    if file.suffix == ".bin":
        names = ["Particle Identifier", *(f"Position.{axis}" for axis in "XYZ"), *PARTICLES[4:]]
    else:
        names = ["Particle Identifiers.1", "Particle Identifiers.2"]
        names += ["Force.1", "Force.2", "Force.3", "Overlap"]
    source = import_file(str(file), columns=names).source
    rows = 0
    for number in range(source.num_frames):
        particles = source.compute(number).particles
        owner = particles if file.suffix == ".bin" else particles.bonds
        rows += owner.count
        for values in owner.values():
            values[...]
    return rows


READERS: dict[str, Callable[[Path], Rows]] = {
    "ours": ours_to_frames,
    "ours, to Parquet": ours_to_parquet,
    "OVITO": ovito_by_frame,
    "pandas, frame by frame": pandas_by_frame,
}


def measure(reader: str, short: Path, file: Path) -> dict[str, float]:
    """Time one reader on one file; runs in a process of its own."""
    READERS[reader](short)
    wall, processor = time.perf_counter(), time.process_time()
    rows = READERS[reader](file)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    return {"rows": rows, "wall_s": wall, "processor_s": processor, "peak_bytes": peak_bytes()}


def peak_bytes() -> int:
    """Most memory that this process has held (not, as getrusage, the one that started it)."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return 1024 * int(line.split()[1])
    raise RuntimeError("the kernel does not tell how much memory a process has held")


# --- the files ----------------------------------------------------------------------------


def made_frames(folder: Path) -> tuple[Path, Path]:
    """A text and a binary dump of frames of random particles and contacts."""
    import struct

    import numpy as np

    rng = np.random.default_rng(1)
    text, binary = folder / "made.dump", folder / "made.bin"
    with text.open("w") as lines, binary.open("wb") as data:
        for step in range(0, 1000, 10):
            count = 2900 + int(rng.integers(60))
            ids, force = rng.integers(1, 1423, (count, 2)), rng.normal(0, 0.1, (count, 3))
            overlap = rng.gamma(2, 4e-6, count)
            lines.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ENTRIES\n{count}\n")
            lines.write("ITEM: BOX BOUNDS ff ff ff\n-0.05 0.05\n-0.05 0.05\n0 0.32\n")
            lines.write(f"ITEM: ENTRIES {' '.join(CONTACTS)} \n")
            rows = zip(*ids.T.tolist(), *force.T.tolist(), overlap.tolist(), strict=True)
            lines.writelines(
                f"{a} {b} {x:.9g} {y:.9g} {z:.9g} {depth:.9g} \n" for a, b, x, y, z, depth in rows
            )
            particles = rng.normal(size=(1422, len(PARTICLES)))
            particles[:, 0] = np.arange(1, 1423)
            head = (step, 1422, 0, *[1] * 6, *BOX, len(PARTICLES), 1, particles.size)
            data.write(struct.pack("<qqi6i6diii", *head) + particles.tobytes())
    return text, binary


def repeated(source: Path, target: Path, size: int) -> None:
    """Write a file over and over until `size` bytes are reached."""
    with target.open("wb") as out:
        while out.tell() < size:
            with source.open("rb") as stream:
                while data := stream.read(1 << 22):
                    out.write(data)


def short_text(source: Path, target: Path) -> None:
    """Keep the first frames of a text dump."""
    with source.open("rb") as stream:
        data = stream.read(4 << 20)
    target.write_bytes(data[: data.rfind(b"ITEM: TIMESTEP")])


def short_binary(source: Path, target: Path) -> None:
    """Keep the first frames of a binary dump."""
    from dragchain.dumps.careful_reader import read_carefully
    from dragchain.run.case import Output

    output = Output("particles", "custom", True, "", PARTICLES, None, 1, 0, None)
    sizes = [
        104 + 8 * len(PARTICLES) * frame.rows
        for frame in islice(read_carefully(source, output), 20)
    ]
    with source.open("rb") as stream:
        target.write_bytes(stream.read(sum(sizes)))


# --- the run ------------------------------------------------------------------------------


def run(kind: str, short: Path, file: Path, rounds: int) -> dict[str, list[dict[str, float]]]:
    """Measure all readers in turn; they must agree on the number of rows."""
    found: dict[str, list[dict[str, float]]] = {reader: [] for reader in READERS}
    for _ in range(rounds):
        for reader in READERS:
            command = [sys.executable, __file__, "--measure", reader, str(short), str(file)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                sys.exit(f"{reader} failed on {kind}:\n{done.stderr}")
            found[reader].append(json.loads(done.stdout.splitlines()[-1]))
            print(kind, reader, found[reader][-1], flush=True)
    rows = {int(one["rows"]) for ones in found.values() for one in ones}
    if len(rows) != 1:
        sys.exit(f"the readers do not agree on the rows of {file.name}: {sorted(rows)}")
    return found


def table(kind: str, file: Path, found: dict[str, list[dict[str, float]]]) -> str:
    """Rates as a Markdown table; ratios are medians over the rounds, each within its round."""
    size = file.stat().st_size
    lines = [
        f"### {kind}: {size / 1e6:.0f} MB, {found['ours'][0]['rows']:,.0f} rows",
        "",
        "| reader | MB/s | MB/s per core | speed-up of ours | by CPU time | peak MB |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for reader, ones in found.items():
        wall = median(size / 1e6 / one["wall_s"] for one in ones)
        processor = median(size / 1e6 / one["processor_s"] for one in ones)
        pairs = list(zip(ones, found["ours"], strict=True))
        ratios = sorted(one["wall_s"] / own["wall_s"] for one, own in pairs)
        work = median(one["processor_s"] / own["processor_s"] for one, own in pairs)
        spread = f"{median(ratios):.1f} ({ratios[0]:.1f} to {ratios[-1]:.1f})"
        peak = max(one["peak_bytes"] for one in ones) / 1e6
        lines.append(
            f"| {reader} | {wall:.0f} | {processor:.0f} | {spread} | {work:.1f} | {peak:.0f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure, print, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--run", type=Path, help="folder of a process run, for its real frames")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--megabytes", type=int, default=500)
    parser.add_argument("--measure", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        reader, short, file = options.measure
        print(json.dumps(measure(reader, Path(short), Path(file))))
        return
    tables = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.run is None:
            text, binary = made_frames(folder)
        else:
            text, binary = options.run / "contacts.1.dump", options.run / "particles.1.bin"
        short_text(text, folder / "short.dump")
        short_binary(binary, folder / "short.bin")
        for kind, source in (("Text", text), ("Binary", binary)):
            file = folder / f"long{source.suffix}"
            repeated(source, file, options.megabytes * 10**6)
            found = run(kind, folder / f"short{source.suffix}", file, options.rounds)
            tables.append(table(kind, file, found))
            file.unlink()
    frames = "made frames" if options.run is None else "real frames, repeated"
    output = "\n\n".join([f"{machine(*PACKAGES)}. {options.rounds} rounds, {frames}.", *tables])
    print(output)


if __name__ == "__main__":
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    main()
