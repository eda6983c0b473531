"""A study's motion as a run drives it: the poses, velocities and entries that follow from it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.study.bowl_motions.bowl_motion import BowlMotion
from dragdeck.study.drive import Drive, EngineMotion, PathEntry, SmoothStart, SuperposedEntry
from dragdeck.study.motion import Motion
from dragdeck.study.rotations import Orientations
from dragdeck.study.stages import StepCounts
from dragdeck.study.superposed.motion import SuperposedMotion


@dataclass(frozen=True)
class DrivenMotion:
    """A motion in whole steps, counted from the start of the drag.

    Attributes
    ----------
    motion : Motion
    drive : Drive
    bowl : BowlMotion or None
        Motion of the bowl, as driven.
    """

    motion: Motion
    drive: Drive
    bowl: BowlMotion | None = None

    @classmethod
    def of(
        cls, motion: Motion, timestep_s: float, speed_factor: float, start: int = 0
    ) -> "DrivenMotion":
        """The motion at a factor on its speeds.

        Its speed is as much higher or lower than asked as its steps take less or more time: it
        ends at the end of the path.

        Parameters
        ----------
        motion : Motion
        timestep_s, speed_factor : float
        start : int
            Step at which the drag begins.
        """
        length, asked = motion.path_length_m, motion.nominal_speed_m_s * speed_factor
        begin = SmoothStart(round(motion.ramp_s / speed_factor / timestep_s))
        steps = max(1, round(length / asked / timestep_s + begin.steps / 2))
        return cls(
            motion,
            Drive(
                start=start,
                end=start + steps,
                timestep_s=timestep_s,
                length_m=length,
                orientation=motion.orientation,
                tilt_deg=motion.tilt_deg or 0.0,
                begin=begin,
            ),
            motion.bowl and motion.bowl.faster(speed_factor),
        )

    @property
    def factor(self) -> float:
        """Its speed over the study's own: about the speed factor."""
        return self.drive.speed_m_s / self.motion.nominal_speed_m_s

    @cached_property
    def superposed(self) -> Mapping[str, SuperposedMotion]:
        """What is superposed on the path, at the speeds that are driven, by name."""
        return self.motion.superposed(self.factor)

    @property
    def fastest_m_s(self) -> float:
        """Highest speed of the workpiece's axis along the path."""
        return self.motion.path.fastest_m_s(self.drive)

    @property
    def keeps_direction(self) -> bool:
        """Whether the direction of motion is always the same in the workpiece's own frame."""
        return not self.motion.turns and self.motion.path.keeps_direction(self.drive.orientation)

    def places(self, since: StepCounts, begun: Floats) -> Floats:
        """Places of the reference point, (N, 3), after (N,) steps from where it begins, m."""
        place = self.motion.path.places(self.drive, since, begun)
        for superposed in self.superposed.values():
            place = place + superposed.shift(self.drive, since)
        return place

    def rotation(self, since: StepCounts, start_rad: float) -> Orientations:
        """Orientations after (N,) steps of a workpiece whose front begins in a direction."""
        path = self.motion.path
        turn = start_rad + path.turn(self.drive, since)
        return self._rotated(since, Orientations(turn, path.in_frame(self.drive, since)))

    def rotation_along(self, since: StepCounts, direction_rad: Floats) -> Orientations:
        """Orientations after (N,) steps, at (N,) directions of motion."""
        return self._rotated(since, self._by_path(since, direction_rad))

    def _by_path(self, since: StepCounts, direction_rad: Floats) -> Orientations:
        path = self.motion.path
        first = np.full_like(direction_rad, path.direction_rad)
        turn = direction_rad if path.turns(self.drive.orientation) else first
        return Orientations(turn, path.in_frame(self.drive, since))

    def _rotated(self, since: StepCounts, rotation: Orientations) -> Orientations:
        for superposed in self.superposed.values():
            rotation = superposed.rotated(self.drive, since, rotation)
        return rotation

    def directions(self, since: StepCounts, ref_xy_m: Floats) -> Floats:
        """Direction of motion along the path, (N,), after (N,) steps and at (N, 2) places, rad."""
        return self.motion.path.directions(self.drive, since, ref_xy_m)

    def velocity(self, since: StepCounts, point_m: Floats, ref_m: Floats) -> Floats:
        """Velocities of points that are fixed to the workpiece, (N, 3) in m/s.

        Parameters
        ----------
        since : (N,) ndarray of int
        point_m, ref_m : (N, 3) ndarray
            The points, and the reference point, after these steps, m.
        """
        velocity = self.motion.path.velocity(self.drive, since, point_m, ref_m)
        before = self._by_path(since, self.directions(since, ref_m[:, :2]))
        for superposed in self.superposed.values():
            velocity = velocity + superposed.velocity(self.drive, since, point_m - ref_m, before)
        return velocity

    @property
    def bowl_rad_s(self) -> float:
        """Angular speed of the bowl about +z."""
        by_path = self.motion.path.bowl_rad_s(self.drive.speed_m_s)
        return self.bowl.rad_s if self.bowl else by_path

    def superposed_on_engine(self) -> Mapping[str, EngineMotion]:
        """How the engine makes what is superposed, by name."""
        heading = self.motion.path.heading_formula(self.drive)
        return {
            name: superposed.on_engine(self.drive, heading)
            for name, superposed in self.superposed.items()
        }

    def path_entry(self) -> PathEntry:
        """The path in ``case.json``."""
        path, drive = self.motion.path, self.drive
        return PathEntry.model_validate(
            {
                "kind": path.kind,
                "axis_speed_m_s": drive.speed_m_s,
                "start_direction_rad": path.direction_rad,
                "orientation": drive.orientation,
                **path.entry(drive),
            }
        )

    def superposed_entries(self) -> list[SuperposedEntry]:
        """What is superposed in ``case.json``."""
        moving = self.superposed.values()
        return [
            SuperposedEntry.model_validate(superposed.entry(self.drive)) for superposed in moving
        ]


_STEPS = 1_000_000
"""Of a drag whose directions are asked for at times."""


def directions(motion: Motion, since_s: Floats) -> Floats:
    """Direction of motion, (N,) in rad without jumps, at times from the start of the drag, s."""
    timestep_s = motion.path_length_m / motion.nominal_speed_m_s / _STEPS
    driven = DrivenMotion.of(motion, timestep_s, 1.0)
    since = np.clip(since_s / timestep_s, 0.0, driven.drive.steps)
    begun = np.array([*motion.path.start_point, motion.path.start_height_m])
    places = driven.places(since, begun)
    return np.asarray(np.unwrap(driven.directions(since, places[:, :2])))
