"""What was found on peaks and chains, in plain sentences made from the numbers."""

from __future__ import annotations

import math
from typing import Any

Found = dict[str, Any]

HOLDS = ("proved", "supported")
FREE = "free_path"


def answer(found: Found) -> list[str]:
    """The sentences that answer the question, the short answer first."""
    return [
        _short(found),
        _existence(found),
        _strength(found),
        _dominance(found),
        _coverage(found),
        _order(found),
        _orientation(found),
        _altitude(found),
        _life(found),
    ]


def _verdict(found: Found, statement: str) -> str:
    return str(next(s["verdict"] for s in found["statements"] if s["statement"] == statement))


def row_of(found: Found, definition: str, descriptor: str, peaks: str = "all") -> Found:
    """The test of a descriptor at the default thresholds."""
    row: Found = next(
        row
        for row in found["tests"]
        if row["default"]
        and (row["definition"], row["descriptor"], row["peaks"]) == (definition, descriptor, peaks)
    )
    return row


def _short(found: Found) -> str:
    stronger = _verdict(found, "presence") in HOLDS
    most = _verdict(found, "coverage") in HOLDS
    only = _verdict(found, "reverse") in HOLDS
    if not stronger:
        return (
            "These runs do not show it: that the chain from workpiece to "
            "bowl is stronger at a peak than at other times could not be told from chance."
        )
    if most and only:
        return (
            "Yes, as far as occurring together can: most peaks come "
            "with a strong chain and most strong chains with a peak."
        )
    coverage, reverse = row_of(found, FREE, "coverage"), row_of(found, FREE, "reverse")
    parts = [
        f"{_percent(coverage['effect'])} of the peaks come with a strong chain"
        if most
        else _limit(coverage, "peaks", "a strong chain"),
        f"{_percent(reverse['effect'])} of the strong chains come with a peak"
        if only
        else _limit(reverse, "strong chains", "a peak"),
    ]
    return (
        "In part. At a peak the chain from workpiece to bowl is stronger "
        "than at other times, by more than chance; " + ", and ".join(parts) + "."
    )


def _limit(row: Found, events: str, others: str) -> str:
    """Say why a share does not carry the statement that most events come with the other."""
    fraction = f"{_percent(row['effect'])} of the {events} come with {others}"
    if row["effect"] is not None and row["effect"] > 0.5:
        return f"that {fraction} could be chance"
    return f"only {fraction}"


def _existence(found: Found) -> str:
    row = row_of(found, "widest_path", "exists")
    return (
        "That there is a chain says little: a path from workpiece to bowl whose every "
        "contact is above "
        f"the mean is there in {_percent(row['at_all_times'])} of all frames, and in "
        f"{_percent(row['at_peaks'])} of those at peaks. What can differ is how strong it is."
    )


def _strength(found: Found) -> str:
    row, rank = row_of(found, FREE, "bottleneck_over_mean"), found["ranks"]["all"][FREE]
    return (
        f"The weakest contact of the chain, the forces on the workpiece left out, is at peaks "
        f"{_number(row['at_peaks'])} times the mean contact force, and at all times "
        f"{_number(row['at_all_times'])} times: {_effect(row)}. The chain of a peak is stronger "
        f"than {_percent(rank['mean'])} of its run's on average (50 % by chance); "
        f"{_percent(rank['above_half'])} of the peaks have a chain above the median."
    )


def _dominance(found: Found) -> str:
    row, ratio = row_of(found, FREE, "stands_out"), row_of(found, FREE, "bottleneck_over_drag")
    fraction = row_of(found, "widest_path", "workpiece_fraction")
    return (
        "Does the chain stand out, or do all forces around the workpiece rise together? "
        "Over the root "
        "mean square force between the particles on the workpiece and their neighbours, its "
        "weakest contact "
        f"differs by {_effect(row)}; over the drag itself, which errs against the claim, by "
        f"{_effect(ratio)}. The chain's own "
        f"contact on the workpiece bears {_percent(fraction['at_peaks'])} of the drag at peaks and "
        f"{_percent(fraction['at_all_times'])} at all times; the rest is borne by other contacts."
    )


def _coverage(found: Found) -> str:
    peaks, chains = row_of(found, FREE, "coverage"), row_of(found, FREE, "reverse")
    limits = found["limits"]
    return (
        f"A strong chain (by {limits['strong_stds']:g} standard deviation) is within "
        f"{limits['near_s']:g} s of {_percent(peaks['effect'])} of the peaks "
        f"({_percent(peaks['expected'])} by chance, {_claimed(peaks)}). Of the strong chains, each "
        f"at its strongest, {_percent(chains['effect'])} have a peak as near "
        f"({_percent(chains['expected'])} by chance, {_claimed(chains)})."
    )


def _order(found: Found) -> str:
    order, left = row_of(found, FREE, "order"), row_of(found, FREE, "left_s")
    curve = found["lags"][FREE]["bottleneck_over_mean"]
    above = curve["above_s"]
    when = (
        "does not leave the band that chance keeps"
        if above is None
        else f"is above the band that chance keeps from {above[0]:+.2f} to {above[1]:+.2f} s"
    )
    return (
        f"Around a peak the chain's strength {when}, and is largest at {curve['peak_lag_s']:+.2f} "
        f"s. Before the peak less after it ({found['limits']['aside_s'][0]:g} to "
        f"{found['limits']['aside_s'][1]:g} s) it differs by {_effect(order)}. The chain of a peak "
        f"lasts {_milliseconds(left['at_peaks'])} more, that of any moment "
        f"{_milliseconds(left['at_all_times'])}: {_effect(left)}."
    )


def _orientation(found: Found) -> str:
    here = found["geometry"]["widest_path"]
    turned = row_of(found, FREE, "resultant")
    angle = here["at_peaks"]["azimuth_mean_rad"]
    return (
        f"At peaks the chains point {_side(angle, found)} on average "
        f"({_side(here['at_all_times']['azimuth_mean_rad'], found)} at all times). The resultant "
        f"of their azimuths is {_number(turned['effect'])} (1: all point one way), "
        f"{_number(turned['expected'])} by chance, {_claimed(turned)}. Their inclination "
        f"varies by {_degrees(here['at_peaks']['inclination_std_rad']['value'])} (standard "
        f"deviation) about {_degrees(here['at_peaks']['inclination_mean_rad']['value'])}."
    )


def _side(angle: float | None, found: Found) -> str:
    if angle is None:
        return "nowhere"
    side = "right" if angle < 0 else "left"
    senses = {run["sense"] for run in found["runs"]}
    words = f"{abs(math.degrees(angle)):.0f}° to the {side} of the motion"
    if len(senses) != 1 or 0 in senses:
        return words
    outward = angle * next(iter(senses)) < 0
    return words + (", towards the bowl's side" if outward else ", towards the bowl's middle")


def _altitude(found: Found) -> str:
    here = found["geometry"]["widest_path"]
    peak, usual = here["at_peaks"], here["at_all_times"]
    return (
        f"The altitude of the chains varies: at peaks it is {_height(peak['altitude_mean_m'])} mm "
        f"with a standard deviation of {_spread(peak['altitude_std_m'])} mm, at all times "
        f"{_height(usual['altitude_mean_m'])} and {_spread(usual['altitude_std_m'])} mm."
    )


def _life(found: Found) -> str:
    life = found["lifetimes"]["widest_path"]
    return (
        f"The dominant chain stays the same for {_milliseconds(life['median_s'])} (median of "
        f"{life['lives']} lives, {life['cut']} of them cut off by the ends of the runs; the "
        f"longest {_milliseconds(life['longest_s'])}). One seen at a peak lasts "
        f"{_milliseconds(life['seen_at_peaks_s']['value'])} in all on average, one seen at any "
        f"moment {_milliseconds(life['seen_at_all_times_s']['value'])}."
    )


# --- numbers ---------------------------------------------------------------------------------


def _effect(row: Found) -> str:
    if row["effect"] is None:
        return "no number, as it never varies"
    known = row["ci95_low"] is not None
    span = f" ({row['ci95_low']:+.2f} to {row['ci95_high']:+.2f} over the fills)" if known else ""
    return f"{row['effect']:+.2f} standard deviations{span}, {_claimed(row)}"


def _claimed(row: Found) -> str:
    holm = "" if row["p_holm"] is None else f", {_p(row['p_holm'])} after Holm"
    return _p(row["p_claimed"]) + holm


def _p(value: float | None) -> str:
    if value is None:
        return "no p"
    return f"p = {value:.2g}" if value >= 1e-4 else "p < 0.0001"


def _percent(fraction: float | None) -> str:
    return "none" if fraction is None else f"{100.0 * fraction:.0f} %"


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.3g}"


def _degrees(value: float | None) -> str:
    return "none" if value is None else f"{math.degrees(value):.0f}°"


def _milliseconds(value: float | None) -> str:
    return "none" if value is None else f"{1e3 * value:.0f} ms"


def _height(row: Found) -> str:
    if row["value"] is None:
        return "no"
    if row["ci95_low"] is None:
        return f"{1e3 * row['value']:.1f}"
    return f"{1e3 * row['value']:.1f} ({1e3 * row['ci95_low']:.1f} to {1e3 * row['ci95_high']:.1f})"


def _spread(row: Found) -> str:
    return "no" if row["value"] is None else f"{1e3 * row['value']:.1f}"
