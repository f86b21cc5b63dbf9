"""MapKeeper: the map of what was seen, which grows with each look, and which feet make better."""

from dataclasses import dataclass, field, replace

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from drake_quad.common import BoolArray, FloatArray
from drake_quad.control.ports import SIZE, GaitPhase
from drake_quad.errors import DrakeQuadError, PlanningError
from drake_quad.perception.growing_map import grow_map
from drake_quad.perception.sight import MapRevision
from drake_quad.perception.stair_map import StairMap
from drake_quad.perception.touchdown_heights import (
    TouchdownHeights,
    add_touchdowns,
    heights_as_seen,
    heights_on_grown_map,
    map_with_touchdowns,
)
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.onward import LOOK_AGAIN, why_not
from drake_quad.systems.depth_camera import NO_IMAGE, DepthImage
from drake_quad.systems.stair_estimator import StairReport
from drake_quad.terrain.elements import Element

LONGEST_WAIT = 5.0  # [s] for an image
AT_REST = 0.3  # [s] after a robot has come to stand, from which on an image of it counts
FIRM = 0.2  # [s] after a foot has touched, from which on it stands firmly


@dataclass(frozen=True)
class MapSettings:
    """What a map is made with.

    Attributes:
        landing: How far the ground is level beyond the last nosing [m].
        reach: How far from the lane's middle line feet are put down [m].
        foot_radius: Radius of the robot's feet [m].
        back: What the course ends with once it is known: `return`, if the robot is to come back.
    """

    landing: float
    reach: float
    foot_radius: float
    back: tuple[Element, ...] = ()


@dataclass(frozen=True, eq=False)
class MapMemory:
    """What a MapKeeper remembers.

    Attributes:
        revisions: The map's revisions so far, that of the start first.
        task: Index of the look under way; -1 for none.
        since: When it began [s].
        bearing_since: When each foot began to bear without a break [s]; infinite if it does not.
        counted: Which feet have been counted since they began to bear.
        heights: What feet have told of the heights; None until one has landed.
        touched_at: When feet told something last [s].
        closed: Whether the map is no longer made better by feet.
    """

    revisions: tuple[MapRevision, ...]
    task: int = -1
    since: float = np.inf
    bearing_since: FloatArray = field(default_factory=lambda: np.full(4, np.inf))
    counted: BoolArray = field(default_factory=lambda: np.zeros(4, dtype=bool))
    heights: TouchdownHeights | None = None
    touched_at: float = -np.inf
    closed: bool = False

    def __deepcopy__(self, memo: object) -> "MapMemory":
        """It never changes, so that Drake may copy a Context without copying it."""
        return self


class MapKeeper(LeafSystem):
    """Holds the map, and adds to it what is seen when the robot has stood and looked again.

    A look is the last task that the plan under way leads to, a stand by the name LOOK_AGAIN. Once
    the gait clock is past it, the newest image of it counts.

    Each foot that has landed on the way up tells how high its tread is. The map has these heights
    from the next look on; or, if the flight was seen to its end, once the clock is past a plan with
    `revises_map`.

    Input ports:
        gait_phase: See GaitPhase.
        motion_plan: The MotionPlan of the task under way (abstract).
        stairs: StairReport, of what the newest image shows.
        depth_measured: DepthImage, the newest.
        feet: (12,) points of the feet on the ground in W [m], leg by leg (FL, FR, RL, RR).
        contacts: (4,) of each foot; it stands where this is more than 0.5.
        estimator_deviation: (9,) see StateEstimator; need not be connected: then the state is true.
    Output ports:
        map_known: MapRevision, the newest.
        looking: (1,) 1 while images are wanted.

    Args:
        first: The map of the look from the start.
        settings: What it is made with.
        period: Time between looks at the clock [s].
    """

    def __init__(self, *, first: MapRevision, settings: MapSettings, period: float = 0.05) -> None:
        super().__init__()
        self.set_name("map_keeper")
        self._settings = settings
        self._phase = self.DeclareVectorInputPort("gait_phase", SIZE)
        self._plan = self.DeclareAbstractInputPort("motion_plan", AbstractValue.Make(object()))
        self._stairs = self.DeclareAbstractInputPort(
            "stairs", AbstractValue.Make(StairReport(-np.inf, None))
        )
        self._image = self.DeclareAbstractInputPort("depth_measured", AbstractValue.Make(NO_IMAGE))
        self._feet = self.DeclareVectorInputPort("feet", 12)
        self._contacts = self.DeclareVectorInputPort("contacts", 4)
        self._deviation = self.DeclareVectorInputPort("estimator_deviation", 9)
        self._kept = self.DeclareAbstractState(AbstractValue.Make(MapMemory((first,))))
        self._newest = self.DeclareAbstractState(AbstractValue.Make(first))
        self.DeclareStateOutputPort("map_known", self._newest)
        self.DeclareVectorOutputPort(
            "looking", 1, self._tell, {self.abstract_state_ticket(self._kept)}
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def revisions(self, context: Context) -> tuple[MapRevision, ...]:
        """The map's revisions so far, for a run's files."""
        return self._of(context).revisions

    def _of(self, context: Context) -> MapMemory:
        kept: MapMemory = context.get_abstract_state(self._kept).get_value()
        return kept

    def _tell(self, context: Context, output: BasicVector) -> None:
        output[0] = float(self._of(context).task >= 0)

    def _update(self, context: Context, state: State) -> EventStatus:
        before = self._of(context)
        kept = before if before.closed else self._take_touchdowns(context, before)
        plan: MotionPlan = self._plan.Eval(context)
        task = int(self._phase.Eval(context)[GaitPhase.TASK])
        if task != plan.index and plan.revises_map and not kept.closed:
            kept = self._revised_by_feet(context, kept)
        else:
            kept = self._look(context, kept, plan, task)
        if kept is before:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._kept).set_value(kept)
        if kept.revisions is not before.revisions:
            state.get_mutable_abstract_state(self._newest).set_value(kept.revisions[-1])
        return EventStatus.Succeeded()

    def _look(self, context: Context, kept: MapMemory, plan: MotionPlan, task: int) -> MapMemory:
        """Begins a look, or ends one; else the same memory."""
        now = context.get_time()
        if kept.task < 0:
            looks = plan.segments[0].name == LOOK_AGAIN and plan.goes_on
            return replace(kept, task=task, since=now) if looks and task == plan.index else kept
        report: StairReport = self._stairs.Eval(context)
        if task == kept.task:
            return kept
        last = kept.revisions[-1]
        if report.stamp >= kept.since + AT_REST:
            kept = self._revised_by_look(context, kept, report)
        elif now > kept.since + LONGEST_WAIT:
            depth = self._image.Eval(context).depth
            revision = MapRevision(
                last.number + 1, now, None, None, last.map, "no image has come", depth
            )
            kept = replace(kept, revisions=(*kept.revisions, revision))
        else:
            return kept
        return replace(kept, task=-1, since=np.inf)

    def _take_touchdowns(self, context: Context, kept: MapMemory) -> MapMemory:
        """The memory with what feet tell that have come to stand firmly; else the same memory."""
        now = context.get_time()
        bears = self._contacts.Eval(context) > 0.5
        since = np.where(bears, np.minimum(kept.bearing_since, now), np.inf)
        counted = kept.counted & bears
        firm = since <= now - FIRM
        landed = np.flatnonzero(firm & ~counted)
        if not len(landed) and np.array_equal(since, kept.bearing_since):
            return kept
        known, heights, touched_at = kept.revisions[-1].map, kept.heights, kept.touched_at
        if len(landed):
            feet = self._feet.Eval(context).reshape(4, 3)
            tilt, place = self._sigmas(context)
            found = add_touchdowns(
                heights or heights_as_seen(known, tilt_sigma=tilt), known, feet, firm,
                firm & ~counted, place_sigma=place,
            )  # fmt: skip
            if found.touchdowns.sum() > (0 if heights is None else heights.touchdowns.sum()):
                touched_at = now
            heights = found
        return replace(
            kept, bearing_since=since, counted=counted | firm, heights=heights,
            touched_at=touched_at,
        )  # fmt: skip

    def _sigmas(self, context: Context) -> tuple[float, float]:
        """Deviations of the estimated tilt [rad] and place [m]; 0 of a true state."""
        if not self._deviation.HasValue(context):
            return 0.0, 0.0
        deviation = self._deviation.Eval(context)
        return float(deviation[:2].max()), float(deviation[6:8].max())

    def _revised_by_feet(self, context: Context, kept: MapMemory) -> MapMemory:
        """The memory with a revision of the map by what the feet have told."""
        last, heights = kept.revisions[-1], kept.heights
        known, reason = last.map, ""
        try:
            known = self._with_touchdowns(known, heights)
        except DrakeQuadError as problem:
            reason = why_not(problem)
        stamp = kept.touched_at if np.isfinite(kept.touched_at) else context.get_time()
        stood_on = 0 if heights is None else int(np.count_nonzero(heights.touchdowns))
        revision = MapRevision(
            last.number + 1, stamp, last.belief, last.level, known, reason, looked=False,
            stood_on=stood_on,
        )  # fmt: skip
        return replace(kept, revisions=(*kept.revisions, revision), closed=True)

    def _with_touchdowns(self, known: StairMap, heights: TouchdownHeights | None) -> StairMap:
        """A map as the feet have found it.

        Raises:
            PlanningError: The feet contradict it.
            InputError: It is no course.
        """
        if heights is None or not (heights.touchdowns.any() or heights.contradicted):
            return known
        for tread, higher in heights.contradicted:
            raise PlanningError(
                f"the feet contradict the map: step {tread} is {abs(higher):.2f} m "
                f"{'higher' if higher > 0.0 else 'lower'} than it has",
                off=abs(higher),
            )
        refined = map_with_touchdowns(known, heights)
        refined.course(foot_radius=self._settings.foot_radius)
        return refined

    def _revised_by_look(self, context: Context, kept: MapMemory, report: StairReport) -> MapMemory:
        """The memory with the next revision of the map, of the newest look."""
        image: DepthImage = self._image.Eval(context)
        standing = self._contacts.Eval(context) > 0.5
        feet = self._feet.Eval(context).reshape(4, 3)[standing]
        last, heights = kept.revisions[-1], kept.heights
        number, known, reason = last.number + 1, last.map, ""
        try:
            grown = grow_map(
                self._with_touchdowns(known, heights), report.belief, report.level, feet=feet,
                landing=self._settings.landing, reach=self._settings.reach, look=number,
                back=self._settings.back,
            )  # fmt: skip
            grown.course(foot_radius=self._settings.foot_radius)
            known = grown
            heights = heights and heights_on_grown_map(heights, known)
        except DrakeQuadError as problem:
            reason = why_not(problem)
        revision = MapRevision(
            number, report.stamp, report.belief, report.level, known, reason, image.depth
        )
        return replace(kept, revisions=(*kept.revisions, revision), heights=heights)
