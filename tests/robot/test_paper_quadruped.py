"""The shipped robot is one that could be built, and that can do what the paper's has to."""

import itertools
import re
import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from rig import GRAVITY, URL, feet_of, model_layout, model_plant, paper_robot, state_from_joints

from drake_quad.common import FloatArray
from drake_quad.gait.workspace import Workspace
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.wrench_distribution import distribute_wrench
from drake_quad.robot.kinematics import calc_jacobians, solve_legs
from drake_quad.robot.loader import AddRobot
from drake_quad.stability.support_polygon import stability_margin

ROOT = Path(__file__).resolve().parents[2]
TABLE_I = Workspace(R_x=0.76, R_y=0.5, P_x=0.8, P_y=0.54)
# The body level, the slope of Table I's stairs (0.26) puts the ground under the foremost corner,
# 0.78 m ahead, 0.203 m above the mean, and under the rearmost as much below.
HALF_STROKE = 0.205  # [m]
SWING = 0.06  # [m] of clearance above the higher end
BODY_HEIGHT = PlanSettings().body_height


def box_corners(low: float, high: float) -> FloatArray:
    """Every combination of a box's corner and a height, for all legs at once, (n, 4, 3) in B."""
    offsets = [
        (x, y, z)
        for x, y, z in itertools.product(
            (-TABLE_I.R_x / 2, 0.0, TABLE_I.R_x / 2),
            (-TABLE_I.R_y / 2, 0.0, TABLE_I.R_y / 2),
            np.linspace(low, high, 12),
        )
    ]
    height = paper_robot().foot_radius - BODY_HEIGHT
    centres = np.column_stack([TABLE_I.centres, np.full(4, height)])
    return np.asarray(centres + np.array(offsets)[:, None])


def test_every_corner_of_table_ones_boxes_is_within_reach_and_limits() -> None:
    """All four legs get to all places of their boxes, over the heights of level climbing."""
    robot = paper_robot()
    q, excess = solve_legs(robot.geometry, box_corners(-HALF_STROKE, HALF_STROKE + SWING))
    assert excess.max() == 0.0
    angles = q.reshape(-1, 12)
    room = np.minimum(angles - robot.q_lower, robot.q_upper - angles)
    worst = np.unravel_index(np.argmin(room), room.shape)[1]
    assert room.min() > 0.0, f"{robot.joint_names[worst]} by {room.min():.3f} rad"


def test_robot_weighs_sixty_kilograms_and_its_legs_a_third() -> None:
    """The legs are no afterthought: a quarter of the mass at least, as in robots of this size."""
    robot = paper_robot()
    assert robot.mass == pytest.approx(60.0, abs=0.5)
    assert 0.25 <= robot.link_mass.sum() / robot.mass <= 0.5


def test_inertias_are_physical_and_rotors_have_one() -> None:
    """Every link's inertia is a real body's; every joint has rotor, gear and limits."""
    plant, robot = model_plant(), paper_robot()
    links = [plant.GetJointByName(name).child_body() for name in robot.joint_names]
    for body in (plant.GetBodyByName(robot.trunk), *links):
        inertia = body.default_spatial_inertia()
        assert inertia.get_mass() > 0.0 and inertia.IsPhysicallyValid(), body.name()
        about_com = inertia.Shift(inertia.get_com()).CalcRotationalInertia()
        moments = np.linalg.eigvalsh(about_com.CopyToFullMatrix3())
        assert moments[0] > 1e-4 and moments[2] <= moments[0] + moments[1] + 1e-12, body.name()
    for index in plant.GetJointActuatorIndices():
        actuator = plant.get_joint_actuator(index)
        assert actuator.default_rotor_inertia() > 0.0 and actuator.default_gear_ratio() > 1.0
        assert 0.0 < actuator.effort_limit() < 1000.0
        assert 0.0 < actuator.joint().velocity_upper_limits()[0] < 50.0
    assert np.all(robot.q_lower < robot.q_upper)


def test_left_and_right_are_alike() -> None:
    """Masses, centres of mass, lengths, limits and feet of the right are the left's mirrored."""
    robot = paper_robot()
    left, right = [0, 2], [1, 3]
    np.testing.assert_array_equal(robot.link_mass[left], robot.link_mass[right])
    np.testing.assert_array_equal(robot.link_com[left], robot.link_com[right] * [1, -1, 1])
    g = robot.geometry
    np.testing.assert_array_equal(g.p_BH[left], g.p_BH[right] * [1, -1, 1])
    np.testing.assert_array_equal(g.offset[left], -g.offset[right])
    for values in (g.thigh, g.shank, g.knee_sign):
        np.testing.assert_array_equal(values[left], values[right])
    for values in (robot.q_lower, robot.q_upper, robot.effort, robot.speed):
        by_leg = values.reshape(4, 3)
        np.testing.assert_array_equal(by_leg[left, 1:], by_leg[right, 1:])
    np.testing.assert_array_equal(robot.q_lower[[0, 6]], -robot.q_upper[[3, 9]])
    assert robot.trunk_com[1] == 0.0


def stances() -> list[FloatArray]:
    """Feet (4, 3) in B: each leg in a corner of its box, at heights of the stairs under it."""
    centres = np.column_stack([TABLE_I.centres, np.full(4, -BODY_HEIGHT)])
    found = []
    for corners in itertools.product(itertools.product((-0.38, 0.38), (-0.25, 0.25)), repeat=4):
        for slope in (-0.26, 0.0, 0.26):
            feet = centres + np.column_stack([np.array(corners), np.zeros(4)])
            feet[:, 2] += slope * feet[:, 0]
            found.append(feet)
    return found


def test_legs_can_hold_the_robot_in_the_worst_corners() -> None:
    """On four and on three feet, with a margin of 5 cm, no joint needs 85 % of its torque."""
    robot, plant, layout = paper_robot(), model_plant(), model_layout()
    context = plant.CreateDefaultContext()
    largest, tried = np.zeros(12), 0
    for feet in stances():
        q, excess = solve_legs(robot.geometry, feet)
        assert excess.max() == 0.0
        state = state_from_joints(np.zeros(5), q)
        plant.SetPositions(context, state[: layout.num_positions])
        com = plant.CalcCenterOfMassPositionInWorld(context)
        gravity = plant.CalcGravityGeneralizedForces(context)[
            layout.v_joints - layout.num_positions
        ]
        J = calc_jacobians(robot.geometry, q)
        for lifted in (None, 0, 1, 2, 3):
            load = [float(k != lifted) for k in range(4)]
            standing = [k for k in range(4) if k != lifted]
            if stability_margin(com[:2], feet[standing, :2]) < 0.05:
                continue
            arms = [tuple((p - com).tolist()) for p in feet]
            forces = distribute_wrench(
                (0.0, 0.0, robot.mass * GRAVITY), (0.0, 0.0, 0.0), arms, load
            )
            torque = -gravity - np.einsum("kij,ki->kj", J, np.array(forces)).ravel()
            largest, tried = np.maximum(largest, np.abs(torque)), tried + 1
    assert tried > 100
    worst = int(np.argmax(largest / robot.effort))
    assert np.all(largest < 0.85 * robot.effort), (
        f"{robot.joint_names[worst]} {largest[worst]:.0f} Nm"
    )


def test_geometry_is_what_the_file_says_in_the_plant() -> None:
    """The feet's spheres are the legs' ends: the plant's collision geometry is the model's."""
    robot = paper_robot()
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, URL)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    names = [inspector.GetName(g) for g in inspector.GetAllGeometryIds()]
    assert all(names.count(name) == 1 for name in robot.foot_geometry)
    state = state_from_joints(np.zeros(5), np.zeros((4, 3)))
    hips = robot.geometry.p_BH + np.outer(robot.geometry.offset, [0.0, 1.0, 0.0])
    np.testing.assert_allclose(feet_of(state), hips - np.outer(robot.geometry.reach, [0, 0, 1]))


def test_script_writes_the_shipped_file(tmp_path: Path) -> None:
    """scripts/make_paper_quadruped.py gives models/paper_quadruped.urdf, byte for byte."""
    (tmp_path / "scripts").mkdir()
    (tmp_path / "models").mkdir()
    script = tmp_path / "scripts" / "make_paper_quadruped.py"
    shutil.copy(ROOT / "scripts" / script.name, script)
    runpy.run_path(str(script))["main"]([])
    written = (tmp_path / "models" / "paper_quadruped.urdf").read_bytes()
    assert written == (ROOT / "models" / "paper_quadruped.urdf").read_bytes()


def test_script_writes_other_feet_to_another_file(tmp_path: Path) -> None:
    """`--foot-radius` changes the feet's balls and their tips; the shipped file stays as it is."""
    main = runpy.run_path(str(ROOT / "scripts" / "make_paper_quadruped.py"))["main"]
    shipped, out = ROOT / "models" / "paper_quadruped.urdf", tmp_path / "other.urdf"
    before = shipped.read_text()
    main(["--foot-radius", "0.03", "--out", str(out)])
    assert out.read_text() == before.replace('radius="0.02"', 'radius="0.03"')
    for refused in (["--foot-radius", "0.03"], ["--foot-radius", "nan", "--out", str(out)]):
        with pytest.raises(SystemExit):
            main(refused)
    assert shipped.read_text() == before


def test_drives_are_within_those_that_one_can_buy() -> None:
    """Torques and speeds are at most those of the Unitree B2's URDF, a robot of the same mass."""
    robot = paper_robot()
    assert robot.mass == pytest.approx(60.0)
    assert np.all(robot.effort.reshape(4, 3) <= [200.0, 200.0, 320.0])
    assert np.all(robot.speed.reshape(4, 3) <= [23.0, 23.0, 14.0])


def test_what_is_seen_of_hips_knees_and_head_can_be_touched() -> None:
    """Each of these has a collision shape as large as its picture, and feet are balls of 20 mm."""
    text = (ROOT / "models" / "paper_quadruped.urdf").read_text()
    for seen, touched in (("motor", "FL_motor"), ("knee", "FL_knee"), ("head", "head")):
        shapes = [
            re.search(rf'<{kind} name="{name}">.*?(<geometry>.*?</geometry>)', text).group(1)  # type: ignore[union-attr]
            for kind, name in (("visual", seen), ("collision", touched))
        ]
        assert shapes[0] == shapes[1]
    assert paper_robot().foot_radius == 0.02
