"""A normal form that was just written is read as every run will read it."""

from pathlib import Path

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from drake_quad.errors import InputError
from drake_quad.robot.importing.parse_source import PARSER_ERRORS
from drake_quad.robot.importing.parser_reason import parser_reason, quiet
from drake_quad.robot.read_model import IMPORTED, read_model


def read_again(urdf: Path, source: str) -> None:
    """Reads a normal form that was just written, before it is kept and everybody stumbles on it.

    Args:
        urdf: The file.
        source: For errors: what the person gave.

    Raises:
        InputError: If it is none after all.
    """
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    with quiet() as said:
        try:
            instance = Parser(plant).AddModels(str(urdf))[0]
            plant.Finalize()
        except PARSER_ERRORS as error:
            raise InputError(
                source=source,
                field="robot.model",
                value=source,
                remedy="has no normal form that can be read: "
                + parser_reason(error, said, {f"{urdf.parent}/": ""}),
            ) from None
        read_model(plant, scene_graph, instance, url=source, tolerance=IMPORTED)
