"""The region of balance: laws that it obeys, and the same by another program in other unknowns."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import linprog

from benchmarks.region import edge_wrenches
from drake_quad.common import FloatArray
from drake_quad.stability.equilibrium_region import (
    MOST_FORCE,
    Contacts,
    Pyramid,
    Region,
    WrenchDemand,
    find_region,
    make_contacts,
)
from drake_quad.stability.projection import EXACT
from drake_quad.stability.support_polygon import stability_margin, support_polygon

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=25, deadline=None)
NEAR = 1e-6  # [m]
UNIT = np.stack([np.cos(a := 2.0 * np.pi * np.arange(32) / 32), np.sin(a)], axis=-1)


def random_contacts(
    rng: np.random.Generator, count: int | None = None, *, tilt: float = 0.6
) -> Contacts:
    """Two to four feet at any heights, on ground tilted by up to `tilt` [rad]."""
    n = int(rng.integers(2, 5)) if count is None else count
    corners = np.array([[0.4, 0.27], [0.4, -0.27], [-0.4, 0.27], [-0.4, -0.27]])
    xy = corners[rng.permutation(4)[:n]] + rng.uniform(-0.2, 0.2, (n, 2))
    turn, lean = rng.uniform(0.0, 2.0 * np.pi, n), rng.uniform(0.0, tilt, n)
    normals = np.stack(
        [np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)], axis=-1
    )
    places = np.column_stack([xy, rng.uniform(-0.3, 0.3, n)])
    return make_contacts(places, normals, rng.uniform(0.2, 1.2, n))


def reach_by_edges(
    contacts: Contacts, way: FloatArray, pyramid: Pyramid, demand: WrenchDemand
) -> float | None:
    """How far the region goes along `way`, by SciPy's HiGHS; None of an empty one.

    Independent of the package: the unknowns are shares of the pyramids' edges and the centre of
    mass itself, and moments are about W's origin.
    """
    edges, caps = edge_wrenches(contacts, pyramid)
    # M - c × F = L, with c = (cx, cy, height): of cx and cy two more columns.
    Fx, Fy, Fz = F = np.array(demand.force)
    of_cx, of_cy = [0, 0, 0, 0, Fz, -Fy], [0, 0, 0, -Fz, 0, Fx]
    A = np.column_stack([edges.T, of_cx, of_cy])
    b = [*F, *(np.array(demand.moment) + np.cross([0.0, 0.0, demand.height], F))]
    found = linprog(
        [*np.zeros(len(edges)), *-way],
        A_eq=A,
        b_eq=b,
        A_ub=np.column_stack([caps.T, np.zeros((len(contacts), 2))]),
        b_ub=np.full(len(contacts), MOST_FORCE),
        bounds=[(0.0, None)] * len(edges) + [(None, None)] * 2,
    )
    return None if found.status == 2 else -float(found.fun)


def worst_difference(contacts: Contacts, demand: WrenchDemand, ways: FloatArray) -> float:
    """Of the region's reach from the independent program's; inf if one alone is empty."""
    pyramid = Pyramid()
    region = find_region(contacts, demand=demand, pyramid=pyramid)
    worst = 0.0
    for way in ways:
        theirs, ours = reach_by_edges(contacts, way, pyramid, demand), region.reach(*way)
        if theirs is None or not len(region.corners):
            return 0.0 if theirs is None and not len(region.corners) else np.inf
        worst = max(worst, abs(ours - theirs))
    return worst


@FEW
@given(SEEDS)
def test_region_is_that_of_an_independent_program(seed: int) -> None:
    """Feet anywhere, tilted ground, at rest: in any direction the same reach within 1e-6 m."""
    rng = np.random.default_rng(seed)
    assert (
        worst_difference(random_contacts(rng), WrenchDemand(), UNIT[rng.integers(0, 32, 6)]) < NEAR
    )


@FEW
@given(SEEDS)
def test_region_in_motion_is_that_of_an_independent_program(seed: int) -> None:
    """The same with any acceleration, moment and height of the centre of mass."""
    rng = np.random.default_rng(seed)
    push = rng.uniform(-0.2, 0.2, 3)
    demand = WrenchDemand(
        (float(push[0]), float(push[1]), 1.0 + float(push[2])),
        tuple(rng.uniform(-0.03, 0.03, 3).tolist()),
        float(rng.uniform(0.2, 1.0)),
    )
    assert worst_difference(random_contacts(rng), demand, UNIT[rng.integers(0, 32, 4)]) < NEAR


# Two feet each, over which the one place of balance is above one of them.
POINTS = [
    (
        [[-0.32504530115153835, -0.11623951478456679, 0.12599715068825335],
         [-0.25249020840095726, 0.4695772265075024, 0.16897971654627186]],
        [[0.31055189253042614, 0.32511085694344466, 0.8932303469672701],
         [0.17216719236025102, 0.2720844291562769, 0.9467462813687157]],
        [0.2874067672470049, 0.6064632524950626],
    ),
    (
        [[0.3524803370003761, 0.44428585960790395, 0.01619361005198261],
         [-0.23195608301011256, -0.3190329880679389, -0.06311044546655509]],
        [[-0.286635202642716, 0.30168352334917864, 0.9093004521859619],
         [-0.039755389743952554, -0.16394122297845481, 0.9856686991046408]],
        [0.47050641205658855, 0.9015106387054701],
    ),
]  # fmt: skip


@pytest.mark.parametrize(("places", "normals", "friction"), POINTS)
def test_a_region_that_is_a_point_is_no_line(
    places: list[list[float]], normals: list[list[float]], friction: list[float]
) -> None:
    """The solver's word is not taken for forces that the friction there does not give.

    Of 10 000 random stances these differed most: by 13 µm and 0.8 mm.
    """
    contacts = make_contacts(places, normals, friction)
    assert worst_difference(contacts, WrenchDemand(), UNIT) < 1e-9
    assert np.ptp(find_region(contacts).corners, axis=0).max() < 1e-9


@pytest.mark.slow
def test_thousand_stances_agree_with_an_independent_program() -> None:
    """None of 1000 random stances differs in any of 32 directions."""
    rng = np.random.default_rng(20)
    worst = [worst_difference(random_contacts(rng), WrenchDemand(), UNIT) for _ in range(1000)]
    assert max(worst) < NEAR


@FEW
@given(SEEDS, st.integers(2, 4))
def test_on_level_ground_it_is_the_hull_of_the_feet(seed: int, count: int) -> None:
    """Feet at one height, with whatever friction: the region is the support polygon."""
    rng = np.random.default_rng(seed)
    level = random_contacts(rng, count, tilt=0.0)
    places = level.places * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.3]
    region = find_region(make_contacts(places, friction=level.friction))
    for x, y in rng.uniform(-0.6, 0.6, (20, 2)):
        assert abs(region.margin(x, y) - stability_margin([x, y], places[:, :2])) < NEAR


@FEW
@given(SEEDS, st.floats(0.3, 0.95))
def test_less_friction_gives_less_room(seed: int, less: float) -> None:
    """The region of less friction lies within that of more."""
    contacts = random_contacts(np.random.default_rng(seed))
    region = find_region(contacts)
    slippery = find_region(Contacts(contacts.places, contacts.normals, less * contacts.friction))
    for x, y in slippery.corners:
        assert region.margin(x, y) > -NEAR


@FEW
@given(SEEDS, st.floats(-3.0, 3.0))
def test_it_goes_with_its_feet(seed: int, turn: float) -> None:
    """Feet moved and turned about the vertical, the pyramids with them: so is the region."""
    rng = np.random.default_rng(seed)
    contacts = random_contacts(rng)
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    away = rng.uniform(-20.0, 20.0, 3)
    moved = make_contacts(contacts.places @ R.T + away, contacts.normals @ R.T, contacts.friction)
    here, there = find_region(contacts), find_region(moved, pyramid=Pyramid(heading=turn))
    assert (len(here.corners) == 0) == (len(there.corners) == 0)
    for x, y in UNIT[::4] if len(here.corners) else ():
        turned = R[:2, :2] @ [x, y]
        assert abs(there.reach(*turned) - (here.reach(x, y) + turned @ away[:2])) < NEAR


@FEW
@given(SEEDS)
def test_mirrored_feet_have_the_mirrored_region(seed: int) -> None:
    """Left and right are alike."""
    contacts = random_contacts(np.random.default_rng(seed))
    flip = np.array([1.0, -1.0, 1.0])
    other = find_region(
        make_contacts(flip * contacts.places, flip * contacts.normals, contacts.friction)
    )
    region = find_region(contacts)
    for x, y in UNIT[::4]:
        a, b = region.reach(x, y), other.reach(x, -y)
        assert a == b or abs(a - b) < NEAR


def test_pyramids_inside_and_outside_close_in_on_the_cone() -> None:
    """The region of the cone is between theirs, and the gap goes with the square of the sides."""
    contacts = random_contacts(np.random.default_rng(2), 3)
    gaps = []
    for sides in (8, 16, 32):
        inner = find_region(contacts, pyramid=Pyramid(sides=sides))
        outer = find_region(contacts, pyramid=Pyramid(sides=sides, outside=True))
        gap = [outer.reach(*way) - inner.reach(*way) for way in UNIT]
        assert min(gap) > -NEAR
        gaps.append(max(gap))
    assert gaps[0] > 3.0 * gaps[1] > 9.0 * gaps[2] > 0.0


def steepest(places: FloatArray) -> float:
    """The greatest gradient of a plane through a side of the feet's hull and another foot."""
    found = 0.0
    for i, j, k in itertools.combinations(range(len(places)), 3):
        normal = np.cross(places[j] - places[i], places[k] - places[i])
        found = max(found, float(np.hypot(normal[0], normal[1]) / max(abs(normal[2]), 1e-9)))
    return found


@FEW
@given(SEEDS)
def test_on_level_treads_it_is_the_hull_unless_they_are_steep(seed: int) -> None:
    """Treads are level, so the hull is always in balance; more is if planes are beyond 1 / μ."""
    rng = np.random.default_rng(seed)
    places = random_contacts(rng, int(rng.integers(3, 5))).places
    hull = support_polygon(places[:, :2])
    for share in (0.5, 0.99):
        region = find_region(make_contacts(places, friction=share / steepest(places)))
        for x, y in UNIT[::4]:
            assert abs(region.reach(x, y) - np.max(hull @ [x, y])) < NEAR
    region = find_region(make_contacts(places, friction=1.2))
    assert all(region.margin(x, y) > -NEAR for x, y in hull)


def test_between_steep_treads_there_is_more_than_the_hull() -> None:
    """One foot above another by more than it is ahead: pressed apart, they reach beyond."""
    feet = np.array([[0.3, 0.0, 0.8], [-0.1, 0.3, 0.0], [-0.1, -0.3, 0.0]])
    region = find_region(make_contacts(feet, friction=1.0))
    assert region.reach(1.0, 0.0) > 0.35


def test_on_nosings_there_is_less_than_the_hull() -> None:
    """Feet on edges stand on tilted ground: where they alone bear, they slip."""
    feet = [[0.9, 0.27, 0.36], [0.7, -0.27, 0.18], [0.1, 0.33, 0.0], [0.2, -0.33, 0.18]]
    tilted = [[-1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
    region = find_region(make_contacts(feet, tilted, 0.5))
    assert region.margin(0.9, 0.27) < -0.05
    assert region.margin(0.7, -0.27) > -NEAR


@pytest.mark.parametrize("places", [[], [[0.0, 0.0, 0.0]], [[0.3, 0.0, 0.2], [-0.3, 0.1, 0.0]]])
def test_fewer_feet_than_three_have_no_room(places: list[list[float]]) -> None:
    """No region, a point, a line: never a positive margin, and -inf without feet."""
    region = find_region(make_contacts(places))
    margin = region.margin(0.0, 0.02)
    assert margin == -np.inf if not places else -0.5 < margin < 0.0


def test_slippery_ground_gives_no_region() -> None:
    """A foot on a slope steeper than its friction holds nothing up."""
    assert find_region(make_contacts([[0, 0, 0]], [[0.5, 0, 1]], 0.4)).margin(0, 0) == -np.inf
    assert find_region(make_contacts([[0, 0, 0]], [[0.3, 0, 1]], 0.4)).margin(0, 0) > -NEAR


def test_a_falling_robot_has_no_region() -> None:
    """Without any weight on the feet there is nothing to balance."""
    contacts = random_contacts(np.random.default_rng(0), 4)
    assert not len(find_region(contacts, demand=WrenchDemand(force=(0.0, 0.0, 0.0))).corners)


def test_between_walls_it_ends_where_forces_do() -> None:
    """Feet pressed against two walls: huge, but not without end."""
    walls = make_contacts(
        [[-0.5, 0.3, 0.5], [-0.5, -0.3, 0.5], [0.5, 0.0, 0.7]], [[1, 0, 0], [1, 0, 0], [-1, 0, 0]]
    )
    region: Region = find_region(walls)
    assert 0.5 < max(region.reach(*way) for way in UNIT) < 2.0 * MOST_FORCE


@FEW
@given(SEEDS)
def test_corners_go_round_counterclockwise(seed: int) -> None:
    """They bound a convex polygon, each its own corner, and cannot be written to."""
    corners = find_region(random_contacts(np.random.default_rng(seed), 4)).corners
    if len(corners) > 2:
        a, b = np.roll(corners, -1, axis=0) - corners, np.roll(corners, -2, axis=0) - corners
        assert np.all(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > -EXACT)
    assert not corners.flags.writeable
