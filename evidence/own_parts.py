"""Four parts as a user brings them, each from its file to the report of its study.

The surfaces are those of a CAD export: rings of nodes with long facets between them, in mm. The
record has what `dragdeck new`, `dragdeck check` and Snakemake said and took.
"""

import math
import re
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import numpy as np
import pandas as pd
from trimesh import Trimesh

from dragdeck.arrays import Floats
from dragdeck.engine.reports import say
from dragdeck.records.run import RunRecord

_AROUND = np.linspace(0, 2 * np.pi, 48, endpoint=False)


def _ring(radius: Floats | float, z: float, turn: float = 0.0, x: float = 0.0) -> Floats:
    """Nodes at radii from an axis, (48, 3), the section turned and shifted."""
    angles = _AROUND + turn
    return np.column_stack([radius * np.cos(angles) + x, radius * np.sin(angles), 0 * angles + z])


def _body(rings: Sequence[Floats], hole: bool = False) -> Trimesh:
    """The surface through rings, whose first and last are closed, or joined where it has a hole."""
    if not hole:
        closed = [np.broadcast_to(ring.mean(axis=0), ring.shape) for ring in (rings[0], rings[-1])]
        rings = [closed[0], *rings, closed[1]]
    nodes = np.arange(len(rings) * len(_AROUND)).reshape(len(rings), -1)
    low, high = (nodes, np.roll(nodes, -1, axis=0)) if hole else (nodes[:-1], nodes[1:])
    after, high_after = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    facets = np.stack([[low, after, high_after], [low, high_after, high]]).transpose(2, 0, 3, 1)
    return Trimesh(np.vstack(rings), facets.reshape(-1, 3), validate=True)


def _ellipse(half_x: float, half_y: float) -> Floats:
    return 1 / np.hypot(np.cos(_AROUND) / half_x, np.sin(_AROUND) / half_y)


def _blade() -> Trimesh:
    """A twisted blade below a platform and a root that are wider than a gap to the bowl."""
    blade = [_ring(_ellipse(7, 1), z, math.radians(z)) for z in np.linspace(0, 45, 16)]
    square = 1 / np.maximum(abs(np.cos(_AROUND)), abs(np.sin(_AROUND)))
    rings = [
        _ring(size * square, z, math.radians(45))
        for size, z in ((12, 45), (12, 49), (6, 49), (6, 62))
    ]
    return _body([*blade, *rings])


def _drill() -> Trimesh:
    """A twist drill of 10 mm with two flutes, a point of 118 degrees and a round shank."""
    flutes, turn = 5 - 2.2 * np.cos(_AROUND) ** 4, 2 * np.pi / 34
    point = [_ring(flutes * part, 3 * part) for part in (0.1, 0.5, 1)]
    fluted = [_ring(flutes, z, turn * (z - 3)) for z in np.linspace(5, 55, 41)]
    return _body([*point, *fluted, *(_ring(5, z, turn * 52) for z in (60, 90))])


def _hip_stem() -> Trimesh:
    """A bent, tapered stem that ends in an inclined neck and a cone."""
    heights, lengths = np.array([0, 5, 30, 60, 90, 105, 115, 118, 135]), np.linspace(0, 1, 9)
    along = np.linspace(0, 1, 33)
    z, x, wide, thick = (
        np.interp(along, lengths, values)
        for values in (heights, [0, 0, 0, 1, 5, 12, 18, 20, 32],
                       [2, 4, 5, 7, 12, 15, 9, 6, 6], [2, 4, 4.5, 5.5, 7, 7.5, 7, 6, 6])
    )  # fmt: skip
    return _body([_ring(_ellipse(a, b), h, 0, s) for h, s, a, b in zip(z, x, wide, thick,
                                                                     strict=True)])  # fmt: skip


def _gear() -> Trimesh:
    """A gear of 12 teeth with a bore."""
    teeth = np.tile([10.0, 13.0, 13.0, 10.0], 12)
    return _body([_ring(4, 0), _ring(teeth, 0), _ring(teeth, 8), _ring(4, 8)], hole=True)


PARTS = {"blade": _blade, "drill": _drill, "hip_stem": _hip_stem, "gear": _gear}


def try_parts(folder: Path, out: Path) -> None:
    """Make the parts and their studies in a new project, run them, and write the record."""
    subprocess.run(["dragdeck", "init", folder], check=True)
    rows = []
    for name, make in PARTS.items():
        part = make()
        part.export(folder / f"{name}.stl")
        began, before = time.monotonic(), getrusage(RUSAGE_CHILDREN)
        _call(folder, "dragdeck", "new", name, "--from", f"{name}.stl")
        checked = _call(folder, "dragdeck", "check", name)
        _call(folder, "snakemake", "--cores", "1", "all", "--config", f"study={name}")
        after, study = getrusage(RUSAGE_CHILDREN), folder / f"results/{name}"
        runs = [RunRecord.read(file) for file in study.glob("*/*/run.json")]
        drag = pd.read_parquet(study / "report/summary.parquet")
        cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        rows.append({
            "part": name.replace("_", " "), "facets": len(part.faces),
            "length_mm": part.extents.max(),
            "warnings": len(re.findall("warning: ", checked)), "runs": len(runs),
            "rejected": sum(not run.complete for run in runs),
            "report": (study / "report/report.html").is_file(),
            "drag_n": drag["drag_mean_n"].iloc[0], "cpu_s": cpu_s,
            "wall_s": time.monotonic() - began,
        })  # fmt: skip
        say(f"{name}: {cpu_s:.0f} s")
        pd.DataFrame(rows).to_csv(out, index=False, float_format="%.4g")


def _call(folder: Path, *command: str) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    (folder / f"{command[0]}.log").write_text(done.stdout + done.stderr)
    done.check_returncode()
    return done.stdout + done.stderr
