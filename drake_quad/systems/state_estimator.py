"""StateEstimator: the robot's state from its own sensors alone."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.common import FloatArray
from drake_quad.estimation.filter import run_filter, write_deviation, write_state
from drake_quad.estimation.filter_state import (
    DEFAULT_SETTINGS,
    LANDMARK_OFF,
    LANDMARKS,
    EstimatorSettings,
    filter_model,
    initial_memory,
)
from drake_quad.estimation.landmark_correction import (
    NO_SIGHTING,
    LandmarkSighting,
    correct_by_landmark,
)
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import RobotModel
from drake_quad.robot.state import StateLayout
from drake_quad.systems.leaf_system import DeclareStateOutput
from drake_quad.terrain.course import Course, box_tops


class StateEstimator(LeafSystem):
    """A contact-aided invariant extended Kalman filter; see docs/estimation.md.

    Place and heading are as good as the start is known, for nothing the robot feels shows them, or
    as landmarks show them. Height is the map's, where there is one.

    Input ports:
        imu_measured: (6,) rate [rad/s] and specific force [m/s^2] in B.
        joint_state_measured: (24,) joint angles [rad], then speeds [rad/s], leg by leg.
        contact_state_measured: (4,) 1 where a foot bears.
        motion_plan: The MotionPlan under way (abstract), where the map grows: its map counts.
        landmark_sighted: LandmarkSighting (abstract), if there are landmarks.
    Output ports:
        robot_state_estimated: [q; v] in the layout's order; joints as measured.
        estimator_deviation: (9,) standard deviations of orientation [rad], velocity [m/s] and
            position [m], along W's axes.
        imu_bias_estimated: (6,) of the rate [rad/s] and of the specific force [m/s^2], in B.
        foot_slip_estimated: (4,) 1 where a bearing foot slipped and has not been firm since.
        estimator_healthy: (1,) 1 while every sensor's reading was sound at the last tick and the
            velocity is known; else the estimate holds, or rests on what sensors are left.
        landmark_state: (4,) how many landmarks were sighted so far, and what the last sighting had
            as the estimate's error: ahead [m], of the heading [rad], to the left [m]; 0 of what was
            not seen. If there are landmarks.
    """

    def __init__(
        self,
        *,
        robot: RobotModel,
        layout: StateLayout,
        p_WB: FloatArray,
        yaw: float,
        pitch: float = 0.0,
        q: FloatArray | None = None,
        settings: EstimatorSettings = DEFAULT_SETTINGS,
        period: float = 0.002,
        course: Course | None = None,
        foot_give: float = 0.0,
        map_grows: bool = False,
        landmarks: bool = False,
    ) -> None:
        """Puts the robot at its known start.

        Args:
            robot: The robot.
            layout: The estimated state's layout.
            p_WB: Where the base is put, (3,) [m].
            yaw: Which way it looks [rad].
            pitch: How it leans forward until the first specific force says better [rad].
            q: (12,) joint angles that the state has until the first reading [rad]; zero if None.
            settings: What the filter assumes.
            period: Period of the filter, and of the IMU [s].
            course: The map, on whose heights the feet come to stand; none is counted on if None.
            foot_give: How much foot and ground give under load: a foot rolls as one whose radius is
                smaller by that, and its middle is lower by it [m].
            map_grows: Whether there is a port `motion_plan`, whose plans have the map that counts.
            landmarks: Whether there is a port `landmark_sighted`.
        """
        super().__init__()
        self.set_name("state_estimator")
        self._model = filter_model(
            robot, settings, radius=robot.foot_radius - foot_give, period=period, layout=layout
        )
        self._tops = np.zeros((0, 10)) if course is None else box_tops(course)
        angles = np.zeros(12) if q is None else np.asarray(q, dtype=np.float64).reshape(12)
        memory = initial_memory(settings, np.asarray(p_WB, dtype=np.float64), yaw, pitch, angles)
        deviation = np.zeros(9)
        write_deviation(memory, deviation)
        # In the order that the kernel takes them.
        self._inputs = [
            self.DeclareVectorInputPort("imu_measured", 6),
            self.DeclareVectorInputPort("joint_state_measured", 24),
            self.DeclareVectorInputPort("contact_state_measured", 4),
        ]
        self._plan = None
        if map_grows:
            self._plan = self.DeclareAbstractInputPort("motion_plan", AbstractValue.Make(object()))
        self._landmark = None
        if landmarks:
            self._landmark = self.DeclareAbstractInputPort(
                "landmark_sighted", AbstractValue.Make(NO_SIGHTING)
            )
        self._mapped: tuple[Course | None, FloatArray] = course, self._tops
        self._memory = int(self.DeclareDiscreteState(memory))
        first = np.zeros(layout.size)
        joints = np.concatenate([angles, np.zeros(12)])
        write_state(memory, joints, self._model[0], first)
        # In the order that the kernel takes them.
        self._outputs = [
            DeclareStateOutput(self, "robot_state_estimated", first),
            DeclareStateOutput(self, "estimator_deviation", deviation),
            DeclareStateOutput(self, "imu_bias_estimated", 6),
            DeclareStateOutput(self, "foot_slip_estimated", 4),
            DeclareStateOutput(self, "estimator_healthy", 1),
        ]
        if landmarks:
            self._landmark_state = DeclareStateOutput(self, "landmark_state", 4)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        # The kernel works in place: `state` begins as a copy of the Context's values.
        value = state.get_mutable_value
        imu, joints, contacts = [port.Eval(context) for port in self._inputs]
        out = tuple(value(index) for index in self._outputs)
        tops = self._tops if self._plan is None else self._tops_of(self._plan.Eval(context))
        if self._landmark is not None:
            landmark: LandmarkSighting = self._landmark.Eval(context)
            memory = value(self._memory)
            correct_by_landmark(memory, landmark, self._model)
            value(self._landmark_state)[:] = memory[LANDMARKS : LANDMARK_OFF + 3]
        run_filter(value(self._memory), (imu, joints, contacts), self._model, tops, out)

    def _tops_of(self, plan: MotionPlan) -> FloatArray:
        """The map that a plan was made on; kept until another one's. It is no state."""
        if plan.course is None:
            return self._tops
        if plan.course is not self._mapped[0]:
            self._mapped = plan.course, box_tops(plan.course)
        return self._mapped[1]
