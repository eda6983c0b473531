"""Names of the columns that several tables share."""

from __future__ import annotations

FORCES = ("force_x_n", "force_y_n", "force_z_n")
POINT = ("point_x_m", "point_y_m", "point_z_m")
TORQUES = ("torque_x_n_m", "torque_y_n_m", "torque_z_n_m")
SLIP = ("slip_x_m_s", "slip_y_m_s", "slip_z_m_s")
REFERENCE = ("ref_x_m", "ref_y_m", "ref_z_m")
KINEMATICS = (
    *("particle_id", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s"),
    *("wx_rad_s", "wy_rad_s", "wz_rad_s", "radius_m"),
)
WORKPIECE_FORCE = (
    *("step", "time_s", "phase", *FORCES, *TORQUES, *REFERENCE),
    *("direction_rad", "drag_n", "lateral_n", "vertical_n", "in_statistics"),
)
WORKPIECE_CONTACTS = (
    *("step", "time_s", "phase", "particle_id", "facet_id", *POINT, *FORCES),
    *("normal_force_n", "tangential_force_n", "overlap_m", *SLIP, "normal_velocity_m_s"),
    *("azimuth_rad", "depth_m", "in_statistics"),
)
CONTACTS = (
    *("step", "time_s", "kind", "a_id", "b_id", *POINT, *FORCES),
    *("normal_force_n", "tangential_force_n", "overlap_m"),
)
