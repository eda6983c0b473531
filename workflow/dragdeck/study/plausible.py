"""Which values are plausible: slips of a unit are named before anything is computed."""

import contextlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatch

from dragdeck.errors import InputError
from dragdeck.study.base import Json, flat

_LENGTH = {"mm": 1e-3, "um": 1e-6, "cm": 1e-2}
_SPEED = {"mm/s": 1e-3, "m/min": 1 / 60}
_MODULUS = {"GPa": 1e9, "MPa": 1e6}
_RATE = {"kHz": 1e3}


@dataclass(frozen=True)
class _Range:
    """What is plausible in a drag finishing process.

    Attributes
    ----------
    least, most : float
        A value beyond them is refused.
    low, high : float
        A value beyond them gives a warning.
    slips : mapping of str to float
        Other units that such a number may be in, in the unit of the field.
    """

    least: float
    low: float
    high: float
    most: float
    slips: Mapping[str, float]

    def hint(self, value: float) -> str:
        """The unit in which the value would be plausible, if there is one."""
        for unit, factor in self.slips.items():
            if self.low <= value * factor <= self.high:
                return f"did you mean {value:g} {unit}? That is {value * factor:.6g}"
        return "check the value and its unit"


_ANGLE = _Range(-1e5, -36e3, 36e3, 1e5, {})
_RANGES = {
    "calibration.angles.*friction.*": _Range(0, 0, 2, 10, {}),
    "calibration.angles.*_deg": _Range(0, 0.05, 60, 90, {"rad": 180 / math.pi}),
    "calibration.angles.*_m": _Range(1e-4, 2e-3, 1, 5, _LENGTH),
    "calibration.angles.*": _Range(1e-3, 0.1, 2e4, 2e4, {}),
    "media.count": _Range(1, 1, 1e6, 4e6, {}),
    "media*.radius_mean_m": _Range(1e-5, 1e-4, 0.02, 0.1, _LENGTH),
    "media*.radius_std_m": _Range(0, 0, 0.006, 0.03, _LENGTH),
    "media*.sieve.*.0": _Range(1e-5, 1e-4, 0.04, 0.2, _LENGTH),
    "media*.sieve.*.1": _Range(0, 0, 1, 1, {"%": 0.01}),
    "media.classes.*.fraction": _Range(1e-9, 1e-6, 1, 1, {"%": 0.01}),
    "media*.shape.aspect": _Range(0.2, 0.2, 5, 5, {}),
    "media*.shape.axes.*": _Range(1e-9, 1e-6, 1e6, 1e9, {}),
    "media*.shape.points.*": _Range(-1e9, -1e6, 1e6, 1e9, {}),
    "media*.shape.spheres": _Range(2, 2, 40, 40, {}),
    "media.mass_kg": _Range(1e-6, 1e-3, 1e3, 1e5, {"g": 1e-3}),
    "media.fill_height_m": _Range(1e-4, 1e-3, 2, 10, _LENGTH),
    "bowl.radius_m": _Range(1e-3, 5e-3, 2, 10, _LENGTH),
    "bowl.height_m": _Range(1e-3, 5e-3, 2, 10, _LENGTH),
    "compound.density_kg_m3": _Range(50, 500, 2e3, 2e4, {"g/cm3": 1e3}),
    "compound.level_m": _Range(1e-4, 1e-3, 2, 10, _LENGTH),
    "workpiece*.shape.radius_m": _Range(1e-5, 2e-4, 0.3, 2, _LENGTH),
    "*facet_*_m": _Range(1e-6, 5e-5, 0.1, 1, _LENGTH),
    "workpiece*.shape.offset_m.*": _Range(-10, -2, 2, 10, _LENGTH),
    "motion.path.*_deg": _Range(-3600, -360, 360, 3600, {}),
    "workpieces.*angle_deg*": _Range(-3600, -360, 360, 3600, {}),
    "workpieces.count": _Range(1, 1, 12, 12, {}),
    "motion.path.radius_m": _Range(1e-5, 1e-3, 2, 10, _LENGTH),
    "motion.path.length_m": _Range(1e-5, 1e-3, 50, 1e4, _LENGTH),
    "motion.path.*_m.*": _Range(-10, -2, 2, 10, _LENGTH),
    "motion.path.points.*.0": _Range(-1e7, -1e6, 1e6, 1e7, {"ms": 1e-3}),
    "motion.path.points.*.[123]": _Range(-10, -2, 2, 10, _LENGTH),
    "motion.path.points.*.speed_m_s": _Range(0, 0, 3, 30, {}),
    "motion.path.points.*.[456]": _Range(-1e6, -36e3, 36e3, 1e6, {}),
    "motion.path.bowl_rpm": _Range(-1e4, -500, 500, 1e4, {"rad/s": 30 / math.pi}),
    "motion.path.fraction": _Range(1e-6, 1e-4, 1, 1, {}),
    "motion.path.revolutions": _Range(1e-5, 1e-3, 1e3, 1e5, {}),
    "motion.path.loops": _Range(1e-5, 1e-3, 1e3, 1e5, {}),
    "motion.plunge_at_m.*": _Range(-10, -2, 2, 10, _LENGTH),
    "motion.immersion_depth_m": _Range(1e-5, 1e-3, 1, 5, _LENGTH),
    "motion.transient_m": _Range(0, 0, 2, 1e3, _LENGTH),
    "motion.counted_from_revolution": _Range(1, 1, 1e3, 1e5, {}),
    "motion.spin.*rpm": _Range(-1e5, -3e3, 3e3, 1e5, {"rad/s": 30 / math.pi}),
    "motion.spin.*until_s": _Range(1e-4, 0.01, 1e4, 1e6, {"ms": 1e-3}),
    "motion.*ramp_s": _Range(0, 0.01, 10, 1e4, {"ms": 1e-3}),
    "motion.oscillation.amplitude_m": _Range(1e-7, 1e-5, 0.2, 1, _LENGTH),
    "motion.oscillation.frequency_hz": _Range(1e-4, 0.01, 100, 1e4, {"1/min": 1 / 60}),
    "motion.*speed_m_s": _Range(1e-6, 1e-4, 3, 30, _SPEED),
    "*_deg": _ANGLE,
    "drop_test.height_m": _Range(1e-5, 5e-4, 1, 20, _LENGTH),
    "materials.*.youngs_modulus_pa": _Range(1e6, 5e6, 1.3e12, 1e13, _MODULUS),
    "materials.*.poissons_ratio": _Range(-0.9, 0, 0.49, 0.499, {}),
    "materials.*.density_kg_m3": _Range(50, 300, 2.3e4, 3e4, {"g/cm3": 1e3}),
    "pairs.*.restitution": _Range(0.05, 0.05, 1, 1, {}),
    "pairs.*.rolling_damping": _Range(0, 0, 1, 10, {"%": 0.01}),
    "pairs.*friction": _Range(0, 0, 2, 10, {}),
    "pairs.*.cohesion_j_m3": _Range(0, 0, 1e9, 1e12, {"kJ/m3": 1e3, "MJ/m3": 1e6}),
    "gravity_m_s2": _Range(0.01, 1, 30, 500, {"cm/s2": 0.01, "mm/s2": 1e-3}),
    "outputs.*_hz": _Range(1e-3, 0.1, 2e5, 1e8, _RATE),
    "outputs.n_checkpoints": _Range(0, 0, 1000, 1000, {}),
    "filling.energy_ratio": _Range(1e-12, 1e-8, 1e-4, 1e-3, {}),
    "filling.max_time_s": _Range(1e-3, 0.1, 200, 1e5, {"ms": 1e-3}),
    "fidel*.speed_factor": _Range(1, 1, 10, 100, {}),
    "fidel*.skin_m": _Range(1e-7, 5e-6, 0.02, 1, _LENGTH),
    "fidel*youngs_modulus_scale": _Range(1e-6, 1e-5, 1, 1, {}),
    "fidel*.windows.most": _Range(2, 2, 64, 64, {}),
    "*.timestep_fraction": _Range(1e-4, 1e-3, 2, 2, {}),
    "fidel*.filling_timestep_fraction": _Range(1e-4, 1e-3, 1, 1, {}),
    "fidel*.ranks": _Range(1, 1, 1024, 1024, {}),
    "fidel*.tolerance": _Range(1e-4, 1e-3, 0.5, 1, {}),
    "drop_test.impacts": _Range(1, 1, 20, 20, {}),
    "calibration.height_std_m": _Range(1e-7, 1e-6, 0.01, 0.1, _LENGTH),
    "seed": _Range(0, 0, 2**32, 2**32, {}),
    "accepted.cases": _Range(1, 1, 1e5, 1e6, {}),
    "scaling.expected_exponent": _Range(-20, -5, 5, 20, {}),
    "scaling.fit_range.*": _Range(1e-30, 1e-20, 1e20, 1e30, {}),
    "reference.signal.*_hz": _Range(1e-3, 0.1, 1e6, 1e8, _RATE),
    "reference.signal.*_s*": _Range(-1e10, -1e3, 1e5, 1e10, {"ms": 1e-3}),
    "reference.signal.margin": _Range(1e-4, 1e-3, 0.5, 1, {"%": 0.01}),
    "reference.signal.sign": _Range(-1, -1, 1, 1, {}),
    "search.*": _Range(-1e30, -1e20, 1e20, 1e30, {}),
    "removal.*_m2_n": _Range(1e-22, 1e-19, 1e-9, 1e-6, {"mm3/(N m)": 1e-9}),
    "removal.calibrate*_kg": _Range(1e-12, 1e-9, 0.1, 10, {"g": 1e-3, "mg": 1e-6}),
    "removal.calibrate*time_s": _Range(0.01, 1, 1e6, 1e8, {"min": 60}),
    "removal.impact_ratio": _Range(1e-9, 1e-6, 1e9, 1e12, {}),
    "removal.hardness_pa": _Range(1e6, 1e8, 1e11, 1e12, _MODULUS),
    "removal.target_depth_m": _Range(1e-10, 1e-9, 1e-3, 0.1, _LENGTH),
    "outputs.first_touch_fraction": _Range(0, 0, 1, 1, {"%": 0.01}),
    "reference.*_n": _Range(-1e5, -1e3, 1e3, 1e5, {"mN": 1e-3}),
}
"""By dotted field, every number of a study; the first that fits counts. Assumptions: they span
laboratory and industrial processes, and more."""


def implausible(data: Json) -> Iterator[tuple[InputError, bool]]:
    """Every value of a study's plain data that is hardly meant, and whether it is refused.

    Parameters
    ----------
    data : mapping
        Numbers may be text, as YAML 1.1 reads ``5e6``; what is no number is passed by.
    """
    for field, value in _numbers(flat(data)):
        known = next((row for name, row in _RANGES.items() if fnmatch(field, name)), None)
        if known is None or known.low <= value <= known.high:
            continue
        refused = not known.least <= value <= known.most
        limit = f"{known.least:g} to {known.most:g}; usual: {known.low:g} to {known.high:g}"
        problem, remedy = "is not plausible", known.hint(value)
        yield InputError(problem, field=field, value=value, limit=limit, remedy=remedy), refused


def _numbers(values: Json) -> Iterator[tuple[str, float]]:
    for field, value in values.items():
        if isinstance(value, list | tuple):
            yield from _numbers({f"{field}.{index}": item for index, item in enumerate(value)})
        elif isinstance(value, Mapping):
            yield from _numbers(flat(value, f"{field}."))
        elif isinstance(value, int | float | str) and not isinstance(value, bool):
            with contextlib.suppress(ValueError, OverflowError):
                yield field, float(value)
