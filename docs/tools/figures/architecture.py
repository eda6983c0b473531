"""The packages and their layers, from the rules that the import linter checks."""

import tomllib

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch
from tables import ROOT

from dragchain.figures.style import BLUE, GREEN, GREY, INK, ORANGE

COLOURS = {"dragdeck": BLUE, "dragchain": GREEN, "evidence": ORANGE}
WIDTH, HEIGHT = 3.0, 0.42


def layers() -> dict[str, list[list[str]]]:
    """Packages of each layer, the highest first, by containing package."""
    rules = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    return {
        rule["containers"][0]: [layer.split(" | ") for layer in rule["layers"]]
        for rule in rules["contracts"]
        if "containers" in rule
    }


def draw() -> Figure:
    """Draw one column per package; imports lead downwards only."""
    columns = layers()
    figure = Figure(figsize=(8.6, 5.6), layout="constrained")
    axes = figure.subplots()
    for place, (name, rows) in enumerate(columns.items()):
        x, colour = 3.9 * place, COLOURS[name]
        axes.text(x + WIDTH / 2, 0.35, name, ha="center", weight="bold", color=colour, fontsize=11)
        for row, packages in enumerate(rows):
            _layer(axes, x, -0.55 * row, packages, colour)
    deepest = -0.55 * max(map(len, columns.values()))
    for start, end, text in (
        (WIDTH, 3.9, "files:\nrun folders,\ncase.json"),
        (6.9, 7.8, "imports\nboth"),
    ):
        y = -0.55 * 4
        axes.annotate(
            "",
            (end, y),
            (start, y),
            arrowprops={"arrowstyle": "<|-|>" if end < 5 else "<|-", "color": GREY},
        )
        axes.text((start + end) / 2, y - 0.1, text, ha="center", va="top", fontsize=8, color=GREY)
    axes.annotate(
        "", (-0.3, deepest + 0.3), (-0.3, 0.0), arrowprops={"arrowstyle": "-|>", "color": INK}
    )
    axes.text(-0.45, deepest / 2, "imports", rotation=90, va="center", ha="right", fontsize=9)
    axes.set(xlim=(-0.9, 10.9), ylim=(deepest, 0.7))
    axes.axis("off")
    return figure


def _layer(axes: Axes, x: float, y: float, packages: list[str], colour: str) -> None:
    width = WIDTH / len(packages)
    for place, name in enumerate(packages):
        corner = (x + place * width + 0.03, y - HEIGHT / 2)
        axes.add_patch(
            FancyBboxPatch(
                corner,
                width - 0.06,
                HEIGHT - 0.06,
                boxstyle="round,pad=0,rounding_size=0.06",
                fc=colour,
                alpha=0.14,
                ec="none",
            )
        )
        if len(packages) > 3:
            name = name.replace("_", "_\n")
        small = 6.0 if len(packages) > 3 else 8.0
        axes.text(
            corner[0] + width / 2 - 0.03, y - 0.03, name, ha="center", va="center", fontsize=small
        )
