"""Laws of the filter, over motions made of kinematics alone."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimation_rig import DT, Motion, angle_between, crawl, estimate, readings, stand
from rig import paper_robot

from drake_quad.estimation.filter_state import E_GYRO, EstimatorSettings
from drake_quad.estimation.imu_units import IDEAL_IMU, MTI_300
from drake_quad.estimation.sensor_models import ODRI_DRIVE

NOISY: dict[str, Any] = {"imu_noise": MTI_300, "joint_noise": ODRI_DRIVE}


@pytest.mark.parametrize("turn", [0.0, 0.2])
def test_ideal_sensors_give_the_truth(turn: float) -> None:
    """Over three strides, straight or turning: place, velocity and attitude to 1e-3."""
    motion = crawl(3, turn=turn)
    imu, joints, _ = readings(motion)
    found = estimate(motion, imu, joints)
    assert np.abs(found.position - motion.position).max() < 1e-3
    assert np.abs(found.velocity - motion.velocity).max() < 1e-3
    assert angle_between(found.rotation, motion.rotation).max() < 1e-3
    assert found.healthy.all() and found.slip.max() == 0.0


def test_estimate_moves_with_its_start() -> None:
    """The same readings from a start turned and shifted: the same motion, turned and shifted.

    To rounding: no error depends on where the robot is or which way it looks. That is what the
    invariant filter has before others.
    """
    motion = crawl(2, turn=0.1)
    imu, joints, _ = readings(motion, **NOISY, seed=3)
    yaw, shift = 2.1, np.array([30.0, -20.0, 4.0])
    there = motion.moved(yaw=yaw, shift=shift)
    one, other = estimate(motion, imu, joints), estimate(there, imu, joints)
    Z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1.0]])
    np.testing.assert_allclose(other.position, one.position @ Z.T + shift, atol=1e-6)
    np.testing.assert_allclose(other.velocity, one.velocity @ Z.T, atol=1e-6)
    np.testing.assert_allclose(other.bias, one.bias, atol=1e-6)
    np.testing.assert_allclose(other.deviation[:, 2], one.deviation[:, 2], rtol=1e-3)
    np.testing.assert_allclose(other.deviation[:, 8], one.deviation[:, 8], rtol=1e-3)


@pytest.mark.parametrize("on_map", [False, True])
def test_covariance_is_one(on_map: bool) -> None:
    """Symmetric to the bit, and positive semidefinite but for rounding, after two strides."""
    motion = crawl(2)
    imu, joints, _ = readings(motion, **NOISY, seed=2)
    settings = replace(ON_MAP, level_start=0.002) if on_map else None
    tops = top(float(motion.feet[0, 0, 2])) if on_map else None
    P = estimate(motion, imu, joints, settings=settings, tops=tops).covariance
    np.testing.assert_array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > -1e-12 * np.abs(P).max()


def test_position_and_yaw_are_known_ever_less() -> None:
    """Nothing that the robot feels shows where it is or where it looks: they may only drift."""
    motion = crawl(6)
    imu, joints, _ = readings(motion, **NOISY, seed=2)
    found = estimate(motion, imu, joints)
    for column in (2, 6, 7, 8):
        assert found.deviation[-1, column] > 1.02 * found.deviation[400, column]
    assert found.deviation[-1, 0] < found.deviation[0, 0]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_gyroscopes_bias_is_found_standing(seed: int) -> None:
    """Two seconds on four feet show all three biases of the rate to a fiftieth of what they are."""
    motion = stand()
    imu, joints, bias = readings(motion, **NOISY, seed=seed)
    found = estimate(motion, imu, joints)
    error = found.bias[-1, :3] - bias[-1, :3]
    assert np.abs(error).max() < 0.15 * MTI_300.gyro_turn_on
    spread = np.sqrt(np.diag(found.covariance))[E_GYRO : E_GYRO + 3]
    assert np.all(np.abs(error) < 4.0 * spread)


def test_accelerometers_bias_is_found_turning() -> None:
    """Tilt stays in the world and the bias goes round with the robot: a turn tells them apart."""
    motion = crawl(6, turn=0.3)
    noise = replace(IDEAL_IMU, accel_turn_on=0.05)
    imu, joints, bias = readings(motion, imu_noise=noise, seed=4)
    found = estimate(motion, imu, joints)
    before = np.linalg.norm(found.bias[250, 3:] - bias[250, 3:])
    after = np.linalg.norm(found.bias[-1, 3:] - bias[-1, 3:])
    assert before > 0.02 and after < 0.4 * before
    assert angle_between(found.rotation[-1:], motion.rotation[-1:])[0] < 2e-3


def test_errors_are_what_the_filter_says() -> None:
    """Over ten seeds the errors lie within the deviations, and do not hide far within."""
    motion = crawl(2)
    ratios = []
    for seed in range(10):
        imu, joints, _ = readings(motion, imu_noise=MTI_300, seed=seed)
        found = estimate(motion, imu, joints)
        error = np.concatenate(
            [
                found.velocity[-1] - motion.velocity[-1],
                found.position[-1] - motion.position[-1],
            ]
        )
        ratios.append(error / found.deviation[-1, 3:])
    rms = np.sqrt(np.mean(np.square(ratios)))
    assert np.abs(ratios).max() < 4.0 and 0.05 < rms < 1.5


@pytest.mark.parametrize("radius", [0.008, 0.025])
def test_feet_that_roll_are_no_points(radius: float) -> None:
    """Left out, rolling is a drift in proportion to the way; taken in, it is gone."""
    drifts = {}
    for strides in (1, 3):
        motion = crawl(strides, radius=radius)
        imu, joints, _ = readings(motion)
        for assumed in (0.0, radius):
            found = estimate(motion, imu, joints, radius=assumed)
            error = np.linalg.norm(found.position[-1] - motion.position[-1])
            drifts[strides, assumed > 0.0] = error
    assert drifts[3, False] > 2.0 * drifts[1, False] > 0.1 * radius
    assert drifts[3, True] < 0.1 * drifts[3, False]


def test_foot_that_slips_is_caught() -> None:
    """A foot gives way by 4 cm: flagged, let go, and the base stays where it was."""
    motion = stand()
    imu, joints, _ = readings(motion, imu_noise=MTI_300, seed=1)
    shank = paper_robot().geometry.shank[0]
    slipped = joints.copy()
    slip = np.clip((np.arange(len(joints)) - 500) / 100, 0.0, 1.0) * 0.04 / shank
    slipped[:, 2] += slip
    slipped[:, 14] += np.gradient(slip, DT)
    found = estimate(motion, imu, slipped)
    assert found.slip[500:620, 0].max() == 1.0 and found.slip[:, 1:].max() == 0.0
    assert np.abs(found.position - motion.position).max() < 3e-3
    assert found.slip[-1, 0] == 0.0  # firm again, where it stands now


@pytest.mark.parametrize("drop", [0.02, 0.2])
def test_contacts_may_chatter(drop: float) -> None:
    """Flags that fail in some ticks cost next to nothing."""
    motion = crawl(2)
    imu, joints, _ = readings(motion)
    fails = np.random.default_rng(1).random(motion.contacts.shape) < drop
    found = estimate(motion, imu, joints, contacts=np.where(fails, 0.0, motion.contacts))
    assert np.abs(found.position - motion.position).max() < 2e-3


@pytest.mark.parametrize(("of_joints", "of_contacts"), [(2, 0), (0, 5), (2, 5), (2, 2)])
def test_late_sensors_cost_no_way(of_joints: int, of_contacts: int) -> None:
    """Joints 4 ms, contacts 10 ms behind the IMU, at up to 0.6 m/s: at most 1 % of the way."""
    motion = crawl(2)
    imu, joints, _ = readings(motion)
    tick = np.arange(len(imu))
    found = estimate(
        motion,
        imu,
        joints[np.maximum(tick - of_joints, 0)],
        contacts=motion.contacts[np.maximum(tick - of_contacts, 0)],
    )
    error = np.linalg.norm(found.position[-1] - motion.position[-1])
    assert error < 0.01 * np.linalg.norm(motion.position[-1] - motion.position[0])


def test_level_ground_shows_the_tilt() -> None:
    """Where the start is known to be level, an accelerometer's bias does not tilt the estimate."""
    motion = stand()
    imu, joints, _ = readings(motion, imu_noise=replace(IDEAL_IMU, accel_turn_on=0.06), seed=1)
    blind, told = (
        angle_between(
            estimate(motion, imu, joints, settings=EstimatorSettings(level_start=s)).rotation,
            motion.rotation,
        )[-1]
        for s in (0.0, 1e-3)
    )
    assert blind > 2e-3 and told < 0.2 * blind


def test_robot_in_the_air_goes_on_by_the_imu() -> None:
    """Without a foot for 0.3 s the state is integrated, and known less and less."""
    motion = stand()
    imu, joints, _ = readings(motion)
    contacts = motion.contacts.copy()
    contacts[500:650] = 0.0
    found = estimate(motion, imu, joints, contacts=contacts)
    np.testing.assert_allclose(found.position, motion.position, atol=1e-4)
    assert found.deviation[649, 3] > 2.0 * found.deviation[499, 3]
    assert found.deviation[-1, 3] < found.deviation[649, 3]


def test_readings_that_fail_do_not_spoil_the_rest() -> None:
    """The IMU silent for 20 ms, the joints for 50 ms, in a stride: found again within 5 mm."""
    motion = crawl(2)
    imu, joints, _ = readings(motion)
    imu[800:810], joints[1300:1325] = np.nan, np.nan
    found = estimate(motion, imu, joints)
    assert not found.healthy[800:810].any() and not found.healthy[1300:1325].any()
    assert found.healthy[900:1300].all() and found.healthy[-200:].all()
    assert np.abs(found.position - motion.position).max() < 0.01
    assert np.abs(found.velocity[-1] - motion.velocity[-1]).max() < 5e-3


ON_MAP = EstimatorSettings(foot_sink=0.0015, map_height=0.005, initial_position=0.01)


def top(height: float, *, half: float = 100.0, gradient: float = 0.0) -> np.ndarray:
    """A map of one square about W's origin, as `box_tops` gives it."""
    return np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half, height, gradient]])


@pytest.mark.parametrize("offset", [0.008, -0.008])
def test_height_is_the_maps_where_feet_are_set_down(offset: float) -> None:
    """Put down 8 mm too high or too low in its own belief, the robot finds its height by its map.

    Without a map nothing shows it. Place and heading stay as they were: a level map does not tell
    them.
    """
    motion = crawl(6)
    imu, joints, _ = readings(motion)
    start = motion.position[0] + [0.0, 0.0, offset]
    height = float(motion.feet[0, 0, 2])  # of points that stand on the ground
    blind = estimate(motion, imu, joints, settings=ON_MAP, p_WB=start)
    told = estimate(motion, imu, joints, settings=ON_MAP, p_WB=start, tops=top(height))
    assert abs(blind.position[-1, 2] - motion.position[-1, 2]) > 0.95 * abs(offset)
    assert abs(told.position[-1, 2] - motion.position[-1, 2]) < 0.2 * abs(offset)
    assert np.abs(told.position[-1, :2] - motion.position[-1, :2]).max() < 2e-3
    assert told.deviation[-1, 8] < blind.deviation[-1, 8]


@pytest.mark.parametrize(
    "tops",
    [
        top(0.0, half=1e-3),  # nowhere under a foot
        top(0.0, gradient=0.01),  # a slope
        top(-1.0),  # farther off than any tread
    ],
    ids=["off the map", "slope", "another floor"],
)
def test_a_map_that_cannot_be_meant_is_not_counted_on(tops: np.ndarray) -> None:
    """Off the map, on a slope, or a metre off, the estimate is that without a map, to the bit."""
    motion = crawl(2)
    imu, joints, _ = readings(motion)
    tops = tops.copy()
    tops[0, 8] += motion.feet[0, 0, 2]
    blind = estimate(motion, imu, joints, settings=ON_MAP)
    told = estimate(motion, imu, joints, settings=ON_MAP, tops=tops)
    np.testing.assert_array_equal(told.position, blind.position)


def edges_ahead(motion: Motion, step: float) -> np.ndarray:
    """A level map on which the ground steps 10 mm ahead of each place where a foot ever is."""
    height = float(motion.feet[0, 0, 2])
    landed = np.unique(motion.feet[motion.contacts > 0.5][:, 0].round(6))
    steps = [[1.0, 0.0, 0.0, 1.0, x + 0.03, 0.0, 0.02, 100.0, height + step, 0.0] for x in landed]
    return np.concatenate([top(height), np.array(steps)])


def test_the_map_is_not_asked_where_two_heights_are_possible() -> None:
    """A curb of 5 mm within 20 mm of a foot: which side it is on its height does not tell."""
    motion = crawl(2)
    imu, joints, _ = readings(motion)
    blind = estimate(motion, imu, joints, settings=ON_MAP)
    told = estimate(motion, imu, joints, settings=ON_MAP, tops=edges_ahead(motion, 0.005))
    np.testing.assert_array_equal(told.position, blind.position)


@pytest.mark.parametrize("offset", [0.008, -0.008])
def test_beside_a_riser_a_foot_is_on_the_tread_that_its_height_is_near(offset: float) -> None:
    """With 0.1 m between treads, an edge close by does not keep the map's height from counting."""
    motion = crawl(6)
    imu, joints, _ = readings(motion)
    start = motion.position[0] + [0.0, 0.0, offset]
    tops = edges_ahead(motion, 0.1)
    told = estimate(motion, imu, joints, settings=ON_MAP, p_WB=start, tops=tops)
    assert abs(told.position[-1, 2] - motion.position[-1, 2]) < 0.2 * abs(offset)


def test_the_maps_heights_leave_the_attitude_alone() -> None:
    """Each foot gives by a millimetre: the height is the map's, the attitude not.

    Without a map the robot believes that it rises by what its feet give. A map must not make a
    pitch of that: attitude is what it is without one.
    """
    motion = crawl(6, sink=0.002)
    imu, joints, _ = readings(motion, **NOISY, seed=3)
    blind = estimate(motion, imu, joints, settings=ON_MAP)
    told = estimate(motion, imu, joints, settings=ON_MAP, tops=top(float(motion.feet[0, 0, 2])))
    rise = blind.position[-1, 2] - motion.position[-1, 2]
    assert rise > 0.005
    assert abs(told.position[-1, 2] - motion.position[-1, 2]) < 0.6 * rise
    assert angle_between(told.rotation, blind.rotation).max() < 1e-7
