"""Chooses a gait's times for speed: the shortest that keep the margins that are required.

A gait that was found for margin is slow. Its swings, and the time on four feet at its switches, are
made as short as the margin allows that is to be kept (`tempo.py`). The two trade against each
other: legs that swing quickly push the body about, so that heavy legs gain by longer swings.
"""

import copy
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import inf

from drake_quad.errors import PlanningError
from drake_quad.gait_design.candidates import flights_of
from drake_quad.gait_design.choose_gait import Design
from drake_quad.gait_design.designed import Designed, Walks
from drake_quad.gait_design.foot_speeds import ANY_SPEED, PEAK, FootSpeeds, slowest
from drake_quad.gait_design.pace import zmp_margin
from drake_quad.gait_design.preference import (
    KEPT,
    RequiredMargins,
)
from drake_quad.gait_design.switch_time import seek_switch
from drake_quad.gait_design.tempo import (
    Tempo,
    TempoTrial,
    is_calm,
    keeps_all_else,
    least_margin,
    least_zmp_margin,
    tread_way,
    try_tempo,
    usual_tempo,
)
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import RobotModel, leg_length
from drake_quad.scenario.build import course_of
from drake_quad.scenario.config import Scenario

STRETCH, OTHER = 1.25, 1.0  # ratios of the shortest swing: the first, and then another
CALM = 1.75  # the first where that finds nothing: heavy legs throw the body about
LOWERED = (0.0, 0.03)  # of a leg: by which a body is lowered that cannot walk higher
FIRST_SHARES = (0.35, 0.7)  # of the way to times that are no quicker: tried if the usual fail
SOUGHT_MOST = (3.0, 2.0, 1.25)  # of what `balanced` keeps, or more is to be kept: what paths seek
CLOSE = 0.05  # of the margin that is to be kept: so near is near enough
CLOSE_MOVING = 0.1  # the same where a gait is balanced by its motion, whose plans take long
SAME_SPEED = 0.02  # shares of a foot's speed that make no difference
PLANS = 4  # with other speeds of the feet, at most
FASTER = (1.0, 0.5)  # shares of the way to feet as fast as their own joints allow
CRITICAL = 0.25  # of the margin that is to be kept: walks with so little more are tried, too
TRIES = 6  # plans of the whole mission, where it leaves less than its critical walks
WORTH = 1.02  # ratio of speeds from which another gait is taken
ENOUGH = 0.97  # of a speed asked for that is as good: a body sways as it begins a flight


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


class SearchStoppedError(Exception):
    """Nobody wants to wait for another trial."""


@dataclass(eq=False)
class Trials:
    """The trials with one ratio of swings, at one height of the body, whose paths seek one margin.

    Attributes:
        known: The trials, by time at the switches [s].
        first: The first one that there is a plan of, which is of the whole mission.
        critical: The tasks that later ones are of, by their places in the mission; those first
            that had the least margin.
    """

    known: dict[float, TempoTrial | None] = field(default_factory=dict)
    first: TempoTrial | None = None
    critical: tuple[int, ...] = ()

    @property
    def walks(self) -> Walks | None:
        """The tasks that are planned for the next trial, and how they begin; None if all are."""
        if self.first is None or not self.critical:
            return None
        plans = self.first.designed.plan.plans
        return tuple((k, plans[k - 1].end) for k in self.critical)


class TempoSearch:
    """Seeks the quickest times of a gait for its course, measured against the slow gait."""

    def __init__(
        self,
        gait: GaitChoice,
        slow: Designed,
        robot: RobotModel,
        kept: RequiredMargins,
        source: str,
        note: Callable[[str], object] = lambda _: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Takes the gait, and what it is measured by.

        Args:
            gait: The gait.
            slow: The gait that was found for margin.
            robot: The scenario's.
            kept: The margins that are to be kept.
            source: What an error names.
            note: Receives a line after each trial.
            stop: Whether no other trial is to be made, asked before each.
        """
        self._gait, self._slow, self._robot, self._source = gait, slow, robot, source
        self._note, self._stop = note, stop
        self.so_far: TempoTrial | None = None  # the quickest plan of all that keeps enough
        self._moving = gait.scenario.body.balance == "dynamic"
        self._kept, self._most = kept, inf
        course = course_of(gait.scenario, source=source, foot_radius=robot.foot_radius)
        runs = [s.run for s in flights_of(course, gait.scenario.gait.deep_tread)]
        self._way = tread_way(gait.scenario.gait, min(runs))
        self._speeds = FootSpeeds.all_at(ANY_SPEED)
        # Whether all are as slow as one joint asks, and whether each is as fast as its own then.
        self._limited = self._grouped = False
        self._refused = False  # whether the gait's footprints have been refused
        self._scenario = gait.scenario
        self._stretch = STRETCH
        self._rooms_known: dict[tuple[float, float], dict[float, Trials]] = {}
        self._trials: dict[float, Trials] = {}  # by ratio of swings
        self._parts = True  # whether later trials are of the critical tasks alone

    def quickest(
        self, enough: float | None, faster_than: float, kept: RequiredMargins | None = None
    ) -> TempoTrial | None:
        """The quickest plan that keeps enough on the course; None if none is found.

        Args:
            enough: A speed that is enough [m/s], if there is one.
            faster_than: A speed that is of no interest, or any lower one [m/s].
            kept: The margins that are to be kept, from now on; as before if None.

        Raises:
            SearchStoppedError: It is stopped before it ends; see `so_far`.
        """
        self._kept = self._kept if kept is None else kept
        # A speed that is asked for has to be met by all of them.
        self._parts = self._parts and enough is None
        for stretch in (STRETCH, CALM):
            self._stretch = stretch
            found = self._quickest_so(enough, faster_than)
            if found is not None:
                return found
        return None

    def _quickest_so(self, enough: float | None, faster_than: float) -> TempoTrial | None:
        """The same with swings first so long as was chosen last.

        Args:
            enough: A speed that is enough [m/s], if there is one.
            faster_than: A speed that is of no interest, or any lower one [m/s].
        """
        first = self._usual(self._stretch).switch
        longest = self._longest_switch(self._stretch, WORTH * faster_than)
        if longest <= self._usual(self._stretch).gap:
            return None
        # A gait that has no plan with the usual times may have one with longer ones.
        longer = (first + share * (longest - first) for share in FIRST_SHARES if longest > first)
        for switch in (first, *longer):
            most = -inf
            for trial in self._rooms(switch):
                # Another choice is worth a search only if it begins with more margin.
                spare = self._spare(trial, self._kept)
                if spare > most:
                    most, found = spare, self._quickest_here(enough, faster_than, switch)
                    if found is not None:
                        return found
            if most > -inf:
                break
        return None

    def _quickest_here(
        self, enough: float | None, faster_than: float, first: float
    ) -> TempoTrial | None:
        """The same at the height and with the margin sought that were chosen last.

        Args:
            enough: A speed that is enough [m/s], if there is one.
            faster_than: A speed that is of no interest, or any lower one [m/s].
            first: The time at the switches to begin with [s].
        """
        at = None if enough is None else self._at_speed(enough)
        for _ in range(TRIES):
            found = at or self._seek(first, faster_than)
            at = None
            if found is None or found.walks is None:
                return found
            # The same times with all that was left out.
            self._speeds = found.tempo.speeds
            whole = self._calm_plan(found.tempo)
            if whole is not None and self._spare(whole, self._kept) >= 0.0:
                return whole if whole.speed > faster_than else None
            self._learn(found, whole)
        return None

    def spread(
        self, times: Iterable[tuple[float, float]], note: Callable[[str], object]
    ) -> Iterator[TempoTrial]:
        """Plans of the whole course that keep enough, with each of some times.

        The body's path seeks all the margin that it can have, or less where that takes the body too
        near to the stairs.

        Args:
            times: Ratios to the shortest swing, and to the usual time at the switches.
            note: Receives a line before each plan.
        """
        if next(self._rooms(self._usual(STRETCH).switch), None) is None:
            return
        room = self._most
        for stretch, share in times:
            usual = self._usual(stretch)
            tempo = replace(usual, switch=max(share * usual.switch, usual.gap))
            note(f"planning with {tempo.swing:.2f} s a swing, {tempo.switch:.2f} s at the switches")
            for most in (inf, room):
                self._most = most
                found = self._calm_plan(tempo)
                if found is not None and self._spare(found, self._kept) >= 0.0:
                    yield found
                    break

    def trial(self, stretch: float, switch: float) -> TempoTrial | None:
        """A plan with swings longer by a ratio, and some time at the switches [s]; None without.

        Feet are made slower, for this trial and others, if their joints would turn too fast. There
        are no more trials once a gait without a plan sets feet down too near each other: where its
        footprints are does not depend on times, and hardly on the body's height.
        """
        if self._refused:
            return None
        trials = self._trials.setdefault(stretch, Trials())
        if switch not in trials.known:
            if self._stop():
                raise SearchStoppedError
            tempo = replace(self._usual(stretch), switch=switch)
            found = self._calm_plan(tempo, trials.walks)
            trials.known[switch] = found
            self._keep(found)
            if found is not None:
                left = f"{1e3 * found.designed.margin:.0f} mm"
                self._note(f"tried {found.speed:.3f} m/s, which leaves {left}")
            if found is not None and trials.first is None:
                trials.first = found
                trials.critical = self._critical(found) if self._parts else ()
        return trials.known[switch]

    def _keep(self, found: TempoTrial | None) -> None:
        """Remembers a plan of all tasks that keeps enough, if it is the quickest so far."""
        if found is None or found.walks is not None or self._spare(found, self._kept) < 0.0:
            return
        if self.so_far is None or found.speed > self.so_far.speed:
            self.so_far = found

    def _critical(self, trial: TempoTrial) -> tuple[int, ...]:
        """The tasks of a whole plan with the least margin, or nearly so, by places in it."""
        plans = (plan for plan in trial.designed.plan.plans if plan.contacts.steps)
        left = sorted((self._left(plan), plan.index) for plan in plans)
        near = CRITICAL * self._kept.margin
        return tuple(k for spare, k in left if spare <= left[0][0] + near)

    def _left(self, plan: MotionPlan) -> float:
        """The margin that a task's plan leaves beyond what is to be kept [m]."""
        seen = least_zmp_margin if self._moving else least_margin
        margin = min(plan.margin, seen(self._robot, plan))
        return self._kept.spare(margin, zmp_margin(self._robot, plan))

    def _learn(self, trial: TempoTrial, whole: TempoTrial | None) -> None:
        """Has later trials be of all tasks in which the whole plan left too little, too.

        Args:
            trial: The trial that left enough.
            whole: The plan of the whole mission with its times, which did not.
        """
        trials = next(t for t in self._trials.values() if trial in t.known.values())
        short = () if whole is None else self._critical(whole)
        more = tuple(k for k in short if k not in trials.critical)
        trials.critical = (*more, *trials.critical) if more else ()
        trials.known = {t: k for t, k in trials.known.items() if k is None or k.walks is None}
        trials.known[trial.tempo.switch] = whole

    def _calm_plan(self, tempo: Tempo, walks: Walks | None = None) -> TempoTrial | None:
        """A plan with some times, and feet as fast as their joints can follow.

        Where a joint could not follow at all, all feet are made slower at first. Then each group is
        made as fast as it can be, or half as much faster, where that leaves enough margin: quick
        legs push the body about.
        """
        found: TempoTrial | None = None
        for _ in range(PLANS):
            now = self._speeds
            try:
                found = self._plan(replace(tempo, speeds=now), walks)
            except PlanningError as error:
                self._refused = "footprints_apart" in error.data and not self._gait.planned
                too_fast = error.data.get("too_fast")
                if too_fast is None:
                    break
                self._speeds = now.at_most(PEAK / too_fast * error.data["foot_speed"])
                self._limited, self._grouped = True, False
            else:
                if is_calm(found):
                    if self._limited and not self._grouped:
                        self._grouped = True
                        return self._group(found, walks)
                    break
                self._speeds = slowest([now, found.suits])
            if self._speeds.like(now, SAME_SPEED):
                break
        return found

    def _group(self, slowed: TempoTrial, walks: Walks | None) -> TempoTrial:
        """A plan whose feet are faster where they can be, if it leaves enough; the speeds stay.

        Args:
            slowed: The plan with all feet as slow as one joint asks.
            walks: The tasks that are planned; all if None.
        """
        best, most = slowed, self._spare(slowed, self._kept)
        for share in FASTER:
            speeds = slowed.tempo.speeds.towards(slowed.suits.at_most(ANY_SPEED), share)
            try:
                found = self._plan(replace(slowed.tempo, speeds=speeds), walks)
            except PlanningError:
                continue
            spare = self._spare(found, self._kept)
            if spare >= 0.0 or spare > most:
                best, most = found, spare
            if spare >= 0.0:
                break
        self._speeds = best.tempo.speeds
        return best

    def _plan(self, tempo: Tempo, walks: Walks | None) -> TempoTrial:
        return try_tempo(
            self._scenario, self._gait.design, self._robot, tempo, most=self._most,
            source=self._source, walks=walks,
            enough=lambda plan: walks is None or self._left(plan) >= 0.0,
        )  # fmt: skip

    def _usual(self, stretch: float) -> Tempo:
        return usual_tempo(self._gait.scenario.gait, self._robot, stretch, moving=self._moving)

    def _longest_switch(self, stretch: float, speed: float) -> float:
        """The time at the switches with which there is a speed, if no swing lasts longer [s]."""
        usual = self._usual(stretch)
        return 0.5 * (self._way / speed - 4.0 * usual.swing) - usual.gap

    def _rooms(self, switch: float) -> Iterator[TempoTrial]:
        """Chooses how much margin the body's path seeks, and lowers the body, where that is needed.

        A path that seeks much margin takes the body far off its way, and so near to the stairs, or
        as quickly from side to side as costs the zero-moment point its margin. A gait of which
        there is a plan with slow times stays as high as it is.

        Yields:
            A plan that leaves enough of all but margin, of each choice that has one.
        """
        height, leg = self._gait.scenario.gait.body_height, leg_length(self._robot)
        for share in LOWERED[: 1 if self._gait.planned else None]:
            self._scenario = copy.deepcopy(self._gait.scenario)
            self._scenario.gait.body_height = float(f"{height - share * leg:.4g}")
            for most in SOUGHT_MOST:
                self._most = most * max(self._kept.margin, KEPT * self._slow.margin)
                self._trials = self._rooms_known.setdefault((share, self._most), {})
                found = self.trial(self._stretch, switch)
                if found is not None and keeps_all_else(found, self._slow):
                    yield found

    def _spare(self, trial: TempoTrial | None, kept: RequiredMargins) -> float:
        """The margin that a trial leaves beyond what is to be kept [m]; -inf if it is of no use."""
        if trial is None or not keeps_all_else(trial, self._slow):
            return -inf
        return kept.spare(trial.designed.margin, trial.pace.zmp_margin)

    def _at_speed(self, speed: float) -> TempoTrial | None:
        """A plan with all the time that there is at a speed [m/s]; None if it keeps too little."""
        least = self._usual(self._stretch).gap
        switch = max(self._longest_switch(self._stretch, speed), least)
        found = self.trial(self._stretch, switch)
        if found is not None and 0.0 < found.speed < speed:  # tall swings last longer
            late = 0.5 * self._way * (1.0 / found.speed - 1.0 / speed)
            found = self.trial(self._stretch, max(switch - late, least))
        enough = found is not None and found.speed >= ENOUGH * speed
        return found if enough and self._spare(found, self._kept) >= 0.0 else None

    def _seek(self, first: float, faster_than: float) -> TempoTrial | None:
        """The quickest trial that keeps margins; None if none that is quicker does.

        Args:
            first: The time at the switches to begin with [s].
            faster_than: A speed that is of no interest, or any lower one [m/s].
        """
        best: TempoTrial | None = None
        for stretch in (self._stretch, OTHER):
            # A longer time at the switches would be no quicker than what is known already.
            most = self._longest_switch(stretch, WORTH * faster_than)
            least = self._usual(stretch).gap
            if most <= least or (best is None and stretch == OTHER):
                continue
            trials = self._trials.setdefault(stretch, Trials())
            switch = seek_switch(
                lambda t, by=stretch: self._spare(self.trial(by, t), self._kept),  # type: ignore[misc]
                first if best is None else 0.95 * most,
                least,
                near=(CLOSE_MOVING if self._moving else CLOSE) * self._kept.margin,
                most=most,
                known={t: self._spare(trial, self._kept) for t, trial in trials.known.items()},
            )
            found = trials.known.get(switch)
            if found is not None and found.speed > faster_than:
                best, faster_than = found, found.speed
        return best
