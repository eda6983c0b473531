"""The report on a study's runs, and on those without a result: a table and one page."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.errors import MissingRunsError, TableError
from dragchain.figures.narrow import NARROW
from dragchain.report.cases import (
    ReportedCase,
    ReportedRun,
    StudyRuns,
    cases_of,
    read_reported,
    read_study_runs,
)
from dragchain.report.coarse_grained import Extrapolation, coarse_grained, table_of_sizes
from dragchain.report.findings import Findings
from dragchain.report.missing_runs import MissingRun, missing_run, scene_of
from dragchain.report.page import (
    NETWORK_PAGE,
    data_uri,
    file_uri,
    remove_earlier,
    render_page,
    write_bundle,
)
from dragchain.report.removal import UM_PER_H, RemovalOfCase, removal_of, touch_rows, touches_per_s
from dragchain.report.roughness import RoughnessOfCase, roughness_of
from dragchain.report.spreadsheet import summary_workbook
from dragchain.report.summary import summary
from dragchain.report.tolerance import answers
from dragchain.report.uncertain_inputs import uncertain_inputs
from dragchain.run.case import upstream_folders
from dragchain.run.workpiece import read_surface
from dragchain.statistics.noisy_map import LARGEST_ERROR
from dragdeck.errors import DragdeckError
from dragdeck.files import write_bytes
from dragdeck.records.case import AssumptionOfRun, load_case
from dragdeck.records.figures import FIGURES, figures_of

if TYPE_CHECKING:
    from dragchain.report.measured_signal import SignalComparison

_OF_CASES = ("network*.html", "*-removal.*", "signal.*", "true_size.*", "complete")
"""Files beside the report that an earlier one may have written of cases there are no longer, and
the mark that it has all runs of the study, which the workflow sets."""


# --- report --------------------------------------------------------------------------------------


_SHOWN = 6
"""Cases that the head of the page names; more are in its first table alone."""

_FROM_LOADING = "workpiece"
"""The figure of `dragchain.loading`, without which a report is still made."""


@dataclass(frozen=True)
class RunSection:
    """What the page shows of one process run.

    `pictures`: data URIs by the names of the figures, of which the page has the captions, and
    `narrow` those for a phone; `network`: page on the contact network.
    """

    study: StudyRuns
    assumptions: list[AssumptionOfRun]
    pictures: dict[str, str]
    narrow: dict[str, str]
    network: Path | None


def write_study_report(
    out_dir: Path, run_dirs: Sequence[Path], preview: Path | None = None, signal: Path | None = None
) -> None:
    """Write ``summary.csv``, ``.parquet`` and ``.xlsx``, and ``report.html``, on process runs.

    ``network.html`` of a run is copied beside the report, which links to it.

    Parameters
    ----------
    out_dir : Path
        Where they go; made if need be.
    run_dirs : sequence of Path
        Folders of process runs, ``results/<study>/<scene>/<run id>``. The filling and the drop
        test that a run names are looked up beside it; their folders may be given too, to say why
        a run that starts from one of them is not there.
    preview : Path, optional
        Picture of the set-up of its first case, PNG.
    signal : Path, optional
        Measured force signal that the study names, CSV; its comparison is also written as
        ``signal.csv`` and ``.parquet``.

    Raises
    ------
    MissingRunsError
        If a run has no result: it is not there, not complete, failed an acceptance check, or its
        findings or figures are missing. The report on the others, if any, is written before,
        and lists it.
    TableError
        If no process run is given.
    """
    sections, missing = _read(_with_upstream(run_dirs))
    if sections:
        studies = [section.study for section in sections]
        table = summary(studies)
        cases = cases_of(studies)
        removed = [(case, *removal) for case in cases if (removal := _removed(case))]
        rough = {case.key: course for case, of, _ in removed if (course := roughness_of(case, of))}
        signals = _signals(cases, signal)
        coarse = coarse_grained([study.measured for study in studies])
        picture = file_uri(preview) if preview else None
        page = _render(sections, cases, missing, picture, removed, rough, signals, coarse)
        remove_earlier(out_dir, *_OF_CASES, kept=[section.network for section in sections])
        for section, name in zip(sections, _network_pages(sections), strict=True):
            if section.network is not None:
                write_bytes(out_dir / name, section.network.read_bytes())
        assumed = {section.study.process.case.run: section.assumptions for section in sections}
        maps = {f"{case.key}-removal": removal.facets for case, removal, _ in removed}
        for key, course in rough.items():
            maps[f"{key}-removal"] = maps[f"{key}-removal"].join(course.ra)
        write_bundle(
            out_dir,
            tables={"summary": table, **maps}
            | _tables(signals)
            | ({"true_size": table_of_sizes(coarse)} if coarse else {}),
            files={"summary.xlsx": summary_workbook(table, assumed)},
            pages={"report": page},
        )
    elif not any(run.scene == "process" for run in missing):
        raise TableError("no folder of a process run is given, so there is nothing to report")
    if missing:
        shown = f"{out_dir / 'report.html'} shows the others" if sections else "there is no report"
        lines = [f"{len(missing)} run(s) have no result; {shown}", *map(str, missing)]
        raise MissingRunsError("\n  ".join(lines))


def _with_upstream(run_dirs: Sequence[Path]) -> list[Path]:
    """The folders of runs and of the runs that these name, each once, in the order of scenes."""
    folders = [folder.resolve() for folder in run_dirs]
    for folder in tuple(folders):
        with suppress(DragdeckError):
            folders += upstream_folders(folder, load_case(folder)).values()
    return sorted(dict.fromkeys(folders), key=lambda folder: scene_of(folder) == "process")


def _read(run_dirs: Sequence[Path]) -> tuple[list[RunSection], list[MissingRun]]:
    """What the page shows of the process runs, and the runs without a result."""
    sections, missing = [], []
    for folder in run_dirs:
        try:
            if scene_of(folder) == "process":
                sections.append(_section(read_study_runs(folder)))
            else:
                read_reported(folder, Findings)
        except DragdeckError as error:
            missing.append(missing_run(folder, error))
    return sections, missing


def _section(study: StudyRuns) -> RunSection:
    process = study.process
    network = process.folder / NETWORK_PAGE
    return RunSection(
        study=study,
        assumptions=_assumptions(study),
        pictures=dict(picture for run in study.runs for picture in _pictures(run)),
        narrow={
            name: uri
            for run in study.runs
            for name in (_FROM_LOADING, *figures_of(run.case.scene))
            if (uri := file_uri(run.folder / "figures" / f"{name}{NARROW}.png"))
        },
        network=network if network.is_file() else None,
    )


def _assumptions(study: StudyRuns) -> list[AssumptionOfRun]:
    """The assumptions of all runs of a study, by field."""
    known: dict[str, AssumptionOfRun] = {}
    for run in reversed(study.runs):
        known |= {assumption.field: assumption for assumption in run.case.assumptions}
    return [known[field] for field in sorted(known)]


def _pictures(run: ReportedRun[Findings]) -> Iterator[tuple[str, str]]:
    """Name and data URI of the figures of a run, that of the loading first.

    Only a filling may lack one of the others, as it may have no thermo table.
    """
    scene = run.case.scene
    for name in (*([_FROM_LOADING] if scene == "process" else []), *figures_of(scene)):
        file = run.folder / "figures" / f"{name}.png"
        if (uri := file_uri(file)) is not None:
            yield name, uri
        elif scene != "filling" and name != _FROM_LOADING:
            raise TableError(f"{file}: there is no such file; run `./run dragchain figures` first")


def _render(
    sections: Sequence[RunSection],
    cases: Sequence[ReportedCase],
    missing: Sequence[MissingRun],
    preview: str | None,
    removed: Sequence[tuple[ReportedCase, RemovalOfCase, str]],
    rough: Mapping[str, RoughnessOfCase],
    signals: Sequence["SignalComparison"],
    coarse: Sequence[Extrapolation],
) -> str:
    """The page: HTML that needs no other file and no network."""
    studies = [section.study for section in sections]
    first, runs = studies[0].process.case, _engine_runs(studies)
    return render_page(
        "report/report.html.j2",
        title=", ".join(dict.fromkeys(study.process.case.study_name for study in studies)),
        heading=first.title or first.study_name,
        preview=preview,
        sections=sections,
        cases=cases,
        network_pages=_network_pages(sections),
        missing=missing,
        captions=FIGURES,
        runs=runs,
        checks=[(run, check) for run in runs for check in run.record.checks],
        compared=[(case, row) for case in cases for row in case.values.against],
        signals=[
            (case, data_uri(case.picture()) if case.differences else None) for case in signals
        ],
        overview=_overview(cases) if len(cases) > 1 else None,
        shown=_SHOWN,
        coarse=coarse,
        asked=[(case, answer) for case in cases for answer in answers(case)],
        removed=removed,
        rough=[(case, of, _ra_map(case, of)) for case in cases if (of := rough.get(case.key))],
        largest_error=LARGEST_ERROR,
        uncertain={
            section.study.process.case.run: list(
                uncertain_inputs(section.assumptions, section.study.process.study)
            )
            for section in sections
        },
        touched=[
            (case, rows, *touches_per_s(case)) for case in cases if (rows := touch_rows(case))
        ],
    )


def _removed(case: ReportedCase) -> tuple[RemovalOfCase, str] | None:
    """The removal of a case and its map as a picture, None if its study has no law."""
    removal = removal_of(case)
    if removal is None:
        return None
    label = "depth of removal (µm/h), mean over areas of a particle's radius"
    title = f"{case.title}: depth of removal by {removal.removal.law}"
    depth = removal.facets["depth_m_s"].to_numpy(np.float64)
    return removal, _surface_map(case, UM_PER_H * depth, label, title)


def _ra_map(case: ReportedCase, roughness: RoughnessOfCase) -> str:
    """The map of the roughness of a case as a picture."""
    title = f"{case.title}: roughness after {roughness.map_minutes:.3g} min"
    return _surface_map(case, 1e6 * roughness.ra["ra_m"].to_numpy(np.float64), "Ra (µm)", title)


def _surface_map(case: ReportedCase, values: Floats, label: str, title: str) -> str:
    """Values of the facets of a case as a picture."""
    from dragchain.figures.style import drawing, png
    from dragchain.loading.figure import surface_figure

    run = case.first.process
    with drawing():
        surface = read_surface(run.folder, run.case)
        return data_uri(png(surface_figure(run.case, surface, values, label, title)))


def _network_pages(sections: Sequence[RunSection]) -> list[str]:
    """The name, beside the report, of each case's page on its contact network."""
    if len(sections) == 1:
        return [NETWORK_PAGE]
    return [f"network-{section.study.process.folder.name}.html" for section in sections]


def _engine_runs(studies: Sequence[StudyRuns]) -> list[ReportedRun[Findings]]:
    """Every run of LIGGGHTS once: cases may share one, and so may workpieces."""
    every = {(str(run.case.scene), run.case.run): run for study in studies for run in study.runs}
    return [run for run in every.values() if run.case.output_of is None]


def _signals(cases: Sequence[ReportedCase], file: Path | None) -> list["SignalComparison"]:
    """The comparisons with a measured signal; no other part of the page needs its filters."""
    references = [case.first.process.study.reference for case in cases]
    if not any(reference and reference.signal for reference in references):
        return []
    from dragchain.report.measured_signal import compare_signal

    return [comparison for case in cases if (comparison := compare_signal(case, file))]


def _tables(signals: Sequence["SignalComparison"]) -> dict[str, pd.DataFrame]:
    """The comparison with a measured signal, if there is one."""
    tables = [signal.table() for signal in signals if signal.differences]
    return {"signal": pd.concat(tables, ignore_index=True)} if tables else {}


def _overview(cases: Sequence[ReportedCase]) -> str:
    """The mean drag of all cases as a figure; no other part of the page needs matplotlib."""
    from dragchain.figures.panels import interval_rows
    from dragchain.figures.style import BLUE, drawing, png

    against = [row.reference for case in cases for row in case.values.against]
    with drawing():
        figure = interval_rows(
            [(fill(case.title, 32), case.values.drag.shown, BLUE) for case in cases],
            {f"{of.label} {of.mean_n:.2f} N": of.mean_n for of in against},
            "mean drag (N); bars: 95 % confidence interval",
        )
        return data_uri(png(figure))
