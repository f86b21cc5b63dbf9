"""What a push did to a run, and whether the robot got over it."""

import json
from typing import Any

import numpy as np
import pytest
from summary_rig import PERIOD, base_columns, changed, values

from drake_quad.runs.event_metrics import push_figures
from drake_quad.systems.disturbances import Push


def kicked(*, base: np.ndarray, pushes: list[float], failed: bool = False) -> list[dict[str, Any]]:
    """Figures of pushes of 0.3 m/s at these times, the base this far off its plan."""
    place = base_columns()[1][0]
    table = changed(**{place: values(place) + base})
    given = [
        Push(time=time, duration=0.1, force_H=(0.0, 180.0, 0.0), body="trunk", speed=0.3)
        for time in pushes
    ]
    return push_figures(table, given, failed=failed)


def test_a_push_is_recovered_from_when_the_base_is_back_and_stays() -> None:
    """0.4 s after a push of 0.1 s the base is calm for good: recovered, in 0.3 s."""
    t = values("t")
    off = np.where((t >= 2.0) & (t < 2.4), 0.08, 0.0)
    (found,) = kicked(base=off, pushes=[2.0])
    assert found["recovered"] is True
    assert found["recovery_time"] == pytest.approx(0.3, abs=2 * PERIOD)
    assert found["base_error_max"] == pytest.approx(0.08)
    assert (found["time"], found["duration"], found["speed"]) == (2.0, 0.1, 0.3)
    assert found["force"] == pytest.approx(180.0)
    (unmoved,) = kicked(base=0.0 * off, pushes=[2.0])
    assert unmoved["recovered"] is True and unmoved["recovery_time"] == 0.0


def test_a_push_that_the_robot_does_not_get_over_is_not_recovered_from() -> None:
    """Off to the end; calm but for the last moment; or a run that failed after it."""
    t = values("t")
    for off in (np.where(t >= 2.0, 0.08, 0.0), np.where(t >= t[-1] - 0.2, 0.08, 0.0)):
        (found,) = kicked(base=off, pushes=[2.0])
        assert found["recovered"] is False and found["recovery_time"] is None
    (found,) = kicked(base=0.0 * t, pushes=[2.0], failed=True)
    assert found["recovered"] is False


def test_each_push_is_judged_until_the_next() -> None:
    """What a second push does is not blamed on the first, nor a fall at the end."""
    t = values("t")
    off = np.where(t >= 4.0, 0.08, 0.0)
    first, second = kicked(base=off, pushes=[4.0, 2.0], failed=True)
    assert (first["time"], second["time"]) == (2.0, 4.0)
    assert first["recovered"] is True and second["recovered"] is False


def test_pushes_at_one_moment_are_judged_alike() -> None:
    """Both are reached, and so they are where no sample lies between their beginnings."""
    t = values("t")
    off = np.where((t >= 2.0) & (t < 2.4), 0.08, 0.0)
    for apart in (0.0, 0.2 * PERIOD):
        *both, last = kicked(base=off, pushes=[1.995, 1.995 + apart, 4.0])
        for found in both:
            assert found["recovered"] is True and found["base_error_max"] == pytest.approx(0.08)
            assert found["recovery_time"] == pytest.approx(0.3, abs=2 * PERIOD)
        assert last["recovered"] is True and last["base_error_max"] == pytest.approx(0.0, abs=1e-5)


def test_a_push_that_the_run_did_not_reach_is_not_judged() -> None:
    """A run that ended before has nothing to say of it; no pushes, no figures."""
    t = values("t")
    (found,) = kicked(base=0.0 * t, pushes=[t[-1] + 1.0], failed=True)
    assert [found[k] for k in ("base_error_max", "recovered", "recovery_time")] == [None] * 3
    assert kicked(base=0.0 * t, pushes=[]) == []
    json.dumps(found, allow_nan=False)
