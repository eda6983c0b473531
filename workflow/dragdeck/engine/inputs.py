"""What the runner reads of a run's ``case.json``."""

from collections.abc import Mapping, Sequence

from dragdeck.decks.case_file import (
    CountOfRun,
    Phase,
    RanksOfRun,
    SettlingCriterion,
    SteadyCriterion,
)
from dragdeck.documents import Document
from dragdeck.physics.run_limits import RunLimits


class RunInputs(Document):
    """What the runner reads of ``case.json``.

    Attributes
    ----------
    entry_step : int
        At which the run begins.
    marks : sequence of str
        Files of states from which other runs go on.
    settled : SettlingCriterion or None
        Of a run that must end with a bed at rest.
    steady : SteadyCriterion or None
        Of a run with a rotating bowl.
    limits : RunLimits or None
        Of a run that is watched.
    """

    remedy = "write it with: dragdeck step render"

    scene: str
    run: str
    fidelity: RanksOfRun
    media: CountOfRun
    phases: Sequence[Phase] = ()
    entry_step: int = 0
    marks: Sequence[str] = ()
    files: Mapping[str, str]
    settled: SettlingCriterion | None = None
    steady: SteadyCriterion | None = None
    limits: RunLimits | None = None
