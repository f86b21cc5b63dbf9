"""Where along a lane the feet may step: on every tread, on evenly spaced places between flights.

Curbs and blocks have a place on either side, or one on their middle. In the wave gait of n treads a
cycle every foot steps n places on, so the level walk is in phase with the flight when the first
foot reaches it, whatever the distance.
"""

from dataclasses import dataclass

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.gait.legs import FloatArray, read_only
from drake_quad.planning.obstacles import find_obstacles, pin_obstacles
from drake_quad.terrain import Lane

SHORTEST_LANDING = 0.4  # of a tread: on a shorter one between two flights there is no place


@dataclass(frozen=True, eq=False)
class Lattice:
    """Places along a lane.

    Attributes:
        s: (nN + 1 + behind + ahead,) places along the lane [m]; the body starts over `s[behind]`
            and ends over `s[behind + nN]`.
        z: Heights of the ground there [m].
        behind: How many places lie behind the start (the gait's rear feet begin there).
        cycles: N: cycles of the wave gait from start to end, n places each.
        on_tread: Which places are on a tread of a flight, or on a block.
        line: Of places several to a tread, those one to a tread: their line is the flights' own.
    """

    s: FloatArray
    z: FloatArray
    behind: int
    cycles: int
    on_tread: tuple[bool, ...]
    line: "Lattice | None" = None

    @property
    def knots(self) -> tuple[FloatArray, FloatArray]:
        """Places [m] and heights [m] that the slope line goes through: one a tread."""
        return (self.s, self.z) if self.line is None else (self.line.s, self.line.z)

    def height(self, s: FloatArray) -> FloatArray:
        """The slope line through the treads' middles, at `s` [m]; flat beyond the ends."""
        return np.asarray(np.interp(s, *self.knots))


def make_lattice(
    lane: Lane,
    *,
    start: float,
    goal: float,
    spacing: float,
    behind: int = 1,
    ahead: int = 1,
    per_cycle: int = 2,
    per_tread: int = 1,
    deep: float = np.inf,
) -> Lattice:
    """Lays the lattice for a walk of the body from `start` to `goal` along `lane`.

    Args:
        lane: The lane.
        start: Where the body's centre starts, along the lane [m].
        goal: Where it is to end [m]; both are to be on level ground.
        spacing: The longest distance between neighbours on level ground [m].
        behind: How many places to lay behind the start.
        ahead: How many to lay beyond the goal.
        per_cycle: n: how many places a cycle advances.
        per_tread: q: how many places every tread has, evenly spaced.
        deep: Depth of treads from which a flight is none, but floors with curbs between [m].

    Raises:
        PlanningError: If there is no room to step between start, flights and goal.
    """
    pins: list[float] = [start]
    end = start  # of the flight before
    level: list[bool] = []  # whether the span after pin k is level
    obstacles = find_obstacles(lane, spacing, deep)
    flights = lane.close_flights(deep)
    for flight in flights:
        treads = lane.treads(flight)
        first, last = treads[0], treads[-1]
        if last[1] < start or first[0] > goal:
            continue
        end = pin_obstacles(obstacles, until=first[0], goal=goal, end=end, pins=pins, level=level)
        before = first[0] - 0.5 * (first[1] - first[0]) / per_tread
        if before >= pins[-1] - 1e-6:
            pins.append(before)
            level.append(True)
        elif len(pins) == 1:
            raise PlanningError(
                f"the walk starts {first[0] - start:.2f} m before a flight; "
                f"{first[0] - before:.2f} m are needed",
                start=start,
                flight=float(first[0]),
            )
        elif first[0] - end < SHORTEST_LANDING * (first[1] - first[0]):
            pins.pop()  # from tread to tread
            level.pop()
        else:
            pins[-1] = 0.5 * (end + first[0])  # one place serves both flights
        for a, b, _ in treads:
            for k in range(1, 2 * per_tread, 2):
                pins.append(((2 * per_tread - k) * a + k * b) / (2 * per_tread))
                level.append(False)
        end = last[1]
        pins.append(end + 0.5 * (end - last[0]) / per_tread)
        level.append(False)
    pin_obstacles(obstacles, until=goal, goal=goal, end=end, pins=pins, level=level)
    if goal < pins[-1] - 1e-6:
        raise PlanningError(
            f"the walk ends {goal - start:.2f} m on, too near behind a flight or before its start",
            goal=goal,
        )
    pins.append(goal)
    level.append(True)

    gaps = np.diff(pins)
    counts = np.array([max(int(np.ceil(g / spacing - 1e-6)), 0) if lv else 1
                       for g, lv in zip(gaps, level, strict=True)])  # fmt: skip
    while counts.sum() % per_cycle:  # whole cycles: let the widest level span have one more
        widths = [g / c if lv and c else 0.0 for g, c, lv in zip(gaps, counts, level, strict=True)]
        if max(widths) <= 0.0:
            raise PlanningError("no level ground on which to adapt the stride", goal=goal)
        counts[int(np.argmax(widths))] += 1
    s = [start]
    for a, gap, count in zip(pins[:-1], gaps, counts, strict=True):
        s += [a + gap * (k + 1) / count for k in range(count)]
    if len(s) == 1:
        s_all, first_gap, last_gap = s, spacing, spacing
    else:
        s_all, first_gap, last_gap = s, s[1] - s[0], s[-1] - s[-2]
    places = np.array(
        [s_all[0] - first_gap * (behind - k) for k in range(behind)]
        + s_all
        + [s_all[-1] + last_gap * (k + 1) for k in range(ahead)]
    )
    z = lane.height(places)
    if np.any(np.isnan(z)):
        bad = places[np.isnan(z)]
        raise PlanningError(
            f"a foot would have to stand at {bad[0]:.2f} m along the lane, beyond the ground",
            places=bad.tolist(),
        )
    steps = {i for f in flights for i in range(f.first, f.last + 1)}
    kinds = [lane.kinds[i] == "block" or i in steps for i in lane.interval(places).tolist()]
    line = None
    if per_tread > 1:
        line = make_lattice(lane, start=start, goal=goal, spacing=per_tread * spacing,
                            behind=0, ahead=0, per_cycle=1, deep=deep)  # fmt: skip
    return Lattice(
        s=read_only(places),
        z=read_only(z),
        behind=behind,
        cycles=(len(s) - 1) // per_cycle,
        on_tread=tuple(kinds),
        line=line,
    )
