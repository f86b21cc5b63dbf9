"""SensorWatch: what no sound sensor shows, of one sensor at a time."""

from dataclasses import replace

import numpy as np
import pytest

from drake_quad.bus.drive_limits import SafetyLimits
from drake_quad.bus.messages import DRIVES_FOLLOW, StateMessage
from drake_quad.bus.sensor_watch import FROZEN, TURNED, SensorWatch
from drake_quad.common import GRAVITY

NAMES = tuple(f"joint_{k}" for k in range(12))
PERIOD = 0.002


def new_watch() -> SensorWatch:
    limits = SafetyLimits(
        q_lower=np.full(12, -2.0), q_upper=np.full(12, 2.0), speed=np.full(12, 20.0),
        effort=np.full(12, 50.0), stiffness=200.0, damping=5.0,
    )  # fmt: skip
    return SensorWatch(limits, NAMES)


def state(tick: int, **fields: object) -> StateMessage:
    """What a robot shows whose joints swing to and fro; no two states are the same."""
    t = PERIOD * tick
    sound = StateMessage(
        1, tick + 1, round(1e9 * t), DRIVES_FOLLOW, np.full(12, 0.5 * np.sin(t)),
        np.full(12, 0.5 * np.cos(t)), np.full(12, 3.0), np.full(3, 1e-3 * np.sin(tick)),
        np.array([0.0, 0.0, GRAVITY + 1e-3 * np.cos(tick)]), np.full(4, 100.0),
    )  # fmt: skip
    return replace(sound, **fields)  # type: ignore[arg-type]


def first_fault(watch: SensorWatch, begin: int, **frozen: object) -> tuple[float, str]:
    """How long after `begin` a fault is told of [s], and which."""
    for tick in range(begin, begin + 2000):
        fault = watch.take(state(tick, **frozen))
        if fault:
            return PERIOD * (tick - begin), fault
    return float("inf"), ""


def sound_watch(ticks: int = 100) -> SensorWatch:
    """A watch that has seen so many sound states."""
    watch = new_watch()
    assert not any(watch.take(state(tick)) for tick in range(ticks))
    return watch


@pytest.mark.parametrize(
    ("name", "sensor"), [("angular_rate", "gyroscope"), ("specific_force", "accelerometer")]
)
def test_one_part_of_the_imu_that_freezes_is_found(name: str, sensor: str) -> None:
    """Though all else goes on: within 10 ms of FROZEN, and not before it."""
    watch = sound_watch()
    last = getattr(state(99), name)
    took, fault = first_fault(watch, 100, **{name: last})
    assert FROZEN - 2 * PERIOD <= took <= FROZEN + 0.01
    assert fault == f"the {sensor} shows the same without end"


@pytest.mark.parametrize("joints", [slice(None), slice(5, 6)])
def test_encoders_that_freeze_are_found_by_the_joints_speeds(joints: slice) -> None:
    """All of them or one: as soon as its speed says that it has turned by TURNED."""
    watch = sound_watch()
    frozen = state(99).position
    for tick in range(100, 400):
        position = state(tick).position
        position[joints] = frozen[joints]
        fault = watch.take(state(tick, position=position))
        if fault:
            break
    turned = 0.5 * (np.sin(PERIOD * tick) - np.sin(PERIOD * 99))
    assert TURNED <= turned <= TURNED + 0.002
    assert f"joint_{joints.start or 0} stays the same" in fault


def test_joints_at_rest_may_show_the_same() -> None:
    """An encoder of few bits does not move while its joint does not: for 10 s there is no fault.

    Nor where its speed has an offset of its own.
    """
    watch = new_watch()
    still = {"position": np.full(12, 0.25), "velocity": np.linspace(-0.09, 0.09, 12)}
    assert not any(watch.take(state(tick, **still)) for tick in range(5000))


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("position", 2.6, "joint_7 is at 2.6 rad"),
        ("velocity", -61.0, "joint_7 turns at -61 rad/s"),
        ("effort", 1e5, "joint_7 gives 1e+05 Nm"),
    ],
)
def test_a_joint_shows_nothing_that_cannot_be(name: str, value: float, said: str) -> None:
    """One value far beyond a joint's limits is a fault at once; at the limits there is none."""
    watch = sound_watch()
    values = np.array(getattr(state(100), name))
    values[7] = value
    fault = watch.take(state(100, **{name: values}))
    assert fault.startswith(said) and fault.endswith("which cannot be")
    limits = {"position": 2.0, "velocity": -20.0, "effort": 50.0}
    values[7] = limits[name]
    assert sound_watch().take(state(100, **{name: values})) == ""


def test_an_imu_shows_nothing_that_cannot_be() -> None:
    """A turn rate of 100 rad/s, and a hundred times gravity: neither is a robot's."""
    assert "gyroscope shows 100" in sound_watch().take(state(100, angular_rate=np.full(3, 100.0)))
    force = np.array([0.0, 0.0, 100.0 * GRAVITY])
    assert "accelerometer shows 981" in sound_watch().take(state(100, specific_force=force))
