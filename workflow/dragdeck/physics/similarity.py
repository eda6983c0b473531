"""The softest particles that the engine takes."""

from dragdeck.physics.contact_mechanics import ENGINE_SOFTEST_PA
from dragdeck.physics.rounding import rounded
from dragdeck.study.model import Study


def softest_scale(study: Study) -> float:
    """The smallest modulus scale that the engine takes for a study's materials."""
    softest = min(study.materials[name].youngs_modulus_pa for name in study.type_names())
    return min(1.0, rounded(ENGINE_SOFTEST_PA / softest, up=True))
