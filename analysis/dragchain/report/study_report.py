"""The summary of a study's runs: a table and one self-contained page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from dragchain.errors import TableError
from dragchain.loading.write import FILE as REMOVAL
from dragchain.loading.write import read_loading
from dragchain.report.cost_check import (
    Entry,
    actual_interval,
    cost_rows,
    prediction_for,
    read_advice,
)
from dragchain.report.findings import Findings, read_findings
from dragchain.report.page import data_uri, file_uri, render_page
from dragchain.run.case import Assumption, Case, Scene, load_case
from dragchain.run.completeness import RunRecord, read_accepted
from dragchain.statistics.correlated import RELIABLE_TIMES
from dragchain.tables.parquet import write_parquet

SHOWN = 6
"""Cases that the head of the page names; more are in its first table alone."""

FIGURES: dict[Scene, dict[str, str]] = {
    "process": {
        "forces": "Force on the workpiece along and across its motion, over process time (from the "
        "start of the drag). Statistics leave out the transient.",
        "network_xy": "Interaction network from above: one cylinder a contact, green (no force) to "
        "red (the frame's largest normal force), radius proportional to the force.",
        "network_xz": "The same frame from the side.",
        "force_around_workpiece": "Normal force on the workpiece by azimuth.",
        "force_depth": "Normal force on the workpiece by depth below the settled surface.",
        "chains_peaks": "Resistance and its peaks above the weakest contact of the dominant path "
        "from workpiece to bowl.",
        "workpiece": "Where particles press and slide on the workpiece: normal force times "
        "sliding distance, per "
        "area of the workpiece and metre of its way. It is what Archard's law of wear "
        "starts from, and "
        "no removed volume.",
    },
    "filling": {"filling": "Settling of the fill."},
    "drop_test": {"drop_test": "Impacts of the drop."},
}
"""Figures of the page by scene, with their captions."""

OPTIONAL = frozenset({"workpiece"})
"""Figures without which a report is still made: they need more than the usual tables."""


@dataclass(frozen=True)
class Run:
    """A run that counts: its folder, case, findings and ``run.json``."""

    folder: Path
    case: Case
    findings: Findings
    record: RunRecord


@dataclass(frozen=True)
class Study:
    """A process run with the fill and the drop it belongs to, None where it names none."""

    process: Run
    filling: Run | None
    drop_test: Run | None

    @property
    def runs(self) -> list[Run]:
        """The runs that there are, the process first."""
        return [run for run in (self.process, self.filling, self.drop_test) if run is not None]


def write_report(out_dir: Path, run_dirs: Sequence[Path], advice: Path | None = None) -> None:
    """Write ``summary.csv``, ``summary.parquet`` and ``report.html`` on process runs.

    Parameters
    ----------
    out_dir
        Where they go; made if need be.
    run_dirs
        Folders of process runs, ``results/<study>/<scene>/<run id>``. The fill and the drop that
        a run names are looked up beside it; their folders may be given too and are then used only
        that way.

    Raises
    ------
    RejectedRunError
        If a run is not complete or an acceptance check of it failed: no report is written at all.
    TableError
        If no process run is given, or the findings or figures of a run are missing.
    """
    cases = {folder: load_case(folder) for folder in run_dirs}
    studies = [read_study(folder) for folder, case in cases.items() if case.scene == "process"]
    if not studies:
        raise TableError("no folder of a process run is given, so there is nothing to report")
    summary = pd.DataFrame([summary_row(study) for study in studies])
    page = render(studies, summary, read_advice(advice) if advice is not None else [])
    out_dir.mkdir(parents=True, exist_ok=True)
    write_parquet(summary, out_dir / "summary.parquet")
    _write_text(out_dir / "summary.csv", summary.to_csv(index=False, lineterminator="\n"))
    _write_text(out_dir / "report.html", page)


def _write_text(path: Path, text: str) -> None:
    draft = path.with_name(f".{path.name}.tmp")
    draft.write_text(text, encoding="utf-8")
    draft.replace(path)


# --- reading ---------------------------------------------------------------------------------


def read_study(run_dir: Path) -> Study:
    """Read a process run with its fill and drop."""
    process = read_run(run_dir)
    results = run_dir.resolve().parent.parent
    upstream = process.case.upstream
    filling, drop = (
        read_run(results / scene / upstream[scene]) if scene in upstream else None
        for scene in ("filling", "drop_test")
    )
    return Study(process, filling, drop)


def read_run(run_dir: Path) -> Run:
    """Read a run, if it counts.

    Raises
    ------
    RejectedRunError
        If ``run.json`` is missing, or says that the run did not end or that an acceptance check
        failed.
    """
    record = read_accepted(run_dir)
    return Run(run_dir, load_case(run_dir), read_findings(run_dir), record)


# --- the summary -----------------------------------------------------------------------------


def summary_row(study: Study) -> dict[str, object]:
    """The row of a process run; a None is a number that there is none of."""
    case, found, record = study.process.case, study.process.findings, study.process.record
    return {
        "study": case.study,
        "case": case.case,
        "run": case.run,
        **{input_column(name): _plain(value) for name, value in case.inputs.items()},
        **{f"fidelity_{name}": value for name, value in vars(case.fidelity).items()},
        "timestep_s": case.timestep_s,
        "ranks": record.ranks,
        "steps_per_s": record.steps_per_s,
        "wall_time_s": record.wall_time_s,
        "engine_version": record.engine_version,
        **_force_columns(found["forces"]),
        **_comparison_columns(found["comparison"]),
        "peak_count": found["peaks"]["count"],
        "peak_max_n": found["peaks"]["largest_n"],
        **_network_columns(found),
        **_chain_columns(found),
        **_upstream_columns(study),
    }


def input_column(name: str) -> str:
    """The summary's column of a dotted input name."""
    return "input_" + name.replace(".", "_")


def _plain(value: object) -> object:
    return value if isinstance(value, str | int | float | None) else json.dumps(value)


def _force_columns(forces: Findings) -> dict[str, object]:
    columns: dict[str, object] = {}
    for key, force in forces.items():
        name = key.removesuffix("_n")
        columns |= {
            f"{name}_mean_n": force["mean"],
            f"{name}_std_n": force["std"],
            f"{name}_ci95_low_n": force["ci95_low"],
            f"{name}_ci95_high_n": force["ci95_high"],
            f"{name}_effective_samples": force["effective_samples"],
            f"{name}_reliable": force["reliable"],
        }
    return columns


def _comparison_columns(comparison: Sequence[Findings]) -> dict[str, object]:
    columns: dict[str, object] = {}
    for row in comparison:
        name = f"drag_against_{row['label']}"
        columns[f"{name}_percent"] = row["difference_percent"]
        columns[f"{name}_ci95_low_percent"] = row["ci95_low"]
        columns[f"{name}_ci95_high_percent"] = row["ci95_high"]
    return columns


def _network_columns(found: Findings) -> dict[str, object]:
    network, sides, slope = found["network"], found["ahead_behind"], found["depth"]["slope_n_per_m"]
    names = ("coordination_number", "mechanical_coordination_number", "rattler_fraction")
    return {
        "network_frames": network["frames"],
        **{name: network[name] for name in names},
        "contact_normal_force_mean_n": network["normal_force_mean_n"],
        "workpiece_contacts_per_frame": network["n_particle_workpiece_contacts"],
        "ahead_mean_n": sides["ahead_n"]["value"],
        "behind_mean_n": sides["behind_n"]["value"],
        "ahead_behind_ratio": sides["ratio"]["value"],
        "ahead_behind_ratio_ci95_low": sides["ratio"]["ci95_low"],
        "ahead_behind_ratio_ci95_high": sides["ratio"]["ci95_high"],
        "depth_slope_n_per_m": slope["value"],
        "depth_slope_ci95_low_n_m": slope["ci95_low"],
        "depth_slope_ci95_high_n_m": slope["ci95_high"],
    }


def _chain_columns(found: Findings) -> dict[str, object]:
    chains, link = found["chains"], found["association"]
    return {
        "peters_chains_per_frame": chains["peters_per_frame"],
        "peters_chain_particles_mean": chains["peters_particles_mean"],
        "widest_paths_per_frame": chains["widest_paths_per_frame"],
        "widest_paths_to_side_fraction": chains["widest_paths_to_side_fraction"],
        "dominant_bottleneck_mean_n": chains["dominant_bottleneck_mean_n"],
        "dominant_bottleneck_max_n": chains["dominant_bottleneck_max_n"],
        "dominant_particles_mean": chains["dominant_particles_mean"],
        "dominant_altitude_mean_m": chains["dominant_altitude_mean_m"],
        "dominant_azimuth_mean_rad": chains["dominant_azimuth_mean_rad"],
        "chain_drag_rank_correlation": link["rank_correlation"],
        "chain_drag_p_value": link["p_value"],
    }


def _upstream_columns(study: Study) -> dict[str, object]:
    bed = study.filling.findings["bed"] if study.filling else {}
    ratio = study.drop_test.findings["restitution"] if study.drop_test else {}
    return {
        "bed_height_m": bed.get("bed_height_m"),
        "solid_fraction": bed.get("solid_fraction"),
        "restitution_effective": ratio.get("mean"),
        "restitution_input": ratio.get("input"),
    }


# --- the page --------------------------------------------------------------------------------


def render(
    studies: Sequence[Study], summary: pd.DataFrame, options: list[Entry] | None = None
) -> str:
    """The page: HTML that needs no other file and no network."""
    columns = {str(name): summary[name].tolist() for name in summary}
    return render_page(
        "report/report.html.j2",
        title=", ".join(dict.fromkeys(study.process.case.study for study in studies)),
        studies=[_section(study, options or []) for study in studies],
        overview=_overview(studies) if len(studies) > 1 else None,
        columns=columns,
        shown=SHOWN,
        reliable_times=RELIABLE_TIMES,
    )


def _section(study: Study, options: list[Entry]) -> dict[str, object]:
    """What the page shows of one process run."""
    process = study.process
    asked = process.case.asked
    expected = prediction_for(process.case, options)
    records = {str(run.case.scene): run.record for run in study.runs}
    assumptions: dict[str, Assumption] = {}
    for run in reversed(study.runs):
        assumptions |= {assumption.field: assumption for assumption in run.case.assumptions}
    return {
        "case": process.case,
        "found": process.findings,
        "runs": study.runs,
        "assumptions": [assumptions[field] for field in sorted(assumptions)],
        "pictures": [picture for run in study.runs for picture in pictures(run)],
        "filling": study.filling.findings["bed"] if study.filling else None,
        "drop_test": study.drop_test.findings if study.drop_test else None,
        "removal": read_loading(process.folder) if (process.folder / REMOVAL).is_file() else None,
        "asked": asked,
        "interval": actual_interval(asked, process.findings["forces"]) if asked else None,
        "costs": list(cost_rows(expected, records)) if expected else [],
        "cost_source": expected["source"] if expected else None,
    }


def pictures(run: Run) -> list[dict[str, str]]:
    """Return name, caption and data URI of a run's figures.

    Raises
    ------
    TableError
        If a figure of a process or a drop is missing; a fill without thermo table has none, and
        a process may lack those of `OPTIONAL`.
    """
    found = []
    for name, caption in FIGURES[run.case.scene].items():
        file = run.folder / "figures" / f"{name}.png"
        uri = file_uri(file)
        if uri is not None:
            found.append({"name": name, "caption": caption, "uri": uri})
        elif run.case.scene != "filling" and name not in OPTIONAL:
            raise TableError(f"{file}: there is no such file; run `dragchain figures` first")
    return found


def _overview(studies: Sequence[Study]) -> str:
    from dragchain.figures.style import png
    from dragchain.report.run_figures import drag_of_cases

    rows = [row for study in studies for row in study.process.findings["comparison"]]
    references = list(dict.fromkeys((row["label"], row["mean_n"]) for row in rows))
    names = [study.process.case.case or study.process.case.run for study in studies]
    forces = [study.process.findings["forces"]["drag_n"] for study in studies]
    return data_uri(png(drag_of_cases(names, forces, references)))
