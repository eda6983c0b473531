"""What the ways to a tolerance are expected to give in example studies, for the pages."""

from collections.abc import Iterator

import pandas as pd

from dragdeck.advice.advise import ways_of
from dragdeck.project import Project
from dragdeck.records.tradeoff import measured_tradeoff
from dragdeck.scenes.lead import FIRST_WINDOWS
from dragdeck.study.fidelity import Tolerance

STUDIES = ("uhlmann2015", "drag-depth", "shallow", "wet", "mixture", "stream")
SCENE = STUDIES[0]
"""Of the figure."""


def ways_table(project: Project) -> pd.DataFrame:
    """Every way of the studies to 10 % on drag and contacts, and of `SCENE` to each of them."""
    asked = [
        *((study, ("drag_mean", "workpiece_contacts")) for study in STUDIES),
        *((SCENE, (quantity,)) for quantity in ("drag_mean", "workpiece_contacts")),
    ]
    rows = [row for study, quantities in asked for row in _rows(project, study, quantities)]
    return pd.DataFrame(rows)


def _rows(
    project: Project, study: str, quantities: tuple[str, ...]
) -> Iterator[dict[str, str | int | float]]:
    case = project.cases(study)[0]
    ways = ways_of(case, Tolerance(tolerance=0.1, quantity=list(quantities)), measured_tradeoff())
    assert ways is not None
    enough, whole = ways.enough_windows, ways.whole
    first = enough or ways.with_windows(FIRST_WINDOWS)
    taken = first if ways.windows_pay else whole
    some = map(ways.with_windows, range(FIRST_WINDOWS, ways.most + 1))
    for way in (ways.of_other_scenes, *some, whole):
        kind = f"{way.windows} windows" if way.windows else way.name
        yield {
            "study": study, "asked": " ".join(quantities), "way": kind, "windows": way.windows,
            "half_width": way.half_width, "relative_cost": way.relative_cost,
            "taken": "yes" if way == taken else "",
            "listed": way.windows in (0, FIRST_WINDOWS, first.windows),
        }  # fmt: skip
