"""LandmarkFinder: depth images of the map's flights to corrections of the estimated pose."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_quad.common import FloatArray, read_only
from drake_quad.estimation.landmark_correction import NO_SIGHTING
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.depth_frame import DepthAccuracy
from drake_quad.perception.landmarks import sight_flight
from drake_quad.perception.stair_tracker import StairTracker
from drake_quad.systems.depth_camera import NO_IMAGE, DepthImage
from drake_quad.systems.stair_estimator import pose_at_capture
from drake_quad.terrain.course import Course


class LandmarkFinder(LeafSystem):
    """Looks in each image that arrives for the flight that the map has ahead of the robot.

    Input ports:
        depth_measured: DepthImage, with the base's pose as it was estimated when it was taken.
    Output ports:
        landmark_sighted: LandmarkSighting, the newest; NO_SIGHTING before the first.

    Args:
        model: Intrinsics of the images.
        R_BC: Attitude of the camera on the base, as it is meant to be, (3, 3).
        p_BC: Place of the camera on the base, (3,) [m].
        accuracy: How well depths are known.
        course: The map.
        period: Time between looks for a new image [s].
        alike: What covariances are multiplied by: of images that follow sooner one after the
            other, more err alike.
    """

    def __init__(
        self,
        *,
        model: CameraModel,
        R_BC: FloatArray,
        p_BC: FloatArray,
        accuracy: DepthAccuracy,
        course: Course,
        period: float = 0.1,
        alike: float = 1.0,
    ) -> None:
        super().__init__()
        self.set_name("landmark_finder")
        self._model, self._course, self._alike = model, course, alike
        self._R_BC, self._p_BC = np.array(R_BC), np.array(p_BC)
        self._tracker = StairTracker(model=model, accuracy=accuracy)  # it remembers nothing
        self._image = self.DeclareAbstractInputPort("depth_measured", AbstractValue.Make(NO_IMAGE))
        self._newest = self.DeclareAbstractState(AbstractValue.Make(NO_SIGHTING))
        self._looked_at = self.DeclareDiscreteState([-np.inf])  # the last image's time [s]
        self.DeclareStateOutputPort("landmark_sighted", self._newest)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._look)

    def _look(self, context: Context, state: State) -> EventStatus:
        image: DepthImage = self._image.Eval(context)
        if image.stamp <= context.get_discrete_state(self._looked_at)[0]:
            return EventStatus.DidNothing()
        state.get_mutable_discrete_state(self._looked_at)[0] = image.stamp
        pose = pose_at_capture(image, self._R_BC, self._p_BC)
        sighting = sight_flight(
            self._tracker, image.depth, self._model, pose, self._course, stamp=image.stamp
        )
        if sighting is not None:
            covariance = read_only(self._alike * sighting.covariance)
            sighting = sighting._replace(covariance=covariance)
            state.get_mutable_abstract_state(self._newest).set_value(sighting)
        return EventStatus.Succeeded()
