"""What standing feet push against, and with what: where a plan's margin is measured from.

The hull of the feet is the region of balance on level ground and with any drives. A plan whose
margin is to be that of the region itself (`drake_quad/stability/region.py`) needs the ground's
normals, its friction, and for `feasible` the joints' torque limits in the posture of the moment.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import inf

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import SHORT_NAMES, BoolArray, FloatArray
from drake_quad.gait.support import stability_margins
from drake_quad.planning.motion_plan import pose_robot, rotations
from drake_quad.planning.settings import PlanSettings
from drake_quad.robot.robot_model import RobotModel
from drake_quad.stability.contacts import Contacts
from drake_quad.stability.kinds import FEASIBLE, FRICTION, HULL
from drake_quad.stability.level import are_hulls
from drake_quad.stability.region import ForceLimits, Region, find_region
from drake_quad.stability.torque import leg_limits
from drake_quad.terrain import Course
from drake_quad.terrain_normals import ground_normals

Normals = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Stances:
    """The robot in many poses (N,), as far as regions of balance depend on them. In W.

    Attributes:
        places: (N, 4, 3) where forces act on the feet [m].
        normals: (N, 4, 3) of the ground there.
        standing: (N, 4) who stands.
        friction: Coulomb's coefficient.
        limits: Of the joints of all legs, if they count: (N, 4, 3, 3) and (N, 4, 3).
        com: (N, 3) the whole robot's centre of mass [m].
        hulls: (N,) whether the region is for certain the hull of the feet.
    """

    places: FloatArray
    normals: FloatArray
    standing: BoolArray
    friction: float
    limits: ForceLimits | None
    com: FloatArray
    hulls: BoolArray

    def region(self, k: int, *, drives: bool = True) -> Region:
        """The region in pose k; without the joints' limits, if they are not to count."""
        who = self.standing[k]
        friction = np.full(int(who.sum()), self.friction)
        contacts = Contacts(self.places[k, who], self.normals[k, who], friction)
        if self.limits is None or not drives:
            return find_region(contacts)
        rows, lower, upper = self.limits.rows, self.limits.lower, self.limits.upper
        return find_region(contacts, limits=ForceLimits(rows[k, who], lower[k, who], upper[k, who]))

    def margins(self) -> FloatArray:
        """The centre of mass's margin in every pose (N,) [m]; -inf of no region."""
        found = stability_margins(self.com[:, :2], self.places[..., :2], self.standing)
        for k in np.flatnonzero(~self.hulls).tolist():  # each its own: the feet roll all the time
            found[k] = self.region(k).margin(*self.com[k, :2].tolist())
        return found


@dataclass(frozen=True, eq=False)
class Footing:
    """The ground under the feet and the drives above them, as a plan counts on them.

    Attributes:
        robot: The robot.
        normals: The ground's unit normals (..., 3) in W at places (..., 2) [m].
        friction: Coulomb's coefficient.
        drives: Whether the joints' torque limits count.
    """

    robot: RobotModel
    normals: Normals
    friction: float
    drives: bool

    def stances(self, body: FloatArray, feet: FloatArray, standing: BoolArray) -> Stances:
        """The robot in many poses.

        Args:
            body: (N, 5) poses in W.
            feet: (N, 4, 3) the foot spheres' centres in W [m].
            standing: (N, 4) who stands.
        """
        q, _, com = pose_robot(self.robot, body, feet)
        normals = self.normals(feet[..., :2])
        places = feet - self.robot.foot_radius * normals
        limits, hulls = None, np.zeros(len(body), dtype=np.bool_)
        if self.drives:
            limits = leg_limits(self.robot, rotations(body), q)
        else:
            hulls = are_hulls(places, normals, standing, self.friction)
        return Stances(places, normals, standing, self.friction, limits, com, hulls)


def footing_of(robot: RobotModel, course: Course, settings: PlanSettings) -> Footing | None:
    """What margins are measured from; None if it is the hull of the feet."""
    if settings.margin == HULL:
        return None
    normals = partial(ground_normals, course)
    return Footing(robot, normals, settings.friction, settings.margin == FEASIBLE)


def kind_of(footing: Footing | None) -> str:
    """Over what margins are measured, one of `stability.kinds.KINDS`."""
    if footing is None:
        return HULL
    return FEASIBLE if footing.drives else FRICTION


def refuse(footing: Footing, margin: float, standing: BoolArray, where: str) -> PlanningError:
    """The error of a plan without a margin, or of a robot that cannot even stand.

    Args:
        footing: What the margin was measured from.
        margin: The least one [m]; -inf where there is no region at all.
        standing: (4,) on which feet.
        where: In which segment, when.
    """
    feet = ", ".join(name for name, on in zip(SHORT_NAMES, standing, strict=True) if on)
    what = (
        f"nothing holds the robot on {feet}"
        if margin == -inf
        else f"the {kind_of(footing)} margin on {feet} would be {margin:.3f} m"
    )
    within = f"within friction {footing.friction:g}"
    helps = "more controller.friction, gentler ground"
    if footing.drives:
        within += " and the joints' torque limits"
        helps = f"stronger drives, a lighter robot, another gait.body_height, {helps}"
    return PlanningError(
        f"{what} {within} {where}; {helps} or a larger gait.duty_factor may help, "
        "and gait.margin: hull does not look",
        margin=margin,
    )
