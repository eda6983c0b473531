"""The workpiece, and several of them on one carousel."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dragdeck.parts import omitted
from dragdeck.study.base import Line, Model, Number, Positive, Whole


class CylinderShape(Model):
    """A generated round workpiece with flat ends."""

    kind: Literal["cylinder"]
    """cylinder, meshed by dragdeck"""
    radius_m: Positive
    """radius of the cylinder, m"""
    facet_size_m: Positive = 0.0015
    """mesh size of the cylinder around its axis, m"""
    facet_length_m: Positive = 0.01
    """mesh size of the cylinder along its axis, m"""


class MeshShape(Model):
    """A workpiece from a mesh or CAD file, turned upright, its lowest point the tip."""

    kind: Literal["mesh"]
    """part from a file"""
    file: Line
    """file in STL, OBJ, PLY, VTK, VTU or STEP format, relative to the study or to meshes/"""
    unit: Literal["m", "cm", "mm", "um", "in"] | None = None
    """unit of length in the file; none: that which a STEP file states"""
    facet_size_m: Positive | None = None
    """target edge length of the facets, m; required for STEP; none: the facets of the file,
    otherwise a closed surface is meshed anew"""
    edge_facet_size_m: Positive | None = None
    """the same at sharp edges of a STEP part, m; none: `facet_size_m`"""
    axis: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = omitted("+z")
    """direction in the file from tip to clamp; the part is turned until it points up, about y for
    x, about x for the others"""
    offset_m: tuple[Number, Number] | None = None
    """x and y of the clamping axis after this turn, m; none: centre of the bounding box"""


Shape = Annotated[CylinderShape | MeshShape, Field(discriminator="kind")]


class Workpiece(Model):
    """The workpiece that is dragged."""

    material: str
    """material of the workpiece: a name under `materials`"""
    shape: Shape


class Station(Model):
    """A workpiece of a carousel."""

    angle_deg: Number
    """angle of its path and motion about the bowl's axis, degrees; positive: counter-clockwise seen
    from above"""
    shape: Shape | None = None
    immersion_depth_m: Positive | None = None
    """immersion depth of its tip, m; none: that of the motion"""


class Carousel(Model):
    """Several workpieces that move alike, each turned about the bowl's axis."""

    count: Annotated[Whole, Field(ge=1, le=12)] | None = None
    """number of workpieces with `workpiece.shape` at equal angles; either this or a list"""
    each: list[Station] | None = Field(default=None, min_length=1, max_length=12)

    @model_validator(mode="before")
    @classmethod
    def _list(cls, value: Any) -> Any:
        """A list is short for `each`."""
        return {"each": value} if isinstance(value, list) else value

    @model_validator(mode="after")
    def _one_form(self) -> "Carousel":
        if (self.count is None) == (self.each is None):
            raise ValueError("give either count, or a list with the angle of each workpiece")
        return self

    @property
    def stations(self) -> Sequence[Station]:
        """The workpieces, from the first to the last."""
        if self.each is not None:
            return self.each
        count = self.count or 1
        return [Station(angle_deg=number * 360 / count) for number in range(count)]


class Material(Model):
    """An elastic material."""

    youngs_modulus_pa: Positive
    """physical Young's modulus, Pa"""
    poissons_ratio: Annotated[Number, Field(gt=-1, lt=0.5)]
    """Poisson's ratio"""
    density_kg_m3: Positive
    """density of the solid material, kg/m3"""
