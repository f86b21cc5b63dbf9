"""Margins beyond the hull's, as the monitor measures and the log holds them."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pydrake.systems.analysis import Simulator
from rig import (
    contacts_of,
    course_of,
    fix_inputs,
    flat_course,
    flat_walk,
    model_layout,
    model_plant,
    paper_robot,
    read,
    stand_plan,
    state_of,
)  # fmt: skip
from test_region import NEAR, UNIT, random_contacts

from drake_quad.common import FloatArray
from drake_quad.planning.motion_plan import evaluate
from drake_quad.runs.planned_columns import Ground, plan_regions
from drake_quad.stability.equilibrium_region import AT_REST, find_region, is_hull, static_region
from drake_quad.stability.margin_kinds import FEASIBLE, FRICTION, HULL
from drake_quad.stability.margins import MarginEstimator, Margins, demand_of
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.systems.stability_monitor import NO_SUPPORT, StabilityMonitor
from drake_quad.terrain.elements import Element

PERIOD = 0.1
SEEDS = st.integers(0, 2**32 - 1)


def gauge(kind: str = FEASIBLE, *, strength: float = 1.0) -> MarginEstimator:
    robot = paper_robot()
    return MarginEstimator(
        robot=robot, kind=kind, friction=0.8, mass=robot.mass, effort=strength * robot.effort,
        none=NO_SUPPORT,
    )  # fmt: skip


class Monitor:
    """A monitor in a simulator of its own; the robot moves without changing its posture."""

    def __init__(self, used: MarginEstimator | None) -> None:
        self.system = StabilityMonitor(
            model=model_plant(), layout=model_layout(), gauge=used, gauge_period=PERIOD
        )
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        stance = stand_plan().end
        self.body, self.feet = np.array(stance.body), np.array(stance.feet)
        self.bearing = np.ones(4)

    def run(self, *, velocity: FloatArray | None = None, ticks: int = 1) -> FloatArray:
        """Gives the inputs, lets so many of the gauge's ticks pass, and reads its margins."""
        places = self.feet - [0.0, 0.0, paper_robot().foot_radius]
        state = state_of(self.body, self.feet)
        if velocity is not None:
            state[model_layout().v_base + 3 : model_layout().v_base + 6] = velocity
        fix_inputs(
            self.system, self.context, robot_state=state,
            contacts=contacts_of(self.bearing, places, np.zeros((4, 3))),
        )  # fmt: skip
        self.simulator.AdvanceTo(self.context.get_time() + ticks * PERIOD + 1e-3)
        return read(self.system, self.context, "further_margins")


def test_on_level_ground_friction_changes_nothing() -> None:
    """At rest every margin is the hull's: of friction, of torque, of the capture point."""
    monitor = Monitor(gauge())
    found = monitor.run(ticks=3)
    hull = read(monitor.system, monitor.context, "stability_margin")[0]
    for place in (Margins.FRICTION, Margins.CAPTURE, Margins.FEASIBLE, Margins.DYNAMIC):
        assert abs(found[place] - hull) < NEAR
    com = read(monitor.system, monitor.context, "com_position")
    assert abs(found[Margins.BUDGET] - np.sqrt(9.81 / com[2]) * hull) < 0.1 * found[Margins.BUDGET]


def test_speed_takes_from_the_capture_margin_and_the_budget() -> None:
    """A robot that moves at constant speed has its static margin, less of the others."""
    still, moving = Monitor(gauge()), Monitor(gauge())
    a, b = still.run(ticks=3), moving.run(velocity=np.array([0.0, 0.3, 0.0]), ticks=3)
    assert b[Margins.CAPTURE] < a[Margins.CAPTURE] - 0.05
    assert b[Margins.BUDGET] < a[Margins.BUDGET] - 0.15
    np.testing.assert_allclose(b[[0, 4, 5]], a[[0, 4, 5]], atol=1e-9)


def test_braking_takes_from_the_dynamic_margin() -> None:
    """With speed lost between two measurements the feet push back: the place for it is aside."""
    monitor = Monitor(gauge())
    before = monitor.run(velocity=np.array([0.0, 0.1, 0.0]), ticks=2)
    after = monitor.run(velocity=np.zeros(3))
    com = read(monitor.system, monitor.context, "com_position")
    feet = monitor.feet[:, :2]
    # The pressure is where weight and inertia point: c - h a / g, a = -1 m/s².
    pressure = [com[0], com[1] + com[2] / 9.81]
    assert abs(after[Margins.DYNAMIC] - stability_margin(pressure, feet)) < 0.01
    assert after[Margins.DYNAMIC] < before[Margins.DYNAMIC] - 0.03


def test_without_feet_there_is_no_support() -> None:
    """In the air, and on feet that cannot, the log has a number for it."""
    monitor = Monitor(gauge())
    monitor.bearing = np.zeros(4)
    found = monitor.run(ticks=2)
    assert np.all(found[[0, 1, 4, 5]] == NO_SUPPORT) and found[Margins.BUDGET] == 0.0
    weak = Monitor(gauge(strength=0.1)).run(ticks=2)
    assert weak[Margins.FEASIBLE] == NO_SUPPORT and weak[Margins.FRICTION] > 0.0


@pytest.mark.parametrize(("kind", "known"), [(HULL, 0), (FRICTION, 4), (FEASIBLE, 6)])
def test_only_what_is_asked_for_is_measured(kind: str, known: int) -> None:
    """The rest is no number."""
    found = Monitor(gauge(kind)).run(ticks=2)
    assert np.all(np.isfinite(found[:known])) and np.all(np.isnan(found[known:]))


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.floats(0.0, 0.3))
def test_the_short_cut_is_the_region(seed: int, tilt: float) -> None:
    """Where the hull is taken for the region, the programs find the same."""
    contacts = random_contacts(np.random.default_rng(seed), tilt=tilt if seed % 2 else 0.0)
    region, found = static_region(contacts), find_region(contacts)
    for x, y in UNIT[::4]:
        a, b = region.reach(x, y), found.reach(x, y)
        assert a == b or abs(a - b) < NEAR


def test_the_short_cut_is_taken_on_stairs_and_never_on_slopes() -> None:
    """Else it would be worth nothing, or wrong."""
    robot, walk = paper_robot(), flat_walk()
    posture_feet = walk.sample(0.0).feet + np.outer([0.36, 0.18, 0.0, 0.18], [0.0, 0.0, 1.0])
    contacts = random_contacts(np.random.default_rng(0), 4, tilt=0.3)
    assert not is_hull(contacts)
    level = type(contacts)(posture_feet, np.tile([0.0, 0.0, 1.0], (4, 1)), np.full(4, 0.8))
    assert is_hull(level) and robot.mass > 0.0


def test_demand_at_rest_is_the_weight() -> None:
    """Without a change of momentum nothing but the weight is asked for; falling asks for none."""
    h = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    rest = demand_of(h, h, 0.1, mass=10.0, height=0.7)
    assert rest.force == AT_REST.force and rest.moment == AT_REST.moment
    fall = demand_of(h - [0, 0, 0, 0, 0, 9.81], h, 0.1, mass=10.0, height=0.7)
    np.testing.assert_allclose(fall.force, [0.0, 0.0, 0.0], atol=1e-12)


def test_planned_margins_on_level_ground_are_the_hulls() -> None:
    """And the torque limits, which are wide there, take nothing away."""
    samples = evaluate(paper_robot(), flat_walk(), np.linspace(0.0, flat_walk().duration, 12))
    friction, within = plan_regions(
        paper_robot(), samples, Ground(flat_course(), 0.8), feasible=True
    )
    np.testing.assert_allclose(friction, samples.margin, atol=NEAR)
    assert np.all(within <= friction + NEAR) and np.all(within > 0.0)


def test_planned_margins_on_a_slope_need_friction() -> None:
    """On a slope of 0.2 a friction of 0.1 holds nobody, one of 0.8 does."""
    slope = course_of(
        Element("floor", length=1.0), Element("slope", going="up", length=20.0, height=4.0),
        Element("floor", length=1.0),
    )  # fmt: skip
    samples = evaluate(paper_robot(), flat_walk(), np.array([5.0, 8.0]))
    away = np.array([6.0, 0.0, 0.0])
    moved = samples.feet + away
    moved[..., 2] += slope.height(moved[..., 0], moved[..., 1])
    shifted = type(samples)(**{**vars(samples), "feet": moved, "com": samples.com + away})
    for mu, holds in ((0.1, False), (0.8, True)):
        friction, _ = plan_regions(paper_robot(), shifted, Ground(slope, mu), feasible=False)
        assert np.all((friction > -1.0) == holds)
