"""The jobs of `snakemake all` and what each needs, from Snakemake's own rule graph."""

import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

from matplotlib.figure import Figure

from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE

ROOT = Path(__file__).resolve().parents[3]
COLOURS = {"render": BLUE, "run": ORANGE, "tabulate": GREEN}
SCENES = ("drop_test", "filling", "process")
"""One row each."""

BOX = {"boxstyle": "round,pad=0.35", "fc": "white", "lw": 1.3}


def rule_graph() -> tuple[dict[str, str], set[tuple[str, str]]]:
    """Label of every rule, and what each edge leads from and to."""
    words = [sys.executable, "-m", "snakemake", "--rulegraph", "dot", "all", "--cores", "1"]
    words += ["--config", "study=quickstart", "--forceall"]
    said = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    labels = dict(re.findall(r'(\d+)\[label = "(\w+)"', said))
    return labels, set(re.findall(r"(\d+) -> (\d+)", said))


def shortest(edges: set[tuple[str, str]]) -> set[tuple[str, str]]:
    """The edges that no longer way replaces."""
    after = defaultdict(set)
    for start, end in sorted(edges):
        after[start].add(end)

    def reached(start: str) -> set[str]:
        return {one for end in after[start] for one in ({end} | reached(end))}

    return {
        (start, end)
        for start, end in edges
        if not any(end in reached(other) for other in after[start] - {end})
    }


def draw() -> Figure:
    """Draw it, from left to right."""
    labels, edges = rule_graph()
    edges = shortest(edges)
    places: dict[str, tuple[float, float]] = {}
    late = {one: _jobs_after(one, edges) for one in labels}
    for one in sorted(labels, key=lambda one: labels[one]):
        row = next((row for row, scene in enumerate(SCENES) if labels[one].endswith(scene)), 2)
        place = (-late[one], -float(row))
        while place in places.values():
            place = (place[0], place[1] - 1.0)
        places[one] = place
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for start, end in sorted(edges):
        axes.annotate(
            "",
            places[end],
            places[start],
            arrowprops={
                "arrowstyle": "-|>",
                "color": GREY,
                "lw": 0.9,
                "shrinkA": 26,
                "shrinkB": 28,
            },
        )
    for one, (x, y) in places.items():
        colour = COLOURS.get(labels[one].partition("_")[0], GREY)
        text = labels[one].removesuffix("_of_process").replace("_", "\n", 1)
        axes.text(x, y, text, ha="center", va="center", fontsize=8, bbox={**BOX, "ec": colour})
    columns, rows = zip(*places.values(), strict=True)
    axes.set(xlim=(min(columns) - 0.5, 0.5), ylim=(min(rows) - 0.4, 0.4))
    axes.axis("off")
    return figure


def _jobs_after(one: str, edges: set[tuple[str, str]]) -> int:
    """Number of jobs on the longest way from a job to the last."""
    return max((1 + _jobs_after(end, edges) for start, end in edges if start == one), default=0)
