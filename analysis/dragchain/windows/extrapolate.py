"""The quantities of one run, and at the physical Young's modulus where windows give them."""

from pathlib import Path

from dragchain.report.extrapolated import FILE, Extrapolated, ExtrapolatedQuantity, WindowsOfRun
from dragchain.run.case import load_case
from dragchain.tradeoff.path_blocks import quantities_along
from dragchain.tradeoff.quantities import QUANTITIES
from dragchain.windows.document import Round


def extrapolate_run(run_dir: Path, round_file: Path | None = None) -> None:
    """Write ``extrapolated.json`` of a run: its quantities, and what its windows make of them.

    Parameters
    ----------
    run_dir : Path
        A complete process run with tables and chains.
    round_file : Path, optional
        Last round of the windows of the run.

    Raises
    ------
    DocumentError
        If the round or the run's case cannot be used.
    TableError
        If a table is missing.
    """
    found = _windowed(Round.read(round_file)) if round_file else _as_simulated(run_dir)
    found.write(run_dir / FILE)


def _as_simulated(run_dir: Path) -> Extrapolated:
    values = quantities_along(run_dir, load_case(run_dir)).values()
    return Extrapolated(
        quantities=tuple(
            ExtrapolatedQuantity(
                name=one.name, label=one.label, unit=one.unit, measured=values[one.name]
            )
            for one in QUANTITIES
            if one.name in values
        )
    )


def _windowed(found: Round) -> Extrapolated:
    """The quantities of a run as its windows have them at physical stiffness."""
    return Extrapolated(
        windows=WindowsOfRun(
            tolerance=found.tolerance,
            asked=tuple(one.label for one in found.quantities if one.asked),
            reached=found.reached,
            runs=tuple(one.run for one in found.entering),
            refused={one.run: one.refused for one in found.windows if one.refused},
            needed=found.needed,
        ),
        quantities=tuple(
            ExtrapolatedQuantity(
                name=one.name,
                label=one.label,
                unit=one.unit,
                measured=one.soft,
                value=one.value,
                ci95_low=one.ci95_low,
                ci95_high=one.ci95_high,
            )
            for one in found.quantities
        ),
    )
