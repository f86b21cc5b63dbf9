"""How far a run's estimate was from the truth, and the load that it found."""

import numpy as np
import pytest
from summary_rig import as_dict, base_columns, estimated, log, summary, values, with_columns

from drake_quad.runs.pose_metrics import distance_walked


@pytest.mark.parametrize(("ahead", "yaw"), [(0.0, 0.0), (-0.03, 0.002), (0.01, -0.05)])
def test_errors_of_the_estimate_are_its_distances_from_the_truth(ahead: float, yaw: float) -> None:
    """Place in metres and as a part of the way, heading and attitude in degrees."""
    found = as_dict(summary(estimated(log(), ahead=ahead, yaw=yaw))["estimate"])
    for key in ("drift", "position_error_max"):
        assert found[key] == pytest.approx(abs(ahead), abs=1e-9)
    assert found["drift_ratio"] == pytest.approx(abs(ahead) / found["way"], abs=1e-9)
    for key in ("yaw_error_max_deg", "attitude_error_max_deg"):
        assert found[key] == pytest.approx(np.degrees(abs(yaw)), abs=1e-6)
    assert found["place_error_sigmas"] == pytest.approx(abs(ahead) / 0.01 / np.sqrt(2.0), abs=1e-6)
    assert found["yaw_error_sigmas"] == pytest.approx(abs(yaw) / 0.002, abs=1e-6)
    assert found["slips_flagged"] == found["samples_unhealthy"] == 0
    assert summary(log())["estimate"] is None


def test_drift_is_that_at_the_end_and_the_greatest_error_that_of_any_time() -> None:
    """An error that comes and goes is no drift; flags are counted as they come."""
    table = estimated(log())
    x, slip = values("base_estimated_x", table), values("RL_slip_estimated", table)
    x[100] += 0.05
    slip[20:30] = slip[50:51] = True
    changes = {"base_estimated_x": x, "RL_slip_estimated": slip}
    found = as_dict(summary(with_columns(table, **changes))["estimate"])
    assert found["position_error_max"] == pytest.approx(0.05) and found["drift"] < 1e-9
    assert found["slips_flagged"] == 2


def test_the_way_is_walked_and_not_swayed() -> None:
    """That of each task from rest to rest, whatever the body does between; a stand has none."""
    c = {name: values(name) for name in log().column_names}
    x, y = (c[name] for name in base_columns()[1][:2])
    assert distance_walked(c) == pytest.approx(2.0, abs=1e-6)  # that much the plan walks, and sways
    assert np.sum(np.hypot(np.diff(x), np.diff(y))) > 2.2
    # There in one task and back in the next is twice the way, though it ends where it began.
    whole = {name: np.concatenate([column, column[::-1]]) for name, column in c.items()}
    whole["task"] = np.repeat([0, 1], len(x))
    assert distance_walked(whole) == pytest.approx(2 * np.hypot(x[-1] - x[0], y[-1] - y[0]))
    stand = as_dict(summary(estimated(log().slice(0, 40)))["estimate"])
    assert stand["drift_ratio"] is None


def test_the_load_is_told_in_kilograms_and_where_it_is() -> None:
    """5 kg 0.1 m ahead and 0.05 m to the left; next to nothing is nowhere."""
    table = estimated(log())
    found = as_dict(summary(table)["carried"])
    assert found["mass"] == pytest.approx(5.0)
    assert (found["ahead"], found["left"]) == (pytest.approx(0.1), pytest.approx(0.05))
    light = with_columns(table, carried_force=np.full(log().num_rows, 1.0))
    found = as_dict(summary(light)["carried"])
    assert found["ahead"] is None and found["left"] is None and found["moment_y"] == -4.905
    assert summary(log())["carried"] is None and summary(log())["qp_unsolved"] is None
    assert summary(table)["qp_unsolved"] == (log().num_rows - 1) // 100
