"""The search for a path that keeps the legs' limits: its steps, when it goes on, what it takes."""

from collections.abc import Sequence

import numpy as np
import pytest

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.planning.limits_search import (
    BESIDE,
    FAR,
    HOPED,
    MOST_PASSES,
    MOST_TIPPING,
    PATIENCE,
    RADII,
    SHRINKS,
    TrustRegion,
    keep_limits,
    keep_limits_from,
)

MANY = 3 * MOST_PASSES
COUNT = 12  # control points


class Passes:
    """A search that counts its passes; each path is their number, with such shorts and margins."""

    leg, route = 1.0, np.zeros((COUNT, 2))

    def __init__(
        self,
        shorts: Sequence[float],
        margins: Sequence[float] = (),
        believed: Sequence[float] = (),
        kept_from: int = MANY,
    ) -> None:
        self.control, self.solved = np.full((COUNT, 2), 1e-3), 0
        self.shorts, self.kept_from = shorts, kept_from
        self.regions: list[tuple[FloatArray | None, FloatArray]] = []
        self.margins, self.beliefs = margins or [0.0] * MANY, believed or [0.0] * MANY

    @property
    def believed(self) -> float:
        """Margin of the last program's path, as the program has it."""
        return self.beliefs[self.solved]

    @property
    def keeps_limits(self) -> bool:
        """Whether the last program's path keeps all limits, as the program has them."""
        return self.solved >= self.kept_from

    @property
    def beyond(self) -> FloatArray:
        """So little that the path is begun with, and no step leads astray."""
        return np.full(COUNT, 1e-3 * self.shorts[self.solved])

    def margin(self) -> float:
        """The margin that the last path really has."""
        return self.margins[self.solved]

    def find_limits(self) -> float:
        """By how much the last path is short of its limits."""
        return self.shorts[self.solved]

    def solve(self, *, broken: float, radius: FloatArray | None = None) -> FloatArray:
        """The next path."""
        self.solved += 1
        self.regions.append((radius, self.control))
        return np.full((COUNT, 2), 1e-3 * (1 + self.solved))

    def follow(self, control: FloatArray) -> None:
        """Takes it."""
        self.control = control

    @property
    def kept(self) -> int:
        """The pass whose path it ended with."""
        return round(1e3 * float(self.control[0, 0])) - 1


def test_a_path_within_its_limits_gets_the_margin_that_it_can_have() -> None:
    """It is solved around again until program and path agree, and the margin grows no more."""
    shorts = [0.9] + [0.0] * MANY
    # The first path that keeps its limits has less margin than its program's, then they grow.
    search = Passes(shorts, [0.03, 0.01, 0.02, 0.0255], [0.0, 0.015, 0.026, 0.0262])
    keep_limits(search)
    assert search.solved == search.kept == 3
    # Where the margin that the program believes in still grows, it is solved around once more.
    search = Passes(shorts, [0.0, 0.02, 0.025], [0.0, 0.02, 0.0205])
    keep_limits(search)
    assert search.solved == search.kept == 2
    # What is found later is not taken if it has less.
    search = Passes(shorts, [0.03, 0.02, 0.019], [0.0, 0.03, 0.03])
    keep_limits(search)
    assert search.solved == 2 and search.kept == 1
    # Where no limit was met nothing is solved again, whatever the margin.
    search = Passes([0.0], [0.01], [0.05])
    keep_limits(search)
    assert search.solved == 0


@pytest.mark.parametrize(
    ("shorts", "passes", "kept"),
    [
        ([0.5, 0.1, 0.0], 2, 2),  # kept: no further pass
        ([0.5] + [0.1] * MANY, 1 + PATIENCE, 1),  # it does not come nearer
        ([0.5, 0.3, 0.1, 0.4, 0.2] + [0.6] * MANY, 2 + PATIENCE, 2),  # to and fro
        ([0.99**k for k in range(MANY)], PATIENCE, PATIENCE),  # so slowly that it is left
        ([0.04] + [0.05] * MANY, PATIENCE, 0),  # no path is better than the first
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
    assert search.solved == passes and search.kept == kept


def test_where_limits_can_be_kept_a_slow_approach_is_not_given_up() -> None:
    """The same shorts are left after some passes if the program knows no path within limits."""
    shorts = [0.99**k for k in range(MANY)]
    for kept_from, passes in ((2, MOST_PASSES), (MANY, PATIENCE)):
        search = Passes(shorts, kept_from=kept_from)
        keep_limits(search)
        assert search.solved == search.kept == passes


class Bent:
    """A path of separate points, each with its own way to a circle that it has to be within.

    The program sees the circle as the half-plane at the nearest place of it, and wants to be as far
    to the right as it may: from far outside that is far off, for the half-plane is endless.
    """

    leg, believed, keeps_limits = 1.0, 0.0, True

    def __init__(self, start: FloatArray, route: FloatArray, radius: float = 0.2) -> None:
        self.control, self.route, self.circle = start, route, radius
        self.begun: list[FloatArray] = []
        self.solved_from: list[FloatArray] = []
        self.regions: list[FloatArray | None] = []

    @property
    def beyond(self) -> FloatArray:
        """How far each point is outside."""
        return np.maximum(np.linalg.norm(self.control, axis=1) - self.circle, 0.0)

    def margin(self) -> float:
        """How far to the right the leftmost is."""
        return float(self.control[:, 0].min())

    def find_limits(self) -> float:
        """How far the farthest point is outside."""
        return float(self.beyond.max())

    def solve(self, *, broken: float, radius: FloatArray | None = None) -> FloatArray:
        """As far to the right as half-planes and region let it, or a metre."""
        self.regions.append(radius)
        self.solved_from.append(self.control)
        path = np.array(self.control)
        most = np.ones(len(path)) if radius is None else radius
        for point, r in zip(path, most, strict=True):
            n_x, n_y = point / np.linalg.norm(point)
            x = np.linspace(point[0] - r, point[0] + r, 201)
            y = np.minimum(point[1], (self.circle - n_x * x) / max(n_y, 1e-9))
            can = (y >= point[1] - r) & (n_x * x + n_y * y <= self.circle + 1e-9)
            best = np.flatnonzero(can)[-1] if can.any() else 0
            point[:] = x[best], max(y[best], point[1] - r, 0.0)
        return path

    def follow(self, control: FloatArray) -> None:
        """Takes a path."""
        self.begun.append(control)
        self.control = control


def test_steps_are_as_long_as_half_planes_are_true() -> None:
    """Endless half-planes lead far outside of a circle; within the trust region paths come back."""
    start = np.tile([0.0, 0.25], (COUNT, 1))
    search = Bent(start, start)
    keep_limits(search)
    # The first program's path may lie anywhere, and the others near the path before.
    assert search.regions[0] is None and search.regions[1] is not None
    assert np.all(search.regions[1] <= RADII[0])
    assert search.find_limits() < 0.02 and search.margin() > 0.1


def test_a_step_without_a_region_that_leads_astray_is_not_taken() -> None:
    """It is made again from the same path, within a region; that shrinks where it leads astray."""
    start = np.tile([0.0, 0.25], (40, 1))
    start[20:] = [0.15, 0.0]  # well within: nothing leads astray there
    search = Bent(start, start)
    keep_limits(search)
    assert search.regions[0] is None
    assert search.solved_from[1] is search.solved_from[0] is start
    regions = [region for region in search.regions if region is not None]
    least = np.min(regions, axis=0)
    assert np.all(least[:20] < RADII[0]) and np.all(least[20 + BESIDE :] == RADII[0])


def test_the_region_becomes_smaller_only_where_a_step_led_astray() -> None:
    """Near that control point, and there by half; where it held a good step it grows again."""
    region = TrustRegion(np.full(40, 0.1), most=0.12, least=0.01)
    worse = np.zeros(40, dtype=bool)
    worse[20] = True
    step = np.full(40, 0.1)
    step[:5] = 0.02  # these could have moved further
    step[21] = 0.0  # it did not move, and is not to blame
    region.adapt(step, worse)
    near = slice(20 - BESIDE, 20 + BESIDE + 1)
    np.testing.assert_allclose(region.radius[near], SHRINKS * 0.1)
    np.testing.assert_allclose(region.radius[5 : 20 - BESIDE], 0.12)
    np.testing.assert_allclose(region.radius[:5], 0.1)
    for _ in range(10):
        region.adapt(0.5 * region.radius, worse)
    np.testing.assert_allclose(region.radius[near], 0.01)


def test_a_search_begins_with_the_route_where_the_best_path_is_of_no_use() -> None:
    """If that is far beyond limits and the route is much nearer to them."""
    far, near = np.tile([0.0, 0.2 + 1.2 * FAR], (COUNT, 1)), np.tile([0.0, 0.21], (COUNT, 1))
    for start, route, begun in ((far, near, near), (near, far, None), (far, 0.95 * far, far)):
        search = Bent(start, route)
        keep_limits(search)
        if begun is None:
            assert search.regions[0] is None
            assert not any(path is route for path in search.begun)
        else:
            paths = [path for path in search.begun if path is start or path is route]
            assert paths[-1] is begun and search.regions[0] is not None


class TwoSided(Passes):
    """A search that finds no margin from the route, and one from the path of most margin."""

    def __init__(self) -> None:
        super().__init__([0.5] + [2e-3] * MANY)
        self.first = self.control

    @property
    def beyond(self) -> FloatArray:
        """So much that the route is begun with."""
        far = 2.0 * FAR if self.control is self.first else 0.0
        return np.full(COUNT, far)

    def margin(self) -> float:
        """None of the paths after the route."""
        return 0.02 if self.solved > 2 + PATIENCE else -0.02


def test_where_no_path_from_the_route_has_a_margin_one_from_the_other_side_may() -> None:
    """Of paths a little beyond limits that cannot be kept, one with a margin is taken."""
    search = TwoSided()
    keep_limits(search)
    assert search.kept > 2 + PATIENCE
    # Less beyond limits is not better without a margin, nor is a margin if limits are far.
    little = Passes([0.5, 2.0e-3, 1.9e-3] + [0.5] * MANY, [-1.0, 0.03, -0.03] + [-1.0] * MANY)
    keep_limits(little)
    assert little.kept == 1
    much = Passes([0.5, 0.1, 1.9e-3] + [0.5] * MANY, [-1.0, 0.03, -0.03] + [-1.0] * MANY)
    keep_limits(much)
    assert much.kept == 2


class Lossy(TwoSided):
    """A search whose paths from the route keep limits with a share of the most margin."""

    def __init__(self, share: float) -> None:
        super().__init__()
        self.shorts = [0.5] + [0.0] * MANY
        self.share, self.anew = share, 0

    def follow(self, control: FloatArray) -> None:
        """Counts how often the first path is taken again."""
        self.anew += control is self.first
        super().follow(control)

    def margin(self) -> float:
        """Nearly all of it, on paths from the path of most margin."""
        if self.control is self.first:
            return 0.05
        return 0.048 if self.anew else 0.05 * self.share


def test_a_path_from_the_route_that_loses_much_margin_is_not_the_last_word() -> None:
    """A B1's kept 26 mm of 46; from the path of most margin on it keeps 33."""
    for share, margin in ((0.9 * HOPED, 0.048), (1.1 * HOPED, 0.055 * HOPED)):
        search = Lossy(share)
        keep_limits(search)
        assert search.margin() == pytest.approx(margin)


def test_a_further_search_begins_again_within_a_region_of_another_size() -> None:
    """From the same path, and held near it at once; there is none once limits are kept."""
    search = Passes([0.04] * MANY)
    start = search.control
    keep_limits(search, 3)
    radii = [radius for radius, path in search.regions if path is start]
    assert len(radii) == 3 and radii[0] is None
    for radius, share in zip(radii[1:], RADII[1:], strict=True):
        assert radius is not None
        np.testing.assert_allclose(radius, share)
    once = Passes([0.04] * MANY)
    keep_limits(once)
    assert once.solved == PATIENCE < search.solved
    kept = Passes([0.04] + [0.0] * MANY)
    keep_limits(kept, 3)
    assert kept.solved == 1


class Failing(Passes):
    """A search whose program has no solution from some pass on."""

    def __init__(self, fails: int, shorts: Sequence[float]) -> None:
        super().__init__(shorts)
        self.fails = fails

    def solve(self, *, broken: float, radius: FloatArray | None = None) -> FloatArray:
        """See there."""
        if self.solved + 1 >= self.fails:
            raise PlanningError("not solved")
        return super().solve(broken=broken, radius=radius)


@pytest.mark.parametrize("searches", [1, 3])
def test_a_program_that_is_not_solved_leaves_the_best_path(searches: int) -> None:
    """Also where no further search gets anywhere; but if it is the very first there is no path."""
    search = Failing(3, [0.5, 0.3, 0.2, 0.1])
    keep_limits(search, searches)
    assert search.kept == 2
    with pytest.raises(PlanningError):
        keep_limits(Failing(1, [0.5]), searches)


def test_paths_along_which_the_robot_falls_over_are_left_soon() -> None:
    """A program that believes in no margin either, several times in turn."""
    shorts, none = [0.9**k for k in range(MANY)], [-0.03] * MANY
    fallen = Passes(shorts, none, none, kept_from=0)
    keep_limits(fallen)
    assert fallen.solved == MOST_TIPPING < MOST_PASSES
    hoped = Passes(shorts, none, [0.03] * MANY, kept_from=0)
    keep_limits(hoped)
    assert hoped.solved == MOST_PASSES


def test_a_search_from_a_known_path_tells_whether_it_kept_limits() -> None:
    """It solves at least once: the known path is another program's."""
    kept = Passes([0.0] * MANY)
    assert keep_limits_from(kept) and kept.solved >= 1
    assert not keep_limits_from(Passes([0.5] * MANY))
