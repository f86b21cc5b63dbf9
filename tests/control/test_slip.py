"""What a slip teaches: less friction is counted on under that foot, and it comes back slowly."""

import numpy as np
from hypothesis import given, strategies as st

from drake_quad.control.contact_load import LEAST, REGAINS, update_friction

PERIOD = 0.002
LEVEL = np.tile([0.0, 0.0, 1.0], (4, 1))
speeds = st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4)
loads = st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4)


@given(speeds, loads, st.floats(0.05, 1.2), st.integers(1, 200))
def test_friction_stays_between_what_is_stood_on_and_what_is_assumed(
    speed: list[float], load: list[float], assumed: float, ticks: int
) -> None:
    """Whatever happens, and for however long."""
    friction, velocity = np.full(4, assumed), np.zeros((4, 3))
    velocity[:, 1] = speed
    for _ in range(ticks):
        update_friction(friction, velocity, np.array(load), LEVEL, assumed, PERIOD)
    assert np.all(friction <= assumed) and np.all(friction >= min(LEAST, assumed))


def test_only_a_foot_that_carries_and_slips_loses() -> None:
    """Not one in the air, not one that stands, not one that is pressed down."""
    velocity = np.array([[0.2, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.0, 0.2], [0.0, 0.03, 0.0]])
    friction = np.full(4, 0.5)
    for _ in range(50):
        update_friction(friction, velocity, np.array([1.0, 0.0, 1.0, 1.0]), LEVEL, 0.5, PERIOD)
    assert friction[0] < 0.25
    np.testing.assert_array_equal(friction[1:], 0.5)


def test_what_is_lost_is_regained_in_its_time() -> None:
    """From next to nothing to all that is assumed in REGAINS seconds at most."""
    friction, still = np.full(4, LEAST), np.zeros((4, 3))
    for _ in range(round(REGAINS / PERIOD)):
        update_friction(friction, still, np.ones(4), LEVEL, 0.5, PERIOD)
    np.testing.assert_array_equal(friction, 0.5)


def test_on_a_slope_no_less_is_assumed_than_standing_takes() -> None:
    """A foot that had less friction than the slope's gradient could not be stood on anyway."""
    friction, velocity = np.full(4, 0.5), np.full((4, 3), 0.5)
    normals = np.array([[0.0, 0.0, 1.0], [-0.4, 0.0, 1.0], [0.0, 0.3, 1.0], [0.6, 0.0, 1.0]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for _ in range(1000):
        update_friction(friction, velocity, np.ones(4), normals, 0.5, PERIOD)
    np.testing.assert_allclose(friction, [LEAST, 0.4, 0.3, 0.5])
