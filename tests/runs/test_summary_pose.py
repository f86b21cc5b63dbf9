"""How far a run's base was from its plan, in place and in angle."""

import numpy as np
import pytest
from pydrake.common.eigen_geometry import AngleAxis, Quaternion
from pydrake.math import RollPitchYaw
from summary_rig import base_columns, changed, log, summary, values

from drake_quad.math.rotations import angle_between, quaternion_of
from drake_quad.runs.pose_metrics import base_error


def test_base_error_is_the_distance_and_the_angle_from_the_plan() -> None:
    """3-4-0 cm off is 5 cm off; rolled by 3° is 3° off, whichever sign the quaternion has."""
    quaternion, place = base_columns()
    at = values(place[0])
    moved = changed(**{place[0]: at + 0.03, place[1]: values(place[1]) - 0.04})
    assert summary(moved)["base_error_max"] == pytest.approx(0.05)
    turned = RollPitchYaw(np.radians(3.0), 0.0, 0.0).ToQuaternion().wxyz()
    for sign in (1.0, -1.0):
        columns = {n: np.full(len(at), sign * v) for n, v in zip(quaternion, turned, strict=True)}
        zero = {"base_desired_yaw": np.zeros(len(at)), "base_desired_pitch": np.zeros(len(at))}
        found = summary(changed(**columns, **zero))
        assert found["base_tilt_error_max_deg"] == pytest.approx(3.0, abs=1e-3)


def test_base_error_at_each_sample() -> None:
    """`base_error` has a row a sample, and sees yaw and pitch of the plan."""
    c = {name: values(name) for name in log().column_names}
    c["base_desired_yaw"] = c["base_desired_yaw"] + 0.1
    place, tilt = base_error(c)
    assert place.shape == tilt.shape == (log().num_rows,)
    np.testing.assert_allclose(tilt, 0.1, atol=1e-6)


@pytest.mark.parametrize("angle", [0.0, 1e-7, 0.3, 3.0])
def test_angle_between_orientations(angle: float) -> None:
    """That of the turn from one to the other, about any axis, to the last digit near zero too."""
    a = quaternion_of(np.array([0.4]), np.array([-0.2]), np.array([2.0]))
    turn = AngleAxis(angle, np.array([0.6, 0.0, 0.8])).quaternion()
    b = turn.multiply(Quaternion(a[0] / np.linalg.norm(a[0]))).wxyz()[None]
    for sign in (1.0, -1.0):
        assert angle_between(a, sign * b)[0] == pytest.approx(angle, abs=1e-12)
