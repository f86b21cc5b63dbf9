"""What tests of the design share: the paper's robot as the search sees it."""

from functools import cache

from rig import paper_robot

from drake_quad.design.shape import Shape, read_shape

MODEL = "package://drake_quad_models/paper_quadruped.urdf"


@cache
def shape() -> Shape:
    """The outline of the paper's robot."""
    return read_shape(paper_robot())
