"""Refuses what a person says of a robot where the robot itself says otherwise."""

from pathlib import Path

from drake_quad.errors import InputError
from drake_quad.robot.importing.normal_form import NormalRobot
from drake_quad.robot.importing.overrides import Overrides


def check_said(robot: NormalRobot, overrides: Overrides, *, source: str) -> None:
    """Makes sure that each leg is where its name says.

    Args:
        robot: In normal form, by the overrides.
        overrides: What a person says.
        source: What the person gave.

    Raises:
        InputError: If not.
    """
    source = Path(source).name
    for leg in robot.legs if overrides.legs else ():
        names = [hinge.name for hinge in leg.raw.hinges]
        (said,) = (short for short, own in (overrides.legs or {}).items() if own == names)
        if said != leg.short:
            raise InputError(
                source=source,
                field=f"legs.{said}",
                value=names,
                remedy=f"by where their hips are these joints are {leg.short}'s: front is +x and "
                "left is +y of the trunk, unless forward_deg says otherwise",
            )
