"""Margins of a plan's stances over the chosen region, and whether the first stance holds.

The hull of the feet is the region of balance on level ground and with any drives. A plan whose
margin is to be that of the region itself (`stability/equilibrium_region.py`) needs the ground's
normals, its friction, and for `feasible` the joints' torque limits in the posture of the moment.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import inf

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.errors import PlanningError
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import Stance, pose_robot
from drake_quad.planning.problem import PlanSettings
from drake_quad.robot.kinematics import solve_legs
from drake_quad.robot.legs import LEGS, SHORT_NAMES
from drake_quad.robot.model import RobotModel
from drake_quad.stability.equilibrium_region import (
    Contacts,
    ForceLimits,
    Region,
    are_hulls,
    find_region,
    leg_limits,
)
from drake_quad.stability.margin_kinds import FEASIBLE, FRICTION, HULL
from drake_quad.stability.support_polygon import stability_margins
from drake_quad.terrain.course import Course, ground_normals

Normals = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Stances:
    """The robot in many poses (N,), as far as regions of balance depend on them. In W.

    Attributes:
        places: (N, 4, 3) where forces act on the feet [m].
        normals: (N, 4, 3) of the ground there.
        standing: (N, 4) who stands.
        friction: Coulomb's coefficient.
        limits: Torque limits of all legs' joints, (N, 4, 3, 3) and (N, 4, 3); None if they do not
            count.
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


@dataclass(frozen=True, eq=False)
class Slopes:
    """Ground with slopes, as a controller counts on it.

    Attributes:
        normals: The ground's unit normals (..., 3) in W at places (..., 2) [m].
        friction: `controller.friction`, which its forces stay within.
    """

    normals: Normals
    friction: float


def slopes_of(course: Course, friction: float) -> Slopes | None:
    """The ground of a course with slopes; None where all of it is level."""
    if not any(box.gradient for box in course.boxes):
        return None
    return Slopes(partial(ground_normals, course), friction)


def footing_of(robot: RobotModel, course: Course, settings: PlanSettings) -> Footing | None:
    """What margins are measured from; None if it is the hull of the feet."""
    if settings.margin == HULL:
        return None
    normals = partial(ground_normals, course)
    return Footing(robot, normals, settings.friction, settings.margin == FEASIBLE)


def kind_of(footing: Footing | None) -> str:
    """The region that margins are measured in, one of `stability.margin_kinds.KINDS`."""
    if footing is None:
        return HULL
    return FEASIBLE if footing.drives else FRICTION


def refuse_stance(
    footing: Footing, margin: float, standing: BoolArray, where: str
) -> PlanningError:
    """The error of a plan without a margin, or of a robot that cannot even stand.

    Args:
        footing: What the margin was measured from.
        margin: The least one [m]; -inf where there is no region at all.
        standing: (4,) on which feet.
        where: Words that say in which segment, and when.
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


MISSED = 1e-6  # [m] that counts as reached


def check_stance(robot: RobotModel, stance: Stance) -> None:
    """Checks that every leg reaches its foot's place, within its joints' limits.

    A path planned from a stance that is out of reach has no legs to keep within their limits: what
    its program then says, if it is solved at all, is of no help.

    Raises:
        PlanningError: With the leg and by how much, its data as `check_plan` gives them.
    """
    q, missed = solve_legs(robot.geometry, (stance.feet - stance.body[:3]) @ rotations(stance.body))
    row = int(np.argmax(missed))
    if missed[row] > MISSED:
        raise PlanningError(
            f"leg {LEGS[row].short} misses its place by {missed[row]:.3f} m as the robot stands at "
            "first",
            excess=float(missed[row]),
            leg=row + 1,
            body=stance.body.tolist(),
            foot=stance.feet[row].tolist(),
        )
    over = np.maximum(robot.q_lower - q.ravel(), q.ravel() - robot.q_upper)
    j = int(np.argmax(over))
    if over[j] > 0.0:
        raise PlanningError(
            f"joint {robot.joint_names[j]} would be {over[j]:.3f} rad beyond its limits as the "
            "robot stands at first",
            joint=robot.joint_names[j],
            excess=float(over[j]),
            body=stance.body.tolist(),
            foot=stance.feet[j // 3].tolist(),
        )
