"""The summary's figures and the log's columns by name."""

import numpy as np

from drake_quad.runs.metrics import FURTHER

# ------------------------------------------------------------------------------------------------
# Which figures summary.json has, by dotted paths: what a study can keep, and be judged by.
# ------------------------------------------------------------------------------------------------


SPREADS = ("margin", "margin_planned", "zmp_margin", *FURTHER)  # each with the three of SPREAD
SPREAD = ("minimum", "percentile_1", "median")
PARTS = {
    "clock_waited_for": ("touchdown", "lift_off", "recovery"),
    "estimate": (
        "drift",
        "way",
        "drift_ratio",
        "position_error_max",
        "yaw_error_max_deg",
        "attitude_error_max_deg",
        "slips_flagged",
        "samples_unhealthy",
    ),
    "carried": ("mass", "ahead", "left", "moment_x", "moment_y"),
    "safety": ("margin_wanted", "safe"),
}
SINGLE = (
    "simulated_time",
    "margin_minimum_at",
    "zmp_inside",
    "margin_within_20mm",
    "samples",
    "samples_under_three_feet",
    "time_under_three_feet",
    "nonfoot_contact_samples",
    "nonfoot_force_max",
    "nonfoot_depth_max",
    "foot_depth_max",
    "swing_contact_samples",
    "swing_force_max",
    "base_error_max",
    "base_tilt_error_max_deg",
    "slip_max",
    "foot_roll_max",
    "torque_ratio_max",
    "torque_ratio_planned_max",
    "speed_ratio_max",
    "position_ratio_max",
    "cost_of_transport",
    "clock_waited",
    "qp_unsolved",
    "friction_estimated_min",
    "contact_friction",
    "seed",
)
# These are true or false; a study counts them as 1 and 0.
VERDICTS = ("safety.safe",)
# Not the same in two runs of one scenario.
WALL_CLOCK = ("wall_time", "real_time_factor", "planning_time")
FIGURES = (
    *SINGLE,
    *(f"{name}.{part}" for name in SPREADS for part in SPREAD),
    *(f"{name}.{part}" for name, parts in PARTS.items() for part in parts),
)


# ------------------------------------------------------------------------------------------------
# How a log's columns of three numbers end.
# ------------------------------------------------------------------------------------------------


Columns = dict[str, np.ndarray]
AXES = ("x", "y", "z")
TURNS = ("roll", "pitch", "yaw")
