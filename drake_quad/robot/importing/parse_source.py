"""Reads a robot's file through Drake's parser, cleaned before."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_quad.errors import InputError
from drake_quad.robot.importing.clean_mjcf import clean_mjcf
from drake_quad.robot.importing.clean_sdf import clean_sdf, included_file
from drake_quad.robot.importing.clean_urdf import clean_urdf
from drake_quad.robot.importing.cleaned import Cleaned
from drake_quad.robot.importing.locate import Found
from drake_quad.robot.importing.misspelt import check_spelling
from drake_quad.robot.importing.parser_reason import parser_reason, quiet
from drake_quad.robot.importing.xml_numbers import COLON
from drake_quad.robot.importing.xml_text import read_xml, write_xml

# What a file can make Drake raise: its assertions are a SystemExit in Python.
PARSER_ERRORS = (RuntimeError, ValueError, SystemExit)
SUFFIXES = {"robot": ".urdf", "sdf": ".sdf", "mujoco": ".xml"}


@dataclass(frozen=True)
class Parsed:
    """A file in a plant of its own, joints at the file's zero.

    Attributes:
        plant: Finalized.
        scene_graph: With its geometry.
        instances: Its models.
        cleaned: What was taken out of the file.
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    instances: list[ModelInstanceIndex]
    cleaned: Cleaned


@contextmanager
def parse(found: Found) -> Iterator[Parsed]:
    """The robot's file in a plant, as long as the context lasts: its meshes are temporary.

    Raises:
        InputError: If the file is no robot that Drake's parser takes.
    """

    def refuse(remedy: str) -> InputError:
        return InputError(source=found.model, field="robot.model", value=found.model, remedy=remedy)

    root = read_xml(found.path, found.model)
    if root.tag not in SUFFIXES:
        raise refuse(
            f"cannot be read as a robot: it begins with <{root.tag.replace(COLON, ':')}>; "
            "URDF begins with <robot>, SDF with <sdf>, MJCF with <mujoco>"
        )
    check_spelling(root, found.model)
    with tempfile.TemporaryDirectory(prefix="drake_quad_") as folder:
        scratch = Path(folder)
        c = Cleaned(root, found.path.parent, scratch, found.model, files=[found.path])
        try:
            {"robot": clean_urdf, "sdf": clean_sdf, "mujoco": clean_mjcf}[root.tag](c)
        except RecursionError:
            raise refuse("cannot be read as a robot: models in it are nested too deep") from None
        file = scratch / f"robot{SUFFIXES[root.tag]}"
        write_xml(root, file)
        said: list[str] = []
        plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
        plant.RegisterAsSourceForSceneGraph(scene_graph)
        try:
            with quiet() as said:
                instances = Parser(plant).AddModels(str(file))
                plant.Finalize()
        except PARSER_ERRORS as error:
            names = {str(file): found.path.name}
            for number, path in enumerate(c.included, start=1):
                names[str(included_file(scratch, number))] = path.name
            names[f"{scratch}/"] = ""
            reason = parser_reason(error, said, names)
            raise refuse(f"cannot be read as a robot: {reason}") from None
        yield Parsed(plant, scene_graph, instances, c)
