"""How fast feet are moved, searched for and followed."""

from typing import NamedTuple


class Pace(NamedTuple):
    """Times and speeds of `place_feet`; see ControlSettings.

    Attributes:
        period: Of the controller [s].
        foothold_time: [s].
        touchdown_press: [m].
        search_speed: [m/s].
        height_time: Over which the body follows the height of the ground as found [s].
    """

    period: float
    foothold_time: float
    touchdown_press: float
    search_speed: float
    height_time: float
