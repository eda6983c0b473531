"""The figures of a process run for a publication: SVG, PDF and PNG at the widths of columns."""

from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.typing import RcKeyType

from dragchain.figures.style import drawing, true_minus
from dragchain.loading.write import compute_loading, figure_of
from dragchain.report.findings import FINDINGS_FILE, ProcessFindings
from dragchain.report.run_data import RunData
from dragchain.report.run_figures import DRAW_PROCESS
from dragdeck.files import write_bytes

COLUMN_MM, PAGE_MM = 85, 180
_ONE_COLUMN = ("force_around_workpiece",)
_MM_PER_IN = 25.4
_DPI = 300
_POINTS = 8
_PRINT: dict[RcKeyType, Any] = {
    "font.size": _POINTS,
    "axes.labelsize": _POINTS,
    "xtick.labelsize": _POINTS,
    "ytick.labelsize": _POINTS,
    "legend.fontsize": _POINTS,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
"""Text of one size that stays text."""


def write_journal_figures(run_dir: Path) -> list[Path]:
    """Draw the figures of a process run into ``figures/journal/``.

    They have no headings, whose content belongs into the caption; several panels have letters.
    Text is 8 points high at the width of one column (85 mm) or of the page (180 mm) and stays
    text in SVG and PDF.

    Parameters
    ----------
    run_dir : Path
        The folder of a process run, with its tables, chains and figures made.

    Returns
    -------
    list of Path
        Three files for each figure.

    Raises
    ------
    DragdeckError
        If it is no process run, a table is missing, or pictures cannot be rendered here.
    """
    run = RunData.open(run_dir)
    findings = ProcessFindings.read(run_dir / FINDINGS_FILE)
    written = []
    with drawing():
        matplotlib.rcParams.update(_PRINT)
        figures = {draw.__name__: draw(run, findings) for draw in DRAW_PROCESS}
        figures["workpiece"] = figure_of(compute_loading(run_dir))
        for name, figure in figures.items():
            width = COLUMN_MM if name in _ONE_COLUMN else PAGE_MM
            as_printed(figure, width)
            for ending in ("svg", "pdf", "png"):
                file = run_dir / "figures/journal" / f"{name}.{ending}"
                write_bytes(file, _encoded(figure, ending))
                written.append(file)
    return written


def as_printed(figure: Figure, width_mm: float) -> None:
    """Scale a figure to a width, take its headings away and give its panels letters."""
    width, height = figure.get_size_inches()
    figure.set_size_inches(width_mm / _MM_PER_IN, height * width_mm / _MM_PER_IN / width)
    figure.suptitle("")
    panels = [axes for axes in figure.axes if _is_panel(axes)]
    for number, axes in enumerate(panels):
        for side in ("left", "center", "right"):
            axes.set_title("", loc=side)
        if panels[1:]:
            letter = f"({chr(ord('a') + number)})"
            above = axes.annotate(letter, (0.0, 1.02), xycoords="axes fraction")
            above.set(weight="bold", ha="right", va="bottom")


def _is_panel(axes: Axes) -> bool:
    """Whether it is one of the figure's panels, and neither a colour bar nor a second axis."""
    return axes.get_visible() and axes.get_label() not in ("<colorbar>", "twin")


def _encoded(figure: Figure, ending: str) -> bytes:
    true_minus(figure)
    for shown in figure.findobj(AxesImage):
        shown.set_interpolation("antialiased" if ending == "png" else "none")
    content = BytesIO()
    figure.savefig(content, format=ending, dpi=_DPI)
    return content.getvalue()
