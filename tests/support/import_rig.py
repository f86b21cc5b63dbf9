"""What tests of the importer share: a robot's file compared with its normal form."""

import atexit
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant

from drake_quad.common import FloatArray
from drake_quad.robot.importer.parse import grow_tree, parse
from drake_quad.robot.importer.pipeline import (
    MAPPING,
    collision_shapes,
    make_mapping,
    normal_robot,
    write_robot,
)
from drake_quad.robot.importer.robot_source import find_source
from drake_quad.robot.loader import MakeModelPlant


@dataclass(frozen=True)
class Dynamics:
    """Of one robot in one state: its mass, centre of mass in the world and mass matrix.

    The matrix is by base (angular velocity, velocity of B's origin, in W) and joints of the normal
    form, in their order there.
    """

    mass: float
    com: FloatArray
    matrix: FloatArray


def write_normal(model: str, folder: Path) -> tuple[Path, dict[str, Any]]:
    """The normal form of a robot, written into `folder` without pictures, and its mapping."""
    given = find_source(model)
    with parse(given.found) as parsed:
        robot = normal_robot(parsed, given)
        collision, _ = collision_shapes(robot)
    urdf = folder / "normal.urdf"
    notes = write_robot(urdf, robot, collision, {}, comment="a test's", source=model)
    mapping = make_mapping(robot, [*robot.notes, *notes], source=model)
    (folder / MAPPING).write_text(yaml.safe_dump(mapping))
    return urdf, mapping


@cache
def normal_by_name(name: str) -> tuple[Path, dict[str, Any]]:
    """The same of a robot that people know, made once for all tests; nobody changes it."""
    folder = TemporaryDirectory()
    atexit.register(folder.cleanup)
    return write_normal(name, Path(folder.name))


def compare(model: str, folder: Path | None, rng: np.random.Generator) -> tuple[Dynamics, Dynamics]:
    """The dynamics of a robot by its own file, and by its normal form, in one random state.

    Both hold the same base pose and joint angles, told in the terms of each. Drives count in
    neither: their inertia is in the normal form alone. Without a `folder` it is a robot by name.
    """
    given = find_source(model)
    urdf, mapping = write_normal(model, folder) if folder else normal_by_name(model)
    q = {name: rng.uniform(-1.0, 1.0) for name in mapping["joints"]}
    X_WB = RigidTransform(
        RotationMatrix(_random_rotation(rng)), np.asarray(rng.uniform(-1.0, 1.0, 3))
    )
    made = _normal_dynamics(MakeModelPlant(str(urdf)), mapping, q, X_WB)
    with parse(given.found) as parsed:
        own = _own_dynamics(parsed.plant, mapping, q, X_WB, parsed.cleaned.reference)
    return own, made


def _normal_dynamics(
    plant: MultibodyPlant, mapping: dict[str, Any], q: dict[str, float], X_WB: RigidTransform
) -> Dynamics:
    context = plant.CreateDefaultContext()
    plant.SetFloatingBaseBodyPoseInWorldFrame(
        context, plant.GetBodyByName(mapping["trunk"]["link"]), X_WB
    )
    for name, angle in q.items():
        plant.GetJointByName(name).set_angle(context, angle)
    M = np.array(plant.CalcMassMatrix(context))
    for index in plant.GetJointActuatorIndices():
        drive = plant.get_joint_actuator(index)
        v = drive.joint().velocity_start()
        M[v, v] -= drive.default_gear_ratio() ** 2 * drive.default_rotor_inertia()
    base = list(range(6))
    order = base + [plant.GetJointByName(name).velocity_start() for name in q]
    com = plant.CalcCenterOfMassPositionInWorld(context)
    return Dynamics(plant.CalcTotalMass(context), np.array(com), M[np.ix_(order, order)])


def _own_dynamics(
    plant: MultibodyPlant,
    mapping: dict[str, Any],
    q: dict[str, float],
    X_WB: RigidTransform,
    reference: dict[str, float],
) -> Dynamics:
    tree = grow_tree(plant)
    assert not tree.others  # what is no robot's would count here
    root = tree.body(tree.root)
    yaw = np.deg2rad(mapping["trunk"]["yaw_TB_deg"])
    X_TB = RigidTransform(RotationMatrix.MakeZRotation(yaw), mapping["trunk"]["p_TB"])
    X_WT = X_WB @ X_TB.inverse()
    context = plant.CreateDefaultContext()
    plant.SetFloatingBaseBodyPoseInWorldFrame(context, root, X_WT)
    positions = np.array(plant.GetPositions(context))
    columns = np.zeros((plant.num_velocities(), 6 + len(q)))
    columns[0:3, 0:3] = columns[3:6, 3:6] = np.eye(3)
    r = X_WT.translation() - X_WB.translation()
    # v_WTo = v_WBo + w x r
    columns[3:6, 0:3] = -np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    for body in tree.below(tree.root)[1:]:
        joint = tree.joint_to[body]
        if joint.num_velocities() == 0:
            continue
        if joint.name() in q:
            told = mapping["joints"][joint.name()]
            positions[joint.position_start()] = told["sign"] * (q[joint.name()] + told["turn"])
            columns[joint.velocity_start(), 6 + list(q).index(joint.name())] = told["sign"]
        else:
            low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
            angle = reference.get(joint.name(), np.clip(0.0, low, high))
            positions[joint.position_start()] = angle
    plant.SetPositions(context, positions)
    com = plant.CalcCenterOfMassPositionInWorld(context)
    M = columns.T @ plant.CalcMassMatrix(context) @ columns
    return Dynamics(plant.CalcTotalMass(context), np.array(com), M)


def _random_rotation(rng: np.random.Generator) -> FloatArray:
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return np.asarray(Q if np.linalg.det(Q) > 0 else -Q)


def write(folder: Path, text: str, name: str = "robot.urdf") -> str:
    """Writes a robot's file and returns its path."""
    path = folder / name
    path.write_text(text)
    return str(path)
