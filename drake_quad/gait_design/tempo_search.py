"""Chooses a gait's times for speed: the shortest that keep the margins that are required.

A gait that was found for margin is slow. Its swings, and the time on four feet at its switches, are
made as short as the margin allows that is to be kept (`tempo.py`). The two trade against each
other: legs that swing quickly push the body about, so that heavy legs gain by longer swings.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from math import inf

from drake_quad.gait_design.candidates import flights_of
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.preference import KEPT, RequiredMargins
from drake_quad.gait_design.switch_time import seek_switch
from drake_quad.gait_design.tempo import TempoTrial, keeps_all_else, tread_way
from drake_quad.gait_design.tempo_planner import GaitChoice, TempoPlanner
from drake_quad.gait_design.tempo_trials import Failures, Trials, most_speed
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.build import course_of
from drake_quad.scenario.config import Scenario

# Ratios of the shortest swing. The next is tried if there is no gait yet, or one that mostly waits
# at its switches, and the zero-moment point is what is short: heavy legs throw the body about. Once
# there is a gait, a swing LESS times as long is tried, too.
STRETCHES = (1.25, 1.75, 2.25, 3.0)
LESS = 0.8
LONG_WAITS = 2.0  # of the time in swings, at the switches: longer swings may be quicker in all
LOWERED = (0.0, 0.03)  # of a leg: by which a body is lowered that cannot walk higher
FIRST_SHARES = (0.35, 0.7)  # of the way to times that are no quicker: tried if the usual fail
SOUGHT_MOST = (3.0, 2.0, 1.25)  # of what `balanced` keeps, or more is to be kept: what paths seek
MORE = 1e-3  # [m] of margin to begin with, for which another choice of these is worth a search
CLOSE = 0.05  # of the margin that is to be kept: so near is near enough
CLOSE_MOVING = 0.1  # the same where a gait is balanced by its motion, whose plans take long
CRITICAL = 0.25  # of the margin that is to be kept: walks with so little more are tried, too
TRIES = 6  # plans of the whole mission, where it leaves less than its critical walks
WORTH = 1.02  # ratio of speeds from which another gait is taken
ENOUGH = 0.97  # of a speed asked for that is as good: a body sways as it begins a flight


class SearchStoppedError(Exception):
    """Nobody wants to wait for another trial."""


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
        self._slow, self._note, self._stop = slow, note, stop
        self._planner = TempoPlanner(gait, slow, robot, kept, source)
        # Plans of all tasks that keep enough, each with its scenario and the margin that it seeks.
        self._enough: list[tuple[TempoTrial, Scenario, float]] = []
        self._moving = gait.scenario.body.balance == "dynamic"
        course = course_of(gait.scenario, source=source, foot_radius=robot.foot_radius)
        runs = [s.run for s in flights_of(course, gait.scenario.gait.deep_tread)]
        self._way = tread_way(gait.scenario.gait, min(runs))
        self._stretch = STRETCHES[0]
        self._rooms_known: dict[tuple[float, float], dict[float, Trials]] = {}
        self._trials: dict[float, Trials] = {}  # by ratio of swings
        self._parts = True  # whether later trials are of the critical tasks alone
        self._lowered = 0.0
        self._failures = Failures(gait.planned)

    def quickest(
        self, enough: float | None, faster_than: float, kept: RequiredMargins | None = None
    ) -> TempoTrial | None:
        """The quickest plan that keeps enough on the course; None if none is found.

        Args:
            enough: A speed that is enough [m/s], if there is one.
            faster_than: A speed that is of no interest, or any lower one [m/s].
            kept: The margins that are to be kept, from now on; as before if None.

        Raises:
            SearchStoppedError: It is stopped before it ends; see `verified_best`.
        """
        if kept is not None:
            self._planner.kept = kept
            # Paths seek less margin, and may have a plan.
            self._failures.forget(has_plan=self._failures.has_plan)
        if enough is not None:  # it has to be met by all of them
            self._parts = self._planner.cut = False
        best: TempoTrial | None = None
        for stretch in STRETCHES:
            self._stretch = stretch
            found = self._quickest_so(enough, faster_than)
            if found is not None:
                best, faster_than = found, found.speed
                if enough is not None or not found.tempo.waits > LONG_WAITS:
                    break
            if not self._throws_body(stretch):
                break
        return best

    def verified_best(self, faster_than: float) -> TempoTrial | None:
        """The quickest plan so far of all tasks that keeps enough; None without.

        A plan that had a warm start, or is of shorter flights, is planned again, from scratch.

        Args:
            faster_than: A speed that is of no interest, or any lower one [m/s].
        """
        planner = self._planner
        while self._enough:
            kept = max(self._enough, key=lambda kept: kept[0].speed)
            found, scenario, most = kept
            if most_speed(found) <= faster_than:
                return None
            if found.from_scratch and found.whole:
                return found
            self._enough.remove(kept)
            planner.scenario, planner.most, planner.speeds = scenario, most, found.tempo.speeds
            self._keep(planner.plan_from_scratch(found.tempo))
        return None

    def _throws_body(self, stretch: float) -> bool:
        """Whether slower swings may leave more margin.

        They may if there is no plan yet, or if the plan that leaves most has too little margin of
        the zero-moment point, or less of that than of the static one.

        Args:
            stretch: The ratio of the swings that were tried.
        """
        tried = [room[stretch].known for room in self._rooms_known.values() if stretch in room]
        plans = [trial for known in tried for trial in known.values() if trial is not None]
        if not plans:
            return True
        most = max(
            plans, key=lambda t: self._planner.kept.spare(t.designed.margin, t.pace.zmp_margin)
        )
        spare = most.designed.margin - self._planner.kept.margin
        return most.pace.zmp_margin - self._planner.kept.zmp_margin < max(spare, 0.0)

    def _quickest_so(self, enough: float | None, faster_than: float) -> TempoTrial | None:
        """The same with swings first so long as was chosen last.

        Args:
            enough: A speed that is enough [m/s], if there is one.
            faster_than: A speed that is of no interest, or any lower one [m/s].
        """
        first = self._planner.usual(self._stretch).switch
        longest = self._longest_switch(self._stretch, WORTH * faster_than)
        if longest <= self._planner.usual(self._stretch).gap:
            return None
        # A gait that has no plan with the usual times may have one with longer ones.
        longer = (first + share * (longest - first) for share in FIRST_SHARES if longest > first)
        for switch in (first, *longer):
            most = -inf
            for trial in self._rooms(switch):
                if self._far_off(trial):
                    return None
                # Another choice is worth a search only if it begins with more margin.
                spare = self._planner.spare(trial)
                if spare > most + MORE:
                    most, found = spare, self._quickest_here(enough, faster_than, switch)
                    if found is not None:
                        return found
            if most > -inf:
                break
        return None

    def _far_off(self, trial: TempoTrial) -> bool:
        """Whether the zero-moment point is so far out that no waiting brings it back."""
        return trial.pace.zmp_margin < -self._planner.kept.zmp_margin

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
            asked, at = at is not None, None
            if found is None or (found.whole and found.from_scratch):
                return found
            # The same times with all that was left out, and as anyone plans them.
            self._planner.speeds = found.tempo.speeds
            whole = self._planner.plan_from_scratch(found.tempo)
            self._keep(whole)
            if whole is not None and self._planner.spare(whole) >= 0.0:
                return whole if asked or whole.speed > faster_than else None
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
        self._planner.cut = False
        if next(self._rooms(self._planner.usual(STRETCHES[0]).switch), None) is None:
            return
        room = self._planner.most
        for stretch, share in times:
            usual = self._planner.usual(stretch)
            tempo = replace(usual, switch=max(share * usual.switch, usual.gap))
            note(f"planning with {tempo.swing:.2f} s a swing, {tempo.switch:.2f} s at the switches")
            for most in (inf, room):
                self._planner.most = most
                found = self._planner.plan_from_scratch(tempo)
                if found is not None and self._planner.spare(found) >= 0.0:
                    yield found
                    break

    def trial(self, stretch: float, switch: float) -> TempoTrial | None:
        """A plan with swings longer by a ratio, and some time at the switches [s]; None without.

        Feet are made slower, for this trial and others, if their joints would turn too fast. There
        are no more trials once a gait without a plan sets feet down too near each other: where its
        footprints are does not depend on times, and hardly on the body's height. Nor are there any
        once several times have had none: feet that are too fast are made slower, and else a plan is
        hardly there for a longer swing alone.
        """
        failures = self._failures
        if self._planner.refused or failures.hopeless:
            return None
        trials = self._trials.setdefault(stretch, Trials())
        if switch not in trials.known:
            if self._stop():
                raise SearchStoppedError
            tempo = replace(self._planner.usual(stretch), switch=switch)
            found = self._planner.plan(tempo, trials.walks)
            trials.known[switch] = found
            if found is None:
                falls_over = self._planner.falls_over and trials.walks is None
                failures.add(stretch, switch, self._lowered, falls_over=falls_over)
                return None
            failures.has_plan = True
            self._keep(found)
            left = f"{1e3 * found.designed.margin:.0f} mm"
            self._note(f"tried {found.speed:.3f} m/s, which leaves {left}")
            if trials.first is None:
                trials.first = found
                trials.critical = self._critical(found) if self._parts else ()
        return trials.known[switch]

    def _keep(self, found: TempoTrial | None) -> None:
        """Remembers a plan of all tasks that keeps enough."""
        if found is not None and found.walks is None and self._planner.spare(found) >= 0.0:
            self._enough.append((found, self._planner.scenario, self._planner.most))

    def _critical(self, trial: TempoTrial) -> tuple[int, ...]:
        """The tasks of a whole plan with the least margin, or nearly so, by places in it."""
        plans = (plan for plan in trial.designed.plan.plans if plan.contacts.steps)
        left = sorted((self._planner.left(plan), plan.index) for plan in plans)
        near = CRITICAL * self._planner.kept.margin
        return tuple(k for spare, k in left if spare <= left[0][0] + near)

    def _learn(self, trial: TempoTrial, whole: TempoTrial | None) -> None:
        """Has later trials be of all tasks in which the whole plan left too little, too.

        Where they are already, and on the course cut short, they are taken to leave so much less on
        the course itself, as this one did. If that has no plan, or one that keeps too little of
        something else than margin, later trials are of the course itself.

        Args:
            trial: The trial that left enough.
            whole: The plan of the whole mission with its times, which did not.
        """
        stretch, trials = next((s, t) for s, t in self._trials.items() if trial in t.known.values())
        if trial.cut and self._planner.spare(whole) == -inf:
            self._planner.cut = False
            for room in self._rooms_known.values():
                room.clear()
            self._failures.forget(has_plan=self._planner.gait.planned or whole is not None)
            self._trials[stretch] = Trials(known={trial.tempo.switch: whole})
            return
        short = () if whole is None or trial.walks is None else self._critical(whole)
        more = tuple(k for k in short if k not in trials.critical)
        if trial.cut and not more:
            assert whole is not None
            more_margin = self._planner.spare(trial) - self._planner.spare(whole)
            trials.cut_has_more = max(trials.cut_has_more, more_margin)
        else:
            if trial.walks is not None:  # else trials are of all tasks already
                trials.critical = (*more, *trials.critical) if more else ()
            trials.known = {t: k for t, k in trials.known.items() if self._stays(k)}
        trials.known[trial.tempo.switch] = whole

    def _stays(self, trial: TempoTrial | None) -> bool:
        """Whether a trial still tells something once one that left enough has proved not to."""
        if trial is None:
            return True
        sure = trial.from_scratch or self._planner.spare(trial) < 0.0
        return trial.walks is None and sure

    def _longest_switch(self, stretch: float, speed: float) -> float:
        """The time at the switches with which there is a speed, if no swing lasts longer [s]."""
        usual = self._planner.usual(stretch)
        return 0.5 * (self._way / speed - 4.0 * usual.swing) - usual.gap

    def _rooms(self, switch: float) -> Iterator[TempoTrial]:
        """Chooses how much margin the body's path seeks, and lowers the body, where that is needed.

        A path that seeks much margin takes the body far off its way, and so near to the stairs, or
        as quickly from side to side as costs the zero-moment point its margin. A gait of which
        there is a plan with slow times stays as high as it is. At a height at which the robot would
        fall over however it sways, and with longer times too, no others are tried.

        Yields:
            A plan that leaves enough of all but margin, of each choice that has one.
        """
        planner = self._planner
        for share in LOWERED[: 1 if planner.gait.planned else None]:
            if self._failures.always_falls(share):
                continue
            self._lowered = share
            planner.lower(share)
            for most in SOUGHT_MOST:
                planner.most = most * max(planner.kept.margin, KEPT * self._slow.margin)
                self._trials = self._rooms_known.setdefault((share, planner.most), {})
                found = self.trial(self._stretch, switch)
                if found is not None and keeps_all_else(found, self._slow):
                    yield found
                if found is not None:
                    continue
                if self._failures.falls(share, switch) or self._failures.hopeless:
                    break
                if self._failures.doubtful:
                    return  # one trial of these times is enough, where others had none at all

    def _at_speed(self, speed: float) -> TempoTrial | None:
        """A plan with all the time that there is at a speed [m/s]; None if it keeps too little."""
        least = self._planner.usual(self._stretch).gap
        switch = max(self._longest_switch(self._stretch, speed), least)
        found = self.trial(self._stretch, switch)
        if found is not None and 0.0 < found.speed < speed:  # tall swings last longer
            late = 0.5 * self._way * (1.0 / found.speed - 1.0 / speed)
            found = self.trial(self._stretch, max(switch - late, least))
        enough = found is not None and found.speed >= ENOUGH * speed
        return found if enough and self._planner.spare(found) >= 0.0 else None

    def _seek(self, first: float, faster_than: float) -> TempoTrial | None:
        """The quickest trial that keeps margins; None if none that is quicker does.

        Args:
            first: The time at the switches to begin with [s].
            faster_than: A speed that is of no interest, or any lower one [m/s].
        """
        best: TempoTrial | None = None
        for stretch in (self._stretch, LESS * self._stretch):
            # A longer time at the switches would be no quicker than what is known already.
            most = self._longest_switch(stretch, WORTH * faster_than)
            least = self._planner.usual(stretch).gap
            if most <= least or (best is None and stretch != self._stretch):
                continue
            trials = self._trials.setdefault(stretch, Trials())
            switch = seek_switch(
                lambda t, by=stretch: self._spare(by, self.trial(by, t)),  # type: ignore[misc]
                first if best is None else 0.95 * most,
                least,
                near=(CLOSE_MOVING if self._moving else CLOSE) * self._planner.kept.margin,
                most=most,
                known={t: self._spare(stretch, trial) for t, trial in trials.known.items()},
            )
            found = trials.known.get(switch)
            if found is not None and most_speed(found) > faster_than:
                best, faster_than = found, found.speed
        return best

    def _spare(self, stretch: float, trial: TempoTrial | None) -> float:
        """See `TempoPlanner.spare`, of the course itself [m]."""
        less = self._trials[stretch].cut_has_more if trial is not None and trial.cut else 0.0
        return self._planner.spare(trial) - less
