"""A flight of stairs as solids: treads down to the foundation, or with noses, or open between."""

from typing import NamedTuple

from drake_quad.gait.legs import FloatArray


class Flight(NamedTuple):
    """The steps of one flight: intervals `first` to `last` (inclusive) of its lane.

    Attributes:
        first: Its first interval.
        last: Its last.
        going: `up` or `down`.
        yaw: Of its nosings against the lane's [rad]: 0 but in the course as it really is.
        overhang: By how much each tread reaches beyond the riser under it [m].
        thickness: Of what reaches out, and of the treads where the risers are open [m].
        open: Whether there is nothing between the treads.
    """

    first: int
    last: int
    going: str
    yaw: float = 0.0
    overhang: float = 0.0
    thickness: float = 0.0
    open: bool = False

    @property
    def undercut(self) -> float:
        """By how much the ground before it stands back under its edge, the first nosing [m]."""
        return self.overhang if self.going == "down" and not self.open else 0.0


class Part(NamedTuple):
    """A piece of a flight, across all of it: from `start` to `end` along the lane [m]."""

    name: str
    start: float
    end: float
    top: float  # [m]
    thickness: float | None = None  # [m]; None: down to the foundation


def flight_parts(flight: Flight, breaks: FloatArray, heights: FloatArray) -> list[Part]:
    """The solids of a flight. From above they are its treads, whatever is under them.

    The breaks are where the nosings are; with an overhang the risers stand back from them under
    the upper tread. Just one part for each tread has `tread` in its name.

    Args:
        flight: What it is like.
        breaks: (n + 1,) ends of its treads along the lane [m].
        heights: (n + 1,) of what is before it, then of its treads, in W [m].
    """
    ends, tops = breaks.tolist(), heights.tolist()
    n = len(ends) - 1
    if flight.open:
        return _open_parts(flight, ends, tops)
    up = flight.going == "up"
    back = flight.overhang if up else -flight.overhang  # from a nosing to its riser
    risers = [end + back for end in ends[:-1]] + [ends[-1]]
    parts = [Part(f"tread_{k + 1}", risers[k], risers[k + 1], tops[k + 1]) for k in range(n)]
    if back == 0.0:
        return parts
    for k in range(n):
        a, b = sorted((ends[k], risers[k]))
        own = k + 1 if up else k  # of the tread after it going up, before it going down
        parts.append(Part(f"nose_{own}", a, b, tops[own], flight.thickness))
    if up:
        parts.append(Part("foot", ends[0], risers[0], tops[0]))
    return parts


def _open_parts(flight: Flight, ends: list[float], tops: list[float]) -> list[Part]:
    """Boards over the ground that is at the flight's lower end; one level with it lies on it."""
    n, over, up = len(ends) - 1, flight.overhang, flight.going == "up"
    parts = []
    for k in range(n):
        a, b = ends[k], ends[k + 1]
        a, b = (a, min(b + over, ends[-1])) if up else (max(a - over, ends[0]), b)
        parts.append(Part(f"tread_{k + 1}", a, b, tops[k + 1], flight.thickness))
    return [*parts, Part("ground", ends[0], ends[-1], tops[0] if up else tops[-1])]
