"""All margins of one measured posture, and when a robot has fallen."""

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from math import atan2, inf

import numpy as np

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.robot.kinematics import LegConstants, leg_constants, normal_felt
from drake_quad.robot.model import RobotModel, contact_friction
from drake_quad.stability.capture_point import (
    SWING_BACK,
    Pendulum,
    capture_margin,
    directions,
    find_pressure_area,
    pressure_reach,
    push_budget,
)
from drake_quad.stability.equilibrium_region import (
    NEARLY,
    Contacts,
    WrenchDemand,
    find_region,
    joint_limits,
    make_contacts,
    static_region,
)
from drake_quad.stability.leg_stroke import leg_stroke_left
from drake_quad.stability.margin_kinds import FEASIBLE, HULL

WAYS = directions(16)
BEARING = 0.5


class Margins(IntEnum):
    """Places in the vector of margins.

    FRICTION: Signed distance of the centre of mass from the border of the static region [m].
    CAPTURE: Signed distance of the capture point from the border of where the pressure can be, now
        and at rest [m].
    BUDGET: The least push that takes a step, of all directions [m/s].
    BUDGET_DIRECTION: Direction of that push in W [rad].
    FEASIBLE: Signed distance as of FRICTION, within the joints' torque limits too [m].
    DYNAMIC: Signed distance as of FEASIBLE, in the region that the measured acceleration leaves
        [m].
    """

    FRICTION = 0
    CAPTURE = 1
    BUDGET = 2
    BUDGET_DIRECTION = 3
    FEASIBLE = 4
    DYNAMIC = 5


@dataclass(frozen=True, eq=False)
class Posture:
    """A robot in motion. W world, B body.

    Attributes:
        bearing: (4,) 1 where a foot bears.
        places: (4, 3) where the feet's forces act, in W [m].
        com: (3,) the whole robot's centre of mass in W [m].
        com_velocity: (3,) in W [m/s].
        p_WB: (3,) [m].
        R_WB: (3, 3).
        q: (4, 3) joint angles [rad].
    """

    bearing: FloatArray
    places: FloatArray
    com: FloatArray
    com_velocity: FloatArray
    p_WB: FloatArray
    R_WB: FloatArray
    q: FloatArray


@dataclass(frozen=True, eq=False)
class MarginEstimator:
    """Measures margins.

    Attributes:
        robot: The robot.
        kind: One of KINDS: which margins, the others are nan.
        friction: Coulomb's coefficient of the ground, see `contact_friction`.
        mass: Mass of the whole robot as it is [kg].
        effort: (12,) torque limits as they are [Nm].
        none: What a margin is where there is no region.
    """

    robot: RobotModel
    kind: str
    friction: float
    mass: float
    effort: FloatArray
    none: float = -inf

    def measure(self, posture: Posture, demand: WrenchDemand) -> FloatArray:
        """The margins, see Margins.

        Args:
            posture: The robot now.
            demand: Force and moment that its motion demands of the feet, for DYNAMIC.
        """
        found = np.full(len(Margins), np.nan)
        if self.kind == HULL:
            return found
        standing = posture.bearing > BEARING
        contacts = self.contacts(posture)
        x, y, z = posture.com.tolist()
        vx, vy, _ = posture.com_velocity.tolist()
        ground = float(contacts.places[:, 2].mean()) if len(contacts) else 0.0
        body = Pendulum(x, y, z, vx, vy, ground)
        region = static_region(contacts)
        area = find_pressure_area(contacts, body)
        far = pressure_reach(region, area, body, WAYS)
        ahead = WAYS @ (np.array(body.capture) - [x, y])
        legs = leg_stroke_left(
            self.robot,
            posture.R_WB,
            posture.q,
            standing,
            WAYS,
            2.0 * (far + np.maximum(ahead, 0.0)),
        )
        budget = push_budget(region, far, body, WAYS, legs, swing_back=SWING_BACK)
        weakest = int(np.argmin(budget))
        found[Margins.FRICTION] = region.margin(x, y)
        found[Margins.CAPTURE] = capture_margin(region, area, body)
        found[Margins.BUDGET] = budget[weakest]
        found[Margins.BUDGET_DIRECTION] = atan2(WAYS[weakest, 1], WAYS[weakest, 0])
        if self.kind == FEASIBLE:
            limits = joint_limits(
                self.robot, posture.R_WB, posture.q, standing, mass=self.mass, effort=self.effort
            )
            found[Margins.FEASIBLE] = find_region(contacts, limits=limits).margin(x, y)
            found[Margins.DYNAMIC] = find_region(contacts, limits=limits, demand=demand).margin(
                x, y
            )
        found[np.isneginf(found)] = self.none
        return found

    def contacts(self, posture: Posture) -> Contacts:
        """The feet that bear; the ground's normal leads from there to the foot sphere's centre."""
        # Plain floats: for three numbers at a time numpy takes several times as long.
        R, base = posture.R_WB.tolist(), posture.p_WB.tolist()
        places, normals, friction = [], [], []
        for leg, bears, place, q, mu in zip(
            self._legs, posture.bearing.tolist(), posture.places.tolist(), posture.q.tolist(),
            self._friction, strict=True,
        ):  # fmt: skip
            if bears > BEARING:
                normal = normal_felt(leg, q, R, base, place)
                places.append(place)
                friction.append(mu)
                normals.append((0.0, 0.0, 1.0) if normal[2] > 1.0 - NEARLY else normal)
        return make_contacts(places, normals, friction)

    @cached_property
    def _friction(self) -> list[float]:
        return contact_friction(self.robot, self.friction).tolist()

    @cached_property
    def _legs(self) -> tuple[LegConstants, ...]:
        return leg_constants(self.robot.geometry)


def demand_of(
    momentum: FloatArray, before: FloatArray, time: float, *, mass: float, height: float
) -> WrenchDemand:
    """Force and moment that a change of momentum demands of the feet, if nothing else pushes.

    Args:
        momentum: (6,) about the centre of mass in W, angular [Nms], then linear [Ns].
        before: Momentum at the sample before, (6,).
        time: Time since that sample [s].
        mass: Mass of the whole robot [kg].
        height: Height of the centre of mass in W [m].
    """
    weight = GRAVITY * mass
    mx, my, mz, fx, fy, fz = ((momentum - before) / (time * weight)).tolist()
    return WrenchDemand((fx, fy, 1.0 + fz), (mx, my, mz), height)


FALLEN_TILT = 0.7  # [rad] of the trunk, 40 degrees, whatever it meant to do
# For so long [s] the trunk is tilted or down before that is a fall. A foot that strikes a tread
# shakes it, and takes the load off the others for a hundredth of a second: going down stairs rear
# feet alone bear then, and the trunk is not far above those.
FALL_TIME = 0.1
