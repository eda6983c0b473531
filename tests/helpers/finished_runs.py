"""Runs with all their tables, made in a second from the tiny run."""

import math
from pathlib import Path
from typing import Any

from loading_files import write_without_picture
from made_run import run_json, stl, write_documents
from tiny_run_files import WORKPIECE_RADIUS_M, case_json, write_tiny_run

from dragchain import write_tables
from dragchain.network.write import write_chains

TRANSIENT_S = 0.01
"""Shorter than that of the tiny run, so that its statistics have enough frames."""

LENGTH_M = 0.06


def square_workpiece() -> str:
    """An STL of four sides about the cylinder; facet 7 faces +x and has the run's contacts."""
    half, facets = WORKPIECE_RADIUS_M * math.sqrt(2), []
    for side in range(4):
        (ax, ay), (bx, by) = (
            (half * math.cos(turn), half * math.sin(turn))
            for turn in (math.pi * (2 * side + 1) / 4, math.pi * (2 * side + 3) / 4)
        )
        upper = ((ax, ay, 0.0), (bx, by, LENGTH_M), (ax, ay, LENGTH_M))
        lower = ((ax, ay, 0.0), (bx, by, 0.0), (bx, by, LENGTH_M))
        facets += [upper, lower]
    return stl(facets)


def write_finished_run(folder: Path, **case: Any) -> Path:
    """Write a process run with its tables, chains and loading; `case` changes its case.json."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    write_tiny_run(folder)
    shorter = case_json(statistics={"transient_s": TRANSIENT_S}) | {"run": folder.name}
    write_documents(folder, shorter | case, record=run_json())
    (folder / "workpiece.stl").write_text(square_workpiece())
    write_tables(folder)
    write_chains(folder)
    write_without_picture(folder)
    return folder
