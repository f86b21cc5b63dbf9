"""Which factors a fit's deviations get."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drake_quad.perception.calibration import (
    DOWN,
    EVEN,
    FACTORS,
    LOW,
    OPEN,
    OVERHUNG,
    QUANTITIES,
    UNEVEN,
    deviation_factors,
    kind_of_stairs,
)


@given(
    first=st.floats(0.3, 2.0), rise=st.floats(0.1, 0.2), run=st.floats(0.24, 0.4),
    steps=st.integers(1, 9), seed=st.integers(0, 1000),
)  # fmt: skip
def test_stairs_are_of_the_kind_that_the_fit_has_them(
    first: float, rise: float, run: float, steps: int, seed: int
) -> None:
    """Down comes first, then open, then an overhang; what is left is even, or by 10 mm not."""
    places = np.asarray(first + run * np.arange(float(steps)), dtype=np.float64)
    heights = np.asarray(rise * np.arange(steps + 1.0), dtype=np.float64)
    assert kind_of_stairs(places, -heights, overhang=0.0, is_open=False) == DOWN
    assert kind_of_stairs(places, heights, overhang=0.02, is_open=True) == OPEN
    assert kind_of_stairs(places, heights, overhang=0.02, is_open=False) == OVERHUNG
    assert kind_of_stairs(places, heights, overhang=0.002, is_open=False) == EVEN
    if steps >= 4:
        by = 0.01 * np.array([1.0, -1.0, 1.0, 1.0, -1.0])
        heights[:5] += by
        assert kind_of_stairs(places, heights, overhang=0.0, is_open=False) == UNEVEN


def test_low_and_high_cameras_have_their_own_factors() -> None:
    """Each quantity of each kind has one, and none is so small that intervals would be empty."""
    for kind, both in FACTORS.items():
        for side, height in zip(both, (LOW - 0.1, LOW + 0.1), strict=True):
            factors = deviation_factors(kind, camera_height=height)
            assert tuple(factors) == QUANTITIES and tuple(factors.values()) == side
            assert min(side) > 0.4


@pytest.mark.parametrize("kind", [EVEN, OVERHUNG])
def test_a_low_camera_is_surer_of_heights_than_its_fit(kind: str) -> None:
    """As measured: a high one is less sure."""
    low, high = (deviation_factors(kind, camera_height=h)["height"] for h in (0.32, 0.95))
    assert low < 1.0 < high
