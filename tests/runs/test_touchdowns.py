"""Touchdowns felt are paired with those that were."""

import numpy as np

from drake_quad.runs.touchdowns import compare_touchdowns


def test_touchdowns_are_paired_missed_and_false() -> None:
    """One felt 10 ms late, one not at all, one that was none; chatter is no touchdown."""
    times = np.linspace(0.0, 3.99, 400)
    real, felt = np.ones((400, 4), dtype=bool), np.ones((400, 4), dtype=bool)
    real[50:100, 0], felt[50:101, 0] = False, False
    real[200:250, 1] = False
    felt[300:350, 2] = False
    real[10:12, 3] = False  # off for 20 ms
    found = compare_touchdowns(times, real, felt)
    assert (found.touchdowns, found.missed, found.false) == (2, 1, 1)
    assert np.allclose(found.delays, [0.01])


def test_a_foot_that_bounces_lands_once_and_one_felt_in_the_air_is_false() -> None:
    """A bounce and a brush against a riser miss nothing; felt in a swing, however soon: false."""
    times = np.linspace(0.0, 3.99, 400)
    real, felt = np.ones((400, 4), dtype=bool), np.ones((400, 4), dtype=bool)
    real[50:100, 0], felt[50:100, 0] = False, False
    real[103:113, 0] = False  # off again for 0.1 s
    real[240, 1] = True  # against a riser
    real[200:260, 1], felt[200:209, 1], felt[215:260, 1] = False, False, False
    found = compare_touchdowns(times, real, felt)
    assert (found.touchdowns, found.missed, found.false) == (2, 0, 1)
    assert np.allclose(found.delays, [0.0, 0.0])
