"""Verdicts on the paper's statements about peaks and chains.

A statement is judged by its tests at the default thresholds that contain no force on the workpiece;
for a definition without such a test, by those in which it only decides which chain counts.

A test supports it with a p-value below `LEVEL` after Holm's adjustment for all tests of claims, and
the sign claimed at most thresholds; a statement about most peaks or most chains must also find a
fraction above one half.

Confirmed
    A test supports it, and all of them contain no force on the workpiece and have the sign claimed
    at every threshold, and their intervals over the packings exclude a zero effect.
Contradicted
    No test supports it, and the interval over the packings of each lies below `SMALL` standard
    deviations (of a fraction, below one half; of the orientation, below chance).
Not confirmed
    Anything else; `Judgement.supported` says whether a test supports it.

A ratio with the drag below the line can support a statement, for it errs against the claim, but not
contradict it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import get_args

from dragchain.documents import Part
from dragchain.statistics.estimate import Real, Verdict
from evidence.validation.peaks.settings import DEFINITIONS, Definition
from evidence.validation.peaks.tests import FRACTIONS, ORIENTATION, BuiltIn, PeakTest, Statement

LEVEL = 0.05
SMALL = 0.2
"""An effect below this many standard deviations is small (Cohen 1988)."""

_FREE: Definition = "free_path"
"""The only definition free of what is built in: its verdict is that of a statement."""


class Outcome(Part):
    """What one test at the default thresholds, with its like at the others, says of a statement.

    Attributes
    ----------
    descriptor, label, built_in, effect, p_holm
        Of the test.
    as_claimed, thresholds : int
        Number of thresholds at which the effect has the sign claimed, and of all thresholds.
    supports, confirms, contradicts : bool
    """

    descriptor: str
    label: str
    built_in: BuiltIn
    effect: Real
    p_holm: Real
    as_claimed: int
    thresholds: int
    supports: bool
    confirms: bool
    contradicts: bool


class Judgement(Part):
    """The verdict for one definition, and what is built in the tests that it rests on.

    Attributes
    ----------
    supported : bool
        Whether a test supports the statement.
    """

    verdict: Verdict
    supported: bool
    built_in: BuiltIn
    tests: tuple[Outcome, ...]


class StatementVerdict(Part):
    """A statement with its verdict, that of the path that leaves out forces on the workpiece."""

    statement: Statement
    verdict: Verdict
    by_definition: Mapping[Definition, Judgement]


def judge(tests: Sequence[PeakTest]) -> tuple[StatementVerdict, ...]:
    """Judge every statement for every definition."""
    claims = [test for test in tests if test.peaks == "all" and test.claim]
    verdicts = []
    for statement in get_args(Statement):
        about = [test for test in claims if test.statement == statement]
        cells = {
            name: _judgement([t for t in about if t.definition == name]) for name in DEFINITIONS
        }
        verdict = cells[_FREE].verdict
        verdicts.append(StatementVerdict(statement=statement, verdict=verdict, by_definition=cells))
    return tuple(verdicts)


def _judgement(tests: Sequence[PeakTest]) -> Judgement:
    levels = {test.built_in for test in tests}
    order: tuple[BuiltIn, ...] = ("none", "choice", "value")
    level: BuiltIn = next((name for name in order if name in levels), "none")
    judged = [test for test in tests if test.built_in in (level, "against")]
    outcomes = [
        _outcome(test, judged) for test in judged if test.default and not math.isnan(test.p_claimed)
    ]
    return Judgement(
        verdict=_verdict(outcomes, level),
        supported=any(outcome.supports for outcome in outcomes),
        built_in=level,
        tests=tuple(outcomes),
    )


def _verdict(outcomes: Sequence[Outcome], level: BuiltIn) -> Verdict:
    full = [outcome for outcome in outcomes if outcome.built_in != "against"]
    if any(outcome.supports for outcome in outcomes):
        confirmed = level == "none" and full and all(outcome.confirms for outcome in full)
        return "confirmed" if confirmed else "not confirmed"
    contradicted = full and all(outcome.contradicts for outcome in full)
    return "contradicted" if contradicted else "not confirmed"


def _outcome(test: PeakTest, judged: Sequence[PeakTest]) -> Outcome:
    like = [t for t in judged if t.descriptor == test.descriptor and not math.isnan(t.effect)]
    as_claimed = sum((t.effect - t.expected) * t.claim > 0 for t in like)
    fraction = test.descriptor in FRACTIONS
    significant = test.p_holm < LEVEL and as_claimed > 0.5 * len(like)
    supports = significant and (not fraction or test.effect > 0.5)
    zero = 0.5 if fraction else test.expected
    low, high = sorted((edge - zero) * test.claim for edge in (test.ci95_low, test.ci95_high))
    small = 0.0 if fraction or test.descriptor == ORIENTATION.name else SMALL
    numbers = {
        "as_claimed": as_claimed,
        "thresholds": len(like),
        "supports": supports,
        "confirms": supports and as_claimed == len(like) and low > 0.0,
        "contradicts": not supports and high < small,
    }
    return Outcome.model_validate({**dict(test), **numbers})
