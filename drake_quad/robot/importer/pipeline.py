"""Imports any quadruped's file: from the file to a cached URDF in normal form."""

import hashlib
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from drake_quad.errors import InputError, MachineError
from drake_quad.robot.from_plant import IMPORTED, read_model
from drake_quad.robot.importer.collision import (
    between_hips,
    foot_shape,
    shank_shapes,
    thigh_shapes,
    thighs_inside_trunk,
    trunk_shapes,
)
from drake_quad.robot.importer.meshes import have_trimesh
from drake_quad.robot.importer.normal_form import NormalRobot, normalise
from drake_quad.robot.importer.output import make_urdf, write_visuals
from drake_quad.robot.importer.overrides import Overrides
from drake_quad.robot.importer.parse import PARSER_ERRORS, Parsed, parse, parser_reason, quiet
from drake_quad.robot.importer.raw_robot import APPROXIMATED, GeometryInstance, Note
from drake_quad.robot.importer.read_robot import read_robot
from drake_quad.robot.importer.robot_source import RobotSource
from drake_quad.robot.importer.sources import files_named_in
from drake_quad.util.files import CACHE_VARIABLE, MOST_TEXT, cache_directory, read_given


def check_overrides(robot: NormalRobot, overrides: Overrides, *, source: str) -> None:
    """Makes sure that each leg is where its name has it.

    Args:
        robot: The robot in normal form, by the overrides.
        overrides: The robot's overrides.
        source: Name of the robot as given.

    Raises:
        InputError: If not.
    """
    source = Path(source).name
    for leg in robot.legs if overrides.legs else ():
        names = [hinge.name for hinge in leg.raw.hinges]
        (given,) = (short for short, own in (overrides.legs or {}).items() if own == names)
        if given != leg.short:
            raise InputError(
                source=source,
                field=f"legs.{given}",
                value=names,
                remedy=f"by where their hips are these joints are {leg.short}'s: front is +x and "
                "left is +y of the trunk, unless forward_deg says otherwise",
            )


def verify_written(urdf: Path, source: str) -> None:
    """Reads a normal form that was just written, before it is kept.

    Args:
        urdf: The file.
        source: Name of the robot as given, for errors.

    Raises:
        InputError: If it is none after all.
    """
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    with quiet() as logged:
        try:
            instance = Parser(plant).AddModels(str(urdf))[0]
            plant.Finalize()
        except PARSER_ERRORS as error:
            raise InputError(
                source=source,
                field="robot.model",
                value=source,
                remedy="has no normal form that can be read: "
                + parser_reason(error, logged, {f"{urdf.parent}/": ""}),
            ) from None
        read_model(plant, scene_graph, instance, url=source, tolerance=IMPORTED)


def make_mapping(robot: NormalRobot, notes: list[Note], *, source: str) -> dict[str, Any]:
    """The mapping as plain data: angle in the file = sign * (angle in normal form + turn)."""
    return {
        "source": source,
        "angles": "angle in the file = sign * (angle here + turn) [rad]",
        "trunk": {
            "link": robot.trunk.name,
            "p_TB": [float(x) for x in robot.p_TB],
            "yaw_TB_deg": float(np.rad2deg(robot.yaw)),
        },
        "joints": {
            hinge.name: {
                "leg": leg.short,
                "role": role,
                "sign": int(leg.frames.sign[k]),
                "turn": float(leg.limits.turn[k]),
            }
            for leg in robot.legs
            for k, (hinge, role) in enumerate(
                zip(leg.raw.hinges, ("abduction", "hip", "knee"), strict=True)
            )
        },
        "notes": [{"kind": note.kind, "text": note.text} for note in notes],
    }


MAPPING = "drake_quad_mapping.yaml"  # beside every file that is written here


def robots_directory() -> Path:
    """Where imported robots are kept."""
    return cache_directory() / "robots"


def import_robot(given: RobotSource) -> Path:
    """The robot's URDF in normal form, made now or found in the cache.

    Raises:
        InputError: If it is no quadruped that can be brought into normal form.
        MachineError: If imported robots cannot be kept here.
    """
    key = _key(given)
    folder = robots_directory() / f"{given.found.name}-{key}"
    urdf = folder / f"{given.found.name}.urdf"
    if urdf.is_file():
        return urdf
    with _kept(given):
        folder.parent.mkdir(parents=True, exist_ok=True)
        place = tempfile.TemporaryDirectory(dir=folder.parent, prefix=".making_")
    with place as making:
        _make(given, Path(making) / folder.name)
        with _kept(given):
            try:
                (Path(making) / folder.name).replace(folder)
            except OSError:  # another process was quicker, or left half a folder
                if not urdf.is_file():
                    shutil.rmtree(folder, ignore_errors=True)
                    (Path(making) / folder.name).replace(folder)
    return urdf


@contextmanager
def _kept(given: RobotSource) -> Iterator[None]:
    """Says of a place where nothing can be written how to give another."""
    try:
        yield
    except OSError as error:
        raise MachineError(
            source=given.source,
            field=CACHE_VARIABLE,
            value=str(robots_directory()),
            remedy=f"imported robots cannot be kept there: {error.strerror or error}; "
            f"set {CACHE_VARIABLE} to another directory",
        ) from None


def _make(given: RobotSource, folder: Path) -> None:
    """Imports the robot into a new folder."""
    urdf = folder / f"{given.found.name}.urdf"
    with parse(given.found) as parsed:
        robot = normal_robot(parsed, given)
        collision, notes = collision_shapes(robot)
        with _kept(given):
            folder.mkdir()
            visual, more = write_visuals(robot, folder, collision)
            notes = list(dict.fromkeys([*parsed.cleaned.notes, *robot.notes, *notes, *more]))
            comment = f"Normal form of {given.found.path.name}, made by drake_quad; see {MAPPING}."
            notes += write_robot(
                urdf,
                robot,
                collision,
                visual,
                comment=comment.replace("--", "-"),
                source=given.source,
            )
            mapping = yaml.safe_dump(
                make_mapping(robot, notes, source=given.found.path.name), sort_keys=False
            )
            (folder / MAPPING).write_text(mapping, encoding="utf-8")


def write_robot(
    urdf: Path,
    robot: NormalRobot,
    collision: dict[str, list[GeometryInstance]],
    visual: dict[str, list[GeometryInstance]],
    *,
    comment: str,
    source: str,
) -> list[Note]:
    """Writes a robot's normal form, and reads it as every run will read it.

    Contacts of thighs with the trunk are left out of it where the two shapes overlap already as
    the robot stands.

    Args:
        urdf: The file to write.
        robot: What to write.
        collision: Shapes by link, in the link's frame.
        visual: Visual shapes; meshes as files relative to the URDF.
        comment: Text at the file's head.
        source: The robot's file, for errors.

    Returns:
        What is to be said of contacts that are left out.

    Raises:
        InputError: If the normal form cannot be read.
    """
    urdf.write_text(make_urdf(robot, collision, visual, comment=comment), encoding="utf-8")
    verify_written(urdf, source)
    inside = thighs_inside_trunk(urdf, robot)
    if not inside:
        return []
    text = make_urdf(robot, collision, visual, comment=comment, inside_trunk=inside)
    urdf.write_text(text, encoding="utf-8")
    told = (
        f"thighs of {', '.join(inside)} lie within the trunk's shape where the robot stands: "
        "their contacts with the trunk are not seen"
    )
    return [Note(APPROXIMATED, told)]


def normal_robot(parsed: Parsed, given: RobotSource) -> NormalRobot:
    """A parsed file's robot in normal form.

    Raises:
        InputError: If there is no quadruped in it that has one.
    """
    legs = given.overrides.legs
    raw = read_robot(
        parsed,
        source=given.source,
        name=given.found.name,
        legs=list(legs.values()) if legs else None,
    )
    robot = normalise(raw, given.overrides, source=given.source)
    check_overrides(robot, given.overrides, source=given.source)
    return robot


def collision_shapes(robot: NormalRobot) -> tuple[dict[str, list[GeometryInstance]], list[Note]]:
    """The collision shapes of every link in normal form, and what was made of meshes."""
    made = {robot.trunk.name: trunk_shapes(robot.trunk)}
    if not robot.trunk.collision and robot.trunk.shapeless:
        made[robot.trunk.name] = between_hips(robot.trunk)
    for leg in robot.legs:
        hip, thigh, shank = leg.links
        made[hip.name] = trunk_shapes(hip)
        made[thigh.name] = thigh_shapes(thigh)
        shapes, notes = shank_shapes(leg)
        made[shank.name] = ([*shapes, foot_shape(leg)], notes)
    return {name: shapes for name, (shapes, _) in made.items()}, [
        note for _, notes in made.values() for note in notes
    ]


def _key(given: RobotSource) -> str:
    """A digest of what the result depends on: the file, those that it names, its overrides."""
    what = (_version(), have_trimesh(), given.found.name, given.overrides)
    digest = hashlib.sha256(repr(what).encode())
    digest.update(str(given.found.path).encode())
    digest.update(read_given(given.found.path, most=MOST_TEXT))
    # A mesh's name, size and time stand for its contents: some have tens of megabytes.
    for path in files_named_in(given.found.path):
        stat = path.stat()
        digest.update(f"{path} {stat.st_size} {stat.st_mtime_ns}".encode())
    return digest.hexdigest()[:12]


@cache
def _version() -> str:
    """A digest of the importer itself: what another one wrote is not taken for this one's."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
