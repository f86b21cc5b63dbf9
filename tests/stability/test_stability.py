"""The compiled margin is that of `stability_margin`; what a monitor measures follows from it."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from drake_quad.common import BoolArray, FloatArray
from drake_quad.stability.support_polygon import margin_over, measure_margins, stability_margin

# Rounded, so that feet in line, on top of each other and under the point come up.
coordinate = st.floats(-1.0, 1.0, allow_nan=False).map(lambda x: round(x, 1))
four_feet = arrays(np.float64, (4, 3), elements=coordinate)
point = arrays(np.float64, 2, elements=coordinate)
standing = arrays(np.bool_, 4)
NONE = -9.0


def judged(com: FloatArray, bearing: FloatArray, feet: FloatArray, force: FloatArray) -> FloatArray:
    """Margin, margin of the centre of pressure, and the ground's height."""
    margins = np.zeros(2)
    ground = measure_margins(com, bearing, feet.ravel(), force.ravel(), NONE, margins)
    return np.array([*margins, ground])


@given(point, four_feet, standing)
@settings(max_examples=300)
def test_margin_is_the_one_of_any_number_of_feet(
    p: FloatArray, feet: FloatArray, stands: BoolArray
) -> None:
    """Over none to four feet, in line or not, it is `stability_margin`'s."""
    found = margin_over(p[0], p[1], feet, stands)
    assert found == pytest.approx(stability_margin(p, feet[stands, :2]), abs=1e-12)


@given(point, four_feet, standing, arrays(np.float64, 4, elements=st.floats(0.0, 500.0)))
@settings(max_examples=200)
def test_margins_are_of_the_bearing_feet_alone(
    p: FloatArray, feet: FloatArray, stands: BoolArray, load: FloatArray
) -> None:
    """Of the centre of mass and of the loads' centre; without feet, or loads, there is none."""
    force = np.column_stack([np.zeros((4, 2)), load])
    found = judged(np.array([*p, 1.0]), stands.astype(float), feet, force)
    support = feet[stands, :2]
    expected = stability_margin(p, support) if stands.any() else NONE
    assert found[0] == pytest.approx(expected, abs=1e-12)
    expected = NONE
    if stands.any() and load.sum() > 1.0:
        expected = stability_margin(load @ feet[:, :2] / load.sum(), support)
    assert found[1] == pytest.approx(expected, abs=1e-9)
    assert found[2] == (feet[stands, 2] if stands.any() else feet[:, 2]).min()
