"""Plans a gait with given times, and feet as fast as their joints can follow."""

import copy
from dataclasses import dataclass, replace
from math import inf

from drake_quad.errors import PlanningError
from drake_quad.gait_design.choose_gait import Design
from drake_quad.gait_design.designed import Designed, Walks
from drake_quad.gait_design.foot_speeds import ANY_SPEED, PEAK, FootSpeeds, slowest
from drake_quad.gait_design.pace import zmp_margin
from drake_quad.gait_design.preference import RequiredMargins
from drake_quad.gait_design.short_course import fewer_steps
from drake_quad.gait_design.tempo import (
    Tempo,
    TempoTrial,
    is_calm,
    keeps_all_else,
    least_margin,
    least_zmp_margin,
    try_tempo,
    usual_tempo,
)
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import RobotModel, leg_length
from drake_quad.scenario.config import Scenario

SAME_SPEED = 0.02  # shares of a foot's speed that make no difference
FALLS_OVER = 0.5  # of the margin to be kept, below zero
PLANS = 4  # with other speeds of the feet, at most
FASTER = (1.0, 0.5)  # shares of the way to feet as fast as their own joints allow


@dataclass(frozen=True, eq=False)
class GaitChoice:
    """A gait whose times are to be chosen.

    Attributes:
        scenario: The scenario with the gait's fields.
        design: The gait.
        planned: Whether there is a plan of it already, with slow times: it is not lowered.
    """

    scenario: Scenario
    design: Design
    planned: bool = False


class TempoPlanner:
    """Plans one gait with one tempo after another; what joints can follow is learned on the way.

    Attributes:
        gait: The gait.
        kept: The margins that are to be kept.
        most: Paths of the body seek no more margin than that [m].
        scenario: The gait's scenario, with the body as high as was asked for last.
        speeds: How fast feet go.
        refused: Whether the gait's footprints have been refused.
        falls_over: Whether the last `plan` had a static margin so far below zero that a path which
            seeks another margin hardly gives it any.
        cut: Whether plans are of the course with its long flights cut short, for now.
    """

    def __init__(
        self,
        gait: GaitChoice,
        slow: Designed,
        robot: RobotModel,
        kept: RequiredMargins,
        source: str,
    ) -> None:
        """Takes the gait, and what its plans are measured by.

        Args:
            gait: The gait.
            slow: The gait that was found for margin.
            robot: The scenario's.
            kept: The margins that are to be kept.
            source: What an error names.
        """
        self._slow, self._robot, self._source = slow, robot, source
        self._moving = gait.scenario.body.balance == "dynamic"
        self.gait, self.kept, self.most, self.scenario = gait, kept, inf, gait.scenario
        self.speeds, self.refused = FootSpeeds.all_at(ANY_SPEED), False
        self.falls_over = False
        self.cut = fewer_steps(gait.scenario) is not gait.scenario
        # Whether all are as slow as one joint asks, and whether each is as fast as its own then.
        self._limited = self._grouped = False
        self._warm_starts: dict[int, MotionPlan] = {}  # the last plan of each task

    def lower(self, share: float) -> None:
        """Plans from now on with the body lower by a share of a leg."""
        height, leg = self.gait.scenario.gait.body_height, leg_length(self._robot)
        self._warm_starts.clear()
        self.scenario = copy.deepcopy(self.gait.scenario)
        self.scenario.gait.body_height = float(f"{height - share * leg:.4g}")

    def plan(self, tempo: Tempo, walks: Walks | None = None) -> TempoTrial | None:
        """A plan with some times, and feet as fast as their joints can follow.

        Where a joint could not follow at all, all feet are made slower at first. Then each group is
        made as fast as it can be, or half as much faster, where that leaves enough margin: quick
        legs push the body about.

        Args:
            tempo: The times; of the speeds of feet nothing is taken from it.
            walks: The tasks that are planned, and how they begin; all if None.

        Returns:
            The plan; None if there is none.
        """
        found: TempoTrial | None = None
        self.falls_over = False
        for _ in range(PLANS):
            now = self.speeds
            try:
                found = self._try(replace(tempo, speeds=now), walks)
            except PlanningError as error:
                self.refused = "footprints_apart" in error.data and not self.gait.planned
                margin = error.data.get("margin", 0.0)
                self.falls_over = not self._moving and margin < -FALLS_OVER * self.kept.margin
                too_fast = error.data.get("too_fast")
                if too_fast is None:
                    break
                self.speeds = now.at_most(PEAK / too_fast * error.data["foot_speed"])
                self._limited, self._grouped = True, False
            else:
                if is_calm(found):
                    if self._limited and not self._grouped:
                        self._grouped = True
                        return self._group(found, walks)
                    break
                self.speeds = slowest([now, found.suits])
            if self.speeds.like(now, SAME_SPEED):
                break
        return found

    def _group(self, slowed: TempoTrial, walks: Walks | None) -> TempoTrial:
        """A plan whose feet are faster where they can be, if it leaves enough; the speeds stay.

        Args:
            slowed: The plan with all feet as slow as one joint asks.
            walks: The tasks that are planned; all if None.
        """
        best, most = slowed, self.spare(slowed)
        for share in FASTER:
            speeds = slowed.tempo.speeds.towards(slowed.suits.at_most(ANY_SPEED), share)
            try:
                found = self._try(replace(slowed.tempo, speeds=speeds), walks)
            except PlanningError:
                continue
            spare = self.spare(found)
            if spare >= 0.0 or spare > most:
                best, most = found, spare
            if spare >= 0.0:
                break
        self.speeds = best.tempo.speeds
        return best

    def plan_from_scratch(self, tempo: Tempo) -> TempoTrial | None:
        """The whole course's plan as anyone finds it who has its times; None if there is none.

        Other plans have warm starts, or are of shorter flights. They are found sooner, and may
        differ a little.
        """
        cut, self.cut = self.cut, False
        try:
            self._warm_starts.clear()
            found = self.plan(tempo)
            if found is None or found.from_scratch:
                return found
            self._warm_starts.clear()
            return self._try(found.tempo, None)
        except PlanningError:
            return None
        finally:
            self.cut = cut

    def _try(self, tempo: Tempo, walks: Walks | None) -> TempoTrial:
        found = try_tempo(
            fewer_steps(self.scenario) if self.cut else self.scenario,
            self.gait.design, self._robot, tempo, most=self.most,
            source=self._source, walks=walks, warm_starts=self._warm_starts,
            enough=lambda plan: walks is None or self.left(plan) >= 0.0,
        )  # fmt: skip
        return replace(found, cut=self.cut)

    def usual(self, stretch: float) -> Tempo:
        """The usual times of the gait, with swings longer by a ratio than the shortest."""
        return usual_tempo(self.gait.scenario.gait, self._robot, stretch, moving=self._moving)

    def spare(self, trial: TempoTrial | None) -> float:
        """The margin that a trial leaves beyond what is to be kept [m]; -inf if it is of no use."""
        if trial is None or not keeps_all_else(trial, self._slow):
            return -inf
        return self.kept.spare(trial.designed.margin, trial.pace.zmp_margin)

    def left(self, plan: MotionPlan) -> float:
        """The margin that a task's plan leaves beyond what is to be kept [m]."""
        seen = least_zmp_margin if self._moving else least_margin
        margin = min(plan.margin, seen(self._robot, plan))
        return self.kept.spare(margin, zmp_margin(self._robot, plan))
