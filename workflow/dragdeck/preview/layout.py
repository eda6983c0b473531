"""The geometry of a case, bowl, bed and moving workpieces, and from where it is seen.

The picture draws what stands here and knows nothing of studies.
"""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.mesh.surface import surface
from dragdeck.physics.packing import Bed
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.motion import Course, course
from dragdeck.scenes.moving_bowl import bed_in_motion
from dragdeck.scenes.workpiece import reference_height, workpiece_mesh, workpiece_radius
from dragdeck.study.model import Study

if TYPE_CHECKING:
    from trimesh import Trimesh


_POSES = 1000
"""Of a leg."""


@dataclass(frozen=True)
class Stage:
    """A leg of the motion as drawn.

    Attributes
    ----------
    name : str
        ``plunge``, ``approach`` or ``drag``.
    poses : (N, 4, 4) array
        From the mesh to the bowl, in m, at equal intervals of time.
    """

    name: str
    poses: Floats


@dataclass(frozen=True)
class MovingWorkpiece:
    """A workpiece as drawn.

    Attributes
    ----------
    mesh : Trimesh
        Its reference point in the origin, m.
    radius_m : float
        Of the cylinder around it.
    direction_rad : float
        Direction of motion from +x at the start of the drag.
    spin : int
        Sense of its spin at the start of the drag: 1 counter-clockwise from above, -1, 0 for none.
    stages : sequence of Stage
        Its legs in their order.
    """

    mesh: "Trimesh"
    radius_m: float
    direction_rad: float
    spin: int
    stages: Sequence[Stage]

    @property
    def drag(self) -> Stage:
        """The last leg."""
        return self.stages[-1]

    @property
    def at_start(self) -> "Trimesh":
        """The mesh where the drag starts."""
        return self.mesh.copy().apply_transform(self.drag.poses[0])


@dataclass(frozen=True)
class CaseLayout:
    """What is drawn of a case; lengths in m.

    Attributes
    ----------
    bowl, bed : Trimesh
        The inside of the bowl, and the expected surface of the bed.
    lines : sequence of (N, 3) array
        Edges of the bowl, and lines up its walls.
    bowl_reach_m, bowl_height_m, surface_m : float
    bowl_turn : int
        Sense of the bowl's rotation: 1 counter-clockwise from above, -1, 0 for none.
    workpieces : sequence of MovingWorkpiece
    """

    bowl: "Trimesh"
    bed: "Trimesh"
    lines: Sequence[Floats]
    bowl_reach_m: float
    bowl_height_m: float
    surface_m: float
    bowl_turn: int
    workpieces: Sequence[MovingWorkpiece]


def layout(case: Case) -> CaseLayout:
    """The geometry of a case in the expected bed, whether it fits or not.

    Raises
    ------
    InputError
        The mesh of the workpiece is missing or cannot be used.
    """
    study = case.study
    inside, level = study.bowl.container, _bed(study).surface_m
    return CaseLayout(
        bowl=study.bowl.mesh(study.bowl.height_m, inside.clear_m / 10),
        bed=_section(inside.sections(level), level),
        lines=list(inside.lines(study.bowl.height_m)),
        bowl_reach_m=inside.reach_m,
        bowl_height_m=study.bowl.height_m,
        surface_m=level,
        bowl_turn=int(np.sign(study.motion.bowl_rad_s)),
        workpieces=[_moving(workpiece) for workpiece in of_each_workpiece(case)],
    )


def _bed(study: Study) -> Bed:
    return bed_in_motion(study, expected_bed(study))


def _moving(case: Case) -> MovingWorkpiece:
    way = course(case.study, _bed(case.study), reference_height(case))
    moving = way.driven.superposed.values()
    turn = sum(float(motion.turn(way.drag, np.ones(1))[0]) for motion in moving)
    return MovingWorkpiece(
        mesh=workpiece_mesh(case),
        radius_m=workpiece_radius(case),
        direction_rad=case.study.motion.path.direction_rad,
        spin=int(np.sign(turn)),
        stages=list(_stages(way)),
    )


def _section(outlines: Sequence[Floats], height_m: float) -> "Trimesh":
    """The surface within an outline, and around a second one."""
    outer, inner = outlines[0][:-1], np.zeros((len(outlines[0]) - 1, 2))
    if len(outlines) > 1:
        inner = outlines[1][:-1]
    count = len(outer)
    points = np.column_stack([np.vstack([outer, inner]), np.full(2 * count, height_m)])
    here = np.arange(count)
    ahead = np.roll(here, -1)
    halves = [[here, ahead, ahead + count], [here, ahead + count, here + count]]
    return surface(points, np.hstack(halves).T)


def _stages(way: Course) -> Iterator[Stage]:
    """The legs as they are driven."""
    for leg in way.legs:
        places, rotation = way.poses(leg, np.linspace(0.0, leg.steps, _POSES))
        poses = np.tile(np.eye(4), (_POSES, 1, 1))
        poses[:, :3, :3], poses[:, :3, 3] = rotation.matrices, places
        yield Stage(leg.name, poses)


# --- views ----------------------------------------------------------------------------------------


COLOURS: dict[str, str] = json.loads(
    resources.files("dragdeck").joinpath("data/colours.json").read_text(encoding="utf-8")
)
"""Those of all figures and pages: a few by name, then one for each thing."""


@dataclass(frozen=True)
class Projection:
    """A parallel projection: what points right and up in it, as unit vectors."""

    title: str
    right: Floats
    up: Floats
    across: str
    along: str

    @property
    def basis(self) -> Floats:
        """(3, 3): right, up, and towards the viewer."""
        return np.array([self.right, self.up, np.cross(self.right, self.up)])


def views(direction_rad: float) -> list[Projection]:
    """From above, along the motion at the start of the drag, from its right, and obliquely."""
    c, s = math.cos(direction_rad), math.sin(direction_rad)
    x, y, z = np.eye(3)
    ahead, beside = np.array([c, s, 0.0]), np.array([s, -c, 0.0])
    right, back = (beside + ahead) / math.sqrt(2), (beside - ahead) / math.sqrt(2)
    low = math.radians(28)
    return [
        Projection("From above", x, y, "x (mm)", "y (mm)"),
        Projection(
            "In the direction of motion", beside, z, "to the right of the axis (mm)", "z (mm)"
        ),
        Projection("From the right of the motion", ahead, z, "along the motion (mm)", "z (mm)"),
        Projection("Oblique", right, math.cos(low) * z - math.sin(low) * back, "", ""),
    ]
