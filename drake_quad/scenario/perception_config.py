"""What a scenario says of the map: told, or seen by a depth camera before the climb."""

from dataclasses import dataclass

from drake_quad.util.schema import choice, number, positive, within

FARTHEST_MOUNT = 2.0  # [m] of a camera from B's origin


def _coordinate(axis: str, usual: str) -> float | None:
    """A coordinate of the camera on the trunk."""
    text = f"{axis} of the camera in B; empty: as `camera` of its `.robot.yaml` says, else {usual}"
    bounds = within(-FARTHEST_MOUNT, FARTHEST_MOUNT)
    coordinate: float | None = number(None, "m", text, bounds)
    return coordinate


@dataclass
class PerceptionConfig:
    """Where the map comes from; see docs/perception.md."""

    map: str = choice(
        "told",
        ("told", "seen"),
        "`told`: planner and controller have `course`; `seen`: `course` is the world alone, and "
        "the map is made of what the robot's depth camera sees ahead before it climbs, and from a "
        "tread if that does not show where the flight ends",
    )
    camera: str = choice(
        "d435", ("d435", "d455"), "Depth camera, with the errors of its kind drawn by the seed"
    )
    camera_hold: str = choice(
        "landscape",
        ("landscape", "portrait"),
        "`portrait`: a quarter of a turn about its optical axis, so that its wide angle of view "
        "stands upright: it sees steps that are nearer, and less to the sides",
    )
    decimation: int = number(
        1,
        "",
        "By what factor the camera's driver makes its images smaller, across and down; images of "
        "half the size take a third of the time",
        within(1, 4),
    )
    image_period: float = number(
        0.5,
        "s",
        "With `estimator.landmarks: stairs`: time between the images of a robot that walks",
        within(0.1, 10.0),
    )
    camera_x: float | None = _coordinate("x", "0.03 m ahead of the trunk")
    camera_y: float | None = _coordinate("y", "0")
    camera_z: float | None = _coordinate("z", "0.05 m below the trunk's top")
    camera_pitch_deg: float | None = number(
        None,
        "deg",
        "Angle of its optical axis below the horizon, B being level; empty: as `camera` of its "
        "`.robot.yaml` says, else 30",
        within(-30, 90),
    )
    look_time: float = number(
        1.0,
        "s",
        "How long the robot stands and looks, at an image each half second; the last one counts",
        within(0.2, 60.0),
    )
    no_way_on: str = choice(
        "stay",
        ("stay", "back_down"),
        "What the robot does on a tread where what it sees cannot be climbed, or contradicts the "
        "map: it stays on its four feet; `back_down`: it goes back the way it came, backwards, to "
        "where it started",
    )
    landing: float = number(
        2.0,
        "m",
        "Level ground that the map has beyond the last nosing: what of it is not seen is taken for "
        "granted",
        positive(),
        within(0.5, 100.0),
    )
