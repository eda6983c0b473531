"""``advice.json``: settings for a tolerance, and what they are expected to cost."""

from collections.abc import Mapping

from dragdeck.documents import Document
from dragdeck.parts import Part
from dragdeck.records.advised import AdvisedSettings
from dragdeck.study.base import Json
from dragdeck.study.fidelity import Fidelity


class SettingsOfOption(Fidelity):
    """The settings of an option, with the MPI ranks of its runs.

    Attributes
    ----------
    ranks : int
        MPI ranks.
    """

    ranks: int


class OptionEntry(Part):
    """An option of ``advice.json``: settings and their expected cost.

    Attributes
    ----------
    role : str
        ``advised`` or ``reference``.
    settings : SettingsOfOption
        Settings of filling and process.
    drop_timestep_fraction : float or None
        Time step of the drop test as a fraction of the Rayleigh time.
    error : float or None
        Largest measured error of a drop test.
    relative_cost : float
        CPU time / CPU time of a plain run at the physical modulus.
    inputs : mapping
        Inputs of the process run, as in its ``case.json``.
    steps, wall_time_s, steps_per_s : mapping
        Expected steps, wall-clock time (s) and speed, by scene.
    source : str
        Where the speed comes from.
    """

    role: str
    settings: SettingsOfOption
    drop_timestep_fraction: float | None
    error: float | None
    relative_cost: float
    inputs: Json
    steps: Mapping[str, int]
    wall_time_s: Mapping[str, float]
    steps_per_s: Mapping[str, float]
    source: str


class WayEntry(Part):
    """A way to the quantities: to the physical modulus, or to a machine by a smaller scene.

    Attributes
    ----------
    name : str
    half_width : float or None
        Expected relative half-width of the 95 % interval, the largest of the quantities; None where
        other scenes say nothing of one.
    relative_cost : float
        CPU time / CPU time of a plain run at the physical modulus, or of the whole machine.
    """

    name: str
    half_width: float | None
    relative_cost: float


class AdvisedCase(Part):
    """A case of ``advice.json``: its process run and its options.

    Attributes
    ----------
    case, run : str
        Name of the case, and its run id.
    asked : AdvisedSettings
        The tolerance, and what it costs.
    options : sequence of OptionEntry
        The advised settings first.
    ways : sequence of WayEntry
        What could be done, the cheapest way first.
    smaller_scenes : sequence of WayEntry
        The machine and what could stand for it, the cheapest first; empty if nothing could.
    """

    case: str
    run: str
    asked: AdvisedSettings
    options: tuple[OptionEntry, ...]
    ways: tuple[WayEntry, ...] = ()
    smaller_scenes: tuple[WayEntry, ...] = ()


class AdviceFile(Document):
    """``advice.json``: settings for a tolerance, with their expected cost.

    Attributes
    ----------
    date : str
        Date on which it was written.
    cases : sequence of AdvisedCase
        One entry per process run.
    """

    remedy = "make it with: ./run dragdeck advise"

    study: str
    date: str
    versions: Mapping[str, str | None]
    cases: tuple[AdvisedCase, ...]
