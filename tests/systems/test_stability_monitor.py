"""The monitor alone: margins as `gait.support` has them, and an end to runs that have failed."""

import numpy as np
import pytest
from control_rig import com_of
from hypothesis import given, settings, strategies as st
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context
from rig import contacts_of, fix_inputs, model_layout, model_plant, read, stand_plan, state_of

from drake_quad.common import FloatArray
from drake_quad.stability.margins import FALL_TIME
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.systems.stability_monitor import NO_SUPPORT, StabilityMonitor

PERIOD = 0.005
FALL = round(FALL_TIME / PERIOD)  # ticks


class Monitor:
    """A monitor in a simulator of its own; the robot stands in its first stance unless told."""

    def __init__(self, window: int = 1) -> None:
        self.system = StabilityMonitor(
            model=model_plant(), layout=model_layout(), period=PERIOD, window=window
        )
        self.simulator = Simulator(self.system)
        self.context: Context = self.simulator.get_mutable_context()
        self.stance = stand_plan().end
        self.state = state_of(self.stance.body, self.stance.feet)
        self.bearing = np.ones(4)
        self.feet = np.array(self.stance.feet)
        self.force = np.tile([0.0, 0.0, 147.0], (4, 1))
        self.other = (0.0, 0.0)  # contacts of anything but feet, and their greatest force

    def run(self, ticks: int = 2) -> SimulatorStatus:
        """Gives the inputs and lets so many ticks pass."""
        fix_inputs(
            self.system,
            self.context,
            robot_state=self.state,
            contacts=np.concatenate(
                [contacts_of(self.bearing, self.feet, self.force)[:-2], self.other]
            ),
        )
        return self.simulator.AdvanceTo(self.context.get_time() + ticks * PERIOD)

    def read(self, port: str) -> FloatArray:
        """An output now."""
        return read(self.system, self.context, port)


def random_monitor(seed: int) -> Monitor:
    """Any contacts and forces under a robot that leans a little."""
    rng = np.random.default_rng(seed)
    monitor = Monitor()
    body = monitor.stance.body + rng.uniform(-0.05, 0.05, 5)
    monitor.state = state_of(body, np.array(monitor.stance.feet))
    monitor.feet = monitor.feet + rng.uniform(-0.1, 0.1, (4, 3))
    monitor.feet[:, 2] = 0.0
    monitor.bearing = (rng.random(4) < 0.8).astype(float)
    monitor.force = rng.uniform(-50.0, 50.0, (4, 3))
    monitor.force[:, 2] += 150.0
    monitor.force *= monitor.bearing[:, None]
    return monitor


def test_the_port_of_all_margins_shows_the_ports_of_each() -> None:
    """One after the other, in the rows that its parts tell, which a log goes by."""
    monitor = random_monitor(3)
    monitor.run()
    together, parts = monitor.read("margins"), monitor.system.parts
    assert np.ptp(together) > 0.0
    assert sorted(k for rows in parts.rows.values() for k in range(rows.start, rows.stop)) == list(
        range(len(together))
    )
    for name, rows in parts.rows.items():
        np.testing.assert_array_equal(together[rows], monitor.read(name))


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_margins_are_those_of_the_support_polygon(seed: int) -> None:
    """Of the whole robot's centre of mass over the bearing feet, and of the centre of pressure."""
    monitor = random_monitor(seed)
    monitor.run()
    com, bears = com_of(monitor.state), monitor.bearing > 0.5
    support = monitor.feet[bears, :2]
    margin = stability_margin(com[:2], support) if bears.any() else NO_SUPPORT
    np.testing.assert_allclose(monitor.read("stability_margin"), margin, atol=1e-12)
    np.testing.assert_allclose(monitor.read("com_position"), com, atol=1e-12)
    if bears.any():
        load = monitor.force[:, 2]
        pressure = load @ monitor.feet[:, :2] / load.sum()
        expected = stability_margin(pressure, support)
        np.testing.assert_allclose(monitor.read("zmp_margin"), expected, atol=1e-9)
    else:
        assert monitor.read("zmp_margin") == NO_SUPPORT


def test_pressure_under_a_robot_at_rest_is_under_its_centre_of_mass() -> None:
    """With forces that balance, both margins are the same."""
    monitor = Monitor()
    com = com_of(monitor.state)
    x, y = (monitor.feet[:, :2] - com[:2]).T
    A = np.array([np.ones(4), x, y])
    monitor.force[:, 2] = np.linalg.pinv(A) @ [588.6, 0.0, 0.0]
    monitor.run()
    np.testing.assert_allclose(monitor.read("zmp_margin"), monitor.read("stability_margin"))


def test_the_least_margins_of_the_last_ticks_are_kept() -> None:
    """A tick with a margin that no later one has is seen for as long as the window, then not.

    Before contacts are measured there is none: what the first two ticks see counts for nothing.
    """
    monitor = Monitor(window=3)
    monitor.bearing = np.zeros(4)
    monitor.run(1)
    assert np.all(np.isinf(monitor.read("least_margins")))
    monitor.bearing = np.ones(4)
    monitor.run(3)
    usual = [monitor.read(port)[0] for port in ("stability_margin", "zmp_margin")]
    np.testing.assert_array_equal(monitor.read("least_margins"), usual)
    monitor.bearing = np.array([1.0, 1.0, 1.0, 0.0])
    monitor.run(1)
    low = [monitor.read(port)[0] for port in ("stability_margin", "zmp_margin")]
    assert low[0] < usual[0]
    monitor.bearing = np.ones(4)
    for ticks, expected in ((1, low), (1, low), (1, usual)):
        monitor.run(ticks)
        assert monitor.read("stability_margin")[0] == usual[0]
        found = monitor.read("least_margins")
        np.testing.assert_array_equal(found, np.minimum(expected, usual))


def test_what_touches_is_counted_at_every_tick() -> None:
    """Between two samples of any log, too: for how long, and the greatest force; nothing is lost.

    Ticks before contacts are measured count for nothing.
    """
    monitor = Monitor()
    monitor.bearing = np.array([1.0, 0.0, 0.0, 1.0])
    monitor.other = (2.0, 40.0)
    monitor.run(1)
    np.testing.assert_array_equal(monitor.read("contact_totals"), np.zeros(3))
    monitor.run(2)  # the tick at one period counts for nothing, either
    np.testing.assert_allclose(monitor.read("contact_totals"), [PERIOD, PERIOD, 40.0])
    monitor.bearing = np.array([1.0, 1.0, 0.0, 1.0])
    monitor.other = (1.0, 30.0)
    monitor.run(3)
    np.testing.assert_allclose(monitor.read("contact_totals"), [PERIOD, 4 * PERIOD, 40.0])
    monitor.other = (0.0, 0.0)
    monitor.run(5)
    np.testing.assert_allclose(monitor.read("contact_totals"), [PERIOD, 4 * PERIOD, 40.0])


def test_fewer_feet_than_three_have_no_positive_margin() -> None:
    """On a line or a point nothing is stable; without feet a number still stands in the log."""
    monitor = Monitor()
    for bearing in ([1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 0, 0]):
        monitor.bearing = np.array(bearing, dtype=float)
        monitor.run()
        assert NO_SUPPORT <= monitor.read("stability_margin")[0] <= 0.0
    assert monitor.read("stability_margin")[0] == NO_SUPPORT


def test_standing_robot_is_left_alone() -> None:
    """Nothing ends a run in which nothing is wrong."""
    assert Monitor().run(200).succeeded()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_state_that_is_not_finite_stops_the_run(bad: float) -> None:
    """A simulation that has blown up ends with that reason, and no number of it is logged."""
    monitor = Monitor()
    monitor.run()
    before = monitor.read("least_margins")
    monitor.state[20] = bad
    status = monitor.run(10)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert "stopped" in status.FormatMessage() and "not finite" in status.FormatMessage()
    np.testing.assert_array_equal(monitor.read("least_margins"), before)
    assert monitor.read("stability_margin") == monitor.read("zmp_margin") == NO_SUPPORT


def quaternion(axis: FloatArray, degrees: float) -> FloatArray:
    half = np.radians(degrees) / 2
    return np.array([np.cos(half), *(np.sin(half) * axis)])


@pytest.mark.parametrize("axis", [0, 1], ids=["roll", "pitch"])
@pytest.mark.parametrize(("degrees", "falls"), [(35.0, False), (45.0, True), (-60.0, True)])
def test_tilt_beyond_the_limit_is_a_fall(axis: int, degrees: float, falls: bool) -> None:
    """Rolled or pitched by more than 40 degrees the robot has fallen, and the reason says so."""
    monitor = Monitor()
    q = model_layout().q_base
    monitor.state[q : q + 4] = 2.0 * quaternion(np.eye(3)[axis], degrees)  # of any length
    status = monitor.run(FALL + 3)
    ended = status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert ended == falls
    if falls:
        assert "fell" in status.FormatMessage()
        assert f"{abs(degrees):.0f}" in status.FormatMessage()


@pytest.mark.parametrize("axis", [0, 1], ids=["roll", "pitch"])
def test_blow_that_tilts_the_trunk_for_a_moment_is_no_fall(axis: int) -> None:
    """Down steep stairs the body is not far from the limit, and touchdowns shake it."""
    monitor = Monitor()
    q = model_layout().q_base
    for _ in range(4):
        monitor.state[q : q + 4] = quaternion(np.eye(3)[axis], 41.0)
        assert monitor.run(FALL // 2).succeeded()
        monitor.state[q : q + 4] = quaternion(np.eye(3)[axis], 38.0)
        assert monitor.run(2).succeeded()
    monitor.state[q : q + 4] = quaternion(np.eye(3)[axis], 41.0)
    assert "tilted by 41°" in monitor.run(FALL + 3).FormatMessage()


def test_yaw_is_no_tilt() -> None:
    """Turning on the spot never ends a run."""
    monitor = Monitor()
    q = model_layout().q_base
    monitor.state[q : q + 4] = quaternion(np.array([0.0, 0.0, 1.0]), 170.0)
    assert monitor.run(FALL + 3).succeeded()


def test_trunk_down_at_its_feet_is_a_fall() -> None:
    """A robot that has sunk to the ground, upright, has fallen too: once it lies there."""
    monitor = Monitor()
    monitor.state[model_layout().q_base + 6] = 0.2
    assert monitor.run(FALL // 2).succeeded()
    status = monitor.run(FALL)
    assert status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
    assert "fell" in status.FormatMessage()


def test_height_is_measured_from_the_feet() -> None:
    """On a landing high up, the trunk as high above W's origin as ever is not enough."""
    monitor = Monitor()
    monitor.feet[:, 2] = 0.78
    assert "fell" in monitor.run(FALL + 3).FormatMessage()
    other = Monitor()
    other.state[model_layout().q_base + 6] += 0.78
    other.feet[:, 2] = 0.78
    assert other.run(FALL + 3).succeeded()


def test_feet_that_lose_the_ground_for_a_moment_are_no_fall() -> None:
    """Rear feet on a tread high above the front ones, which a blow has lifted: again and again."""
    monitor = Monitor()
    monitor.feet[2:, 2] = 0.7
    for _ in range(4):
        monitor.bearing[:2] = 0.0
        assert monitor.run(FALL // 2).succeeded()
        monitor.bearing[:2] = 1.0
        assert monitor.run(2).succeeded()
    monitor.bearing[:2] = 0.0
    assert "fell" in monitor.run(FALL + 3).FormatMessage()


def test_two_contexts_of_one_monitor_are_two_monitors() -> None:
    """The model's scratch Context belongs to one Context of the monitor."""
    a = Monitor()
    a.run()
    other = Simulator(a.system)
    context = other.get_mutable_context()
    moved = a.state.copy()
    moved[model_layout().q_base + 4] += 5.0
    fix_inputs(
        a.system,
        context,
        robot_state=moved,
        contacts=contacts_of(np.ones(4), a.feet, a.force),
    )
    other.AdvanceTo(0.02)
    a.run()
    gap = read(a.system, context, "com_position") - a.read("com_position")
    np.testing.assert_allclose(gap, [5.0, 0.0, 0.0], atol=1e-12)
