"""What was measured of speed against accuracy, ``tradeoff.json``: the advisor reads it."""

from collections.abc import Mapping
from typing import Literal

from dragchain.tradeoff.six_digits import Number, SixDigits
from dragdeck.documents import Document, Part


class Machine(Part):
    """Where the runs were made."""

    cores: int | None
    processor: str


class FidelityParameters(Part):
    """The settings of a run that trade accuracy for speed."""

    youngs_modulus_scale: SixDigits
    timestep_fraction: SixDigits
    speed_factor: SixDigits


class ErrorEntry(Part):
    """An error relative to the reference; `significant`: its 95 % CI excludes zero."""

    value: SixDigits
    se: SixDigits
    ci95_low: SixDigits
    ci95_high: SixDigits
    bound: SixDigits
    significant: bool
    single_parameter_error: SixDigits


class QuantityEntry(Part):
    """A quantity at the reference, and the scatter of a run over the compared path."""

    label: str
    unit: str
    signed: bool
    reference: Number
    se: Number
    run_std: Number
    arc_m: SixDigits


class SettingEntry(FidelityParameters):
    """The runs at a setting; `arc_m`: compared path of all its complete runs together, m."""

    seeds: int
    runs: int
    failed: int
    arc_m: SixDigits
    breaks: bool
    relative_cost: Number
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
    level: Number = None
    ratio: SixDigits
    ci95_low: Number
    ci95_high: Number
    per_step: Number = None
    per_second: Number = None
    wall_ratio: Number = None
    rounds: int | None = None
    steps: int | None = None
    timestep_s: Number = None


class TradeoffRecord(Document):
    """The content of ``tradeoff.json``; null: not known.

    ``scene`` are the dimensionless numbers of the measured scene.
    """

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
