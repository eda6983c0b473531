"""What a body is made of."""

from typing import Annotated

from pydantic import Field

from dragdeck.study.base import Model, Number, Positive


class Material(Model):
    """An elastic material."""

    youngs_modulus_pa: Positive = Field(description="physical Young's modulus, Pa")
    poissons_ratio: Annotated[Number, Field(gt=-1, lt=0.5)] = Field(description="Poisson's ratio")
    density_kg_m3: Positive = Field(description="density of the solid material, kg/m3")
