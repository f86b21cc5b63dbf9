"""What a kinematic replay touches is asked of the geometry, depth by depth."""

import json
from pathlib import Path

import numpy as np
import pytest
from rig import flat_course, model_layout, paper_robot, state_from_joints

from drake_quad.common import FloatArray
from drake_quad.runs.result import write_files
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.kinematic_replay import Touches, find_touches
from drake_quad.simulation.run import simulate

FOOT_END = 0.72  # [m] from the knee to the lower end of the foot, as in the shipped file
SHANK_END = 0.668  # [m] to that of the shank's capsule
SHORT = [
    "course=[{kind: floor, length: 4.0, width: 2.0}]",
    "mission=[{kind: stand, duration: 0.5}]",
    "simulation.log_period=0.05",
    "robot.point_feet=false",
]


def standing(deep: float) -> FloatArray:
    """A state with straight, upright legs whose feet end `deep` [m] in the ground."""
    g = paper_robot().geometry
    height = float(g.thigh[0] - g.p_BH[0, 2]) + FOOT_END - deep
    return state_from_joints(np.array([2.0, 0.0, height, 0.0, 0.0]), np.zeros((4, 3)))


def touches(*depths: float) -> Touches:
    states = np.stack([standing(deep) for deep in depths])
    return find_touches(paper_robot(), flat_course(), np.arange(len(depths), dtype=float), states)


def test_feet_on_the_ground_are_no_contact_of_anything_else() -> None:
    """A foot that just stands, or sinks in, is told of as a foot."""
    found = touches(0.0, 0.012, -0.01)
    assert found.count.tolist() == [0, 0, 0] and found.deepest == ()
    expected = np.outer([0.0, 0.012, 0.0], np.ones(4))
    np.testing.assert_allclose(found.foot_depth, expected, atol=1e-9)


def test_shanks_in_the_ground_are_counted_with_their_depth() -> None:
    """Every shank that comes into the floor counts; the deepest has its name, depth and time."""
    end = FOOT_END - SHANK_END
    found = touches(end - 0.001, end + 0.004, end + 0.009)
    assert found.count.tolist() == [0, 4, 4]
    np.testing.assert_allclose(found.depth, [0.0, 0.004, 0.009], atol=1e-9)
    assert {entry["part"] for entry in found.deepest} == {
        f"{leg}_shank" for leg in ("FL", "FR", "RL", "RR")
    }
    for entry in found.deepest:
        assert entry["depth"] == pytest.approx(0.009) and entry["time"] == 2.0
        assert "floor" in entry["inside"]


def test_positions_are_taken_from_states_that_hold_velocities_too() -> None:
    """A run's log has [q; v]: what lies beyond the positions is not read."""
    state = standing(0.07)
    assert len(state) == model_layout().size
    spoilt = state.copy()
    spoilt[model_layout().num_positions :] = np.nan
    a, b = (
        find_touches(paper_robot(), flat_course(), np.zeros(1), s[None]) for s in (state, spoilt)
    )
    assert a.depth == b.depth > 0.0


def test_a_replay_tells_what_its_plan_touches(tmp_path: Path) -> None:
    """Log and summary of a replay say which shank is how deep in the edge behind it."""
    curb = "course=[{kind: floor, length: 2.2, width: 2.0}, {kind: curb, going: down, height: 0.2},"
    course = f"{curb} {{kind: floor, length: 2.0, width: 2.0}}]"
    free = simulate(load_scenario("paper", SHORT))
    assert free.summary["nonfoot_contact_samples"] == 0 and free.summary["overlaps"] == []
    assert free.summary["nonfoot_depth_max"] == 0.0
    assert free.summary["foot_depth_max"] == pytest.approx(0.0, abs=1e-9)
    # The front feet stand 0.40 m ahead of the body, just beyond the nosing, shanks leaning back.
    near = simulate(load_scenario("paper", [*SHORT, course, "start.distance=1.825"]))
    assert near.summary["nonfoot_contact_samples"] == near.summary["samples"]
    worst = near.summary["overlaps"][0]
    assert worst["depth"] == pytest.approx(near.summary["nonfoot_depth_max"])
    assert near.summary["nonfoot_force_max"] is None
    assert near.table["nonfoot_depth"].to_numpy().max() == worst["depth"]
    write_files(near, near.scenario, tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["overlaps"][0] == worst
