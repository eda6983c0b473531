"""Make the STEP parts of this folder again: `python meshes/parts.py`.

The geometry kernel is OpenCASCADE, through gmsh (`pip install 'dragdeck[cad]'`). Lengths are in
millimetres, which is the unit that the files state.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import gmsh
from gmsh import model

HERE = Path(__file__).parent
CAD = model.occ

_FLUTE = ((0.55, 100.0), (0.5, 150.0), (0.75, 179.0))
"""Points of a flute in its section: part of the radius, degrees from the cutting edge before it.

It ends at 180 degrees, at the next cutting edge, with a positive rake.
"""


def shaft() -> int:
    """Volume of a shaft of three steps with a keyway, its thin end in the origin, along +x."""
    ends, radii = (0.0, 35.0, 65.0, 85.0), (4.0, 5.0, 6.0)
    steps = [
        CAD.addCylinder(start, 0, 0, end - start, 0, 0, radius)
        for (start, end), radius in zip(pairwise(ends), radii, strict=True)
    ]
    (body,), _ = CAD.fuse([(3, steps[0])], [(3, one) for one in steps[1:]])
    CAD.synchronize()
    rim = model.getEntitiesInBoundingBox(-0.01, -5, -5, 0.01, 5, 5, dim=1)
    (body,) = CAD.chamfer([body[1]], [rim[0][1]], [_face(body, 0.0)], [0.5, 0.5])
    (shaft,), _ = CAD.cut([body], _keyway(start=8.0, length=18.0, width=3.0, floor=2.2))
    return int(shaft[1])


def _face(body: tuple[int, int], at_x: float) -> int:
    """The flat end of a body at a place along x."""
    faces = model.getBoundary([body], oriented=False)
    return next(face for _, face in faces if abs(CAD.getCenterOfMass(2, face)[0] - at_x) < 1e-6)


def _keyway(start: float, length: float, width: float, floor: float) -> list[tuple[int, int]]:
    """What a keyway with round ends (DIN 6885, form A) takes away, from a floor upwards."""
    radius, top = width / 2, 10.0
    box = CAD.addBox(start + radius, -radius, floor, length - width, width, top)
    ends = [
        CAD.addCylinder(at, 0, floor, 0, 0, top, radius)
        for at in (start + radius, start + length - radius)
    ]
    slot, _ = CAD.fuse([(3, box)], [(3, end) for end in ends])
    return list(slot)


def cutter() -> int:
    """Volume of an end mill with two helical flutes of 30 degrees, upright on its tip."""
    radius, flutes, length = 5.0, 24.0, 75.0
    twist = flutes * math.tan(math.radians(30.0)) / radius
    sections = 11
    wires = [
        _section(radius, height=part * flutes, turn=part * twist)
        for part in (number / (sections - 1) for number in range(sections))
    ]
    head = CAD.addThruSections(wires)
    shank = CAD.addCylinder(0, 0, flutes, 0, 0, length - flutes, radius)
    (mill,), _ = CAD.fuse(head, [(3, shank)])
    return int(mill[1])


def _section(radius: float, height: float, turn: float) -> int:
    """Wire around a section of the flutes: two lands with a cutting edge each, two flutes."""
    centre = CAD.addPoint(0, 0, height)

    def point(at: float, degrees: float) -> int:
        angle = turn + math.radians(degrees)
        return int(
            CAD.addPoint(at * radius * math.cos(angle), at * radius * math.sin(angle), height)
        )

    edges, backs = ([point(1.0, start + half) for half in (0, 180)] for start in (0.0, 65.0))
    curves = []
    for half in (0, 1):
        curves.append(CAD.addCircleArc(edges[half], centre, backs[half]))
        flute = [point(at, 180 * half + degrees) for at, degrees in _FLUTE]
        curves.append(CAD.addSpline([backs[half], *flute, edges[1 - half]]))
    return int(CAD.addWire(curves, checkClosed=True))


PARTS: dict[str, Callable[[], int]] = {"shaft": shaft, "cutter": cutter}


def _write(file: Path) -> None:
    CAD.synchronize()
    gmsh.write(str(file))


def step(name: str, folder: Path) -> Path:
    """Write a part as STEP, without the time of writing: the same bytes come out every time."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        file = folder / f"{name}.step"
        PARTS[name]()
        _write(file)
        model.add("without the sections that the part was drawn with")
        CAD.importShapes(str(file), highestDimOnly=True)
        _write(file)
    finally:
        gmsh.finalize()
    text = re.sub(r"'\d{4}-\d\d-\d\dT[\d:]+'", "'2000-01-01T00:00:00'", file.read_text("ascii"))
    file.write_text(text, encoding="ascii", newline="\n")
    return file


if __name__ == "__main__":
    for part in PARTS:
        step(part, HERE)
