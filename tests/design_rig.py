"""What tests of the design share: the paper's robot as the search sees it, and answers."""

from functools import cache
from typing import Any

from rig import paper_robot

from drake_quad.check_ask import ask_stairs
from drake_quad.check_stairs import Check
from drake_quad.design.shape import Shape, read_shape
from drake_quad.stability.kinds import HULL

MODEL = "package://drake_quad_models/paper_quadruped.urdf"


@cache
def shape() -> Shape:
    """The outline of the paper's robot."""
    return read_shape(paper_robot())


def asked(model: str, **question: Any) -> Check:
    """`ask_stairs`, which designs a gait, without what is near; the same is asked once."""
    return _asked(model, **{"nearest": False, "margin": HULL, **question})


_asked = cache(ask_stairs)
