"""The push that a stance takes without a step."""

import numpy as np
from hypothesis import given, settings, strategies as st
from test_region import NEAR, random_contacts

from drake_quad.stability.capture_point import (
    Pendulum,
    capture_margin,
    directions,
    find_pressure_area,
    pressure_reach,
    push_budget,
    way_out,
)
from drake_quad.stability.equilibrium_region import (
    Contacts,
    Region,
    WrenchDemand,
    find_region,
    make_contacts,
)

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=20, deadline=None)
FEET = np.array([[0.4, 0.3, 0.0], [0.4, -0.3, 0.0], [-0.4, 0.3, 0.0], [-0.4, -0.3, 0.0]])
WAYS = directions(16)


def budget_of(contacts: Contacts, body: Pendulum) -> tuple[np.ndarray, Region]:
    region = find_region(contacts)
    far = pressure_reach(region, find_pressure_area(contacts, body), body, WAYS)
    return push_budget(region, far, body, WAYS), region


@FEW
@given(st.floats(0.2, 2.0), st.floats(1.1, 4.0))
def test_it_goes_with_the_root_of_gravity_over_height(height: float, higher: float) -> None:
    """On level ground that does not slip the higher robot takes √(h1 / h2) of the push."""
    feet = make_contacts(FEET, friction=20.0)
    low, _ = budget_of(feet, Pendulum(0.05, -0.02, height))
    high, _ = budget_of(feet, Pendulum(0.05, -0.02, height * higher))
    np.testing.assert_allclose(high, low / np.sqrt(higher), rtol=1e-6)
    assert np.all(low > 0.0)


@FEW
@given(SEEDS)
def test_none_is_left_at_the_border(seed: int) -> None:
    """Over a side of the region a push outwards finds nothing, and outside no push does."""
    contacts = random_contacts(np.random.default_rng(seed), 4, tilt=0.3)
    region = find_region(contacts)
    if len(region.corners) < 3:
        return
    a, b = region.corners[:2]
    side = 0.5 * (a + b)
    budget, _ = budget_of(contacts, Pendulum(side[0], side[1], 0.8))
    out = np.array([b[1] - a[1], a[0] - b[0]])
    assert np.all(budget[out @ WAYS.T > 0.0] < 1e-4)
    beyond = side + 0.1 * out / np.linalg.norm(out)
    body = Pendulum(beyond[0], beyond[1], 0.8)
    assert np.all(budget_of(contacts, body)[0] == 0.0)
    assert capture_margin(region, find_pressure_area(contacts, body), body) < 0.0


@FEW
@given(SEEDS, st.floats(0.0, 1.0))
def test_a_push_uses_up_what_it_is_worth(seed: int, share: float) -> None:
    """After a part of the budget, the same way still has the rest, unless friction is short."""
    rng = np.random.default_rng(seed)
    contacts = make_contacts(FEET + rng.uniform(-0.1, 0.1, (4, 3)) * [1, 1, 0], friction=5.0)
    k = int(rng.integers(0, len(WAYS)))
    whole = budget_of(contacts, Pendulum(0.0, 0.0, 0.8))[0][k]
    v = share * whole * WAYS[k]
    rest = budget_of(contacts, Pendulum(0.0, 0.0, 0.8, *v.tolist()))[0][k]
    np.testing.assert_allclose(rest, (1.0 - share) * whole, atol=1e-6)


@FEW
@given(SEEDS)
def test_within_the_budget_forces_can_brake_all_the_way(seed: int) -> None:
    """A pendulum pushed by 99 % comes to rest over its capture point by forces that there are.

    And by 101 % it has none, at first or at rest.
    """
    rng = np.random.default_rng(seed)
    contacts = random_contacts(rng, 4, tilt=0.3)
    middle = contacts.places[:, :2].mean(axis=0)
    body = Pendulum(middle[0], middle[1], 0.8, ground=float(contacts.places[:, 2].mean()))
    budget, _ = budget_of(contacts, body)
    k = int(rng.integers(0, len(WAYS)))
    if budget[k] == 0.0:
        return
    for share, possible in ((0.99, True), (1.01, False)):
        shift = share * budget[k] / body.rate * WAYS[k]
        held = []
        for way in np.linspace(0.0, 1.0, 5):  # from here to rest over the capture point
            c = middle + way * shift
            pull = (c - middle - shift) / body.height
            region = find_region(
                contacts, demand=WrenchDemand((float(pull[0]), float(pull[1]), 1.0), height=0.8)
            )
            held.append(region.margin(*c) > -NEAR)
        assert all(held) == possible


@FEW
@given(SEEDS)
def test_pressure_area_on_level_ground_is_the_hull(seed: int) -> None:
    """With much friction the pressure can be anywhere among the feet."""
    rng = np.random.default_rng(seed)
    feet = FEET + rng.uniform(-0.1, 0.1, (4, 3)) * [1.0, 1.0, 0.0]
    contacts = make_contacts(feet, friction=10.0)
    area = find_pressure_area(contacts, Pendulum(0.1, 0.05, 0.7))
    region = find_region(contacts)
    for x, y in WAYS:
        assert abs(area.reach(x, y) - region.reach(x, y)) < NEAR


def test_slippery_ground_cannot_brake() -> None:
    """With friction μ the pressure comes no farther from the centre of mass than μ h."""
    body = Pendulum(0.0, 0.0, 0.8)
    area = find_pressure_area(make_contacts(FEET, friction=0.1), body)
    assert abs(max(area.reach(*way) for way in WAYS) - 0.08) < 1e-3


def test_two_feet_take_no_push() -> None:
    """On a line there is no room across it."""
    contacts = make_contacts(FEET[:2])
    assert np.all(budget_of(contacts, Pendulum(0.4, 0.0, 0.8))[0] == 0.0)
    assert np.all(way_out(Region(np.zeros((0, 2))), 0.0, 0.0, WAYS) == 0.0)
