"""The shortest time at a gait's switches that keeps a margin, in few trials."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drake_quad.gait_design.switch_time import TRIALS, seek_switch


@given(
    knee=st.floats(0.2, 3.0),
    kept=st.floats(0.01, 0.1),
    first=st.floats(0.3, 3.0),
    most=st.one_of(st.just(np.inf), st.floats(0.2, 4.0)),
)
def test_the_time_that_is_found_keeps_the_margin(
    knee: float, kept: float, first: float, most: float
) -> None:
    """Of a margin that grows with the time, the time that is found was tried, and keeps it.

    It is the shortest that was, and no longer time than the longest is tried.
    """
    tried: dict[float, float] = {}

    def spare(switch: float) -> float:
        tried[switch] = 0.12 * (1.0 - np.exp(-switch / knee)) - kept
        return tried[switch]

    best = seek_switch(spare, first, 0.1, near=0.06 * kept, most=most)
    assert min(tried) >= 0.1 and max(tried) <= most
    if best < np.inf:
        assert tried[best] >= 0.0
        assert best == min(t for t, m in tried.items() if m >= 0.0)
    else:
        assert max(tried.values()) < 0.0


def test_a_time_far_above_one_that_is_hardly_too_short_is_not_near_enough() -> None:
    """A Spot's gait had 0.072 m/s in place of 0.079, as it kept 1 mm more than was asked."""
    least = 0.67

    def spare(time: float) -> float:
        return min(0.05 * (time - least), 1e-3)

    found = seek_switch(spare, 0.66, 0.1, near=1.7e-3)
    assert least <= found < 1.2 * least < 1.4 * 0.66


@pytest.mark.parametrize(("most", "trials"), [(3.0, 2), (20.0, TRIALS)])
def test_a_margin_that_hardly_grows_is_not_waited_for(most: float, trials: int) -> None:
    """It would take longer than the longest time: an ANYmal B's waits of 2.4 s were tried."""
    tried: list[float] = []

    def spare(switch: float) -> float:
        tried.append(switch)
        return -0.01 + 1e-3 * switch

    assert seek_switch(spare, 0.6, 0.1, near=1e-3, most=most) == np.inf
    assert len(tried) == trials


def test_a_time_with_a_plan_may_come_after_times_without_one() -> None:
    """What is known of no plan at all says nothing of longer times."""
    found = seek_switch(lambda t: -np.inf if t < 1.0 else 0.0, 0.6, 0.1, near=1e-3, most=3.0)
    assert 1.0 <= found < 1.3
