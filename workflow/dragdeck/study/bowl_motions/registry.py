"""The registry of motions of the bowl."""

from typing import Annotated

from pydantic import Field

from dragdeck.study.bowl_motions.acceleration import Acceleration
from dragdeck.study.bowl_motions.rotation import Rotation
from dragdeck.study.bowl_motions.vibration import Vibration

AnyBowlMotion = Annotated[Acceleration | Rotation | Vibration, Field(discriminator="kind")]
