"""Runs with all their tables, made in a second from the tiny run."""

import math
from pathlib import Path
from typing import Any

import pyvista as pv
from made_run import run_json, write_documents
from tiny_run_files import WORKPIECE_RADIUS_M, case_json, write_tiny_run

from dragchain import write_tables
from dragchain.loading.write import write_loading
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
    return "solid workpiece\n" + "".join(map(_facet, facets)) + "endsolid workpiece\n"


def _facet(corners: Any) -> str:
    rows = "".join(f"vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in corners)
    return f"facet normal 0 0 0\nouter loop\n{rows}endloop\nendfacet\n"


def write_finished_run(folder: Path, **case: Any) -> Path:
    """Write a process run with its tables, chains and loading; `case` changes its case.json."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    write_tiny_run(folder)
    shorter = case_json(statistics={"transient_s": TRANSIENT_S}) | {"run": folder.name}
    write_documents(folder, shorter | case, record=run_json())
    (folder / "workpiece.stl").write_text(square_workpiece())
    write_tables(folder)
    write_chains(folder)
    write_loading(folder)
    return folder


def analysed_tiny_run(folder: Path) -> Path:
    """The tiny run with its tables, its chains and a mesh of the workpiece."""
    write_tiny_run(folder)
    write_tables(folder)
    write_chains(folder)
    workpiece = pv.Cylinder(center=(0, 0, 0.03), direction=(0, 0, 1), radius=0.005, height=0.06)
    workpiece.triangulate().save(folder / "workpiece.stl")
    return folder
