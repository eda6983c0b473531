"""What OVITO, VTK's readers and a plain parser find in exports, and how fast that goes.

A run is exported for ParaView and as extended XYZ. OVITO opens ``run.pvd`` and ``run.xyz``,
VTK's readers (those of ParaView) open ``run.pvd``; of every frame, time, ids, places,
velocities, spins and radii of the particles, the contacts' forces and the workpiece's facets are
set beside the tables. Any difference ends it with an error; numbers that OVITO reads from
text may be off by two machine epsilons of their type, for its parser rounds more than once.
A radius it holds in 32 bits.

    python benchmarks/formats.py RUN_DIR [--every N] [--rounds 3]

OVITO is in the extra ``benchmarks``.
"""

import argparse
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from itertools import zip_longest
from pathlib import Path
from statistics import median

import numpy as np
import pandas as pd

from dragchain.export.frames import FrameData, FrameSeries, Selection
from dragchain.export.write import folder_size, write_export
from dragchain.tables.run_folder import Run

VECTORS = {
    "Position": ["x_m", "y_m", "z_m"],
    "Velocity": ["vx_m_s", "vy_m_s", "vz_m_s"],
    "Angular Velocity": ["wx_rad_s", "wy_rad_s", "wz_rad_s"],
}
FORCE = ["force_x_n", "force_y_n", "force_z_n"]


# --- the readers: each checks every frame against the tables ------------------------------


def ovito_paraview(folder: Path, expected: Iterator[FrameData]) -> None:
    """Open ``run.pvd`` with OVITO: particles, lines and a mesh."""
    for frame, data in _both(expected, _ovito(folder / "run.pvd")):
        same("time", data.attributes["Time"], frame.time_s)
        _ovito_particles(data.particles, frame.particles)
        if frame.network is not None:
            same("coordination", data.particles["coordination_number"][...], _contacts_of(frame))
        if frame.contacts is not None:
            _ovito_contacts(next(iter(data.lines.values())), frame.contacts)
        if frame.workpiece is not None and not data.surfaces:
            sys.exit("OVITO finds no workpiece")


def ovito_xyz(folder: Path, expected: Iterator[FrameData]) -> None:
    """Open ``run.xyz`` with OVITO."""
    for frame, data in _both(expected, _ovito(folder / "run.xyz")):
        same("time", data.attributes["Time"], frame.time_s, parsed=True)
        same("step", data.attributes["Timestep"], frame.step)
        _ovito_particles(data.particles, frame.particles, parsed=True)
        if frame.network is not None:
            same("coordination", data.particles["Coordination"][...], _contacts_of(frame))


def vtk_paraview(folder: Path, expected: Iterator[FrameData]) -> None:
    """Open ``run.pvd`` with VTK's readers."""
    import pyvista as pv

    reader = pv.PVDReader(folder / "run.pvd")

    def frames() -> Iterator[tuple[float, pv.MultiBlock]]:
        for time_s in reader.time_values:
            reader.set_active_time_value(time_s)
            yield time_s, reader.read()[0]

    for frame, (time_s, blocks) in _both(expected, frames()):
        same("time", time_s, frame.time_s)
        particles = blocks["particles"]
        same("id", particles["id"], frame.particles["particle_id"])
        same("radius", particles["radius"], frame.particles["radius_m"])
        for name, values in zip(
            VECTORS, (particles.points, particles["v"], particles["omega"]), strict=True
        ):
            same(name, values, frame.particles[VECTORS[name]])
        if frame.contacts is not None:
            same("force", blocks["contacts"]["force_n"], frame.contacts[FORCE])


def _ovito(file: Path) -> Iterator[object]:
    from ovito.io import import_file

    source = import_file(str(file)).source
    return (source.compute(number) for number in range(source.num_frames))


def _ovito_particles(dots: object, particles: pd.DataFrame, *, parsed: bool = False) -> None:
    same("id", dots["Particle Identifier"][...], particles["particle_id"])
    for name, columns in VECTORS.items():
        same(name, dots[name][...], particles[columns], parsed=parsed)
    radii = particles["radius_m"].to_numpy(np.float32)
    same("Radius", dots["Radius"][...], radii, parsed=parsed)


def _ovito_contacts(lines: object, contacts: pd.DataFrame) -> None:
    """OVITO puts a line's data on both of its points."""
    same("force", lines["force_n"][::2], contacts[FORCE])
    same("normal force", lines["normal_force_n"][1::2], contacts["normal_force_n"])
    same("id 1", lines["Particle Identifier 1"][::2], contacts["a_id"])


def _contacts_of(frame: FrameData) -> np.ndarray:
    from dragchain.network.statistics import contact_counts

    return contact_counts(frame.network)


def _both(expected: Iterator[FrameData], found: Iterator) -> Iterator:
    for one, other in zip_longest(expected, found):
        if one is None or other is None:
            sys.exit("the reader finds another number of frames than were written")
        yield one, other


def same(what: str, found: object, expected: object, *, parsed: bool = False) -> None:
    """End with an error where a number is not the table's; `parsed` grants it two epsilons."""
    found, expected = np.asarray(found), np.asarray(expected)
    relative = 2.0 * np.finfo(expected.dtype).eps if parsed else 0.0
    equal = found.shape == expected.shape
    if not equal or not (np.abs(found - expected) <= relative * np.abs(expected)).all():
        sys.exit(f"{what} is not what the table holds:\n{found}\n{expected}")


READERS: dict[str, tuple[str, Callable[[Path, Iterator[FrameData]], None]]] = {
    "OVITO, run.pvd": ("paraview", ovito_paraview),
    "VTK (ParaView's readers), run.pvd": ("paraview", vtk_paraview),
    "OVITO, run.xyz": ("xyz", ovito_xyz),
}


# --- the run ------------------------------------------------------------------------------


def timed(action: Callable[[], object]) -> tuple[float, float]:
    """Return wall and processor seconds."""
    wall, processor = time.perf_counter(), time.process_time()
    action()
    return time.perf_counter() - wall, time.process_time() - processor


def row(name: str, times: list[tuple[float, float]], frames: int, size: int) -> str:
    """Return a line of the table: medians over the rounds."""
    wall, processor = (median(column) for column in zip(*times, strict=True))
    rates = f"{frames / processor:.0f} | {size / 1e6 / processor:.0f} | {size / 1e6 / wall:.0f}"
    return f"| {name} | {rates} |"


def main() -> None:
    """Export, read, check and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("run_dir", type=Path, metavar="RUN_DIR", help="a run with its tables")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every N-th frame only")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    selection = Selection(every=options.every)
    series = FrameSeries.of(Run.open(options.run_dir), selection)
    lines = ["| | frames/s per core | MB/s per core | MB/s |", "| --- | ---: | ---: | ---: |"]
    with tempfile.TemporaryDirectory() as name:
        sizes = {}
        for to in ("paraview", "xyz"):
            folder = Path(name) / to
            times = [
                timed(lambda f=folder, t=to: _export(options.run_dir, t, f, selection))
                for _ in range(options.rounds)
            ]
            sizes[to] = folder_size(folder)
            lines.append(row(f"write {to}", times, len(series), sizes[to]))
        known = list(series)
        for reader, (to, check) in READERS.items():
            times = [
                timed(lambda c=check, t=to: c(Path(name) / t, iter(known)))
                for _ in range(options.rounds)
            ]
            lines.append(row(f"read and check {reader}", times, len(series), sizes[to]))
    shown = ", ".join(f"{name} {version(name)}" for name in ("ovito", "vtk", "pyvista", "pyarrow"))
    load = " ".join(f"{value:.1f}" for value in os.getloadavg())
    particles = len(known[0].particles)
    held = ", ".join(f"{size / 1e6:.1f} MB {to}" for to, size in sizes.items())
    print(
        f"{len(os.sched_getaffinity(0))} cores, load {load}; Python {platform.python_version()},"
        f" {shown}.\n{len(series)} frames of {particles} particles, {options.rounds} "
        f"rounds; {held}."
        " Every number read is the table's (OVITO's from text: to two epsilons).\n"
    )
    print("\n".join(lines))


def _export(run_dir: Path, to: str, folder: Path, selection: Selection) -> None:
    write_export(run_dir, to, folder, selection, replace=True)


if __name__ == "__main__":
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    main()
