"""Laws of the places along a lane: one a tread, even in number, evenly spaced between."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from rig import course_of, paper_robot

from drake_quad.errors import PlanningError
from drake_quad.planning.foothold_grid import FootholdGrid, make_foothold_grid
from drake_quad.planning.problem import EDGE_CLEARANCE, PlanSettings
from drake_quad.planning.settled_places import SHORTEST_LANDING
from drake_quad.planning.walk_footsteps import foothold
from drake_quad.robot.legs import LEGS
from drake_quad.terrain.elements import Element
from drake_quad.terrain.lane import Lane

SPACING = 0.5  # [m]
ENDS = 1.2  # [m] of level ground beyond start and goal
ROUNDING = 1e-9


@st.composite
def lanes(draw: st.DrawFn) -> Lane:
    """Floor, up to three flights of any steps with floors of any length or none between, floor."""

    def length(low: float, high: float) -> float:
        return draw(st.floats(low, high).map(lambda x: round(x, 3)))

    elements = [Element("floor", length=length(2.6, 5.0))]
    for k in range(draw(st.integers(0, 3))):
        if k and draw(st.booleans()):
            elements.append(Element("floor", length=length(0.12, 3.0)))
        count = draw(st.integers(1, 6))
        runs = [length(0.28, 0.7)] * count
        if draw(st.booleans()):
            runs = [length(0.28, 0.7) for _ in range(count)]
        rises = [length(0.05, 0.25) for _ in range(count)]
        going = draw(st.sampled_from(["up", "down"]))
        elements.append(Element("stairs", going=going, rises=rises, runs=runs))
    elements.append(Element("floor", length=length(2.6, 5.0)))
    return course_of(*elements).lanes[0]


def lattice_of(lane: Lane) -> FootholdGrid:
    return make_foothold_grid(lane, start=ENDS, goal=lane.length - ENDS, spacing=SPACING)


@given(lanes())
def test_places_go_forward_two_a_cycle(lane: Lane) -> None:
    """They increase strictly; from start to goal there are two for each cycle."""
    lattice = lattice_of(lane)
    assert np.all(np.diff(lattice.s) > 0.0)
    first, last = lattice.behind, lattice.behind + 2 * lattice.cycles
    assert len(lattice.s) == last + 2
    assert lattice.s[first] == pytest.approx(ENDS)
    assert lattice.s[last] == pytest.approx(lane.length - ENDS)


@given(lanes())
def test_every_tread_has_one_place_and_that_at_its_centre(lane: Lane) -> None:
    """No tread is left out or stepped on twice."""
    lattice = lattice_of(lane)
    for flight in lane.flights:
        for a, b, z in lane.treads(flight):
            mine = lattice.s[(lattice.s > a) & (lattice.s < b)]
            assert mine == pytest.approx([0.5 * (a + b)])
            k = int(np.argmin(np.abs(lattice.s - mine[0])))
            assert lattice.on_tread[k] and lattice.z[k] == z
    assert sum(lattice.on_tread) == sum(f.last - f.first + 1 for f in lane.flights)


@given(lanes())
def test_no_step_is_longer_than_the_spacing_or_than_the_treads_ask_for(lane: Lane) -> None:
    """On level ground no gap exceeds the spacing; on and around stairs none exceeds a tread.

    Between two flights with next to no landing it is a tread and that landing.
    """
    lattice = lattice_of(lane)
    runs = [b - a for flight in lane.flights for a, b, _ in lane.treads(flight)]
    widest = max(runs, default=0.0)
    for (a, on_a), (b, on_b) in pairwise(zip(lattice.s, lattice.on_tread, strict=True)):
        stairs = widest * (1.0 + SHORTEST_LANDING if on_a and on_b else on_a or on_b)
        assert b - a <= max(SPACING, stairs) + ROUNDING


@given(lanes())
def test_places_have_the_grounds_height_and_so_has_the_line_through_them(lane: Lane) -> None:
    """`z` is the lane's height there; `height` meets it at every place and is flat beyond."""
    lattice = lattice_of(lane)
    np.testing.assert_allclose(lattice.z, lane.height(lattice.s))
    np.testing.assert_allclose(lattice.height(lattice.s), lattice.z)
    np.testing.assert_allclose(
        lattice.height(np.array([lattice.s[0] - 5.0, lattice.s[-1] + 5.0])), lattice.z[[0, -1]]
    )


@given(lanes(), st.booleans())
def test_footholds_are_whole_on_their_treads(lane: Lane, on_centre: bool) -> None:
    """No foot's sphere overlaps a nosing or a riser, whichever leg takes the place."""
    lattice, radius = lattice_of(lane), paper_robot().foot_radius
    plan_settings = PlanSettings(on_centre=on_centre)
    risers = lane.breaks[1:-1][np.diff(lane.heights) != 0.0]
    for leg in LEGS:
        for k in range(-1, 2 * lattice.cycles + 2):
            s = foothold(lane, lattice, leg, k, plan_settings, radius)
            assert np.all(np.abs(risers - s) >= radius + EDGE_CLEARANCE - ROUNDING)
            place = lattice.s[k + lattice.behind]
            assert lane.height(s) == lane.height(place)
            if on_centre and lattice.on_tread[k + lattice.behind]:
                assert s == place


@settings(max_examples=30)
@given(st.floats(2.5, 30.0), st.floats(0.1, 1.0))
def test_level_lane_is_divided_evenly(length: float, spacing: float) -> None:
    """Without stairs all gaps are the same, the fewest even number that keeps the spacing."""
    lane = course_of(Element("floor", length=length)).lanes[0]
    if length - 2 * ENDS < 1e-3:
        return
    lattice = make_foothold_grid(lane, start=ENDS, goal=length - ENDS, spacing=spacing)
    gaps = np.diff(lattice.s)
    assert np.ptp(gaps) < ROUNDING and gaps[0] <= spacing * (1 + 1e-5)
    if lattice.cycles > 1:
        assert (length - 2 * ENDS) / (2 * lattice.cycles - 2) > spacing * (1 - 1e-5)


def test_a_walk_of_no_length_has_no_cycles() -> None:
    """Start and goal in one place need no step."""
    lane = course_of(Element("floor", length=6.0)).lanes[0]
    lattice = make_foothold_grid(lane, start=3.0, goal=3.0, spacing=SPACING)
    assert lattice.cycles == 0 and len(lattice.s) == 3


@pytest.mark.parametrize(
    ("start", "goal", "word"),
    [(2.9, 6.5, "flight"), (1.0, 4.6, "ends"), (1.0, 4.0, "ends"), (0.2, 6.5, "beyond"),
     (1.0, 7.4, "beyond"), (3.0, 1.0, "ends")],
)  # fmt: skip
def test_walks_without_room_are_refused(start: float, goal: float, word: str) -> None:
    """Too near a flight, on it, off the ground, or backward: the error says which."""
    lane = course_of(
        Element("floor", length=3.0),
        Element("stairs", going="up", rise=0.13, run=0.5, count=3),
        Element("floor", length=3.0),
    ).lanes[0]
    with pytest.raises(PlanningError, match=word):
        make_foothold_grid(lane, start=start, goal=goal, spacing=SPACING)


@given(lanes())
def test_strides_that_make_whole_cycles_are_behind_the_last_flight(lane: Lane) -> None:
    """Before it level ground has as few places as the spacing allows."""
    grid = lattice_of(lane)
    flights = lane.flights
    if not flights:
        return
    first = lane.treads(flights[0])[0]
    before = first[0] - 0.5 * (first[1] - first[0])
    count = int(np.sum((grid.s > ENDS + ROUNDING) & (grid.s < first[0])))
    assert count == max(int(np.ceil((before - ENDS) / SPACING - 1e-6)), 0)


def test_flights_without_a_landing_are_walked_tread_to_tread() -> None:
    """Two flights written one after the other are one flight."""
    floor = Element("floor", length=3.0)

    def up(count: int) -> Element:
        return Element("stairs", going="up", rise=0.13, run=0.5, count=count)

    one = course_of(floor, up(5), floor).lanes[0]
    two = course_of(floor, up(2), up(3), floor).lanes[0]
    np.testing.assert_allclose(lattice_of(two).s, lattice_of(one).s)


def test_short_landing_has_one_place_in_its_middle() -> None:
    """Where there is no room for a place behind one flight and one before the next."""
    lane = course_of(
        Element("floor", length=3.0),
        Element("stairs", going="up", rise=0.13, run=0.3, count=2),
        Element("floor", length=0.3),
        Element("stairs", going="down", rise=0.13, run=0.5, count=2),
        Element("floor", length=3.0),
    ).lanes[0]
    lattice = lattice_of(lane)
    assert lattice.s[(lattice.s > 3.6) & (lattice.s < 3.9)] == pytest.approx([3.75])
