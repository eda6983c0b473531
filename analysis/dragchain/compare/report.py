"""Cases side by side: differences with intervals, load maps on one scale, effects of factors.

Cases are compared with the first one. Where both have the same packings (seeds), the differences
are taken packing by packing, so that what the packings have in common cancels.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.compare.cases import CaseDifference, ComparedCase, differences
from dragchain.compare.factors import FactorEffect, changed_between, effects_of, factors_of
from dragchain.drag import circumference
from dragchain.errors import TableError
from dragchain.figures.panels import new_panels
from dragchain.figures.style import WIDE_IN, force_map
from dragchain.quantities.along import MAP_AZIMUTHS, MAP_DEPTHS
from dragchain.quantities.registry import REPORTED
from dragchain.report.campaign import write_report
from dragchain.report.cases import ReportedCase, StudyRuns, cases_of, read_study_runs
from dragchain.report.page import (
    NETWORK_PAGE,
    TIMES,
    remove_earlier,
    render_page,
    with_interval,
    write_bundle,
)
from dragchain.statistics.estimate import Estimate, flattened, mean_of
from dragchain.tables.by_step import read_table


def draw_maps(cases: Sequence[ComparedCase]) -> Figure:
    """Load maps on one scale and, below, the differences from the first.

    A dot marks a patch whose 95 % interval over the packings excludes zero.
    """
    first, *others = cases
    width = max(12, 88 // len(cases))
    means = [np.mean([*case.load_maps.values()], axis=0) for case in cases]
    figure, panels = new_panels(4.2, 2 * len(cases), WIDE_IN, len(cases), sharex=True, sharey=True)
    scale = Normalize(0.0, max(float(mean.max()) for mean in means))
    for axes, case, mean in zip(panels, cases, means, strict=False):
        drawn = _patches(axes, mean, cmap=force_map(), norm=scale)
        axes.set_title(fill(case.name, width))
    figure.colorbar(drawn, ax=panels[: len(cases)], label="normal load (N per patch)")
    panels[len(cases)].set_visible(False)
    panels[0].tick_params(labelbottom=True)
    changes = [mean - means[0] for mean in means[1:]]
    largest = max(float(np.abs(change).max()) for change in changes)
    below = panels[len(cases) + 1 :]
    below[0].tick_params(labelleft=True)
    for axes, case, change in zip(below, others, changes, strict=True):
        drawn = _patches(axes, change, cmap="RdBu_r", norm=Normalize(-largest, largest))
        title = f"{fill(case.name, width)}\nminus the first"
        axes.set(title=title, xlabel="azimuth from motion")
        if len(case.load_maps) > 1 and case.load_maps.keys() == first.load_maps.keys():
            _mark_certain(
                axes, [case.load_maps[seed] - first.load_maps[seed] for seed in first.load_maps]
            )
    figure.colorbar(drawn, ax=below, label="difference (N per patch)")
    for axes in panels[:: len(cases)]:
        axes.set_ylabel("depth over immersion depth")
    return figure


def _patches(axes: Axes, values: Floats, **style: Any) -> Any:
    azimuths = np.degrees(circumference(MAP_AZIMUTHS))
    axes.set(
        xticks=np.arange(-180, 181, 90), xticklabels=["back", "\nright", "ahead", "\nleft", "back"]
    )
    axes.set_ylim(1.0, 0.0)
    axes.grid(False)
    return axes.pcolormesh(azimuths, np.linspace(0, 1, MAP_DEPTHS + 1), values, **style)


def _mark_certain(axes: Axes, changes: Sequence[Floats]) -> None:
    azimuths = np.degrees(circumference(MAP_AZIMUTHS))
    for level, sector in np.ndindex(MAP_DEPTHS, MAP_AZIMUTHS):
        if not mean_of([change[level, sector] for change in changes]).contains(0.0):
            middle = 0.5 * (azimuths[sector] + azimuths[sector + 1])
            axes.plot(middle, (level + 0.5) / MAP_DEPTHS, ".", color="black")


# --- the report ----------------------------------------------------------------------------------


def read_compared(folders: Sequence[Path]) -> list[ComparedCase]:
    """The cases of studies and of single process runs, in the order given.

    Parameters
    ----------
    folders : sequence of Path
        ``results/STUDY`` with a report, or folders of process runs.

    Raises
    ------
    TableError
        If there are fewer than two cases, or a study has no report.
    RejectedRunError, DocumentError
        If a run cannot be used.
    """
    studies: dict[str, list[StudyRuns]] = {}
    for folder in folders:
        for run_dir in _process_runs(folder):
            study_runs = read_study_runs(run_dir)
            studies.setdefault(study_runs.process.case.study_name, []).append(study_runs)
    grouped = {study: cases_of(runs) for study, runs in studies.items()}
    cases = [
        ComparedCase(_name(study, case, len(grouped), len(of_study)), case)
        for study, of_study in grouped.items()
        for case in of_study
    ]
    if len(cases) < 2:
        known = ", ".join(case.name for case in cases)
        raise TableError(
            f"a comparison has at least two cases, and this one has only {known}: name another "
            "study, or one with a sweep (packings of one case are one case)"
        )
    names = Counter(case.name for case in cases)
    return [case if names[case.name] == 1 else _with_folder(case) for case in cases]


def _with_folder(compared: ComparedCase) -> ComparedCase:
    """A case whose name says where its results are."""
    folder = compared.case.first.process.folder.resolve().parents[1]
    return replace(compared, name=f"{folder.parent.name}/{folder.name}: {compared.name}")


def _process_runs(folder: Path) -> list[Path]:
    if (folder / "case.json").is_file():
        return [folder]
    summary = read_table(folder / "report" / "summary.parquet", ["run"])
    return [folder / "process" / run for run in summary["run"].drop_duplicates()]


def _name(study: str, case: ReportedCase, studies: int, cases: int) -> str:
    if studies == 1:
        return case.name
    return study if cases == 1 else f"{study}: {case.name}"


def write_comparison(out_dir: Path, folders: Sequence[Path]) -> None:
    """Write ``comparison.html``, ``differences.csv``, ``effects.csv`` and the linked networks.

    Parameters
    ----------
    out_dir : Path
        Where they go; made if need be.
    folders : sequence of Path
        See `read_compared`, whose errors it raises.
    """
    cases = read_compared(folders)
    first, *others = cases
    rows = [row for other in others for row in differences(first, other)]
    by_quantity = {
        quantity: [row for row in rows if row.quantity == quantity] for quantity in REPORTED
    }
    notes = Counter(note for case in cases for note in case.case.values.notes)
    factors = factors_of(cases)
    measured = [quantity for quantity in REPORTED if first.case.values.of(quantity.name)]
    effects = (
        [row for quantity in measured for row in effects_of(cases, factors, quantity)]
        if factors
        else []
    )
    linked = _write_networks(out_dir, cases)

    remove_earlier(out_dir, "effects.*")
    tables = {"differences": _table(rows, "difference", "relative")}
    if effects:
        tables["effects"] = _table(effects, "effect")
    write_report(
        out_dir,
        "compare/compare.html.j2",
        draw=lambda: {"maps": draw_maps(cases)},
        tables=tables,
        name="comparison",
        filters={"relative": _relative, "joined": f" {TIMES} ".join},
        cases=cases,
        rows=rows,
        by_quantity={
            quantity: of_quantity for quantity, of_quantity in by_quantity.items() if of_quantity
        },
        notes=notes,
        effects=effects,
        linked=linked,
        changed=changed_between(cases),
    )


def _relative(estimate: Estimate) -> str:
    return with_interval(estimate.over(0.01), "%")


def _table(rows: Sequence[CaseDifference | FactorEffect], *estimates: str) -> pd.DataFrame:
    """Rows as a table, with their estimates in three columns each."""
    table = []
    for row in rows:
        plain: dict[str, object] = {"quantity": row.quantity.name, "unit": row.quantity.unit}
        if isinstance(row, CaseDifference):
            plain |= {"case": row.name, "first": row.first.value, "value": row.value.value}
            plain |= {"basis": row.basis, "paired": row.paired}
        else:
            plain["factors"] = " x ".join(row.factors)
            plain["levels"] = " x ".join(row.levels)
        table.append(flattened(plain | {name: getattr(row, name) for name in estimates}))
    return pd.DataFrame(table)


def _write_networks(out_dir: Path, cases: Sequence[ComparedCase]) -> bool:
    """Copy the contact networks of the cases side by side on one page; whether all have one."""
    files = [case.case.first.process.folder / NETWORK_PAGE for case in cases]
    if not all(file.is_file() for file in files):
        return False
    copies = {f"network-{number}.html": file.read_bytes() for number, file in enumerate(files, 1)}
    shown = list(zip(copies, (case.name for case in cases), strict=True))
    page = render_page("compare/networks.html.j2", shown=shown)
    write_bundle(out_dir, files=copies, pages={"networks": page})
    return True
