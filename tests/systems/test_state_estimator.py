"""The estimator as a system: alone through its ports, with and without sound readings."""

import numpy as np
import pytest
from estimation_rig import DT
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context
from rig import GRAVITY, fix_inputs, flat_course, model_layout, paper_robot, read

from drake_quad.common import FloatArray
from drake_quad.estimation.filter_state import EstimatorSettings
from drake_quad.estimation.landmark_correction import NO_SIGHTING, LandmarkSighting
from drake_quad.robot.kinematics import calc_feet
from drake_quad.systems.state_estimator import StateEstimator

Q = np.tile([0.0, 0.7, -1.4], 4)
REST = {
    "imu_measured": np.array([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY]),
    "joint_state_measured": np.concatenate([Q, np.zeros(12)]),
    "contact_state_measured": np.ones(4),
}


class Alone:
    """The estimator by itself, its inputs fixed."""

    def __init__(self, p_WB: tuple[float, float, float] = (1.0, 2.0, 0.9), yaw: float = 0.3):
        self.system = StateEstimator(
            robot=paper_robot(), layout=model_layout(), p_WB=np.array(p_WB), yaw=yaw, q=Q
        )
        self.simulator = Simulator(self.system)
        self.context: Context = self.simulator.get_mutable_context()
        self.feel(**REST)

    def feel(self, **values: FloatArray) -> None:
        """Fixes what the sensors say from now on."""
        fix_inputs(self.system, self.context, **values)

    def run(self, ticks: int) -> "Alone":
        """Lets so many ticks pass."""
        now = round(self.context.get_time() / DT)
        self.simulator.AdvanceTo((now + ticks) * DT + 0.25 * DT)
        return self

    def read(self, port: str = "robot_state_estimated") -> FloatArray:
        """An output."""
        return read(self.system, self.context, port)


def test_robot_at_rest_stays_where_it_was_put() -> None:
    """Five seconds of nothing move the estimate by nothing, and it is healthy."""
    alone = Alone()
    before = alone.read()
    alone.run(2500)
    np.testing.assert_allclose(alone.read(), before, atol=1e-9)
    assert alone.read("estimator_healthy") == [1.0]
    assert alone.read("foot_slip_estimated").tolist() == [0.0] * 4


@pytest.mark.parametrize("known", [True, False])
def test_height_comes_from_the_course_where_there_is_one(known: bool) -> None:
    """A robot that believes itself 8 mm above its map comes down to it; without one it stays."""
    robot = paper_robot()
    feet = calc_feet(robot.geometry, Q.reshape(4, 3))[:, 2]
    start = float(robot.foot_radius - feet.mean()) + 0.008
    system = StateEstimator(
        robot=robot, layout=model_layout(), p_WB=np.array([2.0, 0.0, start]), yaw=0.0, q=Q,
        settings=EstimatorSettings(initial_position=0.02, map_height=0.005),
        course=flat_course() if known else None,
    )  # fmt: skip
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    fix_inputs(system, context, **REST)
    simulator.AdvanceTo(0.5)
    state = read(system, context, "robot_state_estimated")
    off = model_layout().read(state).p_WB[2] - (start - 0.008)
    assert abs(off) < 0.002 if known else off == pytest.approx(0.008, abs=1e-4)


def test_first_state_is_the_known_start() -> None:
    """Before any tick the output is the start as given, in the layout's order."""
    state = model_layout().read(Alone().read())
    np.testing.assert_allclose(state.p_WB, [1.0, 2.0, 0.9])
    np.testing.assert_allclose(state.R_WB[:, 0], [np.cos(0.3), np.sin(0.3), 0.0], atol=1e-12)
    np.testing.assert_allclose(state.q.ravel(), Q)


def test_tilt_comes_from_the_first_specific_force() -> None:
    """A robot that leans feels gravity aslant; heading stays as given."""
    alone = Alone(yaw=-0.8)
    pitch, roll = 0.1, -0.05
    up_in_body = np.array(
        [-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)]
    )
    alone.feel(imu_measured=np.concatenate([np.zeros(3), GRAVITY * up_in_body]))
    R = model_layout().read(alone.run(1).read()).R_WB
    np.testing.assert_allclose(R[2], up_in_body, atol=1e-9)
    assert np.arctan2(R[1, 0], R[0, 0]) == pytest.approx(-0.8)


@pytest.mark.parametrize("port", ["imu_measured", "joint_state_measured", "contact_state_measured"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_reading_that_is_no_number_does_no_harm(port: str, bad: float) -> None:
    """The estimate holds, is flagged, and is as good as ever when the sensor is back."""
    alone = Alone().run(500)
    before = alone.read()
    broken = REST[port].copy()
    broken[1] = bad
    alone.feel(**{port: broken})
    alone.run(50)
    assert alone.read("estimator_healthy") == [0.0]
    assert np.isfinite(alone.read()).all() and np.isfinite(alone.read("estimator_deviation")).all()
    np.testing.assert_allclose(alone.read(), before, atol=1e-3)
    alone.feel(**REST)
    alone.run(500)
    assert alone.read("estimator_healthy") == [1.0]
    np.testing.assert_allclose(alone.read(), before, atol=1e-3)


def test_nothing_is_believed_before_the_first_sound_readings() -> None:
    """With the joints silent from the start the known start stands, flagged."""
    alone = Alone()
    before = alone.read()
    alone.feel(joint_state_measured=np.full(24, np.nan))
    alone.run(20)
    np.testing.assert_array_equal(alone.read(), before)
    assert alone.read("estimator_healthy") == [0.0]


def test_outputs_are_held_state() -> None:
    """No reading reaches an output but by a tick: no algebraic loop through a controller."""
    assert not Alone().system.HasAnyDirectFeedthrough()


def test_two_contexts_share_nothing() -> None:
    """What one simulation feels, another of the same system knows nothing of."""
    alone = Alone()
    other = alone.system.CreateDefaultContext()
    before = read(alone.system, other, "robot_state_estimated")
    alone.feel(imu_measured=np.array([0.3, 0.0, 0.1, 1.0, 0.0, GRAVITY]))
    alone.run(200)
    assert np.abs(alone.read() - before).max() > 0.01
    np.testing.assert_array_equal(read(alone.system, other, "robot_state_estimated"), before)


def test_a_landmark_corrects_the_estimate_once() -> None:
    """Seen 50 mm too far ahead by a robot that is not sure of its place, it moves back; once."""
    system = StateEstimator(
        robot=paper_robot(), layout=model_layout(), p_WB=np.array([1.0, 2.0, 0.9]), yaw=0.0, q=Q,
        settings=EstimatorSettings(initial_position=0.1, camera_range=0.002), landmarks=True,
    )  # fmt: skip
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    fix_inputs(system, context, **REST)
    port = system.GetInputPort("landmark_sighted")
    port.FixValue(context, AbstractValue.Make(NO_SIGHTING))
    at = model_layout().q_base + 4

    def place(until: float) -> FloatArray:
        simulator.AdvanceTo(until)
        return read(system, context, "robot_state_estimated")[at : at + 3]

    np.testing.assert_allclose(place(0.2), [1.0, 2.0, 0.9], atol=1e-6)
    sighting = LandmarkSighting(
        stamp=0.15, direction=np.array([1.0, 0.0]), eye=np.array([1.6, 2.0, 1.0]),
        off=np.array([0.05, 0.0, 0.0]), covariance=np.diag([1e-6, 1e-6, np.inf]),
    )  # fmt: skip
    port.FixValue(context, AbstractValue.Make(sighting))
    np.testing.assert_allclose(place(0.21), [0.95, 2.0, 0.9], atol=0.002)
    np.testing.assert_allclose(place(1.0), [0.95, 2.0, 0.9], atol=0.002)


def test_without_landmarks_there_is_no_port_for_them() -> None:
    """A robot without a camera has nothing to connect."""
    assert not Alone().system.HasInputPort("landmark_sighted")
