"""How fast the feet of a gait swing: as fast as their joints can follow, group by group.

A swing lasts as long as its foot takes at the speed of its group: swings on one level, of all
legs, and those up and down, leg by leg. A leg that reaches far, or folds much, as it steps up
turns its knee quickly at a speed of the foot at which another leg's knee hardly moves.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf

import numpy as np

from drake_quad.gait_design.pace import HALF, PER_SWING, joint_speeds
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.step_builder import goes, peak_speed
from drake_quad.robot.legs import LEGS
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.motion_config import GaitConfig

ANY_SPEED = 20.0  # [m/s] of a swing foot: then swings are calm, and none lasts longer
JUST_AS_LONG = 1.01  # ratio of times: scenarios have them to four digits
PEAK = 0.8  # of a joint's speed limit: what swings may ask for


@dataclass(frozen=True)
class FootSpeeds:
    """Speeds that swing feet do not exceed along the ground, up or down [m/s].

    Attributes:
        level: `gait.swing_speed`: of swings on one level; 0: all swings last as long.
        up: `gait.swing_speed_up`: of swings up, one a leg.
        down: `gait.swing_speed_down`: of swings down, one a leg.
    """

    level: float = 0.0
    up: tuple[float, ...] = (0.0,) * 4
    down: tuple[float, ...] = (0.0,) * 4

    @classmethod
    def all_at(cls, speed: float) -> "FootSpeeds":
        """The same speed for all."""
        return cls(speed, (speed,) * 4, (speed,) * 4)

    @classmethod
    def of(cls, gait: GaitConfig) -> "FootSpeeds":
        """Those of a scenario's gait, whose zeros are as fast as on one level."""
        ways = (gait.swing_speed_up, gait.swing_speed_down)
        up, down = (tuple(getattr(w, g.short) or gait.swing_speed for g in LEGS) for w in ways)
        return cls(gait.swing_speed, up, down)

    def put(self, gait: GaitConfig) -> None:
        """Writes them into a scenario's gait, to three digits; 0 where they are as on one level."""
        gait.swing_speed = _short(self.level)
        for way, speeds in ((gait.swing_speed_up, self.up), (gait.swing_speed_down, self.down)):
            for leg, speed in zip(LEGS, speeds, strict=True):
                setattr(way, leg.short, 0.0 if speed == self.level else _short(speed))

    def at_most(self, speed: float) -> "FootSpeeds":
        """None faster than that [m/s]."""
        return slowest([self, FootSpeeds.all_at(speed)])

    def towards(self, other: "FootSpeeds", share: float) -> "FootSpeeds":
        """So much of the way to other speeds, in ratios: 1 is all of it."""
        return FootSpeeds.from_values(
            a ** (1.0 - share) * b**share for a, b in zip(self.values, other.values, strict=True)
        )

    @classmethod
    def from_values(cls, values: Iterable[float]) -> "FootSpeeds":
        """The speeds of such `values`."""
        level, *legs = values
        return cls(level, tuple(legs[:4]), tuple(legs[4:]))

    @property
    def values(self) -> tuple[float, ...]:
        """All of them (9,)."""
        return (self.level, *self.up, *self.down)

    def like(self, other: "FootSpeeds", within: float) -> bool:
        """Whether each differs from another's by no more than that share."""
        pairs = zip(self.values, other.values, strict=True)
        return all(abs(a - b) <= within * b for a, b in pairs)


NO_SPEEDS = FootSpeeds()


def _short(speed: float) -> float:
    return float(f"{speed:.3g}")


def slowest(speeds: Iterable[FootSpeeds]) -> FootSpeeds:
    """The least of each; infinite if there are none."""
    least = [min(column) for column in zip(*(s.values for s in speeds), strict=True)] or [inf] * 9
    return FootSpeeds.from_values(least)


def suited_speeds(robot: RobotModel, plan: MotionPlan, shortest: float) -> FootSpeeds:
    """The speeds with which a plan's swings would ask for PEAK of the joints' speeds.

    Swings that last no longer than the shortest, and ask for no more, are not held back by a speed.

    Args:
        robot: The robot.
        plan: A walk's, or of another task, whose swings do not count.
        shortest: How long the gait's swings last at least [s].

    Returns:
        The least of each group; infinite where a group has no swing that is held back.
    """
    begin = min((s.start for s in plan.segments if s.kind == "wave"), default=inf)
    steps = [step for step in plan.contacts.steps if step.lift_off >= begin]
    if not steps:
        return FootSpeeds.all_at(inf)
    times = np.concatenate([np.linspace(s.lift_off, s.touchdown, PER_SWING) for s in steps])
    inside = np.clip(times, HALF, plan.duration - HALF)
    share = (joint_speeds(robot, plan, inside)[0] / robot.speed).reshape(len(steps), -1, 4, 3)
    least = np.full((3, 4), inf)  # level, up and down
    for step, mine in zip(steps, share, strict=True):
        row = step.leg.row
        asked = float(mine[:, row].max())
        if asked <= PEAK and step.swing.duration <= JUST_AS_LONG * shortest:
            continue
        suits = peak_speed(step.swing) * PEAK / asked
        way = goes(step.swing)
        least[way, row] = min(least[way, row], suits)
    return FootSpeeds(float(least[0].min()), tuple(least[1].tolist()), tuple(least[-1].tolist()))
