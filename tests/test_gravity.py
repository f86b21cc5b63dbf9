"""Ours and the simulator's are one."""

from pydrake.multibody.plant import MultibodyPlant

from drake_quad.common import GRAVITY


def test_plans_weigh_what_the_plant_does() -> None:
    """To the last digit, straight down."""
    assert MultibodyPlant(0.0).gravity_field().gravity_vector().tolist() == [0.0, 0.0, -GRAVITY]
