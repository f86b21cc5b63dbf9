"""Landmarks in the Diagram of a run: images of the map's flight reach the state estimator."""

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from drake_quad.estimation.filter_state import COVARIANCE, E_CAMERA, ERRORS, SIGHTED
from drake_quad.estimation.landmark_correction import LandmarkSighting
from drake_quad.scenario.load import load_scenario, parse_scenario
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import simulate


def test_the_flight_ahead_is_seen_and_counts() -> None:
    """A standing robot at its known start sees the flight within 30 mm and a degree of its place.

    What the camera has wrong is known better after three images, for the place is known.
    """
    prepared = prepare(load_scenario("ten_flights", ["monitor.margins=hull"]))
    climb = stair_climb_of(prepared)
    simulator = Simulator(climb.diagram)
    ApplySimulatorConfig(prepared.scenario.simulation.simulator, simulator)
    simulator.set_target_realtime_rate(0.0)
    finder = climb.diagram.GetSubsystemByName("landmark_finder")
    controller = climb.diagram.GetSubsystemByName("controller")
    estimator = controller.GetSubsystemByName("state_estimator")
    root = simulator.get_context()

    def memory() -> np.ndarray:
        """The filter's memory."""
        return np.array(estimator.GetMyContextFromRoot(root).get_discrete_state(0).value())

    def camera_known() -> np.ndarray:
        """Deviations of what the camera has wrong (3,)."""
        P = memory()[COVARIANCE:].reshape(ERRORS, ERRORS)
        return np.sqrt(np.diag(P)[E_CAMERA : E_CAMERA + 3])

    simulator.AdvanceTo(0.02)
    assert memory()[SIGHTED] == -np.inf
    before = camera_known()
    simulator.AdvanceTo(1.2)
    sighting: LandmarkSighting = finder.GetOutputPort("landmark_sighted").Eval(
        finder.GetMyContextFromRoot(root)
    )
    assert sighting.stamp == 1.0 and memory()[SIGHTED] == 1.0
    assert np.all(np.abs(sighting.off) < [0.03, np.radians(1.0), 0.03])
    assert np.all(camera_known() < 0.8 * before)
    told = controller.GetOutputPort("landmark_state").Eval(controller.GetMyContextFromRoot(root))
    assert told[0] == 3.0  # at 0, 0.5 and 1 s
    assert np.all(np.abs(told[1:]) < [0.03, np.radians(1.0), 0.03]) and np.any(told[1:] != 0.0)


def test_a_run_whose_camera_saw_no_flight_says_so() -> None:
    """A course without stairs ahead: the estimate drifts as it would without a camera."""
    text = """
course: [{kind: floor, length: 6.0}]
mission: [{kind: stand, duration: 0.6}]
controller: {kind: whole_body, period: 0.002}
monitor: {margins: hull}
estimator: {kind: ekf, landmarks: stairs}
"""
    result = simulate(parse_scenario(text, source="test"))
    assert result.summary["estimate"]["landmarks_seen"] == 0
    assert result.summary["assumes"].endswith("in its view?")
