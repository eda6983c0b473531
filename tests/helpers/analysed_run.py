"""The tiny run with its tables, its chains and a mesh of the workpiece."""

from pathlib import Path

import pyvista as pv
from tiny_run_files import write_tiny_run

from dragchain.network.write import write_chains
from dragchain.tables.write import write_tables


def analysed_tiny_run(folder: Path) -> Path:
    write_tiny_run(folder)
    write_tables(folder)
    write_chains(folder)
    workpiece = pv.Cylinder(center=(0, 0, 0.03), direction=(0, 0, 1), radius=0.005, height=0.06)
    workpiece.triangulate().save(folder / "workpiece.stl")
    return folder
