"""The registry of motions of the bowl."""

from typing import Annotated

from pydantic import Field

from dragdeck.study.bowl_motions.rotation import Rotation
from dragdeck.study.bowl_motions.vibration import Vibration

AnyBowlMotion = Annotated[Rotation | Vibration, Field(discriminator="kind")]
