"""What is known of reduced moduli, ``stiffness.json``: a law for each quantity, and its errors."""

import math
from collections.abc import Mapping

import numpy as np

from dragchain.documents import Document, Part
from dragchain.tradeoff.load_maps import LoadMapEntry
from dragchain.tradeoff.six_digits import SixDigits
from dragchain.tradeoff.stable_step import StableStepLaw
from dragchain.tradeoff.stiffness_law import Extrapolation, ScaledRuns, StiffnessLaw, extrapolate


class LawEntry(Part):
    """The law of a quantity.

    Attributes
    ----------
    scenes : int
        Number of scenes in the fit.
    friction : str
        Dimensionless number that the law uses as its coefficient of friction.
    stiffness_power : float
        The law is that of the quantity times kappa to this power.
    quantile : float
        Half-width of a 95 % CI / standard error, of the errors by the law.
    path_to_particle : float
        Mean path / particle diameter to which `run_std` refers.
    """

    label: str
    scenes: int
    friction: str
    stiffness_power: SixDigits
    quantile: SixDigits
    path_to_particle: SixDigits
    law: StiffnessLaw

    def at_physical_modulus(
        self, value: float, numbers: Mapping[str, float], scale: float, diameters: float
    ) -> Extrapolation:
        """What the value of one run is at the physical Young's modulus.

        Parameters
        ----------
        value : float
            Not 0; its sign is lost.
        numbers : mapping
            Dimensionless numbers of the scene.
        scale : float
            Factor on Young's modulus in the run.
        diameters : float
            Path that the value covers over the mean diameter of a particle.
        """
        run = ScaledRuns(
            stiffness_number=numbers["stiffness_number"],
            inertial_number=numbers["inertial_number"],
            friction=numbers[self.friction],
            scales=np.array([scale]),
            logarithms=np.log(np.abs([value])),
            path_to_particle=diameters,
            stiffness_power=self.stiffness_power,
        )
        run_std = self.law.run_std * math.sqrt(self.path_to_particle / diameters)
        return extrapolate(self.law, run, np.array([run_std]))


class ExtrapolationErrors(Part):
    """Errors of a plan's extrapolation in scenes that were not part of the fit.

    Attributes
    ----------
    quantity : str
    runs : mapping of str to int
        Runs at each modulus scale.
    scenes : int
    mean, root_mean_square, largest : float
        Of the relative errors.
    inside : int
        Scenes whose measured value lies within the predicted 95 % interval.
    raw_root_mean_square : float
        Root mean square error of the uncorrected value, at the largest modulus of the plan.
    """

    quantity: str
    runs: Mapping[str, int]
    scenes: int
    mean: SixDigits
    root_mean_square: SixDigits
    largest: SixDigits
    inside: int
    raw_root_mean_square: SixDigits


class SceneEntry(Part):
    """A scene of the fit: its dimensionless numbers, and its runs at each modulus scale."""

    numbers: Mapping[str, SixDigits]
    runs: Mapping[str, int]
    failed: int


class CheckEntry(Part):
    """Relative change of a quantity by a modulus scale: predicted by the law, and measured.

    Attributes
    ----------
    predicted, predicted_se : float
        The mean of the law in the scene, and its standard error.
    measured, ci95_low, ci95_high : float
        Error of the setting in the trade-off.
    inside : bool
        Whether the difference is within the 95 % interval of both.
    """

    quantity: str
    scale: SixDigits
    predicted: SixDigits
    predicted_se: SixDigits
    measured: SixDigits
    ci95_low: SixDigits
    ci95_high: SixDigits
    inside: bool


class StiffnessRecord(Document):
    """The content of ``stiffness.json``."""

    made_by = "snakemake stiffness"

    measured: str
    engine_versions: tuple[str, ...]
    scenes: tuple[SceneEntry, ...]
    laws: Mapping[str, LawEntry]
    left_out: tuple[ExtrapolationErrors, ...]
    without_law: Mapping[str, str]
    load_maps: tuple[LoadMapEntry, ...]
    stable_step: StableStepLaw
    checks: tuple[CheckEntry, ...]
