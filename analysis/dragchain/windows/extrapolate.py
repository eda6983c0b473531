"""The quantities of one run, and at the physical Young's modulus where it or windows give them."""

import math
from collections.abc import Iterator
from pathlib import Path

from dragchain.quantities.along import quantities_along
from dragchain.quantities.document import (
    EXTRAPOLATED,
    Extrapolated,
    ExtrapolatedQuantity,
    Need,
    Reached,
)
from dragchain.quantities.registry import COMPARED
from dragchain.windows.estimate import UNKNOWN, Round, WindowsRecord, of_one_run
from dragdeck.records.case import CaseOfRun, load_case


def extrapolate_run(run_dir: Path, record: Path, round_file: Path | None = None) -> None:
    """Write ``extrapolated.json`` of a run: its quantities, and what its windows make of them.

    Parameters
    ----------
    run_dir : Path
        A complete process run with tables and chains.
    record : Path
        ``windows.json``.
    round_file : Path, optional
        Last round of the windows of the run.

    Raises
    ------
    DocumentError
        If a document or the run's case cannot be used.
    TableError
        If a table is missing.
    """
    if round_file is not None:
        last = Round.read(round_file)
        found = Extrapolated(**{name: getattr(last, name) for name in Extrapolated.model_fields})
    else:
        found = _alone(run_dir, load_case(run_dir), WindowsRecord.read(record))
    found.write(run_dir / EXTRAPOLATED)


def _alone(run_dir: Path, case: CaseOfRun, record: WindowsRecord) -> Extrapolated:
    """The quantities of a run without windows."""
    quantities = tuple(_quantities(run_dir, case, record))
    asked = case.asked
    if asked is None or asked.error is not None:
        return Extrapolated(quantities=quantities)
    widths = {one.name: one.value.relative_half_width for one in quantities if one.value}
    worst = max(widths.get(name, math.inf) / asked.tolerance for name in asked.quantities)
    packings = math.ceil(worst**2) if math.isfinite(worst) else 1
    return Extrapolated(
        quantities=quantities,
        tolerance=Reached(
            tolerance=asked.tolerance,
            asked=asked.quantities,
            reached=worst <= 1.0,
            needed=Need(0, packings),
        ),
    )


def _quantities(
    run_dir: Path, case: CaseOfRun, record: WindowsRecord
) -> Iterator[ExtrapolatedQuantity]:
    along = quantities_along(run_dir, case)
    values = along.values()
    for one in COMPARED:
        if one.name in values:
            blocks = one.rooted(along.of_blocks(one.name))
            known = record.quantities.get(one.name, UNKNOWN)
            found = of_one_run(blocks, values[one.name], known)
            physical = found if case.fidelity.youngs_modulus_scale == 1.0 else None
            yield ExtrapolatedQuantity(
                name=one.name, label=one.label, unit=one.unit, measured=found, value=physical
            )
