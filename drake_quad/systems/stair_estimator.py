"""Depth images to a belief of the stairs ahead."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_quad.common import FloatArray
from drake_quad.math.rotations import quaternion_rotation
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.depth_frame import DepthAccuracy
from drake_quad.perception.level_beyond import Level, level_beyond
from drake_quad.perception.look_again import look_again
from drake_quad.perception.sight import MapRevision
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_tracker import CameraPose, StairTracker
from drake_quad.systems.depth_camera import NO_IMAGE, DepthImage


@dataclass(frozen=True)
class StairReport:
    """What the estimator says.

    Attributes:
        stamp: Time of the image that was looked at last [s]; -inf before the first.
        belief: The stairs that it showed; None if it showed none.
        level: What it showed beyond the last nosing of a flight up, where that was looked at.
    """

    stamp: float
    belief: StairBelief | None
    level: Level | None = None


def pose_at_capture(image: DepthImage, R_BC: FloatArray, p_BC: FloatArray) -> CameraPose:
    """Where the camera is believed to have been when it took an image, and how well that is known.

    The camera is ahead of the base, so where the base's attitude errs, the camera's place does.
    Errors of attitude and place are taken to be independent; the mounting's own error is not in it.

    Args:
        image: The image.
        R_BC: Attitude of the camera on the base, as it is meant to be, (3, 3).
        p_BC: Place of the camera on the base, (3,) [m].
    """
    w, x, y, z = (float(value) for value in image.base_pose[:4])
    R_WB = np.array(quaternion_rotation(w, x, y, z))
    lever, turn, place = R_WB @ p_BC, image.base_deviation[:3], image.base_deviation[3:]
    by_turn = np.cross(np.diag(turn), lever)  # of the lever's end, for the turn about each axis
    place_sigmas = np.sqrt(place**2 + np.sum(by_turn**2, axis=0))
    return CameraPose(R_WB @ R_BC, image.base_pose[4:] + lever, turn, place_sigmas)


class StairEstimator(LeafSystem):
    """Looks for stairs in each image that arrives, from what the one before showed.

    Input ports:
        depth_measured: DepthImage, with the base's pose as it was estimated when it was taken.
        feet: (12,) points of the feet on the ground in W [m], leg by leg (FL, FR, RL, RR).
        contacts: (4,) of each foot; it stands where this is more than 0.5.
        map_known: MapRevision: the map so far, of the flight that the robot stands on (abstract).
            Unconnected if it stands before one of which nothing is known.
    Output ports:
        stairs: StairReport.

    Args:
        model: Intrinsics of the images.
        R_BC: Attitude of the camera on the base, as it is meant to be, (3, 3).
        p_BC: Place of the camera on the base, (3,) [m].
        accuracy: How well depths are known.
        period: Time between looks for a new image [s].
        tracking: Whether each image is looked at from what the one before showed. If not, stairs
            are searched for in each anew: it takes half a second, and errs less.
        landing: How far the ground is told to be level beyond the last nosing [m]; None: what is
            beyond it is not looked at.
    """

    def __init__(
        self,
        *,
        model: CameraModel,
        R_BC: FloatArray,
        p_BC: FloatArray,
        accuracy: DepthAccuracy,
        period: float = 0.1,
        tracking: bool = True,
        landing: float | None = None,
    ) -> None:
        super().__init__()
        self.set_name("stair_estimator")
        self._tracking, self._model, self._landing = tracking, model, landing
        self._R_BC, self._p_BC = np.array(R_BC), np.array(p_BC)
        self._tracker = StairTracker(model=model, accuracy=accuracy)  # it remembers nothing
        self._image = self.DeclareAbstractInputPort("depth_measured", AbstractValue.Make(NO_IMAGE))
        self._feet = self.DeclareVectorInputPort("feet", 12)
        self._contacts = self.DeclareVectorInputPort("contacts", 4)
        self._map = self.DeclareAbstractInputPort("map_known", AbstractValue.Make(object()))
        self._stairs = self.DeclareAbstractState(AbstractValue.Make(StairReport(-np.inf, None)))
        self.DeclareStateOutputPort("stairs", self._stairs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._look)

    def _look(self, context: Context, state: State) -> None:
        image: DepthImage = self._image.Eval(context)
        last: StairReport = context.get_abstract_state(self._stairs).get_value()
        if image.stamp <= last.stamp:
            return
        pose = pose_at_capture(image, self._R_BC, self._p_BC)
        standing = self._contacts.Eval(context) > 0.5
        feet = self._feet.Eval(context).reshape(4, 3)[standing]
        if self._map.HasValue(context):
            revision: MapRevision = self._map.Eval(context)
            belief = look_again(
                self._tracker, image.depth, self._model, pose, revision.map, feet=feet,
                stamp=image.stamp,
            )  # fmt: skip
        else:
            before = last.belief if self._tracking else None
            belief = self._tracker.update(
                image.depth, pose, stamp=image.stamp, last=before, feet=feet
            )
        level = None
        if self._landing is not None and belief is not None and belief.going_up:
            level = level_beyond(image.depth, self._model, pose, belief, landing=self._landing)
        report = StairReport(image.stamp, belief, level)
        state.get_mutable_abstract_state(self._stairs).set_value(report)
