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
    Extrapolated,
    ExtrapolatedQuantity,
    Need,
    Reached,
)
from dragchain.quantities.registry import REPORTED
from dragchain.report.findings import (
    FILE,
    AheadBehind,
    AzimuthProfile,
    Chains,
    DepthProfile,
    DropFindings,
    DropImpacts,
    DropRestitution,
    FillingFindings,
    Findings,
    Peaks,
    ProcessFindings,
)
from dragchain.run.reference import ReferenceDrag
from dragchain.statistics.correlated import MeanEstimate
from dragchain.statistics.estimate import Estimate, EstimateColumns
from dragdeck.records.run import figures_of

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


def force(mean: float) -> MeanEstimate:
    return MeanEstimate(
        mean=mean, std=0.5, samples=1000, autocorrelation_samples=5.0, effective_samples=100.0,
        se=0.05, ci95_low=mean - 0.1, ci95_high=mean + 0.1, confidence=0.95, reliable=True,
    )  # fmt: skip


def process_findings(drag: float = -2.5) -> ProcessFindings:
    network = ("coordination_number", "mechanical_coordination_number", "rattler_fraction",
               "normal_force_mean_n", "n_particle_workpiece_contacts")  # fmt: skip
    numbers = dict.fromkeys(Chains.model_fields, 0.25) | {"dominant_frames": 31}
    no_columns = EstimateColumns.of([])
    return ProcessFindings(
        run="workpiece-1", process_time_zero_s=0.1, confidence=0.95, workpiece_frames=31,
        forces=dict.fromkeys(("drag_n", "lateral_n", "vertical_n"), force(drag)),
        comparison=(ReferenceDrag(
            label="experiment", mean_n=-2.59, std_n=0.66, source="a paper"),),
        peaks=Peaks(count=4, process_time_s=(), drag_n=(), largest_n=-3.9, separation_s=0.1),
        network=dict.fromkeys(network, 4.5) | {"frames": 31},
        chains=Chains.model_validate(numbers),
        ahead_behind=AheadBehind(
            ahead_n=known(1.0), behind_n=known(1.0), ratio=known(math.nan),
            fraction_ahead=known(1.0)),
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
    impacts=DropImpacts.model_validate(dict.fromkeys(DropImpacts.model_fields, ())),
)


def make_run(results: Path, case: dict[str, Any], findings: Findings, names: list[str]) -> Path:
    folder = results / "small" / case["scene"] / case["run"]
    write_documents(folder, case, record=run_json())
    (folder / "figures").mkdir()
    findings.write(folder / FILE)
    for name in names:
        (folder / "figures" / f"{name}.png").write_bytes(PNG)
    return folder


REACHED = Reached(
    tolerance=0.1, asked=("drag_mean",), reached=True, needed=Need(3, 1),
    runs=("window-1", "window-2", "window-3"),
)  # fmt: skip


def write_quantities(run: Path, corrected: float | None = None, **reached: Any) -> None:
    """Write ``extrapolated.json``: all quantities 2, by windows that many times it."""
    value = None if corrected is None else Estimate.around(2.0 * corrected, abs(0.2 * corrected))
    own = Estimate(2.0, math.nan, math.nan)
    found = tuple(
        ExtrapolatedQuantity(
            name=one.name, label=one.label, unit=one.unit, measured=own, value=value
        )
        for one in REPORTED
    )
    made = REACHED.model_copy(update=reached) if corrected else None
    Extrapolated(quantities=found, tolerance=made).write(run / EXTRAPOLATED)


def page_of(out: Path) -> Page:
    return Page((out / "report.html").read_text(encoding="utf-8"))


def change_scripts(run_dir: Path, *changed: str) -> None:
    """Let a run have scripts that templates changed."""
    file = run_dir / "case.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"changed_scripts": changed}))
