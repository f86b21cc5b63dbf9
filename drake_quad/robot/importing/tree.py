"""A parsed plant as a tree: bodies, and the joints that carry them."""

from collections.abc import Callable
from dataclasses import dataclass

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Joint, RigidBody


@dataclass(frozen=True)
class Tree:
    """The robot's own bodies, without the world.

    Attributes:
        plant: Whose they are.
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
        """A body and all that it carries by whatever joints, but those `without` and theirs."""
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
