"""Where the body is to be if margins did not matter."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.gait.legs import FloatArray
from drake_quad.planning.settings import PlanSettings
from drake_quad.stability.fallen import FALLEN_TILT
from drake_quad.terrain import Lane

ROUNDING = 1e-9  # [m], [rad] by which a body that begins as the ground asks for may be off that


class Ground(Protocol):
    """Mean height of the ground under the body [m] and its slope, along places (N, 2) in W."""

    def __call__(self, p_W: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns heights (N,) [m] and slopes (N,) (rise over run along the heading)."""
        ...


@dataclass(frozen=True, eq=False)
class Route:
    """Where the body is to be if margins did not matter: piecewise linear in time.

    Attributes:
        times: (k,) [s].
        xy: (k, 2) in W [m].
        yaw: (k,) [rad].
        ground: The ground under the body.
        lane: Whose ground shanks are to keep clear of; None: it is level, they need not.
        start: x, y, z [m] and pitch [rad] of the body at first, (4,); None: as over the ground.
        joined: From when on height and pitch are those over the ground, whatever they began as [s].
    """

    times: FloatArray
    xy: FloatArray
    yaw: FloatArray
    ground: Ground
    lane: Lane | None = None
    start: FloatArray | None = None
    joined: float = 0.0

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns places (N, 2) and yaws (N,) at `times` (N,)."""
        xy = np.stack([np.interp(times, self.times, self.xy[:, k]) for k in range(2)], axis=-1)
        return xy, np.interp(times, self.times, self.yaw)

    def starts_off(self, settings: PlanSettings) -> bool:
        """Whether the body begins at another height or pitch than the ground there asks for."""
        if self.start is None:
            return False
        height, slope = self.ground(self.start[None, :2])
        pitch = body_pitch(settings.pitch_along_slope, slope)
        off = self.start[2:] - [height[0] + settings.body_height, pitch[0]]
        return bool(np.any(np.abs(off) > ROUNDING))


MOST_PITCH = FALLEN_TILT - 0.06  # [rad]: a body on its way is not quite as it is meant to be


def body_pitch(share: ArrayLike, slope: ArrayLike) -> FloatArray:
    """Pitch of a body that tilts with a share of the ground's slope, and is never too steep [rad].

    Args:
        share: Of the slope's angle.
        slope: Rise over run along the heading.
    """
    pitch = -np.asarray(share) * np.arctan(slope)
    return np.asarray(np.clip(pitch, -MOST_PITCH, MOST_PITCH))


def robot_stance(settings: PlanSettings) -> FloatArray:
    """Where the feet stand in B at rest: the workspaces' centres, staggered, (4, 2) [m]."""
    stance = np.array(settings.workspace.centres)
    half = 0.5 * settings.stance_stagger
    stance[:, 1] += np.sign(stance[:, 1]) * np.array([-half, -half, half, half])
    return stance


def level_pose(p_xy: FloatArray, yaw: float, ground: float, settings: PlanSettings) -> FloatArray:
    """The body's pose (5,) at rest on level ground."""
    return np.array([*p_xy, ground + settings.body_height, 0.0, yaw])
