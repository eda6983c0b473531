"""Names of the columns that several tables and raw outputs share."""


def vector(name: str, unit: str) -> tuple[str, str, str]:
    """The columns of a vector."""
    return f"{name}_x_{unit}", f"{name}_y_{unit}", f"{name}_z_{unit}"


FORCES = vector("force", "n")
_TORQUES = vector("torque", "n_m")
POINT = vector("point", "m")
SLIP = vector("slip", "m_s")
REFERENCE = vector("ref", "m")
FLOOR_FORCES = vector("floor_force", "n")
SIDE_FORCES = vector("side_force", "n")
CENTRE = ("x_m", "y_m", "z_m")
VELOCITY = ("vx_m_s", "vy_m_s", "vz_m_s")
SPIN = ("wx_rad_s", "wy_rad_s", "wz_rad_s")
KINEMATICS = ("particle_id", *CENTRE, *VELOCITY, *SPIN, "radius_m")

WORKPIECE_FORCE = (
    "step", "time_s", "phase", *FORCES, *_TORQUES, *REFERENCE,
    "direction_rad", "drag_n", "lateral_n", "vertical_n", "in_statistics",
)  # fmt: skip
BODY = ("turn_rad", "body_x_n", "body_y_n", "body_z_n")
"""Columns of ``workpiece_force`` beside these where the workpiece spins."""

WORKPIECE_CONTACTS = (
    "step", "time_s", "phase", "particle_id", "facet_id", *POINT, *FORCES,
    "normal_force_n", "tangential_force_n", "overlap_m", *SLIP, "normal_velocity_m_s",
    "azimuth_rad", "depth_m", "in_statistics",
)  # fmt: skip
CONTACTS = (
    "step", "time_s", "kind", "a_id", "b_id", *POINT, *FORCES,
    "normal_force_n", "tangential_force_n", "overlap_m",
)  # fmt: skip
IMPACTS = (
    "impact", "start_time_s", "duration_s", "peak_force_n", "speed_in_m_s", "speed_out_m_s",
    "restitution", "time_since_first_s",
)  # fmt: skip
