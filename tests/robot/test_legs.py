"""Laws of the leg names and their tables."""

import numpy as np
import pytest

from drake_quad.common import read_only
from drake_quad.robot.legs import (
    LEGS,
    SIGNS,
    SPIN_ORDER_CLOCKWISE,
    SPIN_ORDER_COUNTERCLOCKWISE,
    WAVE_ORDER,
    Leg,
)


def test_numbering_is_the_papers() -> None:
    """Legs 1 to 4 are front left, front right, rear left, rear right, with x forward and y left."""
    assert [leg.short for leg in LEGS] == ["FL", "FR", "RL", "RR"]
    for leg in LEGS:
        assert (SIGNS[leg.row] > 0).tolist() == [leg.short[0] == "F", leg.short[1] == "L"]


def test_mirror_and_reversal_are_commuting_involutions_that_flip_one_sign() -> None:
    """Mirroring exchanges left and right only, reversing exchanges front and rear only."""
    for leg in LEGS:
        assert leg.mirrored.mirrored is leg and leg.reversed.reversed is leg
        assert leg.mirrored.reversed is leg.reversed.mirrored
        assert SIGNS[leg.mirrored.row].tolist() == [SIGNS[leg.row][0], -SIGNS[leg.row][1]]
        assert SIGNS[leg.reversed.row].tolist() == [-SIGNS[leg.row][0], SIGNS[leg.row][1]]


def test_wave_order_goes_back_to_front_on_each_side() -> None:
    """In the wave each front leg follows the rear leg of its side."""
    for leg in (Leg.REAR_LEFT, Leg.REAR_RIGHT):
        after = WAVE_ORDER[(WAVE_ORDER.index(leg) + 1) % 4]
        assert after is leg.reversed


def test_spin_orders_go_around_the_body_in_their_sense_and_are_each_others_mirror() -> None:
    """Successive legs of a spin are a quarter turn apart in its sense, beginning with leg 1."""
    for order, sense in ((SPIN_ORDER_COUNTERCLOCKWISE, 1), (SPIN_ORDER_CLOCKWISE, -1)):
        assert order[0] is Leg.FRONT_LEFT
        angles = [np.arctan2(SIGNS[leg.row, 1], SIGNS[leg.row, 0]) for leg in order]
        steps = np.diff([*angles, angles[0]])
        assert np.allclose(np.exp(1j * steps), np.exp(1j * sense * np.pi / 2))


def test_read_only_copies() -> None:
    """A read-only array cannot be written to, and is not a view of what it was made from."""
    source = np.zeros(3)
    frozen = read_only(source)
    source[0] = 1.0
    assert frozen[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        frozen[0] = 1.0
