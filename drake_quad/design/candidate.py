"""Candidate gaits: the footprints' pattern, and what else a gait is free in."""

from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np

from drake_quad.gait.legs import BoolArray, FloatArray
from drake_quad.planning.pattern import Pattern
from drake_quad.robot.robot_model import RobotModel, leg_length

TREADS = (1, 2, 3)
LAGS = (1, 2, 3, 4)
STANCES = (0.5, 1.45)  # of the distance between the hips: a stance beyond these is not tried
STAGGER = 0.12  # of a leg
DUTY = 0.85
EDGE = 0.012  # [m] between a foot's sphere and a nosing or riser

# The columns of free parameters. Lengths in legs.
HEIGHT, SHARE, WIDER, PHASE_UP, PHASE_DOWN, SHIFT_UP, SHIFT_DOWN = range(7)
LOWER = np.array([0.50, 0.0, 0.0, -1.0, -1.0, -0.27, -0.27])
UPPER = np.array([0.97, 1.2, 0.35, 1.0, 1.0, 0.27, 0.27])
USUAL = np.array([0.82, 0.9, 0.08, 0.0, 0.0, 0.0, 0.0])  # what is taken where all do as well
# Where treads have several places, runs are long against the legs: more has to be free there.
LIFT_DOWN, SURGE = 7, 8
SHIFTS = [SHIFT_UP, SHIFT_DOWN]


@dataclass(frozen=True, eq=False)
class Grid:
    """C candidates of one pattern, in the robot's own measures [m], arrays (C,).

    Attributes:
        pattern: The footprints.
        height: Of B over the line through the treads.
        share: How much of the slope the body tilts with.
        width: Between left and right feet.
        phase_up: How far ahead of the treads' middles the feet stand going up, of what is possible.
        phase_down: The same going down.
        shift_up: How far ahead of the feet's middle the body goes, going up.
        shift_down: The same going down.
        lift_down: By how much the body is higher going down.
        surge: How far the body stays behind as front feet step, and goes ahead as rear feet do.
        duty_factor: β.
        stagger: Rear feet's |y| minus front feet's.
        stance_length: Between front and rear feet where the ground does not decide.
    """

    pattern: Pattern
    height: FloatArray
    share: FloatArray
    width: FloatArray
    phase_up: FloatArray
    phase_down: FloatArray
    shift_up: FloatArray
    shift_down: FloatArray
    lift_down: FloatArray
    surge: FloatArray
    duty_factor: float
    stagger: float
    stance_length: float

    def __len__(self) -> int:
        return len(self.height)

    def take(self, which: BoolArray) -> "Grid":
        """Those candidates of which `which` (C,) is true."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{k: v[which] for k, v in arrays.items() if np.ndim(v) == 1})

    def phase(self, run: float, *, up: bool, foot_radius: float) -> FloatArray:
        """How far ahead of the treads' middles the feet stand (C,) [m]."""
        most = max(0.5 / self.pattern.per_tread * run - foot_radius - EDGE, 0.0)
        return np.asarray(most * (self.phase_up if up else self.phase_down))


def bounds(pattern: Pattern) -> FloatArray:
    """Least, greatest and usual values of a pattern's free parameters, (3, 7 or 9)."""
    found = np.stack([LOWER, UPPER, USUAL])
    if pattern.per_tread == 1:
        return found
    found[:2, SHIFTS] = [[-0.4, -0.4], [0.4, 0.4]]
    return np.column_stack([found, [-0.1, 0.35, 0.0], [0.0, 0.06, 0.0]])


@lru_cache(maxsize=8)  # a search asks a thousand times
def hip_length(robot: RobotModel) -> float:
    """Between front and rear hips [m]."""
    x = robot.geometry.p_BH[:, 0]
    return float(np.mean(x[:2]) - np.mean(x[2:]))


def hip_width(robot: RobotModel) -> float:
    """Between the planes of left and right legs that hang straight down [m]."""
    y = np.abs(robot.geometry.p_BH[:, 1] + robot.geometry.offset)
    return float(2.0 * np.mean(y))


def make_grid(robot: RobotModel, pattern: Pattern, parameters: FloatArray) -> Grid:
    """Candidates from their free parameters (C, 7 or 9), see `bounds`."""
    leg = leg_length(robot)
    hips = robot.geometry.p_BH[:, 2] + robot.geometry.raised
    drop = -float(np.mean(hips))  # of the hip pitch axes below B
    p = np.asarray(parameters, dtype=np.float64).reshape(-1, bounds(pattern).shape[1])
    more = p[:, LIFT_DOWN:] if pattern.per_tread > 1 else np.zeros((len(p), 2))
    return Grid(
        pattern=pattern,
        height=p[:, HEIGHT] * leg + drop + robot.foot_radius,
        share=p[:, SHARE],
        width=hip_width(robot) + p[:, WIDER] * leg,
        phase_up=p[:, PHASE_UP],
        phase_down=p[:, PHASE_DOWN],
        shift_up=p[:, SHIFT_UP] * leg,
        shift_down=p[:, SHIFT_DOWN] * leg,
        lift_down=more[:, 0] * leg,
        surge=more[:, 1] * leg,
        duty_factor=DUTY,
        stagger=STAGGER * leg if pattern.shares_places else 0.0,
        stance_length=hip_length(robot),
    )


def make_patterns(robot: RobotModel, runs: list[float], per_tread: int = 1) -> list[Pattern]:
    """The patterns whose stance fits the robot on treads of all of these runs [m].

    Args:
        robot: The robot.
        runs: Of all treads.
        per_tread: How many places every tread is to have.
    """
    hips = hip_length(robot)
    if any(0.5 * run / per_tread < robot.foot_radius + EDGE for run in runs):
        return []
    return [
        pattern
        for pattern in (Pattern(treads, lag, per_tread) for treads in TREADS for lag in LAGS)
        if all(
            STANCES[0] * hips <= pattern.stance * run / per_tread <= STANCES[1] * hips
            for run in runs
        )
    ]
