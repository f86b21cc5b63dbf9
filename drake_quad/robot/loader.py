"""Loads a robot: a file in, a RobotModel or a plant out, and the digest that tells robots apart."""

import logging
from contextlib import nullcontext, suppress
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from pathlib import Path

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody

from drake_quad.common import GRAVITY, read_only
from drake_quad.errors import MACHINE_FAULTS, InputError, MachineError, check_kind
from drake_quad.robot.from_plant import EXACT, IMPORTED, read_model
from drake_quad.robot.importer.leg_frames import THINNEST
from drake_quad.robot.importer.meshes import files_of_mesh
from drake_quad.robot.importer.normal_form import TOO_STRONG, beyond_turns
from drake_quad.robot.importer.overrides import Overrides
from drake_quad.robot.importer.parse import PARSER_ERRORS, parser_reason, quiet
from drake_quad.robot.importer.pipeline import MAPPING, import_robot
from drake_quad.robot.importer.robot_source import find_source
from drake_quad.robot.importer.sanitize import HEAVY
from drake_quad.robot.importer.sources import files_named_in
from drake_quad.robot.importer.spelling import check_spelling
from drake_quad.robot.importer.stated_friction import joint_friction, shapes_with_friction
from drake_quad.robot.importer.urdf_numbers import check_urdf
from drake_quad.robot.importer.xml_io import read_xml
from drake_quad.robot.model import RobotModel
from drake_quad.util.files import MOST_MESH, MOST_TEXT, check_given, user_path


def AddRobot(plant: MultibodyPlant, url: str) -> ModelInstanceIndex:
    """Parses the robot `url` into `plant`, in normal form.

    Args:
        plant: Not yet finalized.
        url: What `load_robot` takes; quickest is a RobotModel's `url`.

    Raises:
        InputError: If there is no such robot, or it cannot be brought into normal form.
        MachineError: If that is this machine's fault alone.
    """
    return _parse(plant, normal_form(url))


def MakeModelPlant(url: str) -> MultibodyPlant:
    """Returns a finalized plant with the robot alone, for kinematics and dynamics terms."""
    plant = MultibodyPlant(0.0)
    AddRobot(plant, url)
    plant.Finalize()
    return plant


def load_robot(url: str | Path) -> RobotModel:
    """Reads the robot `url`.

    Args:
        url: A URDF, SDF or MJCF (`package://...` or a path), a `.robot.yaml`, or a robot's name in
            one of the packages of the extra `robots`.

    Raises:
        InputError: If there is no such robot, or it is no quadruped with abduction-hip-knee legs.
    """
    check_kind(url, (str, Path), "robot", "must be a robot's name or file")
    url = str(url)
    file = normal_form(url)
    tolerance = IMPORTED if _is_imported(file) else EXACT
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    instance = _parse(plant, file)
    plant.Finalize()
    root = read_xml(find_source(file).found.path, url)
    camera = find_source(url).overrides.camera
    frictional = shapes_with_friction(root)
    robot = read_model(
        plant, scene_graph, instance, url=file, tolerance=tolerance, frictional=frictional
    )

    def refuse(field: str, value: object, remedy: str) -> InputError:
        return InputError(source=url, field=field, value=value, remedy=remedy)

    friction = joint_friction(root, refuse)
    values = [friction.get(name, 0.0) for name in robot.joint_names]
    return replace(robot, source=url, joint_friction=read_only(np.array(values)), camera=camera)


def normal_form(url: str) -> str:
    """The file to parse for the robot `url`: itself if in normal form already, or its import.

    Raises:
        InputError: If there is no such robot, or it cannot be brought into normal form.
        MachineError: If that is this machine's fault alone.
    """
    path = Path(url)

    def refuse(value: str, reason: str, kind: type[InputError] = InputError) -> InputError:
        remedy = f"cannot be read: {reason}"
        return kind(source=url, field="robot.model", value=value, remedy=remedy)

    try:
        given = find_source(url)
        path = given.found.path
        check_given(path, most=MOST_TEXT)
        for named in files_named_in(path):
            if named.is_dir():
                continue
            check_given(named, most=MOST_MESH)  # Drake's parser opens them, too
            with suppress(PermissionError):  # who may not read it does not read what it names
                for further in files_of_mesh(named):  # and its viewers these
                    check_given(further, most=MOST_MESH)
        stat = path.stat()
        if given.overrides == Overrides() and (
            _is_imported(str(path)) or _is_normal(str(path), stat.st_mtime_ns, stat.st_size)
        ):
            return url if "://" in url or user_path(url).is_file() else str(path)  # of a name
        return str(import_robot(given))
    except OSError as error:
        kind = MachineError if error.errno in MACHINE_FAULTS else InputError
        raise refuse(error.filename or str(path), error.strerror or str(error), kind) from None
    except UnicodeEncodeError:
        raise refuse(str(path), "its name, or a folder's, is no UTF-8; rename it") from None


def _is_imported(file: str) -> bool:
    """Whether the importer wrote the file."""
    return "://" not in file and (Path(file).parent / MAPPING).is_file()


BODIES, POSITIONS = 13, 19  # of a robot in normal form: a trunk that floats, and four legs


@lru_cache(maxsize=64)
def _is_normal(path: str, mtime: int, size: int) -> bool:
    """Whether a file, at a time and of a size, is in normal form just as it is.

    It is a URDF: of the other formats Drake's parser misses things that the importer does not.
    Trunk and legs are all that it has: of a welded or locked link planning would miss the mass.
    """
    if not path.endswith(".urdf"):
        return False
    with quiet(logging.WARNING) as warnings:  # the importer reports what is wrong
        try:
            root = read_xml(Path(path), path)
            check_spelling(root, path)  # the parser passes over it
            check_urdf(root, path)
            plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
            plant.RegisterAsSourceForSceneGraph(scene_graph)
            instance = _parse(plant, path)
            plant.Finalize()
            robot = read_model(plant, scene_graph, instance, url=path)
        except (InputError, *PARSER_ERRORS):
            return False
    has = len(plant.GetBodyIndices(instance)), plant.num_positions(instance)
    if has != (BODIES, POSITIONS) or root.find(".//mimic") is not None:
        return False  # the importer welds, locks and frees what there is beside the legs' joints
    if any(_is_point(plant.get_body(index)) for index in plant.GetBodyIndices(instance)):
        return False  # the importer reports it
    feet = robot.foot_radius - robot.foot_smaller
    if np.any(feet < THINNEST) or np.any(feet > 0.5 * robot.geometry.shank):
        return False  # it refuses such feet
    if not min(robot.trunk_mass, *robot.link_mass[:, 2]) > 0.0:
        return False  # and refuses a trunk or a shank without mass
    if any(
        "inertia" in line for line in warnings
    ):  # Drake puts another in the place of a wrong one
        return False
    strongest = TOO_STRONG * GRAVITY * robot.mass * robot.geometry.reach
    if np.any(robot.effort.reshape(4, 3) > strongest[:, None]):
        return False  # the importer takes another, and reports it
    if any(map(beyond_turns, robot.q_lower, robot.q_upper)):
        return False  # likewise
    limits = (robot.q_lower, robot.q_upper, robot.effort, robot.speed)
    return bool(np.all(np.isfinite(limits)) and np.all(robot.speed > 0.0))


def _is_point(body: RigidBody) -> bool:
    """Whether a body of more than a negligible mass has no inertia about its centre."""
    if not isinstance(body, RigidBody) or body.default_mass() < HEAVY:
        return False
    about = body.default_spatial_inertia().Shift(body.default_com())
    return bool(about.CalcRotationalInertia().Trace() <= 0.0)


def _parse(plant: MultibodyPlant, file: str) -> ModelInstanceIndex:
    """Parses one file into `plant`.

    Raises:
        InputError: If Drake's parser refuses it, or it holds more than one model.
    """

    def refuse(remedy: str) -> InputError:
        return InputError(source=file, field="robot.model", value=file, remedy=remedy)

    parser = Parser(plant)
    parser.package_map().AddPackageXml(
        str(resources.files("drake_quad_models").joinpath("package.xml"))
    )
    # Of a file that the importer wrote Drake would warn that it simulates no friction in joints.
    said = quiet() if _is_imported(file) else nullcontext()
    try:
        with said:
            if "://" in file:
                models = parser.AddModels(url=file)
            else:
                models = parser.AddModels(str(user_path(file).resolve()))
    except PARSER_ERRORS as error:
        raise refuse(f"cannot be read as a robot: {parser_reason(error, [], {})}") from None
    if len(models) != 1:
        raise refuse(f"holds {len(models)} models; give a file with one")
    instance: ModelInstanceIndex = models[0]
    return instance
