"""A map made of what was seen: from a belief of one flight to the course that is planned on.

The map is a floor, the flight and a landing on one lane; or of a flight whose end is not known, its
first steps. The lane leads through the place where the
robot stands, along the climb as it is believed to head, so that its risers lie square across it.
What no image tells is told: the floor under and behind the robot, and how far the ground goes on
level beyond the last nosing where that is farther than it was seen.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from drake_quad.common import BoolArray, FloatArray, read_only
from drake_quad.errors import PlanningError
from drake_quad.perception.level_beyond import Level
from drake_quad.perception.stair_belief import NORMAL_95, StairBelief
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.elements import DEFAULT_THICKNESS, TURNING_SPACE, WIDTH_MIN, Element

SOURCE = "the map of what was seen"
STUB = 0.1  # [m] of ground behind the last tread of a flight whose end is not known
WIDTH_SEEN = 0.6  # [m] of the treads about the way ahead, to be seen in any case
LEAST_OVERHANG = 0.003  # [m]; a map has risers straight under their nosings up to there


@dataclass(frozen=True, eq=False)
class StairMap:
    """One flight up, as it is believed to be; arrays cannot be written to.

    Attributes:
        elements: Floor, stairs and landing.
        origin: Where the map's lane begins in W, (2,) [m].
        yaw: Its heading in W [rad].
        floor: Height of the floor in W [m].
        places: The nosings' places along the lane, (n,) [m].
        heights: Their heights in W, (n,) [m].
        place_errors: Half of the 95 % interval of each place, (n,) [m]; of a map of first steps as
            it is within half a stance's width of the lane.
        height_errors: The same of each height, (n,) [m].
        height_correlation: How the heights' errors go together, (n, n): those of one look are
            mostly the camera's own, and grow with the distance.
        error_place: How far a riser may be off within half a stance's width of the lane [m].
        error_height: How far a tread may be off in height [m].
        turning_space: Length and width of the smallest landing that the robot may turn on [m].
        run: Mean depth of the treads [m].
        complete: Whether all of the flight was seen, and the landing; else the map ends with the
            last tread that was.
        trusted: How many of the first nosings are known well enough to be planned on.
        doubt: Why a flight that was seen to its end is not complete all the same; else empty.
        seen_in: Number of the look that told each nosing, (n,).
        touched: Whether feet have told each height, (n,); empty if none.
    """

    elements: tuple[Element, ...]
    origin: FloatArray
    yaw: float
    floor: float
    places: FloatArray
    heights: FloatArray
    place_errors: FloatArray
    height_errors: FloatArray
    height_correlation: FloatArray
    error_place: float
    error_height: float
    turning_space: float = TURNING_SPACE
    run: float = 0.0
    complete: bool = True
    trusted: int = 0
    doubt: str = ""
    seen_in: tuple[int, ...] = ()
    touched: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        for name in (
            "origin",
            "places",
            "heights",
            "place_errors",
            "height_errors",
            "height_correlation",
        ):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def touched_treads(self) -> BoolArray:
        """Whether feet have told the height of each tread, (n,)."""
        found = np.zeros(len(self.heights), dtype=bool)
        found[: len(self.touched)] = self.touched
        return found

    def course(self, *, foot_radius: float) -> Course:
        """The map laid out as a course.

        Args:
            foot_radius: Radius of the robot's feet [m], for the shortest tread that can bear one.

        Raises:
            InputError: A tread that is believed to be none.
        """
        return lay_map(
            self.elements, origin=self.origin, yaw=self.yaw, floor=self.floor,
            foot_radius=foot_radius, turning_space=self.turning_space,
        )  # fmt: skip

    def describe(self) -> dict[str, Any]:
        """What `course_of_description` makes the course of again, as plain values."""
        elements = [
            {name: value for name, value in asdict(element).items() if value is not None}
            for element in self.elements
        ]
        origin = [float(x) for x in self.origin]
        return {
            "origin": origin, "yaw": self.yaw, "floor": self.floor, "elements": elements,
            "turning_space": self.turning_space,
        }  # fmt: skip


def lay_map(
    elements: tuple[Element, ...],
    *,
    origin: FloatArray,
    yaw: float,
    floor: float,
    foot_radius: float,
    turning_space: float,
) -> Course:
    """A map's elements as a course; the arguments are StairMap's and its `course`'s."""
    return build_course(
        elements, start_height=floor, origin=(float(origin[0]), float(origin[1])), yaw=yaw,
        foot_radius=foot_radius, turning_space=turning_space, source=SOURCE,
    )  # fmt: skip


def course_of_description(told: Mapping[str, Any], *, foot_radius: float) -> Course:
    """The course of a map that was written down by `StairMap.describe`.

    Raises:
        ValueError, TypeError, KeyError, InputError: It is no such description.
    """
    elements = tuple(Element(**element) for element in told["elements"])
    origin = np.array(told["origin"], dtype=float).reshape(2)
    return lay_map(
        elements, origin=origin, yaw=float(told["yaw"]), floor=float(told["floor"]),
        foot_radius=foot_radius, turning_space=float(told.get("turning_space", TURNING_SPACE)),
    )  # fmt: skip


def describe_belief(belief: StairBelief | None) -> str:
    """What is seen, in a few words for people."""
    if belief is None:
        return "no stairs"
    most = belief.count_most
    count = f"{belief.count_least}"
    if most is None:
        count = f"{count} or more"
    elif most != belief.count_least:
        count = f"{count} to {most}"
    way = "up" if belief.going_up else "down"
    steps = "step" if count == "1" else "steps"
    run = f", {belief.run:.2f} m deep" if len(belief.places) > 1 else ""
    return f"{count} {steps} {way}, each {abs(belief.rise):.2f} m high{run}"


def make_stair_map(
    belief: StairBelief | None,
    level: Level | None,
    *,
    standing: FloatArray,
    floor: float,
    behind: float,
    landing: float,
    reach: float,
    turning_space: float = TURNING_SPACE,
    to_its_end: bool = True,
) -> StairMap:
    """The map of the flight up that was seen.

    Args:
        belief: What was seen; None if nothing speaks for stairs.
        level: What was seen beyond the last nosing, and whether the first one was in view; None if
            nobody has looked.
        standing: Where the robot's body is, in W, (2,) [m].
        floor: Height of the floor that its feet stand on, in W [m].
        behind: How far the floor goes on behind the body [m].
        landing: How far the ground is level beyond the last nosing [m]. What of it was not seen is
            taken for granted.
        reach: How far from the lane's middle line feet are put down [m].
        turning_space: Length and width of the smallest landing that the robot may turn on [m].
        to_its_end: Whether all of the flight has to have been seen; if not, the map may be one of
            its first steps.

    Raises:
        PlanningError: There is nothing to climb, or not all of the flight was seen.
    """
    if belief is None:
        raise PlanningError("no stairs are seen")
    if not belief.going_up:
        raise PlanningError("what is seen leads down, and a map of it is not made")
    aside_sigma = reach * belief.sigma("yaw")
    error_place = float(NORMAL_95 * np.hypot(belief.place_sigmas, aside_sigma).max())
    complete = not belief.passed and sees_end(belief, level)
    if to_its_end and not complete:
        raise PlanningError("how many steps there are is not known: not all of them are seen")
    if level is not None and level.below_view:
        many = "the first step is" if level.below_view == 1 else "the first steps are"
        raise PlanningError(f"{many} too near to be seen: start farther away")
    along, aside = belief.direction, np.array([-belief.direction[1], belief.direction[0]])
    offset = belief.origin - standing
    places = behind + float(offset @ along) + belief.places
    lateral = float(offset @ aside)
    width = check_width(width_in_view(lateral, belief, level, reach=reach))
    width = min(width, width_of_steps(np.full(len(places), lateral), level))
    beyond = 0.0 if level is None else width_about(lateral, level.right, level.left)
    overhang = None
    if belief.overhang > max(LEAST_OVERHANG, belief.estimate("overhang").half_width):
        overhang = belief.overhang
    return StairMap(
        elements=lay_flight(
            places, np.array(belief.heights[1:]), floor=floor, run=belief.run, width=width,
            beyond=beyond, landing=landing if complete else None, reach=reach,
            is_open=belief.is_open, overhang=overhang,
        ),
        origin=standing - behind * along,
        yaw=belief.yaw,
        floor=floor,
        places=places,
        heights=np.array(belief.heights[1:]),
        place_errors=NORMAL_95 * belief.place_sigmas,
        height_errors=NORMAL_95 * belief.height_sigmas[1:],
        height_correlation=belief.height_correlation,
        error_place=error_place,
        error_height=float(NORMAL_95 * belief.height_sigmas[1:].max()),
        turning_space=turning_space,
        run=belief.run,
        complete=complete,
        trusted=len(places),
        seen_in=(0,) * len(places),
    )  # fmt: skip


def unfinished(found: StairMap, doubt: str) -> StairMap:
    """The map of a whole flight as one of its first steps, to be looked at again from nearer.

    Args:
        found: The map.
        doubt: Why it is not planned on to its end.
    """
    floor, stairs, landing, *_ = found.elements
    elements = (floor, stairs, replace(landing, length=STUB))
    return replace(found, elements=elements, complete=False, doubt=doubt)


def sees_end(belief: StairBelief, level: Level | None) -> bool:
    """Whether it was seen where a flight ends: by its fit, or by the ground beyond it."""
    return belief.count_most == belief.count_least or (level is not None and level.ends_flight)


def width_in_view(
    lateral: float, belief: StairBelief, level: Level | None, *, reach: float
) -> float:
    """Width about the lane of a flight that is looked at for the first time [m].

    A robot that stands askew sees little of the first steps on one side. Where no step is seen to
    end on that side, and enough of the treads is seen, they are taken to be as wide as feet need.

    Args:
        lateral: How far the climb's line is to the left of the lane's [m].
        belief: What was seen.
        level: What was seen of the steps' ends; None if nobody has looked.
        reach: How far from the lane's middle line feet are put down [m].
    """
    width = width_about(lateral, belief.right, belief.left)
    if level is None or level.ends is None or width < WIDTH_SEEN:
        return width
    narrow_left = belief.left + lateral < -(belief.right + lateral)
    if np.isfinite(level.ends[:, int(narrow_left)]).any():
        return width
    return max(width, WIDTH_MIN, 2.0 * reach)


def check_width(width: float) -> float:
    """The width over which treads are seen about the way ahead [m], if that is enough.

    Raises:
        PlanningError: It is not.
    """
    if width < WIDTH_MIN:
        raise PlanningError(
            f"only {max(width, 0.0):.2f} m of the treads are seen about the way ahead, and "
            f"{WIDTH_MIN:g} m are wanted"
        )
    return width


def lay_flight(
    places: FloatArray,
    heights: FloatArray,
    *,
    floor: float,
    run: float,
    width: float,
    beyond: float,
    landing: float | None,
    reach: float,
    is_open: bool,
    overhang: float | None,
) -> tuple[Element, ...]:
    """The elements of a map: a floor, a flight, and what is behind it.

    Args:
        places: The nosings' places along the lane, (n,) [m].
        heights: The treads' heights in W, (n,) [m].
        floor: Height of the floor in W [m].
        run: Depth of the last tread [m].
        width: Width of the treads [m].
        beyond: Width over which the ground beyond the last nosing was seen to be level [m].
        landing: How far the ground is level beyond the last nosing [m]; None if the flight's end is
            not known: then the map ends with the last tread, and a stub that no plan reaches.
        reach: How far from the lane's middle line feet are put down [m].
        is_open: Whether there is nothing between the treads.
        overhang: How far treads reach over the risers below [m]; None for not at all.

    Raises:
        PlanningError: A landing shorter than a tread.
    """
    if landing is not None and landing <= run:
        raise PlanningError(f"the {landing:g} m of landing that are told are shorter than a tread")
    runs = [*np.diff(places).tolist(), run]
    rises = np.diff(np.concatenate([[floor], heights])).tolist()
    thickness = min(DEFAULT_THICKNESS, 0.5 * min(rises)) if is_open or overhang else None
    stairs = Element(
        kind="stairs", going="up", rises=rises, runs=runs, width=width, overhang=overhang,
        open=is_open or None, thickness=thickness,
    )  # fmt: skip
    length = STUB if landing is None else landing - run
    return (
        Element(kind="floor", length=float(places[0]), width=max(width, 2.0 * reach)),
        stairs,
        Element(kind="landing", length=length, width=max(width, beyond)),
    )


def width_of_steps(lateral: FloatArray, level: Level | None) -> float:
    """Width about the lane that all steps have as far as their ends are seen [m], if it is enough.

    Args:
        lateral: How far the climb's line is to the left of the lane's at each nosing, (n,) [m].
        level: What was seen of the steps' ends; None if nobody has looked.

    Returns:
        The width; infinite where no end is seen.

    Raises:
        PlanningError: A step ends too near to the lane.
    """
    if level is None or level.ends is None:
        return np.inf
    aside = np.column_stack([-(level.ends[:, 0] + lateral), level.ends[:, 1] + lateral])
    k, side = np.unravel_index(int(aside.argmin()), aside.shape)
    nearest = float(aside[k, side])
    if 2.0 * nearest < WIDTH_MIN:
        way = "left" if side else "right"
        raise PlanningError(
            f"step {int(k) + 1} of what is seen ends {max(nearest, 0.0):.2f} m to the {way} of the "
            f"way ahead, and {0.5 * WIDTH_MIN:g} m are wanted"
        )
    return 2.0 * nearest


def width_about(lateral: float, right: float, left: float) -> float:
    """Width about the lane of what is seen from `right` to `left` of the climb's line [m].

    Args:
        lateral: How far the climb's line is to the left of the lane's [m].
        right: The right end, left positive [m].
        left: The left end [m].
    """
    return 2.0 * min(left + lateral, -(right + lateral))
