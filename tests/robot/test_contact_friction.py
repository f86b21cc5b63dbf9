"""Contact friction is what a scenario says: measured on feet that slide, in the plant of runs."""

import io
import xml.etree.ElementTree as ET
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from rich.console import Console
from rig import paper_robot

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.feasibility.inspect_robot import describe_robot, print_robot
from drake_quad.planning.motion_plan import Stance
from drake_quad.robot.importer.raw_robot import DROPPED
from drake_quad.robot.importer.sanitize import Cleaned, read_friction
from drake_quad.robot.importer.sources import PACKAGES, root_of
from drake_quad.robot.kinematics import solve_legs
from drake_quad.robot.loader import AddRobot, load_robot
from drake_quad.robot.model import RobotModel, contact_friction
from drake_quad.scenario.config import SimulationConfig
from drake_quad.systems.contact_monitor import ContactMonitor, find_feet
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.drake_geometry import AddCourse, SetContactFriction, SetHydroelastic
from drake_quad.terrain.elements import Element

SPEED = 1.0  # [m/s] at which the robot is dragged ahead
SETTLED, DRAGGED = 0.3, 0.6  # [s] when its feet have sunk in, and how long it is dragged
SAID = (0.05, 0.1, 0.15, 0.3, 0.5, 0.8, 1.0, 1.2)
SAID_OF_NAMED = (0.05, 0.4, 1.2)
NAMED = [f"{p.name}:{name}" for p in PACKAGES if root_of(p) is not None for name in p.robots]


pytestmark = pytest.mark.usefixtures("own_cache")


@cache
def floor(foot_radius: float) -> Course:
    return build_course([Element("floor", length=8.0)], foot_radius=foot_radius)


def stance_of(robot: RobotModel) -> Stance:
    """On level ground, feet below the hip pitch axes, at the first height that the legs take."""
    g = robot.geometry
    axes = g.p_BH + g.p_HP
    for share in np.linspace(0.6, 0.95, 15):
        feet = axes.copy()
        feet[:, 2] = axes[:, 2].mean() - share * g.reach.min()
        q, excess = solve_legs(g, feet)
        q = q.reshape(12)
        if excess.max() == 0.0 and np.all((q >= robot.q_lower) & (q <= robot.q_upper)):
            up = robot.foot_radius - feet[0, 2]
            return Stance(np.array([2.0, 0.0, up, 0.0, 0.0]), feet + np.array([2.0, 0.0, up]))
    raise AssertionError(f"{robot.name} cannot stand")


def slide(
    robot: RobotModel, friction: float, *, config: MultibodyPlantConfig | None = None
) -> FloatArray:
    """|f_t| / f_n of the feet (4,) of a robot with locked joints that is dragged over the ground.

    A heavy cart without friction drags it, on which it is free to sink alone: so it neither tips
    nor hops, and the feet bear its weight.
    """
    config, builder = config or SimulationConfig().plant, DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(config, builder)
    instance, stance = AddRobot(plant, robot.url), stance_of(robot)
    AddCourse(plant, floor(robot.foot_radius), friction=friction)
    SetContactFriction(plant, scene_graph, instance, robot, friction)
    if config.contact_model != "point":
        SetHydroelastic(plant, scene_graph, instance, robot)
    cart = plant.AddRigidBody("cart", instance, SpatialInertia.SolidBoxWithMass(1e6, 1, 1, 1))
    ahead = plant.AddJoint(
        PrismaticJoint("ahead", plant.world_frame(), cart.body_frame(), [1.0, 0.0, 0.0])
    )
    trunk = plant.GetFrameByName(robot.trunk)
    sink = plant.AddJoint(PrismaticJoint("sink", cart.body_frame(), trunk, [0.0, 0.0, 1.0]))
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    names = {g: inspector.GetName(g) for g in inspector.GetAllGeometryIds()}
    feet = find_feet(plant, robot, names)
    monitor = builder.AddSystem(
        ContactMonitor(plant=plant, foot_geometries=feet, robot=robot, period=plant.time_step())
    )
    builder.Connect(
        plant.get_contact_results_output_port(), monitor.GetInputPort("contact_results")
    )
    if monitor.HasInputPort("plant_state"):
        builder.Connect(plant.get_state_output_port(), monitor.GetInputPort("plant_state"))
    logged = LogVectorOutput(
        monitor.GetOutputPort("foot_force_measured"), builder, plant.time_step()
    )
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    angles, _ = solve_legs(robot.geometry, stance.feet - stance.body[:3])
    for name, angle in zip(robot.joint_names, angles.reshape(12), strict=True):
        joint = plant.GetJointByName(name)
        joint.set_angle(context, angle)
        joint.Lock(context)
    ahead.set_translation(context, stance.body[0])
    ahead.set_translation_rate(context, SPEED)
    sink.set_translation(context, stance.body[2])
    simulator.AdvanceTo(DRAGGED)
    results = plant.get_contact_results_output_port().Eval(context)
    surfaces = 0 if config.contact_model == "point" else 4
    assert results.num_hydroelastic_contacts() == surfaces
    log = logged.FindLog(simulator.get_context())
    # A light robot goes on bouncing by a hair: what counts is the mean.
    force = log.data().T[log.sample_times() > SETTLED].reshape(-1, 4, 3)
    assert np.isclose(force[..., 2].sum(axis=1).mean(), GRAVITY * robot.mass, rtol=0.02)
    along, normal = np.hypot(force[..., 0], force[..., 1]), force[..., 2]
    np.testing.assert_allclose(
        monitor.GetOutputPort("foot_slip_speed").Eval(
            monitor.GetMyContextFromRoot(simulator.get_context())
        ),
        SPEED,
        rtol=0.02,
    )
    return np.asarray(along.mean(axis=0) / normal.mean(axis=0))


@pytest.mark.parametrize("friction", SAID)
def test_sliding_feet_have_the_friction_that_is_said(friction: float) -> None:
    """The shipped robot's: the force along the ground over the normal one, within 1 %."""
    np.testing.assert_allclose(slide(paper_robot(), friction), friction, rtol=0.01)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if "littledog" in n else [pytest.mark.slow]) for n in NAMED]
)
def test_robots_by_name_have_it_too(name: str) -> None:
    """Whatever their files say of friction for other simulators."""
    robot = load_robot(name)
    for friction in SAID_OF_NAMED:
        np.testing.assert_allclose(slide(robot, friction), friction, rtol=0.01)


@pytest.mark.parametrize("friction", [0.3, 0.8])
def test_hydroelastic_feet_have_it_too(friction: float) -> None:
    """Compliant feet on rigid ground: the monitor reads force and slip of contact surfaces."""
    config = SimulationConfig().plant
    config.contact_model = "hydroelastic_with_fallback"
    found = slide(paper_robot(), friction, config=config)
    np.testing.assert_allclose(found, friction, rtol=0.01)


def with_own_friction(folder: Path, *, importable: bool = False, shape: str = "foot") -> RobotModel:
    """The shipped robot, its left feet with a friction of their own; perhaps not in normal form."""
    text = resources.files("drake_quad_models").joinpath("paper_quadruped.urdf").read_text()
    tag = '<drake:proximity_properties><drake:mu_dynamic value="0.6"/></drake:proximity_properties>'
    for leg in ("FL", "RL"):
        foot = f'<collision name="{leg}_{shape}">'
        assert foot in text
        text = text.replace(foot, foot + tag)
    if importable:  # limits that make the importer read it
        text = text.replace('velocity="8.0"', "")
    file = folder / "own.urdf"
    file.write_text(text)
    return load_robot(str(file))


@pytest.mark.parametrize("importable", [False, True])
def test_a_foots_own_friction_is_combined_as_drake_does(importable: bool, tmp_path: Path) -> None:
    """2 · 0.6 · 0.3 / 0.9 where the file says 0.6, and 0.3 as said where it says nothing."""
    robot = with_own_friction(tmp_path, importable=importable)
    assert (Path(robot.url).parent.name != tmp_path.name) == importable
    np.testing.assert_array_equal(np.isnan(robot.foot_friction), [False, True, False, True])
    expected = contact_friction(robot, 0.3)
    np.testing.assert_allclose(expected, [0.4, 0.3, 0.4, 0.3], rtol=1e-12)
    np.testing.assert_allclose(slide(robot, 0.3), expected, rtol=0.01)


@pytest.mark.parametrize("importable", [False, True])
def test_a_friction_of_the_shank_is_none_of_the_foot(importable: bool, tmp_path: Path) -> None:
    """Of a link of which another shape states one, the foot has what is said, not Drake's 1.0."""
    robot = with_own_friction(tmp_path, importable=importable, shape="shank")
    np.testing.assert_array_equal(contact_friction(robot, 0.3), np.full(4, 0.3))
    np.testing.assert_allclose(slide(robot, 0.3), 0.3, rtol=0.01)


def test_the_shipped_robots_feet_state_no_friction() -> None:
    """So that contacts have what is said, to the bit."""
    np.testing.assert_array_equal(contact_friction(paper_robot(), 0.37), np.full(4, 0.37))


def test_inspect_shows_a_foots_own_friction(tmp_path: Path) -> None:
    """Which feet state one, and what comes of it; of a robot that states none, what is said."""
    console = Console(file=io.StringIO(), width=200)
    for robot in (with_own_friction(tmp_path), paper_robot()):
        print_robot(describe_robot(robot, source="x"), console)
    told = console.file.getvalue()  # type: ignore[attr-defined]
    assert "the file states FL 0.6, RL 0.6" in told and "at simulation.friction 0.8 0.686" in told
    assert "simulation.friction, for feet and ground" in told


@pytest.mark.parametrize(
    ("text", "noted"),
    [
        ('<mujoco><worldbody><geom friction="0.6 0.02 0.01"/></worldbody></mujoco>', "MuJoCo's"),
        ("<mujoco><worldbody><geom/></worldbody></mujoco>", ""),
        ('<robot><gazebo reference="x"><mu1>0.6</mu1></gazebo></robot>', "ODE's"),
        ("<sdf><model><link><collision><surface><friction><ode><mu>0.6</mu></ode></friction>"
         "</surface></collision></link></model></sdf>", "ODE's"),
    ],
)  # fmt: skip
def test_a_friction_for_another_simulator_is_noted(text: str, noted: str, tmp_path: Path) -> None:
    """It is combined otherwise there, so it is not used, and the robot's notes say so."""
    cleaned = Cleaned(ET.fromstring(text), tmp_path, tmp_path, "x")
    read_friction(cleaned)
    assert [note.kind for note in cleaned.notes] == ([DROPPED] if noted else [])
    assert all(noted in note.text for note in cleaned.notes) and not cleaned.frictional
