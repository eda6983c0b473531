"""Cases side by side: differences with intervals, load maps on one scale, effects of factors.

Cases are compared with the first one. Where both have the same packings (seeds), the differences
are taken packing by packing, so that what the packings have in common cancels.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from pydantic import JsonValue

from dragchain.arrays import Floats
from dragchain.drag import circumference
from dragchain.errors import SeriesError, TableError
from dragchain.figures.panels import new_panels
from dragchain.figures.style import WIDE_IN, force_map
from dragchain.quantities.along import MAP_AZIMUTHS, MAP_DEPTHS
from dragchain.quantities.basis import Standing
from dragchain.quantities.registry import REPORTED, Quantity
from dragchain.report.campaign import write_report
from dragchain.report.cases import ReportedCase, StudyRuns, cases_of, read_study_runs
from dragchain.report.page import NETWORK_PAGE, TIMES, render_page, with_interval, write_bundle
from dragchain.run.case import changed_inputs
from dragchain.statistics.bed_effects import Factors, fit_effects
from dragchain.statistics.estimate import Estimate, flattened, mean_of
from dragchain.tables.by_step import read_table


@dataclass(frozen=True)
class ComparedCase:
    """A case of a comparison, with its name there."""

    name: str
    case: ReportedCase

    @cached_property
    def by_seed(self) -> Mapping[int, StudyRuns]:
        """Its process runs by the seed of their packing."""
        return {runs.process.study.seed: runs for runs in self.case.studies}

    @cached_property
    def inputs(self) -> Mapping[str, JsonValue]:
        """Values of its study by dotted name."""
        return self.case.first.process.study.inputs()

    @cached_property
    def load_maps(self) -> Mapping[int, Floats]:
        """Mean normal load of each packing by depth and azimuth, N."""
        return {seed: _load_map(study) for seed, study in self.by_seed.items()}


@dataclass(frozen=True)
class CaseDifference:
    """A quantity of a case beside that of the first one.

    Attributes
    ----------
    name : str
        Of the case.
    quantity : Quantity
    first, value : Estimate
        In the first case, and in this one.
    difference : Estimate
        Of the two; the interval is NaN where a single packing gives none.
    basis : str
        Whether both are as simulated, or from windows.
    paired : bool
        Whether it is the mean over packings that both cases have.
    """

    name: str
    quantity: Quantity
    first: Estimate
    value: Estimate
    difference: Estimate
    basis: str
    paired: bool

    @property
    def relative(self) -> Estimate:
        """The difference over the value in the first case: positive where this one is larger."""
        size = self.first.value
        return self.difference.over(size) if size else Estimate(math.nan, math.nan, math.nan)

    @property
    def verdict(self) -> str:
        """Whether the interval excludes zero, and what that says of the magnitude."""
        if not self.difference.known or self.difference.contains(0.0):
            return "undecided" if self.difference.known else "no interval"
        return "larger" if self.relative.value > 0 else "smaller"


def differences(first: ComparedCase, other: ComparedCase) -> list[CaseDifference]:
    """Every quantity that two cases have."""
    rows = []
    for quantity in REPORTED:
        pair = [case.case.values.of(quantity.name) for case in (first, other)]
        if all(pair):
            rows.append(_difference(quantity, first, other))
    return rows


def _difference(quantity: Quantity, first: ComparedCase, other: ComparedCase) -> CaseDifference:
    standings = [_standings(case, quantity) for case in (first, other)]
    corrected = all(standing.corrected for packings in standings for standing in packings.values())
    before, after = (_mean(case, quantity, corrected) for case in (first, other))
    numbers = [
        {seed: _number(standing, corrected).value for seed, standing in packings.items()}
        for packings in standings
    ]
    paired = len(numbers[0]) > 1 and numbers[0].keys() == numbers[1].keys()
    if paired:
        change = mean_of([numbers[1][seed] - numbers[0][seed] for seed in numbers[0]])
    else:
        half = math.hypot(before.half_width, after.half_width)
        change = Estimate.around(after.value - before.value, half)
    basis = str(next(iter(standings[0].values())).basis) if corrected else "as simulated"
    return CaseDifference(other.name, quantity, before, after, change, basis, paired)


def _standings(case: ComparedCase, quantity: Quantity) -> dict[int, Standing]:
    standings = {seed: study.values.of(quantity.name) for seed, study in case.by_seed.items()}
    return {seed: standing for seed, standing in standings.items() if standing}


def _number(standing: Standing, corrected: bool) -> Estimate:
    return standing.shown if corrected else standing.run


def _mean(case: ComparedCase, quantity: Quantity, corrected: bool) -> Estimate:
    standing = case.case.values.of(quantity.name)
    assert standing is not None
    return _number(standing, corrected)


# --- factors -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FactorEffect:
    """What a factor does to a quantity, or two of them together.

    Attributes
    ----------
    quantity : Quantity
    factors : tuple of str
        One: the change from its first level to another, averaged over the other factors.
        Two: half of the difference between the changes of the first factor at another and at the
        first level of the second.
    levels : tuple of str
        Of each factor: the two levels.
    effect : Estimate
    """

    quantity: Quantity
    factors: tuple[str, ...]
    levels: tuple[str, ...]
    effect: Estimate

    @property
    def words(self) -> Sequence[str]:
        """Each factor with its levels."""
        return [f"{name} ({both})" for name, both in zip(self.factors, self.levels, strict=True)]


def _changed(cases: Sequence[ComparedCase]) -> dict[str, list[JsonValue]]:
    """Inputs but the seed that differ between cases, with the value of each case."""
    first, *others = (case.inputs for case in cases)
    names = {name for inputs in others for name in changed_inputs(inputs, first)} - {"seed"}
    return {name: [case.inputs.get(name) for case in cases] for name in sorted(names)}


def factors_of(cases: Sequence[ComparedCase]) -> dict[str, list[JsonValue]]:
    """Inputs that are set independently of each other, with the level of each case.

    Empty unless there are at least two, and every combination of their levels is a case.
    """
    levels_by_name = _changed(cases)
    levels = [{repr(level) for level in column} for column in levels_by_name.values()]
    combined = {tuple(map(repr, row)) for row in zip(*levels_by_name.values(), strict=True)}
    crossed = len(combined) == math.prod(map(len, levels)) == len(cases)
    return levels_by_name if len(levels_by_name) > 1 and crossed else {}


def effects_of(
    cases: Sequence[ComparedCase], factors: Mapping[str, Sequence[JsonValue]], quantity: Quantity
) -> list[FactorEffect]:
    """Main effects and interactions of two factors on a quantity, by least squares.

    Every combination of levels has a coefficient of its own, so that no shape of the response is
    assumed; numbers are ordered, others are as they come. A packing that all cases share is a
    block. Where too few runs remain for the scatter, the effects of single factors are added up.
    """
    levels = {name: _levels(column) for name, column in factors.items()}
    settings = [dict(zip(factors, map(str, row), strict=True))
                for row in zip(*factors.values(), strict=True)]  # fmt: skip
    values = [
        (number, seed, standing.run.value)
        for number, case in enumerate(cases)
        for seed, standing in _standings(case, quantity).items()
    ]
    if len({number for number, *_ in values}) < len(cases):
        return []
    numbers, seeds, measured = zip(*values, strict=True)
    if not 0.0 < np.ptp(measured) < math.inf:
        return []
    shared = all(case.by_seed.keys() == cases[0].by_seed.keys() for case in cases)
    packings = list(dict.fromkeys(seeds))[1:] if shared else []
    blocks = np.array([[float(seed == packing) for packing in packings] for seed in seeds])
    reference = {name: known[0] for name, known in levels.items()}
    for additive in (False, True):
        model = Factors([settings[number] for number in numbers], reference, additive)
        design = np.hstack([model.design(), blocks])
        with suppress(SeriesError):
            fit = fit_effects(design, np.array(measured), range(len(design)))
            break
    else:
        return []
    of_cases = np.array([model.row(setting) for setting in settings])
    terms = [[name] for name in levels] + ([] if additive else [*combinations(levels, 2)])
    effects = []
    for term in terms:
        for others in product(*(levels[name][1:] for name in term)):
            change = {name: (reference[name], other)
                      for name, other in zip(term, others, strict=True)}  # fmt: skip
            weights = np.append(_contrast(of_cases, settings, change), np.zeros(len(packings)))
            words = tuple(" to ".join(both) for both in change.values())
            effects.append(FactorEffect(quantity, tuple(change), words, fit.estimate(weights)))
    return effects


def _levels(column: Sequence[JsonValue]) -> list[str]:
    """What the levels of a factor are called, numbers in their order."""
    if all(isinstance(level, int | float) for level in column):
        column = sorted(column, key=lambda level: float(str(level)))
    return list(dict.fromkeys(map(str, column)))


def _contrast(
    of_cases: Floats, settings: Sequence[Mapping[str, str]], change: Mapping[str, tuple[str, str]]
) -> Floats:
    """Weights of coefficients: from the first levels to others, averaged over other factors."""
    weights = np.zeros(of_cases.shape[1])
    for ends in product((0, 1), repeat=len(change)):
        levels = {name: change[name][end] for name, end in zip(change, ends, strict=True)}
        alike = [setting.items() >= levels.items() for setting in settings]
        weights += (-1) ** (len(change) - sum(ends)) * of_cases[alike].mean(axis=0)
    return weights / len(change)  # of an interaction, half


# --- figures -------------------------------------------------------------------------------------


def _load_map(study: StudyRuns) -> Floats:
    """Load map of a run: that from its windows where it has one."""
    load_map = study.extrapolated.load_map if study.extrapolated else None
    if load_map is not None:
        return np.array(load_map.value).reshape(MAP_DEPTHS, MAP_AZIMUTHS)
    return np.array(study.measured.load_map).reshape(MAP_DEPTHS, MAP_AZIMUTHS)


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
    return cases


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
        changed=_changed(cases),
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
