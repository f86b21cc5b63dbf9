"""Looks at an even flight, from its foot and from its treads, and the map of the first of them."""

import numpy as np
from rig import paper_robot, stance_at

from drake_quad.common import FloatArray
from drake_quad.control.ports import SIZE, GaitPhase
from drake_quad.gait.workspace import Workspace
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.growing_map import trust
from drake_quad.perception.level_beyond import Level
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_map import StairMap, make_stair_map
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.onward import Eyes
from drake_quad.planning.problem import PlanSettings

RISE, RUN, FIRST = 0.16, 0.3, 2.3
DEEP, NOT_SEEN = Level(2.0, ends_flight=True), Level(0.0, ends_flight=False)
FEET = np.array(
    [[3.05, 0.3, 3 * RISE], [3.05, -0.3, 3 * RISE], [2.45, 0.3, RISE], [2.1, -0.3, 0.0]]
)


def flight(
    first: int, count: int, *, sigma: float = 0.004, most: int | None = None, up: float = 0.0
) -> StairBelief:
    """What is told of `count` steps of an even flight; the camera has passed the `first` ones."""
    n = count
    sigmas = np.array([*[sigma] * n, *[0.002] * (n + 1), 0.002, 0.001, 0.002, 0.002])
    return StairBelief(
        stamp=0.9, origin=np.array([1.5 + first * RUN, 0.0]), passed=0,
        places=FIRST - 1.5 + RUN * np.arange(float(n)),
        heights=up + RISE * np.arange(first, first + n + 1.0), yaw=0.0, overhang=0.0, rise=RISE,
        run=RUN, covariance=np.diag(sigmas**2), count_least=n, count_most=most, is_open=False,
        right=-0.9, left=0.9,
    )  # fmt: skip


def first_map(count: int = 5, sigma: float = 0.004) -> StairMap:
    """The map of the first steps, seen from the floor."""
    found = make_stair_map(
        flight(0, count, sigma=sigma), NOT_SEEN, standing=np.array([1.0, 0.0]), floor=0.0,
        behind=1.0, landing=2.0, reach=0.4, to_its_end=False,
    )  # fmt: skip
    return trust(found, reach=0.4, yaw_sigma=0.002)


def gait() -> PlanSettings:
    """A gait of the shipped robot for such a flight, as it was designed for one."""
    return PlanSettings(
        duty_factor=0.85, cycle_time=8.788, stride=0.6,
        pattern=FootholdPattern(treads=2, lag=2, per_tread=1), body_ahead=-0.4,
        tread_phase_up=0.09, tread_phase_down=0.0255, body_shift_up=0.0007,
        body_shift_down=0.0335, shank_room=0.0418, max_ahead=0.1825,
        workspace=Workspace(R_x=4.867, R_y=4.867, P_x=0.8, P_y=0.6629), stance_stagger=0.0,
        body_height=0.9128, pitch_along_slope=0.9041, max_shift=0.3042,
    )  # fmt: skip


def eyes() -> Eyes:
    """A D435 on the shipped robot, held upright, 35 degrees down."""
    R_BC = level_rotation(pitch=np.radians(35.0))
    return Eyes(D435.model.turned(), R_BC, np.array([0.64, 0.0, 0.12]), 1.0)


def standing(known: StairMap, start: float = 1.0) -> Stance:
    """The shipped robot before the flight, where it has looked from."""
    course = known.course(foot_radius=paper_robot().foot_radius)
    return stance_at(course, gait(), start=start)


def phase_of(task: int) -> FloatArray:
    """The gait clock's state as a task begins."""
    phase = np.zeros(SIZE)
    phase[GaitPhase.TASK] = task
    return phase
