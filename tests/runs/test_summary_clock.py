"""What a run's clock waited for, and its recoveries, as its log has them."""

import numpy as np
import pytest
from summary_rig import PERIOD, as_dict, as_list, interrupted, log, summary, values, with_columns

from drake_quad.robot.legs import SHORT_NAMES


def test_a_recovery_is_told_from_its_beginning_until_the_clock_runs() -> None:
    """When, with which legs in order, how long; one that the run did not outlast has no end."""
    (found,) = as_list(summary(interrupted())["recoveries"])
    assert found["time"] == pytest.approx(1.0) and found["legs"] == ["FR", "RL"]
    assert found["duration"] == pytest.approx(0.7)
    (cut,) = as_list(summary(interrupted(cut=True))["recoveries"])
    assert cut["legs"] == ["FR", "RL"] and cut["duration"] is None
    assert summary(log())["recoveries"] == []


def test_a_fall_right_after_the_plan_was_made_is_a_recovery_of_its_own() -> None:
    """Though no sample shows the clock running between the two."""
    table = interrupted()
    mode, leg, t = values("gait_mode", table), values("catch_leg", table), values("t")
    later = (t > 1.7 - 1e-9) & (t < 1.9)
    mode[later] = "catch"
    leg[later] = 4
    first, second = as_list(
        summary(with_columns(table, gait_mode=mode, catch_leg=leg))["recoveries"]
    )
    assert first["legs"] == ["FR", "RL"] and second["legs"] == ["RR"]
    assert first["duration"] == pytest.approx(second["time"] - first["time"])


def waiting(*, at: int, samples: int, swing: list[int], bears: bool) -> dict[str, float]:
    """What a clock waited for that waits `samples` from row `at` on; `swing` is row by row."""
    n = len(swing)
    waited = np.zeros(n)
    waited[at : at + samples] = PERIOD
    rate = np.where(waited > 0.0, 0.0, 1.0)
    table = log().slice(0, n)
    bearing = {f"{leg}_bearing": np.full(n, bears) for leg in SHORT_NAMES}
    changes = {"gait_waited": np.cumsum(waited), "gait_rate": rate, "swing_leg": np.array(swing)}
    return as_dict(summary(with_columns(table, **changes, **bearing))["clock_waited_for"])


def test_what_the_clock_waits_for_is_told_by_where_it_stands() -> None:
    """At a swing's end for the touchdown, on four feet for the lift-off, else for the recovery."""
    wait = 10 * PERIOD
    for swing, bears, reason in (
        ([1] * 25 + [0] * 15, False, "touchdown"),
        ([1] * 25 + [0] * 15, True, "touchdown"),  # the foot bears, but the controller is told late
        ([0] * 25 + [3] * 15, True, "lift_off"),
        ([1] * 25 + [3] * 15, False, "touchdown"),  # one leg lifts off as the other lands
        ([1] * 25 + [3] * 15, True, "lift_off"),
    ):
        found = waiting(at=15, samples=10, swing=swing, bears=bears)
        assert found.pop(reason) == pytest.approx(wait), (swing, bears)
        assert list(found.values()) == [0.0, 0.0]
    whole = summary(interrupted())
    parts = as_dict(whole["clock_waited_for"])
    assert parts["recovery"] == pytest.approx(whole["clock_waited"]) == pytest.approx(0.7)
