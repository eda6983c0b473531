"""A run's contacts as a plain deck would write them: every column, in another order."""

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from dragchain import load_outputs
from dragchain.run.run_parts import iter_frames

Place = Mapping[int, np.ndarray]


def fatten(run: Path, target: Path) -> None:
    """Copy a run without its tables; its contact dumps get columns that nobody reads.

    What was written stays as it was, digit by digit. New are places of particles, distance and
    radii from the particle frames of the same step, and the size of the force.
    """
    shutil.copytree(run, target, ignore=shutil.ignore_patterns("tables", "figures", "as_run"))
    content = json.loads((run / "columns.json").read_text())
    for name in ("contacts", "workpiece_contacts"):
        output = content["outputs"][name]
        places = _places(run) if name == "contacts" else None
        file = output["pattern"].format(part=1)
        with (run / file).open() as lines, (target / file).open("w") as out:
            out.writelines(_fat(lines, output, places))
        extra = EXTRA[name]
        output["columns"] = [*reversed(output["columns"]), *extra]
        output["engine_columns"] = [
            *reversed(output["engine_columns"]),
            *(f"c_more[{i}]" for i in range(len(extra))),
        ]
    (target / "columns.json").write_text(json.dumps(content))


EXTRA = {
    "contacts": [
        *(f"{axis}{particle}_m" for particle in (1, 2) for axis in "xyz"),
        *("distance_m", "radii_m", "force_n"),
    ],
    "workpiece_contacts": ["force_n"],
}


def _places(run: Path) -> dict[int, Place]:
    """Place and radius of every particle in every particle frame, by step and particle."""
    found = {}
    for frame in iter_frames(run, load_outputs(run)["particles"]):
        ids = frame.columns["particle_id"].tolist()
        names = ("x_m", "y_m", "z_m", "radius_m")
        rows = np.column_stack([frame.columns[name] for name in names])
        found[frame.step] = dict(zip(ids, rows, strict=True))
    return found


def _fat(
    lines: Iterator[str], output: Mapping[str, Any], places: Mapping[int, Place] | None
) -> Iterator[str]:
    """Lines of the dump with the columns in reverse order and more of them between."""
    while head := list(islice(lines, 9)):
        step, count = int(head[1]), int(head[3])
        names = head[8].split()[2:]
        order = [output["columns"][output["engine_columns"].index(name)] for name in names]
        extra = EXTRA[output["pattern"].split(".")[0]]
        more = [f"c_more[{i}]" for i in range(len(extra))]
        yield from head[:8]
        yield f"ITEM: ENTRIES {' '.join(_between(names, more))} \n"
        for line in islice(lines, count):
            row = dict(zip(order, line.split(), strict=True))
            values = _more(row, None if places is None else places[step])
            yield " ".join(_between(line.split(), [f"{value:.9g}" for value in values])) + " \n"


def _between(known: Sequence[str], more: Sequence[str]) -> list[str]:
    """The new columns among the known ones, these in reverse."""
    return [*more[1:], *reversed(known), *more[:1]]


def _more(row: Mapping[str, str], places: Place | None) -> list[float]:
    force = float(np.linalg.norm([float(row[f"force_{axis}_n"]) for axis in "xyz"]))
    if places is None:
        return [force]
    one, two = places[int(row["particle1_id"])], places[int(row["particle2_id"])]
    distance = float(np.linalg.norm(one[:3] - two[:3]))
    return [*one[:3], *two[:3], distance, one[3] + two[3], force]
