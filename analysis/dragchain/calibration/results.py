"""What a calibration of the restitution says: its document and its tables."""

import math

import numpy as np
import pandas as pd

from dragchain.calibration.drops import DropTestOfStudy
from dragchain.calibration.fit import Fit, RecordFit
from dragchain.calibration.measured_impacts import MeasuredImpacts
from dragchain.calibration.simulated_drops import Drops
from dragchain.errors import TableError
from dragchain.statistics.estimate import Estimate
from dragdeck.documents import Document


class CalibrationFile(Document):
    """The content of ``result.json``; docs/evidence/calibration.md explains it.

    Attributes
    ----------
    fit, fit_full : Fit
        At the production settings, and at the physical modulus.
    measured : Estimate
        Measured coefficient of restitution.
    effective : float
        Effective restitution of the production drop at the fitted value.
    width_ratio : float
        Ratio of the widths of the first impact, measured / simulated with the same sampling.
    correction : float
        Fitted input value minus measured restitution.
    known : DropTestOfStudy
        The study and its drop test.
    put : float
        The value to set in the study as the restitution of the pair.
    peaks_compared : bool
        Whether peak forces were fitted too.
    record : MeasuredImpacts
        Impacts of the measured record.
    """

    remedy = "make it with: ./run calibrate"

    fit: Fit
    fit_full: Fit
    known: DropTestOfStudy
    put: float
    measured: Estimate
    effective: float
    peaks_compared: bool
    width_ratio: float
    correction: float
    record: MeasuredImpacts


def result(fit: RecordFit) -> CalibrationFile:
    """Content of ``result.json``."""
    full, drops, deck = fit.fit_reference, fit.drops, fit.fit.restitution
    put_at_full = Estimate(full.restitution, full.ci95_low, full.ci95_high)
    measured = put_at_full.mapped(drops.reference.rebound)
    return CalibrationFile(
        known=drops.known,
        put=_rounded(fit.fit),
        measured=measured,
        effective=drops.production.rebound(deck),
        fit=fit.fit,
        fit_full=full,
        peaks_compared=fit.with_peaks,
        width_ratio=fit.width_ratio,
        correction=deck - measured.value,
        record=fit.measured,
    )


def _rounded(fit: Fit) -> float:
    """The deck value with as many decimals as its interval warrants, two at the least."""
    width = max(fit.ci95_high - fit.ci95_low, 1e-9)
    return round(fit.restitution, max(2, math.ceil(-math.log10(width)) + 1))


def bias_table(drops: Drops) -> pd.DataFrame:
    """Effective against deck restitution for each purpose."""
    setting = ["purpose", "restitution_deck"]
    rows = [
        (run.drop.purpose, run.drop.restitution, rebound)
        for run in drops.runs
        for rebound in run.rebound
    ]
    table = pd.DataFrame(rows, columns=[*setting, "rebound"]).groupby(setting)["rebound"]
    return table.agg(
        restitution_effective="mean", lowest="min", highest="max", impacts="size"
    ).reset_index()


def impact_table(fit: RecordFit) -> pd.DataFrame:
    """Measured and simulated impacts, one row each."""
    observed, sampling, impacts = fit.observed, fit.sampling, fit.measured.impacts
    model, deck, count = fit.drops.production, fit.fit.restitution, len(impacts)
    ratio = observed.peaks_n / observed.peaks_n[0]
    ratio_std = ratio * np.hypot(observed.peaks_std[0], observed.peaks_std)
    scale = math.sqrt(fit.fit.height_m / fit.drops.known.height_m)
    parts = scale * model.flights_s(deck) + fit.drops.reference.contact_s(deck)
    return pd.DataFrame(
        {
            "impact": range(1, count + 1),
            "time_since_first_s": [0.0, *observed.times_s],
            "time_since_first_std_s": [0.0, *np.sqrt(np.diag(observed.covariance)[: count - 1])],
            "simulated_time_since_first_s": [0.0, *np.cumsum(parts)[: count - 1]],
            "simulated_time_since_first_std_s": [
                float(np.linalg.norm(model.errors[:k])) for k in range(count)
            ],
            "peak_force_n": observed.peaks_n,
            "peak_force_std_n": observed.peaks_n * observed.peaks_std,
            "peak_over_first": ratio,
            "peak_over_first_std": [0.0, *ratio_std[1:]],
            "simulated_peak_over_first": [1.0, *np.exp(model.log_peaks(deck)[: count - 1])],
            "largest_sample_n": [impact.peak_n for impact in impacts],
            "peak_correction": 1.0 / sampling.peak_ratio,
            "samples": [impact.samples for impact in impacts],
            "width_s": [impact.width_s for impact in impacts],
            "simulated_width_s": sampling.width_s,
        }
    )


def confirmed(drops: Drops) -> dict[str, float]:
    """Rebound of the production drops at the fitted value: mean, standard error and deviation.

    Raises
    ------
    TableError
        There are fewer than two.
    """
    runs = drops.select("confirm")
    if len(runs) < 2:
        raise TableError("the confirming drop tests are missing; run `./run calibrate`")
    rebound = np.array([run.effective for run in runs])
    std = float(rebound.std(ddof=1))
    return {
        "restitution": runs[0].drop.restitution,
        "drops": len(runs),
        "effective": float(rebound.mean()),
        "se": std / math.sqrt(len(runs)),
        "std": std,
    }
