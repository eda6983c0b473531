"""What the model predicts for published results (docs/evidence/published.md), and the comparison.

The predictions of ``design.yaml`` are committed before the published values are typed in.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.calibration.angles import read_angle
from dragchain.scaling.document import read_scalings
from dragchain.statistics.bed_effects import EffectsFit, fit_effects
from dragchain.statistics.estimate import Estimate
from dragdeck.cases.case import Case
from dragdeck.decks import RUN_FILE
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.records.case import load_case
from dragdeck.records.run import RunRecord
from dragdeck.scenes.angles import AngleRun, angle_scene
from dragdeck.scenes.process import PROCESS
from dragdeck.sweep.design import Design
from evidence.beds import Repeated, batch_here, designed, dragged

DESIGN = Path(__file__).with_name("design.yaml")

RESULTS = ("plate", "lift", "bars", "angle", "spin", "repose")
"""Designs of the file."""

LIFTED = ("bar_round", "bar_square", "bar_half_flat_down", "bar_half_flat_up")
"""Bars that lie across the direction of motion; the others have their angle to it in the name."""

FRICTION_STD = 0.067 / 0.274
"""Relative standard deviation of a measured friction of glass."""

_PLATE_M = 0.030
"""Width of both plates, and length of the one that lies flat."""

_DEPTHS_M = (0.020, 0.040)
"""Of the tip of the rod that spins, each with what is within `_WINDOW_M` of it."""

_WINDOW_M = 0.005

_FROM_DEPTH_M = 0.013
"""Two particle diameters: above, the flat plate meets single particles."""


def predict_published(out_dir: Path) -> None:
    """Make the runs that are missing; write a row per run, and the predictions.

    Raises
    ------
    InputError
        The design cannot be used.
    EngineError
        No LIGGGHTS, or it was interrupted.
    RejectedRunError
        A check of a run did not pass.
    """
    batch, rows = batch_here("published"), []
    out_dir.mkdir(parents=True, exist_ok=True)
    for result in RESULTS:
        for _, case in designed(Design[Repeated], DESIGN, result):
            measure = _heap if result == "repose" else _drag
            rows.append({"result": result, **measure(batch, case)})
            say(f"{result}: {len(rows)} runs")
            pd.DataFrame(rows).to_csv(out_dir / "runs.csv", index=False, float_format="%.5g")
    predictions(pd.DataFrame(rows)).to_csv(
        out_dir / "predictions.csv", index=False, float_format="%.4g"
    )


# --- measures ------------------------------------------------------------------------------------


def _heap(batch: Batch, case: Case) -> dict[str, Any]:
    """The angle of a heap in degrees, its friction and the radius of its particles in m."""
    pair, radius = case.study.pairs["ceramic-ceramic"], case.study.media.typical_radius_m
    coefficients = pair.model_dump(include={"friction", "rolling_friction"})
    run = AngleRun(rig="repose", seed=case.study.seed, **coefficients)
    name = f"repose-{pair.friction:g}-{radius:g}-{run.seed}"
    cost = batch.result(name, angle_scene(case, run)).cpu_time_s
    angle = read_angle(batch.folder / name)["angle_deg"]
    shown = {"seed": run.seed, "friction": pair.friction, "radius_m": radius, "cpu_time_s": cost}
    return {**shown, "value": angle}


def _drag(batch: Batch, case: Case) -> dict[str, Any]:
    """What distinguishes a run (body, friction, spin, seed), and the force that it measures.

    This is the lift of a bar, N; the lateral force of one at an angle, N; the vertical force on a
    rod that goes down, N, at two depths; the work of two bars that go down, J; or the stress on a
    plate per depth, N/m3.
    """
    study, folder = case.study, dragged(batch, PROCESS.run_id(case), case)
    force = pd.read_parquet(folder / "tables" / "workpiece_force.parquet")
    depth = (load_case(folder).surface_m or 0.0) - force.ref_z_m
    steady = force[force.in_statistics]
    row: dict[str, Any] = {
        "seed": study.seed,
        "body": Path(getattr(study.workpiece.shape, "file", "rod")).stem,
        "friction": study.pairs[f"ceramic-{study.workpiece.material}"].friction,
        "spin_rpm": study.motion.spin.rpm if study.motion.spin else 0.0,
        "cpu_time_s": RunRecord.read(folder / RUN_FILE).cpu_time_s,
    }
    if row["body"].startswith("bar"):
        lies_across = row["body"] in LIFTED
        return {**row, "value": steady["vertical_n" if lies_across else "lateral_n"].mean()}
    if row["body"] == "rod":
        at = [force.force_z_n[(depth - middle).abs() < _WINDOW_M].mean() for middle in _DEPTHS_M]
        return {**row, "value": at[0], "deeper": at[1]}
    if row["body"].startswith("pair"):
        return {**row, "value": np.trapezoid(force.force_z_n, depth)}
    if row["body"] == "plate_flat":
        down = force.phase.eq("plunge") & (depth > _FROM_DEPTH_M)
        slope = (force.force_z_n * depth)[down].sum() / (depth[down] ** 2).sum()
        return {**row, "value": slope / _PLATE_M**2}
    under = _PLATE_M * study.motion.immersion_depth_m**2 / 2
    return {**row, "value": -steady.drag_n.mean() / under}


# --- predictions ---------------------------------------------------------------------------------


def predictions(runs: pd.DataFrame) -> pd.DataFrame:
    """The predicted quantities with their 95 % intervals, one row each.

    Runs of the same packing have a random effect in common (`fit_effects`).
    """
    of = dict(iter(runs.groupby("result")))
    stress, lift, angle = (of[name] for name in ("plate", "lift", "angle"))
    by_plate = _fit(pd.get_dummies(stress.body), stress.assign(value=np.log(stress.value)))
    by_bar = _fit(pd.get_dummies(lift.body)[[*LIFTED]], lift)
    rows = {
        "plate_ratio": by_plate.estimate([1, -1]).exp(),  # flat, upright: in alphabetical order
        **{
            f"lift_{bar}_n": by_bar.estimate(row)
            for bar, row in zip(LIFTED, np.eye(4), strict=True)
        },
        **_bars(of["bars"]),
        "angle_of_largest_force_deg": _peak(angle),
        **_spin(of["spin"]),
        "drag_std_by_friction": _by_friction(),
        "repose_friction_exponent": _exponent(of["repose"], "friction"),
        "repose_diameter_exponent": _exponent(of["repose"], "radius_m"),
    }
    return pd.DataFrame([
        {"quantity": name, "predicted": known.value, "low": known.ci95_low, "high": known.ci95_high}
        for name, known in rows.items()
    ])  # fmt: skip


def _fit(design: Any, runs: pd.DataFrame) -> EffectsFit:
    return fit_effects(np.asarray(design, dtype=float), runs.value.to_numpy(), [*runs.seed])


def _bars(runs: pd.DataFrame) -> dict[str, Estimate]:
    """Gap of the largest work of two bars, in particle diameters, and that over the widest gap."""
    gaps = np.sort(runs.body.str.removeprefix("pair_").astype(float).unique())
    fit = _fit(pd.get_dummies(runs.body), runs.assign(value=np.log(runs.value)))
    at_three = np.where(gaps == 3, 1, 0) - np.where(gaps == gaps[-1], 1, 0)
    return {
        "work_of_two_bars": _largest(fit, gaps, np.eye(len(gaps))),
        "work_rise_of_two_bars": fit.estimate(at_three).exp(minus=1.0),
    }


def _largest(fit: EffectsFit, places: Floats, rows: Floats, draws: int = 2000) -> Estimate:
    """The place, (P,), at which effects times its row, (P, effects), are largest."""
    random = np.random.default_rng(1).standard_t(fit.degrees, (draws, len(fit.effects)))
    drawn = fit.effects + random @ np.linalg.cholesky(fit.covariance).T
    low, high = np.quantile(places[(drawn @ rows.T).argmax(axis=1)], [0.025, 0.975])
    return Estimate(places[(rows @ fit.effects).argmax()], low, high)


def _peak(runs: pd.DataFrame) -> Estimate:
    """Angle of the largest force: of a sine series that vanishes along and across the motion."""
    angle = np.radians(runs.body.str.removeprefix("bar_").astype(float))
    fine = np.linspace(1, 89, 881)
    series, on_fine = (
        np.column_stack([np.sin(2 * at), np.sin(4 * at)]) for at in (angle, np.radians(fine))
    )
    return _largest(_fit(series, runs.assign(value=runs.value.abs())), fine, on_fine)


def _spin(runs: pd.DataFrame) -> dict[str, Estimate]:
    """Reductions by spin: how much larger with more friction, and how much smaller deeper.

    The reductions of a packing and friction at both depths have a random effect in common.
    """
    force = runs.set_index(["friction", "seed"])[["value", "deeper"]]
    spins = (runs.spin_rpm > 0).to_numpy()
    reduced: Any = (1 - force[spins] / force[~spins]).stack()
    rows = reduced.rename("value").reset_index()
    design = np.column_stack([
        np.ones(len(rows)),
        np.where(rows.friction == rows.friction.max(), 1, 0),
        np.where(rows.level_2 == "deeper", -1, 0),
    ])  # fmt: skip
    pairs = rows.assign(seed=rows.friction.astype(str) + rows.seed.astype(str))
    names = ("spin_reduction", "spin_friction_effect", "spin_depth_effect")
    fit = _fit(design, pairs)
    return dict(zip(names, map(fit.estimate, np.eye(3)), strict=True))


def _by_friction() -> Estimate:
    """Relative standard deviation of the drag by that of the friction, from the scaling law."""
    law = next(scaling for scaling in read_scalings() if scaling.study == "drag-friction")
    return law.fit.exponent.over(1 / FRICTION_STD)


def _exponent(runs: pd.DataFrame, field: str) -> Estimate:
    """The exponent of the angle of a heap in a field, with the others as in the first run."""
    (other,) = {"friction", "radius_m"} - {field}
    part = runs[runs[other] == runs[other].iloc[0]]
    design = np.column_stack([np.ones(len(part)), np.log(part[field])])
    return _fit(design, part.assign(value=np.log(part.value))).estimate([0, 1])


# --- comparison ----------------------------------------------------------------------------------


def compare(predicted: pd.DataFrame, published: pd.DataFrame) -> pd.DataFrame:
    """The predictions beside the published values, with verdicts.

    A published value is confirmed if the interval contains it, and contradicted otherwise. A
    published sign is confirmed if the whole interval has it, contradicted if the whole interval
    has the other one, and otherwise not confirmed.

    Parameters
    ----------
    predicted : DataFrame
        As `predictions` makes it.
    published : DataFrame
        Columns ``quantity``, ``published`` (a value, or 1 or -1 for a sign, or none) and ``kind``,
        ``value`` or ``sign``.
    """
    both = published.merge(predicted, on="quantity", how="left")
    both["verdict"] = [_verdict(row) for row in both.itertuples()]
    return both


def write_verdicts(folder: Path) -> None:
    """Compare ``predictions.csv`` with ``published.csv``: a row per quantity, and one per result.

    Parameters
    ----------
    folder : Path
        With ``runs.csv`` and ``labels.csv``, too; gets ``comparison.csv`` and ``results.csv``.
    """
    runs, labels, predicted, published = (
        pd.read_csv(folder / f"{name}.csv")
        for name in ("runs", "labels", "predictions", "published")
    )
    compared = compare(predicted, labels.merge(published, on="quantity", how="left"))
    compared.to_csv(folder / "comparison.csv", index=False)
    minutes = runs.groupby("result").cpu_time_s.sum() / 60
    rows = [
        {
            "no": number, "statement": statement,
            "predicted": "; ".join(filter(None, map(_said, part.itertuples()))),
            "published": "; ".join(part.said.dropna()), "cpu_min": minutes.get(result),
            "verdict": _judged(part),
        }
        for (number, result, statement), part in compared.groupby(["no", "result", "statement"])
    ]  # fmt: skip
    pd.DataFrame(rows).to_csv(folder / "results.csv", index=False, float_format="%.3g")


def _judged(part: pd.DataFrame) -> str:
    """The verdicts of the quantities of a result, named where they differ."""
    if part.verdict.nunique() == 1:
        return str(part.verdict.iloc[0])
    return "; ".join(f"{row.short}: {row.verdict}" for row in part.itertuples())


def _said(row: Any) -> str:
    """A prediction as words; empty if there is none."""
    if np.isnan(row.predicted):
        return ""
    label = row.label if isinstance(row.label, str) else ""
    return f"{label} {row.predicted:.3g} ({row.low:.3g} to {row.high:.3g})".strip()


def _verdict(row: Any) -> str:
    known = Estimate(row.predicted, row.low, row.high)
    if not known.known:
        return "not run"
    if np.isnan(row.published):
        return "not compared"
    if row.kind == "value":
        return known.agrees_with(row.published)
    return known.over(row.published).exceeds(0.0)
