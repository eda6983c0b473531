"""The files of a calibration: record, result, tables and trials."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd

from dragchain.calibration.fit import (
    Calibration,
    Emulator,
    Fit,
    bias_rows,
    calibrate,
    emulate,
    prepare,
)
from dragchain.calibration.force_record import Record, as_json, measure, read_record
from dragchain.calibration.simulated_drops import IMPACTS, DropRun, Drops, read_drops
from dragchain.calibration.synthetic_record import Sensor, coverage, record_of, run_trials
from dragchain.errors import TableError

SCHEMA = 2
NORMAL_95 = 1.96
"""Half width of a 95 % interval of a normal distribution, in standard deviations."""

PURPOSES: tuple[Literal["production", "reference"], ...] = ("production", "reference")


def write_record(record: Path, fall_time_s: float, out: Path) -> Path:
    """Read a record, find its impacts and write ``record.json``.

    Raises
    ------
    RecordError
        The record cannot be used.
    """
    measured = measure(read_record(record), fall_time_s=fall_time_s)
    return _write_json(out, as_json(measured))


def write_calibration(record: Path, drops_file: Path, out: Path) -> Path:
    """Fit a record and write ``result.json``, ``impacts.csv`` and ``bias.csv``.

    Parameters
    ----------
    record : Path
        The CSV.
    drops_file : Path
        ``drops.json`` of the sweep.
    out : Path
        Their folder.

    Raises
    ------
    DragchainError
        The record or the sweep cannot be used.
    """
    drops = read_drops(drops_file)
    found = calibrate_file(record, drops)
    out.mkdir(parents=True, exist_ok=True)
    bias = pd.DataFrame(bias_rows(drops))
    _write_csv(out / "bias.csv", bias)
    _write_csv(out / "impacts.csv", pd.DataFrame(impact_rows(found)))
    return _write_json(out / "result.json", result(found, drops))


def calibrate_file(record: Path, drops: Drops) -> Calibration:
    """Fit a record."""
    measured = measure(read_record(record), fall_time_s=drops.known["fall_time_s"])
    return calibrate(measured, prepare(drops))


def result(found: Calibration, drops: Drops) -> dict[str, Any]:
    """Content of ``result.json``."""
    measured = {
        name: float(found.reference.rebound(value))
        for name, value in _interval(found.fit_reference).items()
    }
    deck, settings = found.fit.restitution, drops.known
    return {
        "schema": SCHEMA,
        "known": dict(settings),
        "put": {"field": f"pairs.{settings['pair']}.restitution", "value": _rounded(found.fit)},
        "measured": measured,
        "effective": float(found.production.rebound(deck)),
        "fit": _fit_json(found.fit),
        "fit_full": _fit_json(found.fit_reference),
        "peaks_compared": found.with_peaks,
        "peaks_why": found.why,
        "direct": direct(found, settings),
        "correction": deck - measured["value"],
        "put_for": [
            {**row, **_interval(found.fit)} if row["used"] else row
            for row in put_for(drops, measured)
        ],
        "scatter_of_one_drop": found.production.scatter,
        "settings": settings_of(drops),
        "record": as_json(found.measured),
    }


def settings_of(drops: Drops) -> dict[str, dict[str, float]]:
    """Modulus and step of the drops at production and at the reference."""
    names = ("youngs_modulus_scale", "timestep_s", "timestep_fraction")
    return {
        purpose: {name: getattr(drops.select(purpose)[0], name) for name in names}
        for purpose in PURPOSES
    }


def _interval(fit: Fit) -> dict[str, float]:
    return {"value": fit.restitution, "low": fit.low, "high": fit.high}


def _rounded(fit: Fit) -> float:
    """The deck value with as many decimals as its interval warrants, two at the least."""
    width = max(fit.high - fit.low, 1e-9)
    return round(fit.restitution, max(2, math.ceil(-math.log10(width)) + 1))


def _fit_json(fit: Fit) -> dict[str, Any]:
    return {**vars(fit), "residuals": fit.residuals.tolist()}


def direct(found: Calibration, known: Mapping[str, Any]) -> dict[str, float | None]:
    """Rebound straight from the times, without a model of the contact.

    First impact: flight time over twice the fall time, which needs the height.
    Second: second flight over the first, which does not. Contact times are
    left out of the flights.
    """
    parts = [float(c(found.fit_reference.restitution)) for c in found.reference.contact_s]
    since = [0.0, *found.observed.times_s.tolist()]
    flights = [b - a - part for a, b, part in zip(since, since[1:], parts, strict=False)]
    return {
        "first_impact": flights[0] / (2.0 * known["fall_time_s"]),
        "second_impact": flights[1] / flights[0] if len(flights) > 1 else None,
    }


def put_for(drops: Drops, measured: Mapping[str, float]) -> list[dict[str, Any]]:
    """The deck value for the measured rebound, by modulus, step and contact option.

    The interval holds that of the measured rebound and the scatter of the drops.
    """
    rows, known = [], drops.known
    for purpose in PURPOSES:
        for option in (True, False):
            model = emulate(
                drops.select(purpose, option),
                known["height_m"],
                known["gravity_m_s2"],
                single=purpose == "reference",
            )
            own = NORMAL_95 * model.rebound_error
            value = measured["value"]
            low = value - math.hypot(value - measured["low"], own)
            high = value + math.hypot(measured["high"] - value, own)
            rows.append(
                {
                    "purpose": purpose,
                    "limit_force": option,
                    "used": purpose == "production" and option == known["limit_force"],
                    "value": model.inverse(value),
                    "low": model.inverse(low),
                    "high": model.inverse(high),
                }
            )
    return rows


def impact_rows(found: Calibration) -> list[dict[str, Any]]:
    """Rows of ``impacts.csv``: measured and simulated, impact by impact."""
    fit, observed, model = found.fit, found.observed, found.production
    scale = found.misfit.speed_scale(fit.restitution)
    rows = []
    for k, impact in enumerate(found.measured.impacts):
        since = float(observed.times_s[k - 1]) if k else 0.0
        simulated = _simulated_time(model, found.reference, fit.restitution, scale, k)
        rows.append(
            {
                "impact": k + 1,
                "time_since_first_s": since,
                "time_since_first_std_s": math.sqrt(observed.covariance[k - 1, k - 1])
                if k
                else 0.0,
                "simulated_time_since_first_s": simulated,
                "simulated_time_since_first_std_s": float(np.linalg.norm(model.errors[:k])),
                "peak_force_n": float(observed.peaks_n[k]),
                "peak_force_std_n": float(observed.peaks_n[k] * observed.peaks_std[k]),
                "peak_over_first": float(observed.peaks_n[k] / observed.peaks_n[0]),
                "peak_over_first_std": _ratio_std(found, k),
                "simulated_peak_over_first": (
                    float(math.exp(model.log_peaks[k - 1](math.log(fit.restitution)))) if k else 1.0
                ),
                "largest_sample_n": impact.peak_n,
                "peak_correction": 1.0 / found.samplings[k].peak_ratio,
                "samples": impact.samples,
                "width_s": impact.width_s,
                "simulated_width_s": found.samplings[k].width_s,
            }
        )
    return rows


def _ratio_std(found: Calibration, k: int) -> float:
    ratio = float(found.observed.peaks_n[k] / found.observed.peaks_n[0])
    std = found.observed.peaks_std
    return ratio * math.hypot(float(std[0]), float(std[k])) if k else 0.0


def _simulated_time(
    model: Emulator, reference: Emulator, restitution: float, scale: float, impact: int
) -> float:
    flights = sum(float(f(restitution)) for f in model.flights_s[:impact]) * scale
    return flights + sum(float(c(restitution)) for c in reference.contact_s[:impact])


def confirmed(drops: Drops) -> dict[str, Any]:
    """Rebound of the production drops at the fitted value, and its standard error."""
    rebound = np.array([run.rebound[:IMPACTS].mean() for run in drops.select("confirm")])
    if len(rebound) < 2:
        raise TableError("there are no confirming drops; run `dragdeck drops STUDY confirm`")
    std = float(rebound.std(ddof=1))
    return {
        "restitution": drops.select("confirm")[0].restitution,
        "drops": len(rebound),
        "effective": float(rebound.mean()),
        "se": std / math.sqrt(len(rebound)),
        "std": std,
    }


def full_drop(drops: Drops) -> DropRun:
    """The drop at full modulus among the confirming ones."""
    return drops.select("reference")[0]


def write_trials(drops_file: Path, trials_file: Path, seed: int, records: int, out: Path) -> Path:
    """Recover known values from records of simulated drops; write ``trials.csv`` and ``.json``."""
    runs = read_drops(trials_file).select("trial")
    rows = run_trials(runs, prepare(read_drops(drops_file)), seed, records)
    _write_csv(out.with_suffix(".csv"), pd.DataFrame(rows))
    summary = {
        "schema": SCHEMA,
        "seed": seed,
        "drops": len(runs),
        "records_per_drop": records,
        "refused": sum(row["refused"] is not None for row in rows),
        "deck": coverage([row["deck_held"] for row in rows]),
        "effective": coverage([row["effective_held"] for row in rows]),
    }
    return _write_json(out, summary)


def write_synthetic(trials_file: Path, name: str, sensor: Sensor, seed: int, out: Path) -> Path:
    """Write a record of a simulated drop as a CSV that says what it is.

    Raises
    ------
    TableError
        There is no such drop.
    """
    listed = json.loads(trials_file.read_text(encoding="utf-8"))["drops"]
    folders = [row["folder"] for row in listed]
    if name not in folders:
        raise TableError(f"{trials_file}: no drop {name!r}; there are: {', '.join(folders)}")
    run = read_drops(trials_file).runs[folders.index(name)]
    record = record_of(run, sensor, np.random.default_rng(seed))
    effective = float(run.rebound[:IMPACTS].mean())
    out.write_text(_synthetic_text(record, run, sensor, seed, effective), encoding="utf-8")
    return out


def _synthetic_text(
    record: Record, run: DropRun, sensor: Sensor, seed: int, effective: float
) -> str:
    option = "on" if run.limit_force else "off"
    head = [
        "# SYNTHETIC: no measurement. A drop of the engine as a force sensor would show it.",
        f"# engine: restitution {run.restitution:g} in the deck, limitForce {option},",
        f"#   modulus times {run.youngs_modulus_scale:g}, step {run.timestep_fraction:.2%} of the",
        f"#   Rayleigh time, height {run.height_m * 1e3:.4f} mm; it rebounds with {effective:.5f}",
        f"# sensor: {sensor.rate_hz:g} Hz, noise {sensor.noise_n:g} N (standard deviation),",
        f"#   offset {sensor.offset_n:g} N, drift {sensor.drift_n_per_s:g} N/s,",
        f"#   resolution {sensor.resolution_n:g} N, seed {seed}",
        "# how it was made: docs/calibration.md",
        "time_s,force_n",
    ]
    digits = max(0, math.ceil(-math.log10(sensor.resolution_n))) if sensor.resolution_n else 6
    stamps = max(0, math.ceil(-math.log10(0.1 * record.interval_s)))
    rows = [
        f"{time:.{stamps}f},{force:.{digits}f}"
        for time, force in zip(record.time_s, record.force_n, strict=True)
    ]
    return "\n".join([*head, *rows]) + "\n"


def _write_json(file: Path, content: Mapping[str, Any]) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    draft = file.with_name(file.name + ".part")
    draft.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    draft.replace(file)
    return file


def _write_csv(file: Path, table: pd.DataFrame) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    draft = file.with_name(file.name + ".part")
    table.to_csv(draft, index=False, float_format="%.9g")
    draft.replace(file)


def calibrate_command(record: Path, drops_file: Path, out_dir: Path) -> str:
    """Fit a drop test as the command line asks for; what to put into the study."""
    result = json.loads(write_calibration(record, drops_file, out_dir).read_text())
    fit, put = result["fit"], result["put"]
    return (
        f"put restitution: {put['value']:g} into {put['field'].removesuffix('.restitution')}\n"
        f"  95 % interval {fit['low']:.4f} to {fit['high']:.4f}\n"
        f"  the particle then rebounds with {result['effective']:.4f}; measured "
        f"{result['measured']['value']:.4f}"
    )
