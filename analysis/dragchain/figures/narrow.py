"""Figures as PNG files: as they are drawn, and for a phone."""

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.figures.style import NARROW_IN, png
from dragdeck.files import write_bytes

_LETTERS_IN = 13
"""Letters of a figure's text per inch."""


NARROW = "-narrow"
"""End of the names of files for a phone."""


def save(figure: Figure, file: Path) -> Path:
    """Write a figure as PNG, also for a phone; each appears only once it is whole."""
    write_bytes(file, png(figure))
    write_bytes(file.with_stem(file.stem + NARROW), png(narrow(figure)))
    return file


def narrow(figure: Figure) -> Figure:
    """Lay a drawn figure out anew: panels in rows that fit, texts in shorter lines; the figure."""
    places: dict[Any, list[Axes]] = {}
    for axes in figure.axes:
        _break_lines(axes)
        if spec := axes.get_subplotspec():  # colour bars have none, twins the same
            places.setdefault(spec, []).append(axes)
    if not places:
        return figure
    rows, tall = _rows(list(places), figure.get_figwidth()), 0.0
    height = max(0.7 * figure.get_figheight() / next(iter(places)).get_gridspec().nrows, 2.2)
    outer: Any = figure.add_gridspec(len(rows), 1)
    for cell, row in zip(outer, rows, strict=True):
        inner = cell.subgridspec(1, len(row), width_ratios=[_share(spec) for spec in row])
        for spec, new in zip(row, inner, strict=True):
            for axes in places[spec]:
                axes.set_subplotspec(new)
        first = places[row[0]][0]
        first.tick_params(labelleft=True)
        label = first.get_ylabel() or figure.axes[0].get_ylabel()
        first.set_ylabel(fill(label, int(0.7 * _LETTERS_IN * height)))
        lines = sum(name.get_text().count("\n") + 1 for name in first.get_yticklabels())
        tall += max(height, 0.8 + 0.17 * lines)
    legends: list[Any] = [*figure.legends, *(axes.get_legend() for axes in figure.axes)]
    for legend in filter(None, legends):
        labels = [fill(text.get_text(), 46) for text in legend.get_texts()]
        legend.remove()
        figure.legend(legend.legend_handles, labels, loc="outside lower left", ncols=1)
        tall += 0.2 * len(labels)
    figure.set_size_inches(NARROW_IN, tall)
    for text in figure.texts:
        text.set(text=_filled(text.get_text()), x=0.0, y=0.0, va="top")
    figure.suptitle(_filled(figure.get_suptitle()), x=0.02, ha="left")
    return figure


def _share(spec: Any) -> float:
    """Width of a panel as a part of that of its figure."""
    ratios = spec.get_gridspec().get_width_ratios()
    return float(np.sum(ratios[spec.colspan.start : spec.colspan.stop]) / np.sum(ratios))


def _rows(specs: list[Any], width_in: float) -> list[list[Any]]:
    """Places of panels in rows of a phone, in their order."""
    rows: list[list[Any]] = [[]]
    for spec in specs:
        if rows[-1] and width_in * sum(map(_share, [*rows[-1], spec])) > NARROW_IN:
            rows.append([])
        rows[-1].append(spec)
    return rows


def _break_lines(axes: Axes) -> None:
    """Break titles and labels of axes, and names of rows."""
    axes.set_xlabel(_filled(axes.get_xlabel()))
    axes.set_title(_filled(axes.get_title(loc="left")), loc="left")
    names = [label.get_text() for label in axes.get_yticklabels()]
    if any(len(name) > 20 for name in names):
        axes.set_yticks(axes.get_yticks(), [fill(name, 24) for name in names], fontsize=8)


def _filled(text: str) -> str:
    return "\n".join(fill(line, int(_LETTERS_IN * NARROW_IN)) for line in text.split("\n"))
