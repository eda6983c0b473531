"""Tables and page of the verification suite."""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import get_args

import pandas as pd

from dragchain.errors import TableError
from dragchain.figures.style import drawing, png
from dragchain.report.page import data_uri, render_page, write_bundle
from dragchain.tables.by_step import read_table
from dragdeck.errors import RejectedRunError
from dragdeck.physics.damping import tangential_damping_ratio
from evidence.contact_law.impact import limited_restitution
from evidence.verification.checks import CHECKS, JUDGED, Verdict, judge
from evidence.verification.collide import CollideCase
from evidence.verification.figures import draw
from evidence.verification.published import published
from evidence.verification.recording import Recording, read_recording

_BY_SERIES = ["number", "test", "series", "quantity", "against"]

Rows = Sequence[Mapping[Hashable, object]]


@dataclass(frozen=True)
class Section:
    """A test on the page.

    Attributes
    ----------
    case : CollideCase
        Of one of its runs.
    picture : str
        Its figure as a data URI.
    same, others : sequence of rows
        Comparisons with the law that the engine claims to compute, and with others.
    steps : list of int
        Time steps in the shortest contact of its runs.
    """

    case: CollideCase
    picture: str
    same: Rows
    others: Rows
    steps: Sequence[int]


@dataclass(frozen=True)
class TwoSpins:
    """Scaled spins at one scaled patch velocity, read off the published points of two tests."""

    patch: float
    tangential: float
    angle: float


def write_verification(out_dir: Path, run_dirs: Sequence[Path]) -> None:
    """Judge the runs of the suite and write its tables and its page.

    Writes ``checks.csv`` and ``checks.parquet`` (one row per comparison), ``verification.csv`` and
    ``verification.parquet`` (one row per quantity of a series: its worst comparison) and
    ``verification.html``.

    Parameters
    ----------
    out_dir : Path
        Made if need be.
    run_dirs : sequence of Path
        Folders of runs of the `collide` scene.

    Raises
    ------
    RejectedRunError
        A run is not complete.
    TableError
        No run is given, or an impact is not whole.
    """
    if not run_dirs:
        raise TableError("no folder of a run is given, so there is nothing to verify")
    runs = [read_recording(folder) for folder in run_dirs]
    checks = judge(runs)
    summary = summarise(checks)
    write_bundle(
        out_dir,
        tables={"checks": checks, "verification": summary},
        pages={"verification": render(runs, summary)},
    )


def summarise(checks: pd.DataFrame) -> pd.DataFrame:
    """The worst comparison of each quantity of each series, with their number."""
    groups = [
        group.sort_values("error", kind="stable").tail(1).assign(points=len(group))
        for _, group in checks.groupby(_BY_SERIES, sort=False)
    ]
    return pd.concat(groups, ignore_index=True)


def counts(summary: pd.DataFrame) -> dict[str, int]:
    """How many rows have each verdict."""
    verdicts = summary["verdict"].tolist()
    return {name: verdicts.count(name) for name in get_args(Verdict)}


def verdict(report_dir: Path) -> str:
    """How many quantities have each verdict, in words.

    Raises
    ------
    RejectedRunError
        At least one failed: names each, with its error.
    TableError
        There is no summary.
    """
    summary = read_table(report_dir / "verification.parquet")
    said = ", ".join(f"{number} {name}" for name, number in counts(summary).items())
    bad = summary[summary["verdict"] == "fail"]
    if bad.empty:
        return said
    lines = [
        f"{row.test}, {row.series}, {row.quantity}: error {row.error:.2g}"
        f" (allowed: {row.tolerance:.2g})"
        for row in bad.itertuples()
    ]
    raise RejectedRunError("\n  ".join([f"{report_dir / 'verification.html'}: {said}", *lines]))


def render(runs: Sequence[Recording], summary: pd.DataFrame) -> str:
    """The page: HTML that needs no other file and no network."""
    order = list(CHECKS)
    ordered = sorted(runs, key=lambda run: (run.case.number, order.index(run.case.test)))
    by_test = {test: list(group) for test, group in groupby(ordered, key=lambda run: run.case.test)}
    return render_page(
        "verification/verification.html.j2",
        {
            "quantity": quantity,
            "limited_restitution": limited_restitution,
            "tangential_damping_ratio": tangential_damping_ratio,
        },
        "evidence",
        sections={test: _section(test, group, summary) for test, group in by_test.items()},
        spins=published_spins(by_test.get("oblique_angle"), by_test.get("oblique_tangential")),
        counts=counts(summary),
        failures=summary[summary["verdict"] == "fail"].to_dict("records"),
        runs=len(runs),
    )


def _section(test: str, runs: Sequence[Recording], summary: pd.DataFrame) -> Section:
    rows = summary[summary["test"] == test]
    judged = rows["against"].isin(JUDGED)
    with drawing():
        picture = data_uri(png(draw(test, runs)))
    return Section(
        case=runs[0].case,
        picture=picture,
        same=rows[judged].to_dict("records"),
        others=rows[~judged].to_dict("records"),
        steps=sorted({run.case.steps_per_contact for run in runs}),
    )


_SPIN_AT = 4.0
"""Scaled patch velocity at which the published spins of two tests are compared."""


def published_spins(
    angle: Sequence[Recording] | None, tangential: Sequence[Recording] | None
) -> TwoSpins | None:
    """The published spins of the tests over the angle and over the tangential speed.

    Both are scaled as the second is: surface speed by spin over friction times normal speed,
    against patch velocity over the same.
    """
    if not angle or not tangential:
        return None
    impact = angle[0].contacts[0]
    contact, before = impact.constants, impact.before
    inclined = math.atan(_SPIN_AT * contact.friction)
    normal = math.hypot(before.normal_m_s, before.tangential_m_s) * math.cos(inclined)
    spin = published("oblique_angle", angle[0].case.series, "spin_rad_s").at(math.degrees(inclined))
    own = published("oblique_tangential", tangential[0].case.series, "scaled_spin").at(_SPIN_AT)
    return TwoSpins(_SPIN_AT, own, contact.particle.radius_m * spin / (contact.friction * normal))


_UNITS = {
    "_rad_s2": "rad/s²",
    "_m_s2": "m/s²",
    "_rad_s": "rad/s",
    "_m_s": "m/s",
    "_deg": "degrees",
    "_n": "N",
    "_m": "m",
    "_s": "s",
}


def quantity(name: str) -> str:
    """A quantity's name in words, its unit in brackets."""
    for ending, unit in _UNITS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')} ({unit})"
    return name.replace("_", " ")
