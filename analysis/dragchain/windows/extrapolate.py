"""What the windows of a run give at the physical Young's modulus, and whether that is enough."""

from pathlib import Path

from dragchain.quantities.document import (
    EXTRAPOLATED,
    MEASURED_FILE,
    Extrapolated,
    Reached,
    RunQuantities,
)
from dragchain.windows.estimate import Round
from dragchain.windows.rounds import Asked, reached_by
from dragdeck.records.case import CaseOfRun, load_case


def extrapolate_run(run_dir: Path, packings: int = 1, round_file: Path | None = None) -> None:
    """Write ``extrapolated.json`` of a run.

    Parameters
    ----------
    run_dir : Path
        A process run with its quantities.
    packings : int
        Of its case, whose mean is to be inside the tolerance.
    round_file : Path, optional
        Last round of the windows of the run.

    Raises
    ------
    DocumentError
        If a document or the run's case cannot be used.
    """
    if round_file is not None:
        last = Round.read(round_file)
        said = {name: getattr(last, name) for name in Extrapolated.model_fields}
    else:
        quantities = RunQuantities.read(run_dir / MEASURED_FILE)
        said = {"tolerance": _reached(load_case(run_dir), quantities, packings)}
    Extrapolated(**said).write(run_dir / EXTRAPOLATED)


def _reached(case: CaseOfRun, quantities: RunQuantities, packings: int) -> Reached | None:
    """What a run without windows was asked for and reached, None if nothing was."""
    asked = case.asked
    if asked is None or asked.error is not None:
        return None
    if case.fidelity.youngs_modulus_scale != 1.0:
        quantities = quantities.model_copy(update={"values_of_run": {}})
    return reached_by(quantities, Asked(asked.tolerance, asked.quantities, packings=packings))
