"""The answer whether a robot climbs stairs or a course, and what follows from it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import inf
from typing import Any

from drake_quad.certificate.certify import Certificate, certify_plans
from drake_quad.certificate.kinematics import shank_of
from drake_quad.feasibility.changes import Case, Change, find_change, kinds_for
from drake_quad.feasibility.flight import AS_USUAL, Around
from drake_quad.feasibility.nearest import nearest_stairs
from drake_quad.gait_design.candidates import hip_length
from drake_quad.gait_design.choose_gait import highest_rise
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.designer import design_longer
from drake_quad.gait_design.pace import NearestLimit, PlanPace, measure_pace, nearest_limit
from drake_quad.gait_design.preference import GaitPreference
from drake_quad.gait_design.speed_curve import SpeedCurve, trace_curve
from drake_quad.gait_design.tempo_search import ENOUGH
from drake_quad.infeasibility.boxes import ClimbClass
from drake_quad.infeasibility.proof import InfeasibilityProof, prove_infeasible
from drake_quad.planning.mission import MissionPlan
from drake_quad.robot.model import RobotModel, leg_length, link_outline_of
from drake_quad.scenario.build import course_of, mission_of
from drake_quad.scenario.config import Scenario
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.elements import Stairs
from drake_quad.util.display import html_table, one_line
from drake_quad.util.parallel import map_in_processes

MOST_MARGIN = GaitPreference()


def no_margin(_case: Case) -> float | None:
    """Nothing is found by an answer that nobody searched for."""
    return None


@dataclass(frozen=True, eq=False)
class Feasibility:
    """Whether a robot climbs stairs or a course, and how.

    Attributes:
        scenario: Robot and course; with the gait, ready to be run, if there is one.
        designed: The gait with its plan; None if there is none.
        reason: Why there is none.
        data: The figures behind the reason.
        robot: The robot; None if the answer is made up, as in a test.
        stairs: The flight of the question; None if the question was about a course.
        around: What is around the flight.
        preference: What the gait was to be good at.
        slow: The gait that was found for margin, against which quicker ones were measured; it is
            `designed` itself if none was sought or taken. None without a gait.
        stopped: Whether the search for a quicker gait was stopped before it ended.
        quick_margin: The static margin of a plan that a quick search finds for another robot, or
            other stairs [m]; None if it finds none.
    """

    scenario: Scenario
    designed: Designed | None
    reason: str
    data: dict[str, Any]
    robot: RobotModel | None = None
    stairs: Stairs | None = None
    around: Around = AS_USUAL
    preference: GaitPreference = MOST_MARGIN
    slow: Designed | None = None
    stopped: bool = False
    quick_margin: Callable[[Case], float | None] = no_margin

    @property
    def feasible(self) -> bool:
        """Whether there is a gait."""
        return self.designed is not None

    @cached_property
    def proof(self) -> InfeasibilityProof | None:
        """A proof that the flight cannot be climbed by any statically stable gait of its class.

        None if there is a plan, if no proof is found, or if none is sought: of a course; of open
        risers or an overhang, where feet have places that a proof leaves out; of another margin
        than the hull's, for on steep stairs friction holds a robot whose centre of mass is beside
        the polygon; of a gait that is balanced by its motion; of a landing so short that not all
        feet need to be on it at once.
        """
        flight, robot = self.stairs, self.robot
        if self.feasible or flight is None or not flight.closed or robot is None:
            return None
        if self.preference.dynamic:
            return None
        landing = self.around.landing
        apart = hip_length(robot) + 2.0 * leg_length(robot)  # of fore and hind feet, at most
        if self.scenario.gait.margin != HULL or (landing is not None and landing < apart):
            return None
        return prove_infeasible(robot, ClimbClass(flight.rise, flight.run, flight.count))

    @property
    def plan(self) -> MissionPlan | None:
        """The plan of the whole course; None if there is none."""
        return None if self.designed is None else self.designed.plan

    @property
    def margin(self) -> float | None:
        """Smallest margin of the plan [m]; None if there is no plan.

        It is the static one, or that of the zero-moment point, see `balanced_by_motion`.
        """
        return None if self.designed is None else self.designed.margin

    @cached_property
    def pace(self) -> PlanPace | None:
        """How fast the plan is on each flight, and what it asks of the joints; None without one."""
        return self._pace_of(self.designed)

    @cached_property
    def slow_pace(self) -> PlanPace | None:
        """The same of the gait that was found for margin; None if its times were not chosen."""
        return self._pace_of(self.slow) if self.preference.quick else None

    def _pace_of(self, designed: Designed | None) -> PlanPace | None:
        if designed is None or self.robot is None:
            return None
        course = course_of(designed.scenario, foot_radius=self.robot.foot_radius)
        tasks = mission_of(designed.scenario, course, source="check")
        return measure_pace(self.robot, course, tasks, designed.plan)

    @cached_property
    def certificate(self) -> Certificate | None:
        """What is proven of the plan at every time; None without a plan.

        None, too, if it is balanced by its motion: static margins are proven. Swings along arcs are
        not proven, and a designed gait has none.
        """
        if self.designed is None or self.robot is None or self.balanced_by_motion:
            return None
        if self.designed.certificate is not None:
            return self.designed.certificate
        course = course_of(self.designed.scenario, foot_radius=self.robot.foot_radius)
        plans = self.designed.plan.plans
        return certify_plans(self.robot, shank_of(self.robot), plans, course.boxes)

    @property
    def speed(self) -> float | None:
        """Speed of the body along the slowest flight [m/s]; None if there is none, or no plan."""
        slowest = None if self.pace is None else self.pace.slowest
        return None if slowest is None else slowest.speed

    @property
    def flight_time(self) -> float | None:
        """Time for the slowest flight [s]; None if there is none, or no plan."""
        slowest = None if self.pace is None else self.pace.slowest
        return None if slowest is None else slowest.time

    @property
    def balanced_by_motion(self) -> bool:
        """Whether there is a plan whose margin is that of the zero-moment point."""
        return self.plan is not None and self.plan.dynamic

    @property
    def unmet(self) -> list[str]:
        """What was asked for and the plan is not: the speed, the margin, the balance, in words."""
        preference, quick, margin = self.preference, self.speed, self.margin
        words = []
        if preference.speed is not None and (quick is None or quick < ENOUGH * preference.speed):
            words.append(f"at {preference.speed:g} m/s")
        least = preference.min_margin
        if least is not None and (margin is None or margin < least):
            words.append(f"with a margin of {least:g} m")
        if preference.dynamic and not self.balanced_by_motion:
            words.append("balanced by motion")
        return words

    @property
    def fulfilled(self) -> bool:
        """Whether the plan is what was asked for: as quick, with as much margin, as balanced."""
        return not self.unmet

    @property
    def bound(self) -> NearestLimit | None:
        """The limit that the plan comes nearest to; None without a plan."""
        if self.designed is None or self.pace is None:
            return None
        return nearest_limit(
            self.pace,
            margin=None if self.balanced_by_motion else self.designed.margin,
            torque=self.designed.torque,
            room=self.designed.clearance.weighted,
            part=self.designed.clearance.part,
            wanted=self.designed.design.wanted,
        )

    def curve(self, note: Callable[[str], object] = lambda _: None) -> SpeedCurve | None:
        """Speed against static margin, for this robot and these stairs; None if there is no gait.

        Args:
            note: Receives a line before each plan.
        """
        slow = self.slow or self.designed
        if slow is None or self.robot is None:
            return None
        others = design_longer(slow, self.robot, source="check")
        return trace_curve(slow, self.robot, others=others, source="check", note=note)

    def nearest(self, note: Callable[[str], object] = lambda _: None) -> Stairs | None:
        """The nearest stairs that a quick search finds a gait for: lower steps, or deeper treads.

        Gaits for these are sought for margin, whatever the gait was to be good at.

        Args:
            note: Receives a line about each kind of stairs before it is tried.

        Returns:
            The stairs of the question if the robot climbs these; None if nothing was found, or if
            the question was about a course.
        """
        if self.feasible or self.stairs is None or self.robot is None:
            return self.stairs if self.feasible else None
        note("not these; looking for the nearest stairs that it can climb")
        check = self
        if "slacks" in self.data and "run" in self.data and "nearest_rise" not in self.data:
            # There is no gait at all, not even on endless stairs, where a lower rise takes less
            # time to judge.
            highest = highest_rise(
                self.robot, link_outline_of(self.robot), self.stairs.run, below=self.stairs.rise
            )
            check = replace(self, data={**self.data, "nearest_rise": highest})

        case = Case(self.robot, self.stairs, self.around.landing)

        def climbs(stairs: Stairs) -> bool:
            note(f"not these; trying {stairs}")
            return self.quick_margin(replace(case, stairs=stairs)) is not None

        return nearest_stairs(climbs, check.data, self.stairs)

    def changes(
        self,
        *,
        workers: int = 1,
        progress: Callable[[int, int], object] = lambda _done, _total: None,
    ) -> list[Change]:
        """What would make it a yes: the least change of each kind, alone, by a quick search.

        Each that is found is planned in full, on the whole flight. Empty if there is a plan, or if
        the question was about a course.

        Args:
            workers: Number of processes.
            progress: Receives the number of kinds of change that are done, and of all.

        Returns:
            A change of each kind; those that are found come first, the least of their figures'
            shares first.
        """
        if self.feasible or self.stairs is None or self.robot is None:
            return []
        case = Case(self.robot, self.stairs, self.around.landing)
        search = partial(find_change, self.quick_margin, case)
        names = [(name,) for name in kinds_for(case)]
        found = map_in_processes(search, names, workers=workers, progress=progress)
        return sorted(found, key=lambda one: inf if one.share is None else abs(one.share))

    def __repr__(self) -> str:
        who = "" if self.robot is None else self.robot.name
        where = self.scenario.description if self.stairs is None else str(self.stairs)
        if self.designed is None:
            return one_line(self, who, where, self._answer)
        speed = "" if self.speed is None else f"{self.speed:.3f} m/s on the flight"
        margin = f"{self._answer}, {margin_name(self.plan)} {self.designed.margin:.3f} m"
        return one_line(self, who, where, margin, speed)

    @property
    def _answer(self) -> str:
        """Yes or no in words; also what was asked for, where the plan is not that."""
        if self.designed is None:
            return f"no plan was found: {self.reason}"
        return f"yes{but_not(self.unmet)}"

    def _repr_html_(self) -> str:
        """The answer, where a notebook shows it."""
        rows = [("answer", self._answer)]
        if self.stairs is not None:
            rows.insert(0, ("stairs", str(self.stairs)))
        if self.robot is not None:
            rows.insert(0, ("robot", self.robot.name))
        if self.designed is not None:
            rows += [
                (f"{margin_name(self.plan)} of the plan", f"{1e3 * self.designed.margin:.0f} mm"),
                *(
                    []
                    if self.speed is None or self.flight_time is None
                    else [
                        (
                            "speed on the flight",
                            f"{self.speed:.3f} m/s, {self.flight_time:.0f} s for all of it",
                        )
                    ]
                ),
                ("torque that it leaves", f"{100.0 * self.designed.torque:.0f} % of the limit"),
                ("the whole course takes", f"{self.designed.plan.duration:.0f} s"),
            ]
        if self.certificate is not None:
            failure = self.certificate.failure
            proven = "for every time" if failure is None else f"no: {failure.reason}"
            rows.append(("certified", proven))
        return html_table(rows)


def but_not(unmet: Sequence[str]) -> str:
    """What a yes lacks of what was asked for, to go on with after it; empty if nothing."""
    return f", but not {' or '.join(unmet)}" if unmet else ""


def margin_name(plan: MissionPlan | None) -> str:
    """What a plan's margin is of, in words."""
    moving = plan is not None and plan.dynamic
    return "margin of the zero-moment point" if moving else "static margin"
