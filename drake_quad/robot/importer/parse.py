"""Reads a robot's file by Drake's parser: the plant as a tree, and refusals in plain words."""

import logging
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Joint, ModelInstanceIndex, RigidBody

from drake_quad.errors import InputError
from drake_quad.robot.importer.sanitize import Cleaned
from drake_quad.robot.importer.sanitize_mjcf import clean_mjcf
from drake_quad.robot.importer.sanitize_sdf import clean_sdf, included_file
from drake_quad.robot.importer.sanitize_urdf import clean_urdf
from drake_quad.robot.importer.sources import Found
from drake_quad.robot.importer.spelling import check_spelling
from drake_quad.robot.importer.urdf_numbers import check_urdf
from drake_quad.robot.importer.xml_io import COLON, read_xml, write_xml

_CONDITION = re.compile(r"Failure at \S+ in (\w+)\(\): condition '(.*?)' failed\.?(.*)")
_SDFORMAT = re.compile(r"SDFormat Error.*?Msg: (.*)")


def parser_reason(error: BaseException, logged: list[str], names: dict[str, str]) -> str:
    """One line that says why, without the innards of Drake.

    Args:
        error: What the parser raised.
        logged: Lines that it logged before, see `quiet`.
        names: What to say for texts that mean nothing to who gave the file, such as its copy's
            path.
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    reason = lines[0] if lines else "Drake's parser gives no reason"
    broken = _CONDITION.search(reason)
    if broken:
        reason = f"what {broken[1]} needs does not hold: {broken[2]}.{broken[3]}"
    messages = [found[1] for found in map(_SDFORMAT.search, logged) if found]
    if messages:
        reason = f"{reason}: {messages[0]}"
    for text, instead in names.items():
        # SDFormat writes an absolute path after a slash of its own.
        reason = reason.replace(f"/{text}", instead).replace(text, instead)
    return reason if " " in reason else f"Drake's parser fails on it ({reason})"


@contextmanager
def quiet(level: int = logging.ERROR) -> Iterator[list[str]]:
    """Without Drake's log on the screen; what is in it from a level on is in the list."""
    logger, logged = logging.getLogger("drake"), _Collector()
    before, propagate, handlers = logger.level, logger.propagate, logger.handlers
    logger.setLevel(level)
    logger.propagate, logger.handlers = False, [logged]
    try:
        yield logged.lines
    finally:
        logger.propagate, logger.handlers = propagate, handlers
        logger.setLevel(before)


class _Collector(logging.Handler):
    """Keeps what is logged."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keeps one message."""
        self.lines.append(record.getMessage())


# What a file can make Drake raise: its assertions are a SystemExit in Python.
PARSER_ERRORS = (RuntimeError, ValueError, SystemExit)
SUFFIXES = {"robot": ".urdf", "sdf": ".sdf", "mujoco": ".xml"}


@dataclass(frozen=True)
class Parsed:
    """A file in a plant of its own, joints at the file's zero.

    Attributes:
        plant: Finalized.
        scene_graph: Scene graph with its geometry.
        instances: The robot's models.
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
    if root.tag == "robot":
        check_urdf(root, found.model)
    with tempfile.TemporaryDirectory(prefix="drake_quad_") as folder:
        scratch = Path(folder)
        c = Cleaned(root, found.path.parent, scratch, found.model, files=[found.path])
        try:
            {"robot": clean_urdf, "sdf": clean_sdf, "mujoco": clean_mjcf}[root.tag](c)
        except RecursionError:
            raise refuse("cannot be read as a robot: models in it are nested too deep") from None
        file = scratch / f"robot{SUFFIXES[root.tag]}"
        write_xml(root, file)
        logged: list[str] = []
        plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
        plant.RegisterAsSourceForSceneGraph(scene_graph)
        try:
            with quiet() as logged:
                instances = Parser(plant).AddModels(str(file))
                plant.Finalize()
        except PARSER_ERRORS as error:
            names = {str(file): found.path.name}
            for number, path in enumerate(c.included, start=1):
                names[str(included_file(scratch, number))] = path.name
            names[f"{scratch}/"] = ""
            reason = parser_reason(error, logged, names)
            raise refuse(f"cannot be read as a robot: {reason}") from None
        yield Parsed(plant, scene_graph, instances, c)


@dataclass(frozen=True)
class Tree:
    """The robot's own bodies, without the world.

    Attributes:
        plant: The plant that they are in.
        root: Index of the body that carries all.
        joint_to: The joint that carries each body but the root, by body index.
        children: Indices of the bodies that each body carries, by body index.
        others: Names of bodies that the root does not carry.
    """

    plant: MultibodyPlant
    root: int
    joint_to: dict[int, Joint]
    children: dict[int, list[int]]
    others: tuple[str, ...]

    def body(self, index: int) -> RigidBody:
        """A body by its index."""
        return self.plant.get_body(BodyIndex(index))

    def is_fixed(self, index: int) -> bool:
        """Whether a body does not move against the one that carries it."""
        return int(self.joint_to[index].num_velocities()) == 0

    def welded(self, index: int) -> list[int]:
        """A body and all that is welded to it, outwards."""
        return self._outwards(index, self.is_fixed)

    def moving(self, index: int) -> list[int]:
        """The bodies that move on what is welded to a body."""
        return [
            child
            for body in self.welded(index)
            for child in self.children[body]
            if not self.is_fixed(child)
        ]

    def below(self, index: int, *, without: frozenset[int] = frozenset()) -> list[int]:
        """A body and all that hangs on it by whatever joints, but those `without` and theirs."""
        return self._outwards(index, lambda child: child not in without)

    def _outwards(self, index: int, follow: Callable[[int], bool]) -> list[int]:
        """A body and all that it carries by those to `follow`, each before what it carries."""
        found, ahead = [], [index]
        while ahead:
            found.append(ahead.pop())
            ahead += filter(follow, reversed(self.children[found[-1]]))
        return found


def grow_tree(plant: MultibodyPlant) -> Tree:
    """The tree of a finalized plant; of several that stand in the world, the one of most bodies."""
    world = int(plant.world_body().index())
    joint_to: dict[int, Joint] = {}
    children: dict[int, list[int]] = {i: [] for i in range(plant.num_bodies())}
    for j in plant.GetJointIndices():
        joint = plant.get_joint(j)
        child = int(joint.child_body().index())
        children[int(joint.parent_body().index())].append(child)
        joint_to[child] = joint
    whole = Tree(plant, world, joint_to, children, ())
    if not children[world]:
        return whole
    root = max(children[world], key=lambda i: len(whole.below(i)))
    mine = {*whole.below(root), world}
    others = [i for i in range(plant.num_bodies()) if i not in mine]
    names = tuple(plant.get_body(BodyIndex(i)).name() for i in others)
    return Tree(plant, root, joint_to, children, names)
