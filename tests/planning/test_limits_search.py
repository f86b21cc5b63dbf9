"""The search for a path that keeps the legs' limits: when it goes on, and what it takes."""

from collections.abc import Sequence

import numpy as np
import pytest

from drake_quad.common import FloatArray
from drake_quad.planning.limits_search import (
    DAMPED,
    LINEAR,
    MOST_PASSES,
    OTHERWISE,
    PATIENCE,
    keep_limits,
)

MANY = MOST_PASSES + 4


class Passes:
    """A search that counts its passes; each path is their number, with such shorts and margins."""

    def __init__(
        self,
        shorts: Sequence[float],
        margins: Sequence[float] = (),
        believed: Sequence[float] = (),
        kept_from: int = MANY,
    ) -> None:
        self.control, self.solved, self.shorts = np.zeros(1), 0, shorts
        self.margins, self.beliefs = margins or [0.0] * MANY, believed or [0.0] * MANY
        self.kept_from = kept_from

    @property
    def believed(self) -> float:
        """Margin of the last program's path, as the program has it."""
        return self.beliefs[self.solved]

    @property
    def keeps_limits(self) -> bool:
        """Whether the last program's path keeps all limits, as the program has them."""
        return self.solved >= self.kept_from

    def margin(self) -> float:
        """The margin that the last path really has."""
        return self.margins[self.solved]

    def find_limits(self) -> float:
        """By how much the last path is short of its limits."""
        return self.shorts[self.solved]

    def solve(self, *, broken: float) -> FloatArray:
        """The next path."""
        self.solved += 1
        return np.array([float(self.solved)])

    def follow(self, control: FloatArray) -> None:
        """Takes it."""
        self.control = control


def path_of(passes: int) -> float:
    """The path after so many passes: the first whole, then DAMPED of the way to each next."""
    path = min(passes, 1.0)
    for k in range(2, passes + 1):
        path += DAMPED * (k - path)
    return path


def test_a_path_within_its_limits_gets_the_margin_that_it_can_have() -> None:
    """Seen from far beyond them limits are too tight: such a path is not the last."""
    shorts = [0.9] + [0.0] * MANY
    # The first path that keeps its limits has no margin, and neither had its program's.
    search = Passes(shorts, [0.03, -0.03, 0.02, 0.0255], [0.0, -0.03, 0.026, 0.0258])
    keep_limits(search)
    assert search.solved == 3
    assert float(search.control[0]) == pytest.approx(path_of(3))
    # What is found later is not taken if it has less.
    search = Passes(shorts, [0.03, 0.02, 0.019, 0.018], [0.0, 0.02, 0.03, 0.018])
    keep_limits(search)
    assert search.solved == 3 and float(search.control[0]) == path_of(1)
    # Where no limit was met nothing is solved again, whatever the margin.
    search = Passes([0.0], [0.01], [0.05])
    keep_limits(search)
    assert search.solved == 0


def test_small_gains_of_margin_add_up() -> None:
    """A path that gains 0.4 mm in each pass is not given up, one that stays is."""
    shorts = [0.9] + [0.0] * MANY
    believed = [0.1] * MANY
    gains = [0.02 + 0.0004 * k for k in range(MANY)]
    search = Passes(shorts, gains, believed)
    keep_limits(search)
    assert search.solved == MOST_PASSES
    search = Passes(shorts, [0.02] * MANY, believed)
    keep_limits(search)
    assert search.solved == 1 + PATIENCE


@pytest.mark.parametrize(
    ("shorts", "passes", "kept"),
    [
        ([0.5, LINEAR, 0.0], 2, 2),  # kept: no further pass
        ([0.5, 0.2, 0.0, 0.0], 3, 2),  # as seen from far beyond them: once more, but no better
        ([0.5] + [0.1] * MANY, 1 + PATIENCE, 1),  # it does not come nearer
        ([0.5, 0.3, 0.1, 0.4, 0.2] + [0.6] * MANY, 2 + PATIENCE, 2),  # to and fro
        ([0.99**k for k in range(MANY)], PATIENCE, PATIENCE),  # so slowly that it is left
        ([0.5**k for k in range(MANY)], MOST_PASSES, MOST_PASSES),
        ([0.5**k for k in range(8)] + [0.0], 8, 8),
    ],
)
def test_a_path_that_comes_nearer_to_its_limits_is_not_given_up(
    shorts: list[float], passes: int, kept: int
) -> None:
    """It goes on while each leaves clearly less; the best path is kept."""
    search = Passes(shorts)
    keep_limits(search)
    assert search.solved == passes
    assert float(search.control[0]) == pytest.approx(path_of(kept))


def test_where_limits_can_be_kept_a_slow_approach_is_not_given_up() -> None:
    """The same shorts are left after some passes if the program knows no path within limits."""
    shorts = [0.99**k for k in range(MANY)]
    for kept_from, passes in ((2, MOST_PASSES), (MANY, PATIENCE)):
        search = Passes(shorts, kept_from=kept_from)
        keep_limits(search)
        assert search.solved == passes
        assert float(search.control[0]) == pytest.approx(path_of(passes))


class Overshooting:
    """A search whose programs lead 4.5 times as far beyond the best path as it is away."""

    believed, keeps_limits = 0.0, True

    def __init__(self) -> None:
        self.control, self.solved = np.array([1.2]), 0

    def margin(self) -> float:
        """All paths have the margin that the program believes in."""
        return 0.0

    def find_limits(self) -> float:
        """Paths within 60 mm of the best one keep their limits."""
        return max(abs(float(self.control[0]) - 1.0) - 0.06, 0.0)

    def solve(self, *, broken: float) -> FloatArray:
        """A path on the other side."""
        self.solved += 1
        return 1.0 - 4.5 * (self.control - 1.0)

    def follow(self, control: FloatArray) -> None:
        """Takes it."""
        self.control = control


def test_a_step_that_leads_far_beyond_limits_is_made_shorter() -> None:
    """Paths would go to and fro, ever farther; no program is solved for the shorter step."""
    search = Overshooting()
    keep_limits(search)
    assert search.find_limits() == 0.0
    assert search.solved < MOST_PASSES


class Stuck:
    """A search that goes to and fro with steps of the usual length, and with no other."""

    believed, keeps_limits = 0.0, False

    def __init__(self, works: float) -> None:
        self.control, self.works, self.begun = np.zeros(1), works, 0

    def margin(self) -> float:
        """All paths have the margin that the program believes in."""
        return 0.0

    def find_limits(self) -> float:
        """Limits are kept after a step of the share that works."""
        gone = float(self.control[0])
        return 0.0 if gone > 1.0 and abs(gone - 1.0 - self.works) < 1e-9 else 0.04

    def solve(self, *, broken: float) -> FloatArray:
        """A unit further, or back where it began."""
        return np.array([1.0]) if self.control[0] < 0.5 else np.array([2.0])

    def follow(self, control: FloatArray) -> None:
        """Takes it; counts how often that is the first path again."""
        self.begun += int(control[0] == 0.0)
        self.control = control


@pytest.mark.parametrize(("searches", "kept"), [(1, False), (2, False), (3, True)])
def test_a_further_search_goes_otherwise(searches: int, kept: bool) -> None:
    """Steps of 0.3 find what steps of 0.6 and 0.8 do not."""
    search = Stuck(OTHERWISE[1])
    keep_limits(search, searches)
    assert (search.find_limits() == 0.0) is kept


def test_no_further_search_is_begun_once_limits_are_kept() -> None:
    """The first search's path stays."""
    search = Stuck(DAMPED)
    keep_limits(search, 3)
    assert search.find_limits() == 0.0 and search.begun == 0
