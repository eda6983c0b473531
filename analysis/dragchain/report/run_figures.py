"""The figures of a run, as PNG files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from dragchain.figures.style import drawing, save
from dragchain.report import process_figures, upstream_figures
from dragchain.report.collect import write_findings
from dragchain.report.run_data import RunData
from dragchain.run.case import load_case

Draw = Callable[[RunData, Any], Figure | None]
"""Draws a figure of a run with its findings; None: it lacks an optional table."""

_DRAWN: Mapping[str, Sequence[Draw]] = {
    "process": process_figures.DRAWN,
    "filling": (upstream_figures.filling,),
    "drop_test": (upstream_figures.drop_test,),
}
FIGURES = {scene: {draw.__name__: draw for draw in drawn} for scene, drawn in _DRAWN.items()}
"""The figures of each scene by name, as the report shows them; it has their captions."""


def write_figures(run_dir: Path) -> list[Path]:
    """Draw the figures of a run into ``figures/`` and their numbers into ``tables/figures.json``.

    Parameters
    ----------
    run_dir : Path
        The folder of a run of any scene, with its tables made; for a process, chains too.

    Returns
    -------
    list of Path
        The pictures, ``figures/<name>.png`` for each of the `FIGURES` of its scene; a filling
        without a thermo table has none.

    Raises
    ------
    DragchainError
        If a table is missing, a series is too short, or pictures cannot be rendered here.
    """
    run = RunData(run_dir, load_case(run_dir))
    findings = write_findings(run)
    written = []
    with drawing():
        for name, draw in FIGURES[run.case.scene].items():
            if (figure := draw(run, findings)) is not None:
                written.append(save(figure, run_dir / "figures" / f"{name}.png"))
    return written
