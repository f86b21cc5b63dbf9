"""The monitor reads what the contact solver found: bearing feet, their forces, and the rest."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from rig import (
    GRAVITY,
    URL,
    feet_of,
    flat_course,
    paper_robot,
    read,
    stand_plan,
    state_from_joints,
    state_of,
)

from drake_quad.common import FloatArray
from drake_quad.robot.legs import Leg
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.state import StateLayout, make_layout
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet
from drake_quad.terrain.drake_geometry import AddCourse

ROBOT_WEIGHT = 60.0 * GRAVITY
MODEL = Path(__file__).parents[2] / "models" / URL.rpartition("/")[2]


@dataclass
class Rig:
    """The robot on a floor, its joints held by the plant's own PD, and the monitor."""

    diagram: Diagram
    plant: MultibodyPlant
    monitor: ContactMonitor
    layout: StateLayout
    names: dict[str, object]


@cache
def rig(url: str = URL) -> Rig:
    """Of the shipped robot, or of one like it."""
    builder = DiagramBuilder()
    config = MultibodyPlantConfig(
        time_step=0.001, contact_model="point", discrete_contact_approximation="lagged"
    )
    plant, scene_graph = AddMultibodyPlant(config, builder)
    instance = AddRobot(plant, url)
    AddCourse(plant, flat_course(), friction=0.8)
    plant.Finalize()
    for index in plant.GetJointActuatorIndices(instance):
        plant.get_joint_actuator(index).set_controller_gains(PdControllerGains(p=4000.0, d=160.0))
    inspector = scene_graph.model_inspector()
    names = {g: inspector.GetName(g) for g in inspector.GetAllGeometryIds()}
    monitor = builder.AddSystem(
        ContactMonitor(
            plant=plant,
            foot_geometries=find_feet(plant, paper_robot(), names),
            robot=paper_robot(),
            period=0.005,
        )
    )
    builder.Connect(
        plant.get_contact_results_output_port(), monitor.GetInputPort("contact_results")
    )
    builder.ExportInput(plant.get_desired_state_input_port(instance), "desired")
    layout = make_layout(plant, paper_robot())
    return Rig(builder.Build(), plant, monitor, layout, {n: g for g, n in names.items()})


class Scene:
    """One simulation of the rig, from a state, with the joints held where they are then."""

    def __init__(self, state: FloatArray, url: str = URL) -> None:
        self.rig = rig(url)
        self.simulator = Simulator(self.rig.diagram)
        self.context: Context = self.simulator.get_mutable_context()
        self.rig.plant.SetPositionsAndVelocities(
            self.rig.plant.GetMyMutableContextFromRoot(self.context), state
        )
        layout = self.rig.layout
        held = state[layout.q_joints][np.argsort(layout.actuators)]
        self.rig.diagram.GetInputPort("desired").FixValue(
            self.context, np.concatenate([held, np.zeros(12)])
        )

    def run(self, seconds: float) -> "Scene":
        """Lets simulated time pass."""
        self.simulator.AdvanceTo(self.context.get_time() + seconds)
        return self

    def read(self, port: str) -> FloatArray:
        """A vector output of the monitor."""
        return read(self.rig.monitor, self.rig.monitor.GetMyContextFromRoot(self.context), port)

    @property
    def state(self) -> FloatArray:
        """[q; v] now."""
        context = self.rig.plant.GetMyContextFromRoot(self.context)
        return np.array(self.rig.plant.GetPositionsAndVelocities(context))


def standing_state(height: float = 0.0) -> FloatArray:
    """The robot's first stance, so much above the ground [m]."""
    stance = stand_plan().end
    body, feet = np.array(stance.body), np.array(stance.feet)
    body[2] += height
    feet[:, 2] += height
    return state_of(body, feet, layout=rig().layout)


@cache
def settled() -> Scene:
    """Dropped from 2 cm, four seconds later."""
    return Scene(standing_state(0.02)).run(4.0)


def test_feet_of_a_standing_robot_bear_its_weight() -> None:
    """In equilibrium all four bear; their forces add up to the weight, and point up."""
    assert settled().read("contact_state_measured").tolist() == [1.0] * 4
    force = settled().read("foot_force_measured").reshape(4, 3)
    np.testing.assert_allclose(force.sum(axis=0), [0.0, 0.0, ROBOT_WEIGHT], atol=0.5)
    assert np.all(force[:, 2] > 50.0)


def test_forces_act_where_the_feet_stand() -> None:
    """Each contact is below its foot's centre, at the ground; nothing slides."""
    position = settled().read("foot_contact_position").reshape(4, 3)
    np.testing.assert_allclose(position[:, :2], feet_of(settled().state)[:, :2], atol=2e-3)
    np.testing.assert_allclose(position[:, 2], 0.0, atol=2e-3)
    assert np.all(settled().read("foot_slip_speed") < 1e-3)


def test_forces_balance_about_the_centre_of_mass() -> None:
    """What is read is what holds the robot: no net moment in equilibrium."""
    scene = settled()
    plant = scene.rig.plant
    com = plant.CalcCenterOfMassPositionInWorld(
        plant.GetMyContextFromRoot(scene.context), [plant.GetModelInstanceByName("paper_quadruped")]
    )
    force = scene.read("foot_force_measured").reshape(4, 3)
    arms = scene.read("foot_contact_position").reshape(4, 3) - com
    np.testing.assert_allclose(np.cross(arms, force).sum(axis=0), 0.0, atol=1.0)


def test_only_feet_touch_the_ground_in_a_stance() -> None:
    """Nothing else is counted, and the greatest force of nothing is none."""
    assert settled().read("nonfoot_contact").tolist() == [0.0, 0.0]


def test_nobody_bears_in_the_air() -> None:
    """A robot that falls touches nothing, and no force is made up."""
    scene = Scene(standing_state(0.5)).run(0.1)
    assert scene.read("contact_state_measured").tolist() == [0.0] * 4
    assert np.all(scene.read("foot_force_measured") == 0.0)
    assert np.all(scene.read("nonfoot_contact") == 0.0)


def test_place_of_a_foot_that_is_lifted_is_the_last_known() -> None:
    """As its knee bends up the foot lets go; where it stood stays where it was."""
    scene = Scene(standing_state()).run(0.3)
    before = scene.read("foot_contact_position").reshape(4, 3)
    layout, held = scene.rig.layout, scene.state[scene.rig.layout.q_joints]
    held[2] -= 0.5  # the front left knee
    desired = np.concatenate([held[np.argsort(layout.actuators)], np.zeros(12)])
    scene.rig.diagram.GetInputPort("desired").FixValue(scene.context, desired)
    scene.run(0.2)
    assert scene.read("contact_state_measured")[0] == 0.0
    after = scene.read("foot_contact_position").reshape(4, 3)
    np.testing.assert_allclose(after[0], before[0], atol=0.02)


@pytest.mark.parametrize("lifted", [0, 3])
def test_lifted_foot_does_not_bear(lifted: int) -> None:
    """A foot a hand above the ground is told from those that stand."""
    stance = stand_plan().end
    feet = np.array(stance.feet)
    feet[lifted, 2] += 0.1
    scene = Scene(state_of(stance.body, feet, layout=rig().layout)).run(0.1)
    bearing = scene.read("contact_state_measured")
    assert bearing[lifted] == 0.0 and bearing.sum() >= 2.0
    force = scene.read("foot_force_measured").reshape(4, 3)
    np.testing.assert_array_equal(force[lifted], 0.0)


def test_trunk_on_the_ground_is_a_contact_of_no_foot() -> None:
    """With its legs folded up the robot lies on its trunk, and that is no foot's force."""
    q = np.tile([0.0, 1.9, -2.7], (4, 1))
    scene = Scene(state_from_joints(np.array([2.0, 0.0, 0.1, 0.0, 0.0]), q, layout=rig().layout))
    scene.run(0.5)
    count, force = scene.read("nonfoot_contact")
    assert count >= 1.0 and force > 0.1 * ROBOT_WEIGHT
    feet = scene.read("foot_force_measured").reshape(4, 3)[:, 2]
    assert feet.sum() < 0.9 * ROBOT_WEIGHT


def test_foot_against_foot_bears_nothing() -> None:
    """Two feet that meet in the air push each other: neither bears, and it counts as no foot's."""
    stance = stand_plan().end
    body, feet = np.array(stance.body), np.array(stance.feet)
    body[2] += 0.5
    feet[:, 2] += 0.5
    middle = 0.5 * (feet[0] + feet[2])
    apart = np.array([0.8 * paper_robot().foot_radius, 0.0, 0.0])
    feet[0], feet[2] = middle + apart, middle - apart
    scene = Scene(state_of(body, feet, layout=rig().layout)).run(0.011)
    count, force = scene.read("nonfoot_contact")
    assert count == 1.0 and force > 1.0
    assert scene.read("contact_state_measured").tolist() == [0.0] * 4
    assert np.all(scene.read("foot_force_measured") == 0.0)


def test_foot_against_the_trunk_bears_nothing(tmp_path: Path) -> None:
    """A foot that touches the robot's own trunk, in the air, is no foot that stands.

    It would widen the polygon in which the centre of mass has to be. The robot is the shipped one
    with a trunk that hangs down to its feet.
    """
    text = MODEL.read_text(encoding="utf-8")
    box = '<collision name="trunk"><origin xyz="0 0 0.02"/><geometry><box size="0.86 0.26 0.16"/>'
    deep = '<collision name="trunk"><origin xyz="0 0 -0.2"/><geometry><box size="0.6 0.06 0.6"/>'
    assert box in text
    file = tmp_path / "deep.urdf"
    file.write_text(text.replace(box, deep), encoding="utf-8")
    stance = stand_plan().end
    body, feet = np.array(stance.body), np.array(stance.feet)
    body[2] += 0.5
    feet[:, 2] += 0.5
    radius = paper_robot().foot_radius
    feet[0] = body[:3] + np.array([0.2, 0.03 + 0.8 * radius, -0.48])
    scene = Scene(state_of(body, feet, layout=rig().layout), str(file)).run(0.011)
    count, force = scene.read("nonfoot_contact")
    assert count >= 1.0 and force > 1.0
    assert scene.read("contact_state_measured").tolist() == [0.0] * 4
    assert np.all(scene.read("foot_force_measured") == 0.0)


@pytest.mark.parametrize("leg", ["FL", "FR"])  # rear thighs do not reach it within their limits
def test_thigh_against_the_trunk_is_a_contact_of_no_foot(leg: str) -> None:
    """A thigh that is drawn up and in meets the trunk in the air; nothing filters that away."""
    q = np.tile([0.0, 0.6, -1.2], (4, 1))
    row = [member.short for member in Leg].index(leg)
    outward = 1.0 if leg.endswith("L") else -1.0
    q[row] = [outward, 1.85, -1.2]  # the thigh points up and in
    scene = Scene(state_from_joints(np.array([2.0, 0.0, 2.0, 0.0, 0.0]), q, layout=rig().layout))
    scene.run(0.002)
    results = scene.rig.plant.get_contact_results_output_port().Eval(
        scene.rig.plant.GetMyContextFromRoot(scene.context)
    )
    pairs = [results.point_pair_contact_info(k) for k in range(results.num_point_pair_contacts())]
    bodies = {
        frozenset(scene.rig.plant.get_body(b).name() for b in (p.bodyA_index(), p.bodyB_index()))
        for p in pairs
    }
    assert frozenset({"trunk", f"{leg}_thigh"}) in bodies
    count, force = scene.read("nonfoot_contact")
    assert count >= 1.0 and force > 1.0


def test_sliding_foot_is_seen_to_slide() -> None:
    """Under a robot that is thrown forward the feet slip; under one at rest they do not."""
    state = standing_state()
    state[rig().layout.v_base + 3] = 2.0
    assert Scene(state).run(0.015).read("foot_slip_speed").max() > 0.5
    assert Scene(standing_state()).run(0.02).read("foot_slip_speed").max() < 0.05


def test_threshold_is_one_per_cent_of_the_weight_unless_told() -> None:
    """A foot that only just touches does not bear yet."""
    monitor = rig().monitor
    strict = ContactMonitor(
        plant=rig().plant,
        foot_geometries={},
        robot=paper_robot(),
        threshold=0.5 * ROBOT_WEIGHT,
    )
    assert monitor._threshold == pytest.approx(0.01 * ROBOT_WEIGHT, rel=1e-3)
    assert strict._threshold == 0.5 * ROBOT_WEIGHT


def test_feet_are_found_by_the_files_names() -> None:
    """Each foot's geometry has its leg's row; a plant without one is an error that names it."""
    robot, names = paper_robot(), rig().names
    by_id = {g: n for n, g in names.items()}
    found = find_feet(rig().plant, robot, by_id)  # type: ignore[arg-type]
    assert {by_id[g]: row for g, row in found.items()} == {
        name: row for row, name in enumerate(robot.foot_geometry)
    }
    by_id.pop(names[robot.foot_geometry[2]])
    with pytest.raises(KeyError, match="feet"):
        find_feet(rig().plant, robot, by_id)  # type: ignore[arg-type]


def test_sensors_are_held_and_the_rest_is_of_now() -> None:
    """A contact result reaches the controller's sensors by a tick alone, and the log at once."""
    monitor = rig().monitor
    for k in range(monitor.num_output_ports()):
        held = monitor.get_output_port(k).get_name() == "contact_state_measured"
        assert monitor.HasDirectFeedthrough(k) != held
