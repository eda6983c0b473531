"""Rates of finding chains, paths and clusters in networks of 3e3 to 1e6 contacts.

Two kinds of networks: `tiled`, a real frame side by side with itself, each tile with a workpiece
of its own; `bed`, one connected lattice of particles out of place with random forces around one
workpiece. Rates are contacts over the processor time of one thread, the arrays' and compiled
loops' beside the plain oracle's of the tests, which is how it was done before; both must find the
same. Then whole runs of tiled frames are read and their chains written, each in a process of its
own, for the memory.

    python benchmarks/chains.py [--run RUN_DIR] [--rounds 3] [--plain 300000]

Without ``--run`` the real frame is the one of the tests. On networks of more contacts than
``--plain`` the oracle is left out.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import pandas as pd
from machine import machine

PACKAGES = ("numpy", "numba", "scipy", "pandas")
ROOT = Path(__file__).resolve().parent.parent
FRAME = ROOT / "tests" / "dragchain" / "data" / "real_frame"
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}

TILES = (1, 3, 10, 30, 97, 291)
EDGES = (10, 15, 22, 33, 48, 70)

LEAST_S = 0.03
"""A measurement is repeated until it took this long."""

STREAMS = ((87, 2), (87, 6), (291, 2))
"""Tiles and frames of the runs that are read and written."""


# --- networks -----------------------------------------------------------------------------


def tiled(frame: Path, tiles: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """A frame repeated on a square grid, a bowl's width and a half apart."""
    import numpy as np
    import pandas as pd

    contacts = pd.read_parquet(frame / "contacts.parquet")
    particles = pd.read_parquet(frame / "particles.parquet")
    pitch = 1.5 * float(np.ptp(particles["x_m"]))
    shift = int(particles["particle_id"].max())
    across = int(np.ceil(np.sqrt(tiles)))

    def moved(table: pd.DataFrame, names: tuple[str, str, list[str]], tile: int) -> pd.DataFrame:
        x, y, ids = names
        row, column = divmod(tile, across)
        table = table.assign(**{x: table[x] + pitch * column, y: table[y] + pitch * row})
        for name in ids:
            table[name] = table[name].where(table[name] <= 0, table[name] + shift * tile)
        return table

    particle_names = ("x_m", "y_m", ["particle_id"])
    contact_names = ("point_x_m", "point_y_m", ["a_id", "b_id"])
    return (
        pd.concat([moved(contacts, contact_names, tile) for tile in range(tiles)]),
        pd.concat([moved(particles, particle_names, tile) for tile in range(tiles)]),
    )


def bed(edge: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Particles on a jittered cubic lattice, six contacts each, around one workpiece.

    A pair of next neighbours, or next but one, touches with a chance of one third; forces are
    exponentially distributed. The 40 upper particles nearest to the axis touch the workpiece.
    """
    import numpy as np
    import pandas as pd

    random = np.random.default_rng(edge)
    radius, count = 0.003, edge**3
    place = np.stack(np.unravel_index(np.arange(count), (edge,) * 3), axis=1)
    centre = 2.0 * radius * (place - (edge - 1) / 2 + random.uniform(-0.15, 0.15, place.shape))
    ways = [way for way in np.ndindex(3, 3, 3) if 0 < sum(k != 1 for k in way) < 3]
    pairs = []
    for way in (np.array(ways) - 1)[[way > (1, 1, 1) for way in ways]]:
        beside = place + way
        there = np.flatnonzero(((beside >= 0) & (beside < edge)).all(axis=1))
        there = there[random.random(there.size) < 1.0 / 3.0]
        pairs.append(np.stack([there, there + way @ np.array([edge**2, edge, 1])]))
    a, b = np.concatenate(pairs, axis=1)
    upper = np.flatnonzero(place[:, 2] >= edge // 2)
    workpiece = upper[np.argsort(np.hypot(*centre[upper, :2].T))[:40]]
    side = np.flatnonzero(((place[:, :2] == 0) | (place[:, :2] == edge - 1)).any(axis=1))
    floor = np.flatnonzero(place[:, 2] == 0)
    particle = np.concatenate([a, workpiece, floor, side])
    bodies = [np.full(len(on), body) for body, on in ((0, workpiece), (-1, floor), (-2, side))]
    normal = random.exponential(size=len(particle))
    away = random.normal(size=(len(particle), 3))
    away[: len(a)] = centre[b] - centre[a]
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    point = centre[particle] + radius * away
    contacts = pd.DataFrame({"a_id": 1 + particle, "b_id": np.concatenate([1 + b, *bodies])})
    contacts[[f"point_{axis}_m" for axis in "xyz"]] = point
    contacts[[f"force_{axis}_n" for axis in "xyz"]] = -normal[:, None] * away
    contacts["normal_force_n"] = normal
    particles = pd.DataFrame({"particle_id": 1 + np.arange(count), "radius_m": radius})
    particles[["x_m", "y_m", "z_m"]] = centre
    return contacts, particles.assign(step=1, time_s=0.5)


# --- measurements -------------------------------------------------------------------------


def measure(kind: str, frame: Path, size: int, rounds: int, largest: int) -> dict[str, Any]:
    """Processor seconds of every job on one network, ours and the oracle's in turn.

    The oracle's are left out in a network of more than `largest` contacts.
    """
    import numpy as np

    sys.path.insert(0, str(ROOT / "tests" / "dragchain"))
    import plain_chains as plain

    from dragchain.network import chains, clusters
    from dragchain.network.chain_table import chain_table
    from dragchain.network.frame import frame_of

    contacts, particles = tiled(frame, size) if kind == "tiled" else bed(size)
    columns = [{name: table[name].to_numpy() for name in table} for table in (contacts, particles)]
    net = frame_of(*columns, 1, 0.5, 0.0)
    jobs: dict[str, tuple[Callable[[], Any], Callable[[], Any]]] = {
        "build": (
            lambda: frame_of(*columns, 1, 0.5, 0.0),
            lambda: plain.plain_frame(contacts, particles),
        ),
        "clusters": (
            lambda: clusters.frame_clusters(net),
            lambda: [
                plain.plain_clusters(net, factor * net.mean_force_n())
                for factor in clusters.FORCE_FACTORS
            ],
        ),
        "Peters chains": (lambda: chains.peters_rows(net), lambda: plain.plain_peters(net)),
        "workpiece paths": (lambda: chains.path_rows(net), lambda: plain.plain_paths(net)),
        "chain table": (lambda: chain_table(net), lambda: plain.plain_table(net)),
    }
    count = len(contacts)
    found: dict[str, Any] = {"contacts": count, "particles": len(particles)}
    found["workpieces"] = int((net.other == 0).sum())
    for name, (ours, theirs) in jobs.items():
        ours()
        found[name] = {"ours": [], "plain": []}
        for _ in range(rounds):
            found[name]["ours"].append(seconds(ours))
            if count <= largest:
                found[name]["plain"].append(seconds(theirs))
    if count <= largest:
        assert chains.peters_rows(net).particle_lists() == plain.plain_peters(net)
        assert chains.widest_paths(net) == plain.plain_paths(net)
        assert np.array_equal(chains.particle_stress(net), plain.plain_stress(net))
    print(kind, found, flush=True)
    return found


def seconds(job: Callable[[], Any]) -> float:
    """Processor time of a job, s; a short one is repeated."""
    start, times = time.process_time(), 0
    while times == 0 or time.process_time() - start < LEAST_S:
        job()
        times += 1
    return (time.process_time() - start) / times


def stream(frame: Path, tiles: int, frames: int) -> dict[str, Any]:
    """Write the chains of a run of equal frames: processor time and most memory."""
    import numpy as np
    import pandas as pd
    import pyarrow as pa
    import pyarrow.parquet as pq

    with tempfile.TemporaryDirectory() as name:
        tables = Path(name) / "tables"
        tables.mkdir()
        steps = 100 * np.arange(1, frames + 1)
        rows = {"step": steps, "direction_rad": 0.0 * steps, "in_statistics": steps > 0}
        pd.DataFrame(rows).to_parquet(tables / "workpiece_force.parquet")
        held = tiled(frame, tiles)
        contacts = len(held[0])
        for table, file in zip(held, ("contacts", "particles"), strict=True):
            schema = pa.Schema.from_pandas(table, preserve_index=False)
            with pq.ParquetWriter(tables / f"{file}.parquet", schema) as writer:
                for step in steps:
                    moment = table.assign(step=step, time_s=1e-3 * step)
                    part = pa.Table.from_pandas(moment, schema, preserve_index=False)
                    writer.write_table(part, row_group_size=131_072)
        command = [sys.executable, __file__, "--write", name]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    print(tiles, "tiles", frames, "frames", done.stdout, flush=True)
    return {"contacts": contacts, "frames": frames} | json.loads(done.stdout.splitlines()[-1])


def write(run: Path) -> dict[str, float]:
    """Write the chains of a run."""
    from dragchain.network.write import write_chains

    before = memory("VmRSS")
    start = time.process_time()
    write_chains(run)
    return {
        "processor_s": time.process_time() - start,
        "peak_bytes": memory("VmHWM"),
        "start_bytes": before,
    }


def memory(name: str) -> int:
    """What this process holds (`VmRSS`) or has held at most (`VmHWM`), bytes."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{name}:"):
            return 1024 * int(line.split()[1])
    raise RuntimeError("the kernel does not tell how much memory a process holds")


# --- the page -----------------------------------------------------------------------------

JOBS = ("build", "clusters", "Peters chains", "workpiece paths", "chain table")


def exponent(contacts: list[int], cost: list[float]) -> str:
    """Slope of log cost over log contacts with its 95 % interval (Student, all sizes alike)."""
    import numpy as np
    from scipy.stats import linregress, t

    fit = linregress(np.log(contacts), np.log(cost))
    half = float(t.ppf(0.975, len(contacts) - 2)) * fit.stderr
    return f"{fit.slope:.3f} ({fit.slope - half:.3f} to {fit.slope + half:.3f})"


def page_tables(kind: str, found: list[dict[str, Any]]) -> str:
    """Rates by size, ratios to the oracle, and exponents."""
    contacts = [one["contacts"] for one in found]
    lines = [
        f"### {kind}: million contacts per second of CPU time",
        "",
        f"| contacts | particles | on workpieces | {' | '.join(JOBS)} |",
        f"| ---: | ---: | ---: |{' ---: |' * len(JOBS)}",
    ]
    cost = {job: [median(one[job]["ours"]) for one in found] for job in JOBS}
    for at, one in enumerate(found):
        rates = [f"{contacts[at] / cost[job][at] / 1e6:.2f}" for job in JOBS]
        counts = f"{contacts[at]:,} | {one['particles']:,} | {one['workpieces']:,}"
        lines.append(f"| {counts} | {' | '.join(rates)} |")
    lines += [
        "",
        "Speed-up relative to the oracle (median of rounds, smallest to largest):",
        "",
        f"| contacts | {' | '.join(JOBS)} |",
        f"| ---: |{' ---: |' * len(JOBS)}",
    ]
    for one in [one for one in found if one[JOBS[0]]["plain"]]:
        cells = []
        for job in JOBS:
            pairs = zip(one[job]["plain"], one[job]["ours"], strict=True)
            ratios = sorted(theirs / ours for theirs, ours in pairs)
            cells.append(f"{median(ratios):.1f} ({ratios[0]:.1f} to {ratios[-1]:.1f})")
        lines.append(f"| {one['contacts']:,} | {' | '.join(cells)} |")
    lines += [
        "",
        "Exponent of CPU time against contacts, with 95 % CI:",
        "",
        "| sizes | " + " | ".join(JOBS) + " |",
        f"| --- |{' ---: |' * len(JOBS)}",
    ]
    for name, first in (("all", 0), (f"from {contacts[3]:,} on", 3)):
        cells = [exponent(contacts[first:], cost[job][first:]) for job in JOBS]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def stream_table(found: list[dict[str, Any]]) -> str:
    """Time and memory of whole runs."""
    lines = [
        "### Runs: tables read, chains, clusters and statistics written (`dragchain chains`)",
        "",
        "| contacts per frame | frames | million contacts/s | peak MB | of it, at the start |",
        "| ---: | ---: | ---: | ---: | ---: |",
    ]
    for one in found:
        rate = one["contacts"] * one["frames"] / one["processor_s"] / 1e6
        lines.append(
            f"| {one['contacts']:,} | {one['frames']} | {rate:.2f} | {one['peak_bytes'] / 1e6:.0f}"
            f" | {one['start_bytes'] / 1e6:.0f} |"
        )
    return "\n".join(lines)


# --- the run ------------------------------------------------------------------------------


def one_frame(run: Path, folder: Path) -> None:
    """Keep the network frame in the middle of a run's counted stretch."""
    import pandas as pd

    steps = pd.read_parquet(run / "tables" / "network.parquet", columns=["step"])["step"]
    where = [("step", "==", int(steps.iloc[len(steps) // 2]))]
    for name in ("contacts", "particles"):
        names = pd.read_parquet(FRAME / f"{name}.parquet").columns.to_list()
        table = pd.read_parquet(run / "tables" / f"{name}.parquet", columns=names, filters=where)
        table.to_parquet(folder / f"{name}.parquet", index=False)


def report(run: Path | None, rounds: int, largest: int) -> None:
    """Measure everything and write the page."""
    with tempfile.TemporaryDirectory() as name:
        frame = FRAME if run is None else Path(name)
        if run is not None:
            one_frame(run, frame)
        tables = []
        for kind, sizes in (("tiled", TILES), ("bed", EDGES)):
            found = [measure(kind, frame, size, rounds, largest) for size in sizes]
            tables.append(page_tables(kind, found))
        tables.append(stream_table([stream(frame, *sizes) for sizes in STREAMS]))
    source = "the frame of the tests" if run is None else "a frame of a run"
    output = "\n\n".join([f"{machine(*PACKAGES)}. {rounds} rounds, {source}.", *tables])
    print(output)


def main() -> None:
    """Measure, print, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--run", type=Path, help="folder of a process run with its tables")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--plain", type=int, default=300_000)
    parser.add_argument("--write", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    os.environ.update(ONE_THREAD)  # before numpy is imported
    if options.write is not None:
        print(json.dumps(write(options.write)))
    else:
        report(options.run, options.rounds, options.plain)


if __name__ == "__main__":
    main()
