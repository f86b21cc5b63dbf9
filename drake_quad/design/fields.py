"""A designed gait as the fields of a scenario, with feedback scaled to the robot's size.

The feedback's numbers were found on the paper's robot (60 kg, legs of 1.22 m). Robots of like build
move alike when lengths scale with the leg l, masses with m and times with sqrt(l / g) (dynamic
similarity; Alexander and Jayes 1983): forces scale with m, stiffness with m / l, damping with
m / sqrt(l), moments with m l.
"""

from collections.abc import Sequence
from math import sqrt

from drake_quad.design.candidate import EDGE, hip_length
from drake_quad.design.choose import Design
from drake_quad.design.search import swing_clearance
from drake_quad.robot.robot_model import RobotModel, leg_length

Fields = dict[str, dict[str, float | int | str]]

MASS, LEG = 60.0, 1.22  # of the robot that the numbers below are of [kg], [m]
CYCLE_TIME = 8.0  # [s]
TREADS_TIME = {1: 0.9, 2: 1.1, 3: 1.35}  # of it: a shorter step takes less time
FOUND_RADIUS = 0.008  # [m] of the feet with which `foothold_time` was found
MOST_AHEAD = 0.15  # of a leg: that the body may be ahead of its place, or behind
SWING_TIME, SHIFT_TIME = 1.2, 1.3  # [s]
WIDEST = {1: 0.25, 2: 0.36}  # of a leg: that they sway, by places a tread
SWITCH_WAIT = 0.75  # [s] where treads have several places: small robots sway far for their margin


def scenario_fields(robot: RobotModel, design: Design, runs: Sequence[float]) -> Fields:
    """The fields, by section, of a scenario with that gait.

    Args:
        robot: The robot.
        design: The gait.
        runs: Of the course's treads [m]: of them all the feet keep whole on the shallowest.
    """
    c, leg = design.gait, leg_length(robot)
    run = min(runs, default=1.0)
    # Off the places [treads].
    most = max(0.5 / c.pattern.per_tread - (robot.foot_radius + EDGE) / run, 0.0)
    share = float(c.share[0])
    size, mass = leg / LEG, robot.mass / MASS
    tempo = sqrt(size)
    cycle_time = CYCLE_TIME * tempo * TREADS_TIME[c.pattern.treads]
    gait: dict[str, float | int | str] = {
        "duty_factor": c.duty_factor,
        "cycle_time": cycle_time,
        # As short as on the stairs: front feet are on treads while rear feet are not yet.
        "switch_wait": SWITCH_WAIT * tempo if c.pattern.per_tread > 1 else 0.0,
        "stride": min(design.stride, c.pattern.treads * run / c.pattern.per_tread),
        "treads": c.pattern.treads,
        "lag": c.pattern.lag,
        "places_per_tread": c.pattern.per_tread,
        "body_ahead": c.pattern.ahead(c.duty_factor),
        "tread_phase_up": most * float(c.phase_up[0]),
        "tread_phase_down": most * float(c.phase_down[0]),
        "body_shift_up": float(c.shift_up[0]),
        "body_shift_down": float(c.shift_down[0]),
        "lift_down": float(c.lift_down[0]),
        "shank_room": design.wanted["legs"],
        "max_ahead": MOST_AHEAD * leg + float(c.surge[0]),
        "stance_length": hip_length(robot),
        "stance_width": float(c.width[0]),
        "stance_stagger": c.stagger,
        # The joints' own limits are checked: boxes as large as a leg are none.
        "workspace_length": 4.0 * leg,
        "workspace_width": 4.0 * leg,
        "swing_clearance": swing_clearance(robot),
        "body_height": float(c.height[0]),
        "pitch": "slope" if share > 0.0 else "level",
        "pitch_share": share,
    }
    return {
        "gait": {key: _short(value) for key, value in gait.items()},
        "spin": {
            "cycle_time": _short(CYCLE_TIME * tempo),
            "workspace_length": _short(0.65 * leg),
            "workspace_width": _short(0.41 * leg),
        },
        "transition": {
            "max_shift": _short(WIDEST[c.pattern.per_tread] * leg),
            "swing_time": _short(SWING_TIME * tempo),
            "shift_time": _short(SHIFT_TIME * tempo),
        },
        "body": {
            "margin_desired": _short(0.10 * size),
            "zmp_margin": _short(0.08 * size),
        },
        "controller": control_fields(mass, size, robot.foot_radius),
    }


def control_fields(mass: float, size: float, foot_radius: float) -> dict[str, float | int | str]:
    """The controller's, for a robot of so many times the mass and leg length.

    A foot rolls on as far as it is thick [m], and what it is held at lags behind by what it rolls
    in `foothold_time`: thick feet were pulled at by their joints, which tipped light robots.
    """
    tempo = sqrt(size)
    foothold_time = 0.3 * tempo * min(1.0, FOUND_RADIUS * size / foot_radius)
    return {
        "kind": "whole_body",
        "period": 0.002,
        "kp": _short(2000.0 * mass * size),
        "kd": _short(80.0 * mass * size * tempo),
        "base_stiffness": _short(3000.0 * mass / size),
        "base_damping": _short(900.0 * mass / tempo),
        "base_rotation_stiffness": _short(1000.0 * mass * size),
        "base_rotation_damping": _short(100.0 * mass * size * tempo),
        "least_force": _short(20.0 * mass),
        "unload_time": _short(0.25 * tempo),
        "foothold_time": _short(foothold_time),
        "touchdown_press": _short(max(0.003 * size, 0.001)),
        "lift_off_margin": _short(0.02 * size),
        "pressure_margin": _short(0.01 * size),
        "push_speed": _short(0.12 * tempo),
    }


def _short(value: float | int | str) -> float | int | str:
    """Four digits are enough, and pleasant to read."""
    return float(f"{value:.4g}") if isinstance(value, float) else value
