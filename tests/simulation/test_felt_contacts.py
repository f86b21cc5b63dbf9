"""Whole runs in which the drives' torques alone tell which feet bear."""

import numpy as np
import pytest

from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import simulate

CLIMB = (
    "course=[{kind: floor, length: 1.6, width: 2.0}, "
    "{kind: stairs, going: up, rise: 0.12, run: 0.4, count: 2, width: 2.0}, "
    "{kind: landing, length: 1.6, width: 2.0}]",
    "mission=[]",
    "sensors.contacts=joints",
    "monitor.margins=hull",
)


@pytest.mark.long
def test_a_robot_that_feels_with_its_joints_climbs_two_steps() -> None:
    """It gets there on estimates; every touchdown is felt, soon, and none where there was none.

    What the controller acts on is what the log says was felt, and no sensor in a foot: the felt
    flags are not the sensed ones.
    """
    scenario = load_scenario("case_study", [*CLIMB, "estimator.kind=ekf"])
    prepared = prepare(scenario)
    controller = stair_climb_of(prepared).diagram.GetSubsystemByName("controller")
    assert controller.HasInputPort("joint_torque_measured")
    assert not controller.HasInputPort("contact_state_measured")
    result = simulate(prepared)
    summary = result.summary
    assert summary["outcome"] == "goal_reached", summary["reason"]
    felt = summary["felt"]
    assert felt["touchdowns"] >= 16  # each foot, four times
    assert felt["missed"] == 0 and felt["false"] == 0
    assert 0.0 <= felt["delay_median"] <= 0.02
    assert "feel" in summary["assumes"] and "without error" not in summary["assumes"]
    flags = {
        name: np.stack([result.table.column(f"{leg}_{name}").to_numpy() for leg in SHORT_NAMES])
        for name in ("bearing", "felt")
    }
    assert np.any(flags["bearing"] != flags["felt"])
    assert np.mean(flags["bearing"] == flags["felt"]) > 0.98
