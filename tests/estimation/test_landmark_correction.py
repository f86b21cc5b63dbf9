"""Landmarks correct the filter's place along the ground and its heading, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from estimation_rig import DT
from hypothesis import given, settings, strategies as st
from rig import model_layout, paper_robot

from drake_quad.common import FloatArray
from drake_quad.estimation import filter_state as at
from drake_quad.estimation.filter import drift_by_step
from drake_quad.estimation.filter_state import (
    COVARIANCE,
    DEFAULT_SETTINGS,
    ERRORS,
    SIZE,
    filter_model,
    initial_memory,
)
from drake_quad.estimation.landmark_correction import LandmarkSighting, correct_by_landmark
from drake_quad.math.rotations import rotation_exp

SETTINGS = replace(
    DEFAULT_SETTINGS, camera_range=0.01, camera_yaw=0.004, camera_side=0.006, landmarks_alike=1.0
)
MODEL = filter_model(paper_robot(), SETTINGS, radius=0.022, period=DT, layout=model_layout())
SIGHT = np.diag([0.005**2, 0.003**2, 0.005**2])
CAMERA = np.array([0.6, 0.0, 0.1])  # in B [m]


def memory(p: FloatArray, yaw: float, *, place: float = 0.05, heading: float = 0.02) -> FloatArray:
    """A robot at `p` (3,) that has gone astray by about so much [m], [rad], on four firm feet."""
    known = replace(SETTINGS, initial_position=place, initial_yaw=heading)
    m = initial_memory(known, p, yaw, 0.05, np.zeros(12))
    m[at.STARTED] = 1.0
    m[at.VELOCITY : at.VELOCITY + 3] = rotation_exp(0.0, 0.0, yaw) @ [0.2, 0.0, 0.01]
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    for k in range(4):
        m[at.FIRM + k] = 1.0
        foot = p + rotation_exp(0.0, 0.0, yaw) @ [0.4 - 0.8 * (k // 2), 0.3 - 0.6 * (k % 2), -0.9]
        m[at.FEET + 3 * k : at.FEET + 3 * k + 3] = foot
        d = slice(at.E_FEET + 3 * k, at.E_FEET + 3 * k + 3)
        P[d] = P[at.E_POSITION : at.E_POSITION + 3]
        P[:, d] = P[:, at.E_POSITION : at.E_POSITION + 3]
        P[d, d] += 1e-6 * np.eye(3)
    P[:] = 0.5 * (P + P.T)
    return m


def astray(p: FloatArray, x: float, y: float) -> FloatArray:
    """A place (3,) so far off along the ground [m]."""
    return p + np.array([x, y, 0.0])


def seen(
    m: FloatArray, p: FloatArray, yaw: float, *, climb: float = 0.0,
    wrong: FloatArray | None = None, covariance: FloatArray = SIGHT, stamp: float = 1.0,
) -> LandmarkSighting:  # fmt: skip
    """What an exact camera shows of the memory's errors, if the robot is at `p` (3,), `yaw`.

    `wrong` (3,) is added: what the camera has wrong ahead, about the vertical and aside.
    """
    R = m[at.ROTATION : at.ROTATION + 9].reshape(3, 3)
    eye = m[at.POSITION : at.POSITION + 3] + R @ CAMERA
    turned = float(np.arctan2(R[1, 0], R[0, 0])) - yaw
    R_true = rotation_exp(0.0, 0.0, -turned) @ R
    apart = eye - (p + R_true @ CAMERA)
    c, s = np.cos(climb), np.sin(climb)
    off = np.array([c * apart[0] + s * apart[1], turned, c * apart[1] - s * apart[0]])
    return LandmarkSighting(
        stamp, np.array([c, s]), eye, off + (0.0 if wrong is None else wrong), covariance
    )


def errors(m: FloatArray, p: FloatArray, yaw: float) -> tuple[FloatArray, float]:
    """Errors of place (3,) [m] and heading [rad]."""
    R = m[at.ROTATION : at.ROTATION + 9].reshape(3, 3)
    return m[at.POSITION : at.POSITION + 3] - p, float(np.arctan2(R[1, 0], R[0, 0])) - yaw


@settings(max_examples=40, deadline=None)
@given(
    x=st.floats(-50.0, 50.0), y=st.floats(-50.0, 50.0), z=st.floats(0.5, 20.0),
    yaw=st.floats(-3.0, 3.0), climb=st.floats(-3.0, 3.0),
    ahead=st.floats(-0.1, 0.1), aside=st.floats(-0.1, 0.1), turned=st.floats(-0.04, 0.04),
)  # fmt: skip
def test_a_sighting_takes_most_of_the_error_away(
    x: float, y: float, z: float, yaw: float, climb: float,
    ahead: float, aside: float, turned: float,
) -> None:  # fmt: skip
    """Wherever the robot is and the flight leads, a tenth of the error is left, and 3 mm."""
    p = np.array([x, y, z])
    m = memory(astray(p, ahead, aside), yaw + turned)
    assert correct_by_landmark(m, seen(m, p, yaw, climb=climb), MODEL) == 3
    place, heading = errors(m, p, yaw)
    assert np.hypot(*place[:2]) < 0.1 * np.hypot(ahead, aside) + 0.003
    assert abs(heading) < 0.1 * abs(turned) + 0.001


@settings(max_examples=40, deadline=None)
@given(
    ahead=st.floats(-0.1, 0.1), aside=st.floats(-0.1, 0.1), turned=st.floats(-0.04, 0.04),
    climb=st.floats(-3.0, 3.0),
)  # fmt: skip
def test_base_and_feet_move_as_one_piece(
    ahead: float, aside: float, turned: float, climb: float
) -> None:
    """Where feet stand in the base's frame, tilt, height and speed stay; biases do, too."""
    p = np.array([3.0, -2.0, 0.9])
    m = memory(astray(p, ahead, aside), 0.7 + turned)

    def told() -> list[FloatArray]:
        R = m[at.ROTATION : at.ROTATION + 9].reshape(3, 3)
        feet = (m[at.FEET : at.FEET + 12].reshape(4, 3) - m[at.POSITION : at.POSITION + 3]) @ R
        return [
            feet, R[2], m[at.VELOCITY : at.VELOCITY + 3] @ R, m[at.POSITION + 2 : at.POSITION + 3],
            m[at.GYRO_BIAS : at.GYRO_BIAS + 6],
        ]  # fmt: skip

    before = [np.array(value) for value in told()]
    correct_by_landmark(m, seen(m, p, 0.7, climb=climb), MODEL)
    for old, new in zip(before, told(), strict=True):
        np.testing.assert_allclose(new, old, atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(climb=st.floats(-3.0, 3.0), share=st.floats(-0.9, 0.9))
def test_the_covariance_is_one_and_shrinks(climb: float, share: float) -> None:
    """Symmetric, positive, and of place and heading never more than before."""
    p = np.array([3.0, -2.0, 0.9])
    m = memory(p, 0.4)
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    C = np.array(SIGHT)
    C[1, 2] = C[2, 1] = share * np.sqrt(C[1, 1] * C[2, 2])
    before = np.array(P)
    correct_by_landmark(m, seen(m, p, 0.4, climb=climb, covariance=C), MODEL)
    np.testing.assert_array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > -1e-12
    lever = np.array([[0.0, p[2], -p[1]], [-p[2], 0.0, p[0]]])
    of_place = np.zeros((2, ERRORS))
    of_place[:, at.E_ROTATION : at.E_ROTATION + 3] = lever
    of_place[:, at.E_POSITION : at.E_POSITION + 2] = np.eye(2)
    assert np.all(np.diag(of_place @ (before - P) @ of_place.T) > 0.0)
    assert P[2, 2] < before[2, 2]


def test_each_sighting_counts_once() -> None:
    """The same sighting again, or an older one, changes nothing."""
    p = np.array([3.0, -2.0, 0.9])
    m = memory(astray(p, 0.05, 0.02), 0.4)
    first = seen(m, p, 0.4, stamp=1.0)
    assert correct_by_landmark(m, first, MODEL) == 3
    after = m.copy()
    for again in (first, first._replace(stamp=0.5)):
        assert correct_by_landmark(m, again, MODEL) == -1
        np.testing.assert_array_equal(m, after)
    assert correct_by_landmark(m, seen(m, p, 0.4, stamp=1.5), MODEL) == 3


def test_what_was_not_seen_is_not_corrected() -> None:
    """Where no side of the flight is in view the robot may be anywhere across."""
    p = np.array([3.0, -2.0, 0.9])
    m = memory(astray(p, 0.05, 0.04), 0.0, heading=1e-4)
    unseen = np.diag([0.005**2, 0.003**2, np.inf])
    assert correct_by_landmark(m, seen(m, p, 0.0, covariance=unseen), MODEL) == 2
    place, _ = errors(m, p, 0.0)
    assert abs(place[0]) < 0.006 and abs(place[1] - 0.04) < 0.002
    assert m[at.LANDMARKS] == 1.0
    np.testing.assert_allclose(
        m[at.LANDMARK_OFF : at.LANDMARK_OFF + 3], [0.05, 0.0, 0.0], atol=1e-9
    )


def test_what_cannot_be_is_not_believed() -> None:
    """A flight that seems to be a metre off, to a filter that is sure to 5 cm, is another thing."""
    p = np.array([3.0, -2.0, 0.9])
    m = memory(p, 0.0)
    far = seen(m, p, 0.0, wrong=np.array([1.0, 0.0, 0.0]))
    assert correct_by_landmark(m, far, MODEL) == 2
    place, _ = errors(m, p, 0.0)
    assert np.abs(place).max() < 1e-3


def test_what_the_camera_always_has_wrong_is_learned_where_the_place_is_known() -> None:
    """Of a robot at its known start what is off is the camera's: later it is allowed for."""
    p, wrong = np.array([1.0, 0.0, 0.9]), np.array([0.012, 0.004, -0.006])
    m = memory(p, 0.0, place=1e-3, heading=1e-3)
    for k in range(30):
        correct_by_landmark(m, seen(m, p, 0.0, wrong=wrong, stamp=0.5 * k), MODEL)
    place, heading = errors(m, p, 0.0)
    assert np.abs(place[:2]).max() < 0.0015 and abs(heading) < 0.0005
    learned = m[at.CAMERA : at.CAMERA + 3] + wrong
    assert np.all(np.abs(learned) < [0.0015, 0.0008, 0.0015])
    assert len(m) == SIZE


def test_the_more_sightings_err_as_one_the_less_each_counts() -> None:
    """Ten that err alike move the estimate by less than ten that do not."""
    p, moved = np.array([3.0, -2.0, 0.9]), []
    for alike in (1.0, 100.0):
        m = memory(astray(p, 0.02, 0.0), 0.0, place=0.01)
        model = filter_model(
            paper_robot(), replace(SETTINGS, landmarks_alike=alike), radius=0.022, period=DT,
            layout=model_layout(),
        )  # fmt: skip
        correct_by_landmark(m, seen(m, p, 0.0), model)
        moved.append(0.02 - errors(m, p, 0.0)[0][0])
    assert 0.0 < moved[1] < 0.3 * moved[0]


def test_each_step_of_a_foot_may_lead_astray() -> None:
    """Base and feet grow uncertain together, along the ground alone, by each foot that is set down.

    How far they are from each other is known as well as before.
    """
    p = np.array([3.0, -2.0, 0.9])
    m = memory(p, 0.0)
    P = m[COVARIANCE:].reshape(ERRORS, ERRORS)
    before = np.array(P)
    model = filter_model(
        paper_robot(), replace(SETTINGS, step_drift=0.002), radius=0.022, period=DT,
        layout=model_layout(),
    )  # fmt: skip
    drift_by_step(m, model[0]["settings"])
    more, place, foot = P - before, at.E_POSITION, at.E_FEET + 3
    for i, expected in enumerate((0.002**2, 0.002**2, 0.0)):
        assert more[place + i, place + i] == pytest.approx(expected, abs=1e-12)
        apart = (
            more[place + i, place + i] + more[foot + i, foot + i] - 2 * more[place + i, foot + i]
        )
        assert apart == pytest.approx(0.0, abs=1e-12)


def test_a_heading_that_is_not_believed_does_not_move_the_robot_aside() -> None:
    """Half a radian off, of an image whose sides err with its heading: the rest counts as it is."""
    p = np.array([3.0, -2.0, 0.9])
    m = memory(p, 0.0)
    C = np.array(SIGHT)
    C[1, 2] = C[2, 1] = -0.9 * np.sqrt(C[1, 1] * C[2, 2])
    wrong = np.array([0.0, 0.5, 0.0])
    assert correct_by_landmark(m, seen(m, p, 0.0, wrong=wrong, covariance=C), MODEL) == 2
    place, heading = errors(m, p, 0.0)
    assert np.abs(place).max() < 1e-3 and abs(heading) < 1e-3
