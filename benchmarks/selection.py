"""How often picking the cheapest of many settings breaks a promise (winner's curse).

    python benchmarks/selection.py --draws 500

The recorded errors are taken for the truth. The trade-off is then measured again and again by
chance: the error of each setting is drawn about its truth with its standard error, of which the
uncertainty of the reference is common to all. The advisor picks from each of these records. A
promise is broken if the true error of what it picked exceeds the tolerance. A bound of 95 % breaks
in at most 5 % of the records for a setting that is fixed beforehand, and in more if picking favours
settings whose errors happen to look small.
"""

import argparse
import math
from pathlib import Path

import numpy as np

from dragdeck.advice.advise import advise
from dragdeck.outlook.measured import MeasuredError, Tradeoff, measured_tradeoff
from dragdeck.project import Project
from dragdeck.study.model import Tolerance

QUANTITIES = (
    "drag_mean",
    "workpiece_contacts",
    "contact_force_mean",
    "contact_force_p90",
    "coordination_number",
    "chain_count",
)
TOLERANCES = (0.05, 0.1, 0.15, 0.2)

ONE_SIDED = 1.645 / 1.960
"""Reach of a one-sided bound of 95 % over half of a two-sided interval."""


def measured_again(
    error: MeasuredError, shift: float, common: float, chance: float
) -> MeasuredError:
    """An error as another measurement of it would have been.

    `shift` is what the reference errs by this time, `common` its standard error, `chance` a
    standard normal number.
    """
    truth = math.log1p(error.value)
    own = math.sqrt(max((error.se / (1 + error.value)) ** 2 - common**2, 0.0))
    value = truth + shift + own * chance
    reach = ONE_SIDED * (math.log1p(error.ci95_high) - math.log1p(error.ci95_low)) / 2
    bound = max(abs(math.expm1(value - reach)), abs(math.expm1(value + reach)))
    return error.model_copy(update={"value": math.expm1(value), "bound": bound})


def record_again(tradeoff: Tradeoff, quantity: str, rng: np.random.Generator) -> Tradeoff:
    """The trade-off as another campaign would have measured one of its quantities."""
    common = tradeoff.quantities[quantity].se or 0.0
    shift = common * rng.standard_normal()
    settings = []
    for one in tradeoff.settings:
        error = one.errors.get(quantity)
        if error is not None and error.se > 0:
            error = measured_again(error, shift, common, rng.standard_normal())
            one = one.model_copy(update={"errors": {**one.errors, quantity: error}})
        settings.append(one)
    return tradeoff.model_copy(update={"settings": tuple(settings), "stiffness": None})


def main() -> None:
    """Print, for each quantity and tolerance, how often the promise is broken."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=500, help="records (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of chance (default: %(default)s)")
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    tradeoff = measured_tradeoff()
    case = Project(Path(__file__).parents[1]).cases("uhlmann2015")[0]
    print("| quantity | tolerance | reference taken | settings picked | promise broken |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for quantity in QUANTITIES:
        records = [record_again(tradeoff, quantity, rng) for _ in range(asked.draws)]
        for tolerance in TOLERANCES:
            wanted = Tolerance(tolerance=tolerance, quantity=quantity)
            picks = [advise(case, wanted, record).chosen for record in records]
            truths = [
                true.errors[quantity].value
                for pick, record in zip(picks, records, strict=True)
                for one, true in zip(record.settings, tradeoff.settings, strict=True)
                if pick.error is not None and pick.error is one.errors.get(quantity)
            ]
            found = sum(pick.error is not None for pick in picks)
            assert len(truths) == found, "a picked setting is none that was measured"
            share = sum(abs(truth) > tolerance for truth in truths) / asked.draws
            se = math.sqrt(share * (1 - share) / asked.draws)
            kinds = len({str(pick) for pick in picks})
            print(
                f"| {tradeoff.label(quantity)} | {100 * tolerance:g} % | "
                f"{100 * (1 - found / asked.draws):.0f} % | {kinds} | "
                f"{100 * share:.1f} +- {196 * se:.1f} % |",
                flush=True,
            )


if __name__ == "__main__":
    main()
