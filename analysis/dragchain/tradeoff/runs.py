"""The runs of a trade-off: the setting of each, and its values over the path that all have."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import JsonValue

from dragchain.errors import TableError
from dragchain.run.case import changed_inputs
from dragchain.tradeoff.measures import FILE, Measures

_PARAMETERS = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
OTHER = "other"
"""The factor that holds all else a point changes."""

SILENT = (
    "seed",
    "motion.path.revolutions",
    "motion.path.length_m",
    "motion.path.fraction",
    "outputs.workpiece_contacts_hz",
    "outputs.network_hz",
)
"""Inputs that differ between runs without being a setting: what is written changes nothing."""


@dataclass(frozen=True)
class Setting:
    """What a point asks for, apart from seed and path."""

    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    other: str = ""

    def factors(self) -> dict[str, Hashable]:
        """Factor to level, as `Factors` wants them."""
        return {**self.parameters(), OTHER: self.other}

    @classmethod
    def of(cls, parameters: object, other: str = "") -> "Setting":
        """The setting of what has the parameters as attributes."""
        modulus, step, speed = (float(getattr(parameters, name)) for name in _PARAMETERS)
        return cls(modulus, step, speed, other)

    def parameters(self) -> dict[str, float]:
        """Fidelity parameter to level."""
        return {name: getattr(self, name) for name in _PARAMETERS}

    def __str__(self) -> str:
        parts = [
            f"E x {self.youngs_modulus_scale:g}",
            f"{100 * self.timestep_fraction:g} % of Rayleigh",
        ]
        if self.speed_factor != 1.0:
            parts.append(f"speed x {self.speed_factor:g}")
        return ", ".join([*parts, self.other] if self.other else parts)


@dataclass(frozen=True)
class Run:
    """A run of the trade-off.

    Attributes
    ----------
    setting : Setting
    bed : str or None
        Id of the filling.
    values : mapping of str to float
        Quantity to the run's value over the common path; empty if it failed.
    measures : Measures
    further : sequence of mapping of str to float
        The same over each further stretch of its path that is as long as the common one.
    """

    setting: Setting
    bed: str | None
    values: Mapping[str, float]
    measures: Measures
    further: Sequence[Mapping[str, float]] = ()

    @property
    def stretches(self) -> list[Mapping[str, float]]:
        """The values over every stretch of its path."""
        return [self.values, *self.further]

    @property
    def complete(self) -> bool:
        """Whether it ended well."""
        return self.measures.complete


def read_runs(files: Sequence[Path], reference_run: Path) -> tuple[list[Run], Setting, float]:
    """Read the runs of a trade-off.

    Of runs that differ in the length of their path alone the longest counts; one that is
    several times as long as the common path counts as several runs from its bed.

    Parameters
    ----------
    files : sequence of Path
        Their ``measures.json``.
    reference_run : Path
        Folder of a run at the reference.

    Returns
    -------
    runs : list of Run
    reference : Setting
    arc_m : float
        The longest path that all complete runs have, m.

    Raises
    ------
    DocumentError
        If a file was written by another version.
    TableError
        If no run is complete, or the reference is not among them.
    """
    every = {file: Measures.read(file) for file in files}
    standard = every.get(reference_run / FILE)
    if standard is None:
        raise TableError(f"{reference_run}: the reference is not among the runs of the trade-off")
    longest: dict[tuple[Setting, str | None], Measures] = {}
    for measures in every.values():
        key = (_setting(measures, standard), measures.bed)
        if key not in longest or measures.arc_m > longest[key].arc_m:
            longest[key] = measures
    complete = [measures.arc_m for measures in longest.values() if measures.complete]
    if not complete:
        raise TableError("no run of the trade-off is complete, so there is nothing to compare")
    arc = min(complete)
    runs = [_run(setting, bed, own, arc) for (setting, bed), own in longest.items()]
    return runs, _setting(standard, standard), arc


def _inputs(measures: Measures) -> dict[str, JsonValue]:
    fidelity = {f"fidelity.{name}": value for name, value in measures.fidelity}
    silent = {*SILENT, "fidelity.name", *(f"fidelity.{name}" for name in _PARAMETERS)}
    inputs = {**measures.inputs, **fidelity}
    return {name: value for name, value in inputs.items() if name not in silent}


def changed_settings(measures: Measures, standard: Measures) -> dict[str, JsonValue]:
    """Inputs and settings of a run, by dotted name, that differ from those of another.

    No parameter is among them.
    """
    return changed_inputs(_inputs(measures), _inputs(standard))


def _setting(measures: Measures, standard: Measures) -> Setting:
    changed = changed_settings(measures, standard)
    other = [f"{name} {_shown(value)}" for name, value in changed.items()]
    return Setting.of(measures.fidelity, ", ".join(other))


def _shown(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _run(setting: Setting, bed: str | None, measures: Measures, arc_m: float) -> Run:
    first, *further = (
        values_within(measures, arc_m, stretch)
        for stretch in range(max(1, int(measures.arc_m / arc_m + 1e-9)))
    )
    return Run(setting, bed, first, measures, further)


def values_within(measures: Measures, arc_m: float, stretch: int = 0) -> dict[str, float]:
    """A run's values over a stretch of its path, the first if no other; blocks stay whole.

    What has one value a bed belongs to the first stretch.
    """
    if not measures.complete:
        return {}
    count = max(1, round(arc_m / measures.block_m))
    single = {} if stretch else measures.single
    return {**single, **measures.values(stretch * count, (stretch + 1) * count)}
