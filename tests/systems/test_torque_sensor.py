"""The drives' torque sensors show what the drives give, leg by leg, with the noise that is said."""

import numpy as np
from pydrake.systems.analysis import Simulator
from rig import fix_inputs, model_layout, read

from drake_quad.common import FloatArray
from drake_quad.estimation.sensor_models import draw_torque_errors
from drake_quad.systems.sensors import TorqueSensor

DT = 0.002
FIRST = np.linspace(-5.0, 6.0, 12)


def shown(given: FloatArray, deviation: FloatArray, *, seed: int = 0, ticks: int = 1) -> FloatArray:
    """What the sensor shows (ticks + 1, 12), before its first sample and then at each."""
    sensor = TorqueSensor(
        layout=model_layout(), initial=FIRST, period=DT,
        errors=draw_torque_errors(deviation, np.random.default_rng(seed)),
    )  # fmt: skip
    simulator = Simulator(sensor)
    context = simulator.get_mutable_context()
    fix_inputs(sensor, context, net_actuation=given)
    rows = [read(sensor, context, "joint_torque_measured")]
    for k in range(ticks):
        simulator.AdvanceTo((k + 0.5) * DT)
        rows.append(read(sensor, context, "joint_torque_measured"))
    assert not sensor.HasAnyDirectFeedthrough()
    return np.array(rows)


def test_torques_come_leg_by_leg_in_whatever_order_the_plant_has_its_drives() -> None:
    """A joint's torque, put where the plant has its drive, comes out in the joint's row."""
    own = np.arange(12.0)
    given = np.zeros(12)
    given[model_layout().actuators] = own
    rows = shown(given, np.zeros(12))
    np.testing.assert_array_equal(rows[0], FIRST)
    np.testing.assert_array_equal(rows[1], own)


def test_noise_has_each_joints_deviation_and_the_seed_decides_it() -> None:
    """Scatter by joint as asked for; one seed, one run to the bit; another seed, another."""
    deviation = np.linspace(0.5, 2.0, 12)
    first, again, other = (
        shown(np.full(12, 10.0), deviation, seed=s, ticks=4000)[1:] for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    np.testing.assert_allclose(first.std(axis=0), deviation, rtol=0.06)
    np.testing.assert_allclose(first.mean(axis=0), 10.0, atol=0.2)
