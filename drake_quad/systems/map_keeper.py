"""MapKeeper: the map of what was seen, which grows with each look from a tread."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from drake_quad.control.ports import SIZE, GaitPhase
from drake_quad.errors import DrakeQuadError
from drake_quad.perception.growing_map import grow_map
from drake_quad.perception.sight import MapRevision
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.onward import LOOK_AGAIN, why_not
from drake_quad.systems.depth_camera import NO_IMAGE, DepthImage
from drake_quad.systems.stair_estimator import StairReport
from drake_quad.terrain.elements import Element

LONGEST_WAIT = 5.0  # [s] for an image
AT_REST = 0.3  # [s] after a robot has come to stand, from which on an image of it counts


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
    """

    revisions: tuple[MapRevision, ...]
    task: int = -1
    since: float = np.inf

    def __deepcopy__(self, memo: object) -> "MapMemory":
        """It never changes, so that Drake may copy a Context without copying it."""
        return self


class MapKeeper(LeafSystem):
    """Holds the map, and adds to it what is seen when the robot has stood and looked again.

    A look is the last task that the plan under way leads to, a stand by the name LOOK_AGAIN. Once
    the gait clock is past it, the newest image of it counts.

    Input ports:
        gait_phase: See GaitPhase.
        motion_plan: The MotionPlan of the task under way (abstract).
        stairs: StairReport, of what the newest image shows.
        depth_measured: DepthImage, the newest.
        feet: (12,) points of the feet on the ground in W [m], leg by leg (FL, FR, RL, RR).
        contacts: (4,) of each foot; it stands where this is more than 0.5.
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
        kept, now = self._of(context), context.get_time()
        plan: MotionPlan = self._plan.Eval(context)
        task = int(self._phase.Eval(context)[GaitPhase.TASK])
        looks = plan.segments[0].name == LOOK_AGAIN and plan.goes_on
        if kept.task < 0:
            if not looks or task != plan.index:
                return EventStatus.DidNothing()
            self._keep(state, MapMemory(kept.revisions, task, now))
            return EventStatus.Succeeded()
        report: StairReport = self._stairs.Eval(context)
        if task == kept.task:
            return EventStatus.DidNothing()
        last = kept.revisions[-1]
        if report.stamp >= kept.since + AT_REST:
            revision = self._revise(context, last, report)
        elif now > kept.since + LONGEST_WAIT:
            depth = self._image.Eval(context).depth
            revision = MapRevision(
                last.number + 1, now, None, None, last.map, "no image has come", depth
            )
        else:
            return EventStatus.DidNothing()
        self._keep(state, MapMemory((*kept.revisions, revision)))
        state.get_mutable_abstract_state(self._newest).set_value(revision)
        return EventStatus.Succeeded()

    def _keep(self, state: State, kept: MapMemory) -> None:
        state.get_mutable_abstract_state(self._kept).set_value(kept)

    def _revise(self, context: Context, last: MapRevision, report: StairReport) -> MapRevision:
        """The next revision of the map, of the newest look."""
        image: DepthImage = self._image.Eval(context)
        standing = self._contacts.Eval(context) > 0.5
        feet = self._feet.Eval(context).reshape(4, 3)[standing]
        number, known, reason = last.number + 1, last.map, ""
        try:
            grown = grow_map(
                known, report.belief, report.level, feet=feet, landing=self._settings.landing,
                reach=self._settings.reach, look=number, back=self._settings.back,
            )  # fmt: skip
            grown.course(foot_radius=self._settings.foot_radius)
            known = grown
        except DrakeQuadError as problem:
            reason = why_not(problem)
        return MapRevision(
            number, report.stamp, report.belief, report.level, known, reason, image.depth
        )
