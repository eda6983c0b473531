"""Runs of a study as a report finds them: documents, findings and pictures."""

import base64
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from made_run import made_case, run_json, write_documents
from pages import Page

from dragchain.quantities.document import (
    EXTRAPOLATED,
    MEASURED_FILE,
    Extrapolated,
    Need,
    Reached,
    RunQuantities,
)
from dragchain.quantities.registry import REPORTED
from dragchain.report.findings import (
    FINDINGS_FILE,
    AheadBehind,
    AzimuthProfile,
    Chains,
    DepthProfile,
    DropFindings,
    DropRestitution,
    FillingFindings,
    Findings,
    Peaks,
    ProcessFindings,
)
from dragchain.statistics.estimate import Estimate, EstimateColumns
from dragdeck.records.figures import figures_of

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
PICTURES = list(figures_of("process"))

ASKED = {
    "tolerance": 0.05, "quantities": ["drag_mean"], "error": None, "relative_cost": 0.04,
    "largest_cost": 0.09, "fallback": None,
}  # fmt: skip


def case_json(
    scene: str, run: str, study: Mapping[str, Any] | None = None, **more: Any
) -> dict[str, Any]:
    """Content of ``case.json`` of a study's run."""
    own = {
        "study_name": "small", "case": "10 mm <workpiece>", "timestep_s": 2.5e-5,
        "rayleigh_time_s": 3.2e-5, "surface_m": 0.07, "restitution": 0.68,
        "fidelity": {"timestep_fraction": 0.77, "skin_m": 0.0003, "ranks": 2},
        "media": {"count": 1422, "radius_mean_m": 0.00327, "density_kg_m3": 2656.0},
        "bowl": {"radius_m": 0.04}, "workpiece": {"length_m": 0.08, "immersion_depth_m": 0.05},
        "motion": {"path": {"kind": "circle", "radius_m": 0.02}, "speed_m_s": 0.01,
                   "orientation": "follow_path", "plunge_at_m": [0, 0]},
        "phases": [{"name": "drag", "start_step": 4000, "end_step": 64000}],
        "statistics": {"transient_s": 0.5},
        "assumptions": [{"field": "bowl.radius_m", "value": 0.04, "why": "a plausible fraction"}],
    }  # fmt: skip
    reference = {"source": "a paper", "experiment": {"drag_mean_n": -2.59, "drag_std_n": 0.66}}
    changes = {"media.count": 1422, "reference": reference, **(study or {})}
    return made_case(scene, run, changes, **own | more)


def known(value: float) -> Estimate:
    return Estimate(value, value, value)


def process_findings() -> ProcessFindings:
    numbers = dict.fromkeys(Chains.model_fields, 0.25)
    no_columns = EstimateColumns.of([])
    return ProcessFindings(
        run="workpiece-1", process_time_zero_s=0.1, confidence=0.95, workpiece_frames=31,
        peaks=Peaks(count=4, process_time_s=(), drag_n=(), largest_n=-3.9, separation_s=0.1),
        network_frames=31, rattler_fraction=0.1, chains=Chains.model_validate(numbers),
        ahead_behind=AheadBehind(ahead_n=known(1.0), behind_n=known(1.0)),
        azimuth=AzimuthProfile(edges_rad=(), force_n=no_columns),
        depth=DepthProfile(
            edges_m=(), contact_n=no_columns, line_load_n_per_m=no_columns,
            slope_n_per_m=known(5.0)),
    )  # fmt: skip


FILLING = FillingFindings(
    run="filling-1", bed={"bed_height_m": 0.0703, "solid_fraction": 0.592}, rest_energy_ratio=None
)
DROP = DropFindings(
    run="drop-1",
    restitution=DropRestitution(mean=0.71, lowest=0.7, highest=0.72, impacts=3, input=0.68),
)


FORCES = ("drag_mean", "lateral_mean", "vertical_mean")


def make_run(
    results: Path, case: dict[str, Any], findings: Findings, names: list[str], drag: float = -2.5
) -> Path:
    """Write a run; all forces of a process are `drag`, with a half-width of 0.1 N."""
    folder = results / "small" / case["scene"] / case["run"]
    write_documents(folder, case, record=run_json())
    (folder / "figures").mkdir()
    findings.write(folder / FINDINGS_FILE)
    if case["scene"] == "process":
        values = dict.fromkeys(FORCES, Estimate.around(drag, 0.1))
        write_measured(folder, **values, drag_std=Estimate.around(0.5, 0.1))
    for name in names:
        (folder / "figures" / f"{name}.png").write_bytes(PNG)
    return folder


def write_measured(folder: Path, **values: Estimate) -> None:
    """Write ``quantities.json`` of a process run, or add values to it."""
    file, case = folder / MEASURED_FILE, json.loads((folder / "case.json").read_text())
    if file.is_file():
        measured = RunQuantities.read(file)
        values = {**measured.values_of_run, **values}
    cost = {
        "steps": 1, "wall_time_s": 1.0, "cpu_time_s": 1.0, "ranks": 1, "timestep_s": 1e-5,
        "axis_speed_m_s": 0.01, "steps_per_m": 1e7,
    }  # fmt: skip
    names = ("study_name", "study", "run", "fidelity", "versions")
    whole = {name: case[name] for name in names} | {
        "bed": None, "complete": True, "cost": cost, "started": "", "values_of_run": values,
    }  # fmt: skip
    RunQuantities.model_validate(whole).write(file)


REACHED = Reached(
    tolerance=0.1, asked=("drag_mean",), reached=True, needed=Need(3, 1),
    runs=("window-1", "window-2", "window-3"),
)  # fmt: skip


def write_quantities(run: Path, corrected: float | None = None, **reached: Any) -> None:
    """All quantities but those that are known are 2; by windows they are so many times that."""
    file = run / MEASURED_FILE
    two = dict.fromkeys((quantity.name for quantity in REPORTED), Estimate(2.0, math.nan, math.nan))
    values = two | RunQuantities.read(file).values_of_run
    write_measured(run, **values)
    if corrected:
        windows = {
            name: Estimate.around(corrected * value.value, abs(0.1 * corrected * value.value))
            for name, value in values.items()
        }
        tolerance = REACHED.model_copy(update=reached)
        Extrapolated(values=windows, tolerance=tolerance).write(run / EXTRAPOLATED)


def page_of(out: Path) -> Page:
    return Page((out / "report.html").read_text(encoding="utf-8"))


def change_scripts(run_dir: Path, *changed: str) -> None:
    """Let a run have scripts that templates changed."""
    file = run_dir / "case.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"changed_scripts": changed}))
