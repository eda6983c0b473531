"""What was measured of speed against accuracy: ``tradeoff.json`` and ``costs.json``."""

import math
import os
import platform
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, PlainSerializer

from dragdeck.documents import Document
from dragdeck.parts import Part
from dragdeck.study.fidelity import Fidelity

_FILE = Path(str(resources.files("dragdeck"))) / "data" / "tradeoff.json"
"""The trade-off that was measured with this version."""


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.6g}")


SixDigits = Annotated[float, PlainSerializer(_rounded, when_used="json")]
"""A number that is written with six digits."""

Known = Annotated[SixDigits | None, BeforeValidator(_finite)]
"""The same, None where it is not finite."""


class Machine(Part):
    """Where the runs were made."""

    cores: int | None
    processor: str

    @classmethod
    def here(cls) -> "Machine":
        """The machine that this runs on."""
        return cls(cores=os.cpu_count(), processor=processor())


def processor() -> str:
    """Name of the machine's processor, as far as it is known."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


class FidelityParameters(Part):
    """The settings of a run that trade accuracy for speed."""

    youngs_modulus_scale: SixDigits
    timestep_fraction: SixDigits
    speed_factor: SixDigits


class ErrorEntry(Part):
    """Difference to the reference, relative to it.

    Attributes
    ----------
    value, se : float
    ci95_low, ci95_high : float
        Its 95 % CI.
    bound : float
        One-sided 95 % upper bound of the absolute error.
    significant : bool
        Whether the interval excludes zero.
    """

    value: SixDigits
    se: SixDigits
    ci95_low: SixDigits
    ci95_high: SixDigits
    bound: SixDigits
    significant: bool


class QuantityEntry(Part):
    """A quantity at the reference, and the scatter of a run over the compared path."""

    label: str
    unit: str
    signed: bool
    reference: Known
    se: Known
    run_std: Known
    arc_m: SixDigits


class SettingEntry(FidelityParameters):
    """The runs at a setting; `arc_m`: compared path of all its complete runs together, m."""

    seeds: int
    runs: int
    failed: int
    arc_m: SixDigits
    breaks: bool
    relative_cost: Known
    errors: Mapping[str, ErrorEntry]


class DropEntry(Part):
    """A time step of the drop test; the error is that of the worst impact."""

    timestep_fraction: SixDigits
    restitution_error: SixDigits
    relative_cost: SixDigits


class CostEntry(Part):
    """CPU time with one change relative to that without it, timed side by side.

    ``ratio`` refers to ``unit``. ``parameter`` and ``level`` are those of a variant
    that changes one setting of the fidelity alone.
    """

    name: str
    scene: str
    what: str
    against: str | None = None
    unit: Literal["per_step", "per_second"] = "per_second"
    parameter: str | None = None
    level: Known = None
    ratio: SixDigits
    ci95_low: Known
    ci95_high: Known
    per_step: Known = None
    per_second: Known = None
    wall_ratio: Known = None
    rounds: int | None = None
    steps: int | None = None
    timestep_s: Known = None


class CostsFile(Document):
    """What is read of ``costs.json``."""

    remedy = "make it with: python -m evidence costs"

    fidelity: Fidelity | None = None
    costs: tuple[CostEntry, ...]


class TradeoffRecord(Document):
    """The content of ``tradeoff.json``; null: not known.

    ``scene`` are the dimensionless numbers of the measured scene.
    """

    remedy = (
        "name a fidelity instead of a tolerance; or measure the trade-off, `./run "
        "tradeoff --config study=uhlmann2015 plan=long`, and copy its "
        "tradeoff.json to workflow/dragdeck/data/"
    )

    measured: str
    commands: tuple[str, ...]
    plan: str
    study: str
    versions: Mapping[str, str]
    machine: Machine
    runs: int
    engine_hours: SixDigits
    scene: Mapping[str, SixDigits]
    reference: FidelityParameters
    quantities: Mapping[str, QuantityEntry]
    settings: tuple[SettingEntry, ...]
    drop_test: tuple[DropEntry, ...]
    costs: tuple[CostEntry, ...]

    def cost(self, name: str) -> CostEntry | None:
        """The cost of a variant, None if it was not timed."""
        return next((cost for cost in self.costs if cost.name == name), None)


@cache
def measured_tradeoff(file: Path = _FILE) -> TradeoffRecord:
    """The measured trade-off.

    Raises
    ------
    DocumentError
        It has not been measured, or another version of dragdeck wrote it.
    """
    return TradeoffRecord.read(file)
