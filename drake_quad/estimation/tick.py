"""A whole tick of the filter with its outputs, in one call."""

from drake_quad.compiled import compiled, copy_vector
from drake_quad.estimation.filter import step
from drake_quad.estimation.memory import ACCEL_BIAS, GYRO_BIAS, SLIP, STARTED
from drake_quad.estimation.outputs import IntArray, write_deviation, write_state
from drake_quad.gait.legs import FloatArray


@compiled
def run_filter(
    m: FloatArray,
    imu: FloatArray,
    joints: FloatArray,
    contacts: FloatArray,
    legs: FloatArray,
    radius: float,
    dt: float,
    settings: FloatArray,
    places: IntArray,
    q_base: int,
    v_base: int,
    x: FloatArray,
    deviation: FloatArray,
    bias: FloatArray,
    slip: FloatArray,
    healthy: FloatArray,
) -> None:
    """`step`, then what it comes to.

    Args:
        m: The memory; goes on a tick.
        imu: See `step`, as all inputs.
        joints: See there.
        contacts: See there.
        legs: See there.
        radius: See there.
        dt: See there.
        settings: See there.
        places: See `write_state`, as the next two.
        q_base: See there.
        v_base: See there.
        x: Result: [q; v], as it was until the filter has started.
        deviation: Result: see `write_deviation`.
        bias: Result (6,): of the rate [rad/s] and of the specific force [m/s^2].
        slip: Result (4,): 1 for each foot that slipped.
        healthy: Result (1,).
    """
    healthy[0] = 1.0 if step(m, imu, joints, contacts, legs, radius, dt, settings) else 0.0
    write_deviation(m, deviation)
    copy_vector(bias, m[GYRO_BIAS : ACCEL_BIAS + 3])
    copy_vector(slip, m[SLIP : SLIP + 4])
    if m[STARTED] > 0.5:
        write_state(m, joints, places, q_base, v_base, x)
