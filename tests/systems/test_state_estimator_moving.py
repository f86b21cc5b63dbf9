"""The estimator on a robot that moves, slides and is pushed: near the truth of the physics."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from estimation_rig import DT
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink
from rig import URL, feet_of, flat_course, model_layout, paper_robot, read, stand_plan, state_of

from drake_quad.common import FloatArray
from drake_quad.estimation.imu_units import IDEAL_IMU, MTI_300
from drake_quad.estimation.sensor_models import IDEAL_JOINTS, ODRI_DRIVE, SensorErrors
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.simulation.instruments import AddSensors
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet
from drake_quad.systems.state_estimator import StateEstimator
from drake_quad.terrain.drake_geometry import AddCourse


@dataclass
class Robot:
    """The robot on a floor, its joints held by the plant's PD, with sensors and estimator."""

    diagram: Diagram
    plant: MultibodyPlant
    estimator: StateEstimator
    layout: StateLayout
    logs: dict[str, VectorLogSink]


@cache
def robot(
    *, noisy: bool = False, seed: int = 1, friction: float = 0.8, rolls: bool = True,
    foot_give: float = 0.0, smaller: float = 0.0,
) -> Robot:  # fmt: skip
    builder = DiagramBuilder()
    config = MultibodyPlantConfig(
        time_step=0.001,
        contact_model="point",
        discrete_contact_approximation="lagged",
    )
    plant, scene_graph = AddMultibodyPlant(config, builder)
    instance = AddRobot(plant, URL)
    AddCourse(plant, flat_course(), friction=friction)
    plant.Finalize()
    for index in plant.GetJointActuatorIndices(instance):
        plant.get_joint_actuator(index).set_controller_gains(PdControllerGains(p=4000.0, d=160.0))
    layout, model = make_layout(plant, paper_robot()), paper_robot()
    model = replace(model, foot_radius=model.foot_radius - smaller)
    if not rolls:
        model = replace(model, foot_radius=0.0)
    inspector = scene_graph.model_inspector()
    names = {g: inspector.GetName(g) for g in inspector.GetAllGeometryIds()}
    monitor = builder.AddSystem(
        ContactMonitor(
            plant=plant,
            foot_geometries=find_feet(plant, paper_robot(), names),
            robot=paper_robot(),
            period=0.004,
        )
    )
    stance = stand_plan().end
    angles, _, _ = pose_robot(paper_robot(), stance.body[None], stance.feet[None])
    builder.Connect(
        plant.get_contact_results_output_port(), monitor.GetInputPort("contact_results")
    )
    of_imu, of_joints = np.random.default_rng(seed).spawn(2)
    senses = AddSensors(
        builder,
        plant.get_state_output_port(),
        layout=layout,
        errors=SensorErrors(
            imu=MTI_300 if noisy else IDEAL_IMU,
            joints=ODRI_DRIVE if noisy else IDEAL_JOINTS,
            imu_generator=of_imu,
            joint_generator=of_joints,
        ),
        period=DT,
    )
    estimator = builder.AddNamedSystem(
        "state_estimator",
        StateEstimator(
            robot=model,
            layout=model_layout(),
            p_WB=np.array(stance.body[:3]),
            yaw=float(stance.body[4]),
            pitch=float(stance.body[3]),
            q=angles.reshape(12),
            foot_give=foot_give,
        ),
    )
    senses["contact_state_measured"] = monitor.GetOutputPort("contact_state_measured")
    for name, port in senses.items():
        builder.Connect(port, estimator.GetInputPort(name))
    builder.ExportInput(plant.get_desired_state_input_port(instance), "desired")
    # Loggers see the state as it is when a tick begins.
    logs = {"truth": LogVectorOutput(plant.get_state_output_port(), builder, DT)}
    for name in ("robot_state_estimated", "foot_slip_estimated"):
        logs[name] = LogVectorOutput(estimator.GetOutputPort(name), builder, DT)
    return Robot(builder.Build(), plant, estimator, layout, logs)


class Stance:
    """One simulation: the robot stands at its start, its joints held as asked."""

    def __init__(self, parts: Robot) -> None:
        self.parts = parts
        self.simulator = Simulator(parts.diagram)
        self.context: Context = self.simulator.get_mutable_context()
        stance = stand_plan().end
        state = state_of(stance.body, stance.feet, layout=parts.layout)
        self.plant_context = parts.plant.GetMyMutableContextFromRoot(self.context)
        parts.plant.SetPositionsAndVelocities(self.plant_context, state)
        self.ask(np.array(stance.body))

    def ask(self, body: FloatArray) -> None:
        """Joint angles that put the base at `body` (5,) above the feet of the first stance."""
        q, _, _ = pose_robot(paper_robot(), body[None], stand_plan().end.feet[None])
        desired = q.reshape(12)[np.argsort(self.parts.layout.actuators)]
        self.parts.diagram.GetInputPort("desired").FixValue(
            self.context, np.concatenate([desired, np.zeros(12)])
        )

    def run(self, seconds: float, path: Callable[[float], FloatArray] | None = None) -> "Stance":
        """Lets time pass, the base asked to go along `path` (share of the time -> body)."""
        begin, n = round(self.context.get_time() / DT), round(seconds / DT)
        for k in range(1, n + 1):
            if path is not None:
                self.ask(path(k / n))
            self.simulator.AdvanceTo((begin + k + 0.25) * DT)
        return self

    def log(self, name: str) -> FloatArray:
        """A log, (N, size)."""
        return np.array(self.parts.logs[name].FindLog(self.context).data().T)

    @property
    def truth(self) -> FloatArray:
        """(N, 37) as the plant has it."""
        return self.log("truth")

    @property
    def estimates(self) -> FloatArray:
        """(N, 37) as the estimator has it, two ticks late: one the sensors', one its own."""
        return self.log("robot_state_estimated")

    @property
    def slips(self) -> FloatArray:
        """(N, 4)."""
        return self.log("foot_slip_estimated")

    def push(self, velocity: tuple[float, float, float]) -> "Stance":
        """Changes the base's velocity at once [m/s]."""
        x = np.array(self.parts.plant.GetPositionsAndVelocities(self.plant_context))
        j = self.parts.layout.v_base
        x[j + 3 : j + 6] += velocity
        self.parts.plant.SetPositionsAndVelocities(self.plant_context, x)
        return self

    def read(self, port: str) -> FloatArray:
        """An output of the estimator."""
        estimator = self.parts.estimator
        return read(estimator, estimator.GetMyContextFromRoot(self.context), port)

    def position_error(self) -> FloatArray:
        """Estimated less true position of the time it speaks of, (N, 3) [m]."""
        i = self.parts.layout.q_base
        return (self.estimates[2:] - self.truth[:-2])[:, i + 4 : i + 7]

    def velocity_error(self) -> FloatArray:
        """Estimated less true velocity, (N, 3) [m/s]."""
        j = self.parts.layout.v_base
        return (self.estimates[2:] - self.truth[:-2])[:, j + 3 : j + 6]


def along(axis: int, distance: float) -> Callable[[float], FloatArray]:
    """The base goes so far [m] along an axis of W, from rest to rest."""

    def path(share: float) -> FloatArray:
        body = np.array(stand_plan().end.body)
        body[axis] += distance * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        return body

    return path


def sink(depth: float) -> Callable[[float], FloatArray]:
    """The base goes down by `depth` [m]: every shank turns the same way, and its foot rolls."""
    return along(2, -depth)


def sway(distance: float) -> Callable[[float], FloatArray]:
    """The base goes to the left by `distance` [m]."""
    return along(1, distance)


def test_ideal_sensors_give_the_truth_of_a_simulated_robot() -> None:
    """It settles on its feet and bends its knees; position is right to 1 mm throughout."""
    stance = Stance(robot()).run(0.3).run(0.8, sink(0.2))
    assert np.abs(stance.position_error()).max() < 1e-3
    assert np.abs(stance.velocity_error()).max() < 0.01
    assert np.max(stance.slips) == 0.0


@pytest.mark.parametrize("sideways", [False, True])
def test_feet_roll(sideways: bool) -> None:
    """In a plant where feet roll, a filter that takes them for points is off by twice or more.

    Bending the knees rolls them along x, swaying the base along y. What is left then is ground
    that gives: load moves to one side, and those feet sink deeper.
    """
    path, axis = (sway(0.06), 1) if sideways else (sink(0.2), 0)
    right, wrong = (
        np.abs(Stance(robot(rolls=rolls)).run(0.3).run(0.8, path).position_error()[-1, axis])
        for rolls in (True, False)
    )
    assert wrong > 5e-4 and right < 0.5 * wrong


def test_a_foot_that_gives_rolls_as_a_smaller_one() -> None:
    """A filter that knows that feet give by 8 mm has the estimates of one for smaller feet.

    The plant's feet do not give, so it is off as the other is.
    """
    gives, smaller, right = (
        Stance(robot(foot_give=give, smaller=less)).run(0.2).run(0.5, sink(0.2)).estimates
        for give, less in ((0.008, 0.0), (0.0, 0.008), (0.0, 0.0))
    )
    assert np.array_equal(gives, smaller)
    assert np.abs(gives - right).max() > 1e-3


@pytest.mark.parametrize("seed", [1, 2])
def test_real_sensors_come_near_the_truth(seed: int) -> None:
    """With the noise of real units the base is known to 3 mm and 0.02 m/s rms."""
    stance = Stance(robot(noisy=True, seed=seed)).run(0.5).run(0.8, sink(0.1))
    assert np.abs(stance.position_error()).max() < 3e-3
    assert np.sqrt(np.mean(np.sum(stance.velocity_error() ** 2, axis=1))) < 0.02
    assert stance.read("estimator_healthy") == [1.0]


def test_push_is_felt_and_followed() -> None:
    """A push of 0.6 m/s is beyond the accelerometer's range; 40 ms later the speed is known."""
    stance = Stance(robot(noisy=True)).run(0.4).push((0.6, 0.0, 0.0)).run(0.5)
    assert np.abs(stance.velocity_error()[222:]).max() < 0.05
    assert np.abs(stance.position_error()).max() < 5e-3
    speed = stance.truth[200:, stance.parts.layout.v_base + 3]
    assert np.abs(speed).max() > 0.5  # or nothing was tried


def test_feet_that_slide_are_seen_to() -> None:
    """On ice a push makes the feet slide: flagged, and the estimate stays within the slide."""
    stance = Stance(robot(friction=0.1)).run(0.4).push((0.6, 0.0, 0.0)).run(0.6)
    slid = (
        stance.truth[-1][stance.parts.layout.q_base + 4]
        - stance.truth[200][stance.parts.layout.q_base + 4]
    )
    assert slid > 0.05
    assert np.max(stance.slips, axis=0).tolist() == [1.0] * 4
    assert np.abs(stance.position_error()[-1, 0]) < 0.8 * slid
    calm = Stance(robot()).run(0.4).push((0.3, 0.0, 0.0)).run(0.3)
    assert np.max(calm.slips) == 0.0


def test_one_foot_that_creeps_is_seen_to() -> None:
    """A wide sway unloads the right feet, and one creeps: it alone is flagged."""
    stance = Stance(robot()).run(0.3).run(0.8, sway(0.12))
    crept = np.abs(feet_of(stance.truth[-1])[:, 1] - feet_of(stance.truth[200])[:, 1])
    # The others' centres move by up to 4 mm, as their balls of 20 mm roll.
    assert crept[1] > 8e-3 > 5e-3 > max(crept[0], crept[2], crept[3])
    assert np.max(stance.slips, axis=0).tolist() == [0.0, 1.0, 0.0, 0.0]
    assert np.abs(stance.position_error()).max() < 2e-3


def test_same_seed_same_estimate_to_the_bit() -> None:
    """All randomness comes from the generator; another seed gives another run."""
    first, again = (Stance(robot(noisy=True)).run(0.2).estimates for _ in range(2))
    np.testing.assert_array_equal(first, again)
    robot.cache_clear()
    np.testing.assert_array_equal(first, Stance(robot(noisy=True)).run(0.2).estimates)
    other = Stance(robot(noisy=True, seed=2)).run(0.2).estimates
    assert np.abs(np.array(first) - np.array(other)).max() > 1e-5
