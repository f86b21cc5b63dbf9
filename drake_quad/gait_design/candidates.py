"""Candidate gaits on endless staircases, and one cycle of each."""

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from math import gcd
from typing import NamedTuple

import numpy as np

from drake_quad.common import BoolArray, FloatArray, IntArray
from drake_quad.math.curves import quintic
from drake_quad.planning.body_reference import body_pitch
from drake_quad.planning.foothold_pattern import LIFT_OFF, FootholdPattern
from drake_quad.planning.problem import EDGE_CLEARANCE
from drake_quad.robot.legs import LEGS, SIGNS, WAVE_ORDER
from drake_quad.robot.model import RobotModel, leg_length
from drake_quad.terrain.course import Course

TREADS = (1, 2, 3)
LAGS = (1, 2, 3, 4)
STANCES = (0.5, 1.45)  # of the distance between the hips: a stance beyond these is not tried
STAGGER = 0.12  # of a leg
DUTY = 0.85
# [m] between a foot's sphere and a nosing or riser: what plans keep, and a little more, so that no
# designed footprint has to be moved when it is planned.
EDGE = EDGE_CLEARANCE + 0.002

# The columns of free parameters. Lengths in legs.
HEIGHT, SHARE, WIDER, PHASE_UP, PHASE_DOWN, SHIFT_UP, SHIFT_DOWN = range(7)
LOWER = np.array([0.50, 0.0, 0.0, -1.0, -1.0, -0.27, -0.27])
UPPER = np.array([0.97, 1.2, 0.35, 1.0, 1.0, 0.27, 0.27])
USUAL = np.array([0.82, 0.9, 0.08, 0.0, 0.0, 0.0, 0.0])  # what is taken where all do as well
# Where treads have several places, runs are long against the legs: more has to be free there.
LIFT_DOWN, SURGE = 7, 8
SHIFTS = [SHIFT_UP, SHIFT_DOWN]


@dataclass(frozen=True, eq=False)
class CandidateBatch:
    """C candidates of one pattern, in the robot's own measures [m], arrays (C,).

    Attributes:
        pattern: The footprints.
        height: Height of B over the line through the treads.
        share: How much of the slope the body tilts with.
        width: Distance between left and right feet.
        phase_up: How far ahead of the treads' middles the feet stand going up, of what is possible.
        phase_down: How far ahead they stand going down.
        shift_up: How far ahead of the feet's middle the body goes, going up.
        shift_down: How far ahead of it the body goes, going down.
        lift_down: How much higher the body is going down.
        surge: How far the body stays behind as front feet step, and goes ahead as rear feet do.
        duty_factor: β.
        stagger: Rear feet's |y| minus front feet's.
        stance_length: Distance between front and rear feet where the ground does not decide.
    """

    pattern: FootholdPattern
    height: FloatArray
    share: FloatArray
    width: FloatArray
    phase_up: FloatArray
    phase_down: FloatArray
    shift_up: FloatArray
    shift_down: FloatArray
    lift_down: FloatArray
    surge: FloatArray
    duty_factor: float
    stagger: float
    stance_length: float

    def __len__(self) -> int:
        return len(self.height)

    def take(self, which: BoolArray) -> "CandidateBatch":
        """Those candidates of which `which` (C,) is true."""
        if which.all():
            return self
        arrays = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{k: v[which] for k, v in arrays.items() if np.ndim(v) == 1})

    def phase(self, run: float, *, up: bool, foot_radius: float) -> FloatArray:
        """How far ahead of the treads' middles the feet stand (C,) [m]."""
        most = max(0.5 / self.pattern.per_tread * run - foot_radius - EDGE, 0.0)
        return np.asarray(most * (self.phase_up if up else self.phase_down))


def candidate_bounds(pattern: FootholdPattern) -> FloatArray:
    """Least, greatest and usual values of a pattern's free parameters, (3, 7 or 9)."""
    found = np.stack([LOWER, UPPER, USUAL])
    if pattern.per_tread == 1:
        return found
    found[:2, SHIFTS] = [[-0.4, -0.4], [0.4, 0.4]]
    return np.column_stack([found, [-0.1, 0.35, 0.0], [0.0, 0.06, 0.0]])


@lru_cache(maxsize=8)  # a search asks a thousand times
def hip_length(robot: RobotModel) -> float:
    """Between front and rear hips [m]."""
    x = robot.geometry.p_BH[:, 0]
    return float(np.mean(x[:2]) - np.mean(x[2:]))


def hip_width(robot: RobotModel) -> float:
    """Between the planes of left and right legs that hang straight down [m]."""
    y = np.abs(robot.geometry.p_BH[:, 1] + robot.geometry.offset)
    return float(2.0 * np.mean(y))


def make_candidates(
    robot: RobotModel, pattern: FootholdPattern, parameters: FloatArray
) -> CandidateBatch:
    """Candidates from their free parameters (C, 7 or 9), see `candidate_bounds`."""
    leg = leg_length(robot)
    hips = robot.geometry.p_BH[:, 2] + robot.geometry.raised
    drop = -float(np.mean(hips))  # of the hip pitch axes below B
    p = np.asarray(parameters, dtype=np.float64).reshape(-1, candidate_bounds(pattern).shape[1])
    more = p[:, LIFT_DOWN:] if pattern.per_tread > 1 else np.zeros((len(p), 2))
    return CandidateBatch(
        pattern=pattern,
        height=p[:, HEIGHT] * leg + drop + robot.foot_radius,
        share=p[:, SHARE],
        width=hip_width(robot) + p[:, WIDER] * leg,
        phase_up=p[:, PHASE_UP],
        phase_down=p[:, PHASE_DOWN],
        shift_up=p[:, SHIFT_UP] * leg,
        shift_down=p[:, SHIFT_DOWN] * leg,
        lift_down=more[:, 0] * leg,
        surge=more[:, 1] * leg,
        duty_factor=DUTY,
        stagger=STAGGER * leg if pattern.shares_places else 0.0,
        stance_length=hip_length(robot),
    )


def make_foothold_patterns(
    robot: RobotModel, runs: list[float], per_tread: int = 1
) -> list[FootholdPattern]:
    """The patterns whose stance fits the robot on treads of all of these runs [m].

    Args:
        robot: The robot.
        runs: Depths of all treads [m].
        per_tread: How many places every tread is to have.
    """
    hips = hip_length(robot)
    if any(0.5 * run / per_tread < robot.foot_radius + EDGE for run in runs):
        return []
    return [
        pattern
        for pattern in (
            FootholdPattern(treads, lag, per_tread) for treads in TREADS for lag in LAGS
        )
        if all(
            STANCES[0] * hips <= pattern.stance * run / per_tread <= STANCES[1] * hips
            for run in runs
        )
    ]


class Staircase(NamedTuple):
    """Treads of one rise and one run without end, or level ground.

    Tread i reaches from (i - 1/2) run to (i + 1/2) run along the way and is i rise high: the line
    through the treads' middles goes through the origin.

    Attributes:
        rise: Height of a step [m]; negative going down, 0 on level ground.
        run: Depth of a tread [m]; on level ground the distance between places to step on.
    """

    rise: float
    run: float

    @property
    def slope(self) -> float:
        """Rise over run."""
        return self.rise / self.run

    def line(self, s: FloatArray) -> FloatArray:
        """Height of the line through the treads' middles at `s` [m]."""
        return self.slope * s


PHASES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])  # of every swing, that are looked at


class Cycle(NamedTuple):
    """C candidates at N moments: those of every leg's swing. W begins at the body's first place.

    Attributes:
        body: (C, N, 5) x, y, z, pitch, yaw of B; y is 0.
        feet: (C, N, 4, 3) foot sphere centres [m].
        swing: (N,) row of the leg in the air.
        landed: (N, 4) the moment at which each foot was set down last; cycles follow one another.
    """

    body: FloatArray
    feet: FloatArray
    swing: FloatArray
    landed: IntArray

    @property
    def standing(self) -> BoolArray:
        """Which feet stand (N, 4)."""
        return np.asarray(np.arange(4) != self.swing[:, None])


def make_cycle(
    grid: CandidateBatch,
    stairs: Staircase,
    *,
    foot_radius: float,
    clearance: float,
    stance_length: float | None = None,
) -> Cycle:
    """Lays a cycle of every candidate, or as many as it takes until all treads are alike.

    Args:
        grid: The candidates.
        stairs: What is walked on.
        foot_radius: Radius of the foot spheres [m].
        clearance: Distance by which the foot's sphere clears what it passes [m].
        stance_length: Distance between front and rear feet on level ground [m]; None is the
            pattern's.
    """
    pattern = grid.pattern
    beats = _lay_beats(pattern, stairs, grid.duty_factor, clearance)
    body = _body(grid, stairs, beats.at, _places(pattern, stairs))
    body[..., 0] += grid.surge[:, None] * beats.ahead
    lift = 0.0 if stairs.rise >= 0.0 else grid.lift_down[:, None]
    body[..., 2] = stairs.line(body[..., 0]) + grid.height[:, None] + lift

    along = beats.along
    if stance_length is not None:
        along = along + 0.5 * SIGNS[:, :1] * (stance_length - pattern.stance * stairs.run)
    feet = np.empty((len(grid), len(beats.at), 4, 3))
    feet[..., 0] = along.T
    if stairs.rise != 0.0:
        phase = grid.phase(stairs.run, up=stairs.rise > 0.0, foot_radius=foot_radius)
        feet[..., 0] += phase[:, None, None]
    half = 0.5 * grid.stagger * np.array([-1.0, -1.0, 1.0, 1.0])
    feet[..., 1] = SIGNS[:, 1] * (0.5 * grid.width[:, None] + half)[:, None, :]
    feet[..., 2] = beats.up.T + foot_radius
    return Cycle(body, feet, beats.swing, beats.landed)


class _Beats(NamedTuple):
    """What all candidates of a pattern have alike on a staircase, at N moments.

    Attributes:
        at: When they are (N,) [cycles].
        ahead: 1 where a rear leg swings, -1 where a front leg does (N,).
        along: How far along the stairs the feet are, before the candidates' own phases (4, N) [m].
        up: How high the feet are (4, N) [m].
        swing: See Cycle.
        landed: See Cycle.
    """

    at: FloatArray
    ahead: FloatArray
    along: FloatArray
    up: FloatArray
    swing: FloatArray
    landed: IntArray


def _places(pattern: FootholdPattern, stairs: Staircase) -> int:
    """Places a tread: on level ground places are alike."""
    return 1 if stairs.rise == 0.0 else pattern.per_tread


@lru_cache(maxsize=64)  # a search asks a thousand times; nobody writes into what it has
def _lay_beats(
    pattern: FootholdPattern, stairs: Staircase, duty_factor: float, clearance: float
) -> _Beats:
    """Lays as many cycles as it takes until all feet stand alike on other treads."""
    per = _places(pattern, stairs)
    cycles = per // gcd(per, pattern.treads)
    beats = [(c, leg) for c in range(cycles) for leg in WAVE_ORDER]
    at = np.concatenate([c + LIFT_OFF[leg] + PHASES * (1.0 - duty_factor) for c, leg in beats])
    ahead = np.repeat([-SIGNS[leg.row, 0] for _, leg in beats], len(PHASES))
    swings = np.repeat([[leg == other for _, other in beats] for leg in LEGS], len(PHASES), axis=1)
    steps = [[c + (LIFT_OFF[leg] < LIFT_OFF[other]) for c, other in beats] for leg in LEGS]
    first = np.array([[pattern.first(leg)] for leg in LEGS])
    begin = first + pattern.treads * np.repeat(steps, len(PHASES), axis=1)  # places, (4, N)
    along, up = _ways(stairs, begin, begin + pattern.treads * swings, per, clearance)
    swing = np.repeat([float(leg.row) for _, leg in beats], len(PHASES))
    return _Beats(at, ahead, along, up, swing, _landed(cycles))


def _body(grid: CandidateBatch, stairs: Staircase, at: FloatArray, per: int) -> FloatArray:
    """The bodies (C, N, 5) at times (N,) [cycles], with no height yet."""
    pattern = grid.pattern
    treads = (pattern.treads * at + pattern.ahead(grid.duty_factor) - 0.5 * (per - 1)) / per
    body = np.zeros((len(grid), len(at), 5))
    body[..., 0] = stairs.run * treads
    if stairs.rise != 0.0:
        body[..., 0] += (grid.shift_up if stairs.rise > 0.0 else grid.shift_down)[:, None]
    body[..., 3] = body_pitch(grid.share, stairs.slope)[:, None]
    return body


def _ways(
    stairs: Staircase, begin: IntArray, end: IntArray, per: int, clearance: float
) -> tuple[FloatArray, FloatArray]:
    """How far along the stairs and how high feet are, (4, N) [m], from places to places (4, N).

    Up and over, and then along: the arc's own shape is found when it is planned.
    """
    s = np.tile(PHASES, begin.shape[1] // len(PHASES))
    share = quintic(s)
    tread, goal = begin // per, end // per
    # How far ahead of its tread's middle each place is.
    here, there = (stairs.run * ((place % per + 0.5) / per - 0.5) for place in (begin, end))
    along = stairs.run * (tread + (goal - tread) * share) + here + share * (there - here)
    low, high = tread * stairs.rise, goal * stairs.rise
    over = np.where(begin != end, np.maximum(low, high) + clearance, low)
    return along, np.where(s == 0.0, low, np.where(s == 1.0, high, over))


def _landed(cycles: int) -> IntArray:
    """See Cycle; the end of each leg's swing, or of its swing in the cycle before."""
    last = len(PHASES) - 1
    landed = np.empty((cycles, 4, len(PHASES), 4), dtype=np.intp)
    for c in range(cycles):
        for beat in range(4):
            for other, leg in enumerate(WAVE_ORDER):
                earlier = other < beat
                before = c if earlier else (c - 1) % cycles
                landed[c, beat, :, leg.row] = (4 * before + other) * len(PHASES) + last
            own = (4 * c + beat) * len(PHASES) + last
            landed[c, beat, last, WAVE_ORDER[beat].row] = own
    return landed.reshape(-1, 4)


SAME = 1e-4  # [m]
MOST = 6  # kinds of steps that are looked at one by one


def flights_of(course: Course, deep: float = np.inf) -> list[Staircase]:
    """Every kind of step on the course, once; of many kinds those with extreme rises and runs.

    Args:
        course: The ground.
        deep: Depth of treads from which a flight is none, but floors with curbs between [m].
    """
    found: list[Staircase] = []
    for lane in course.lanes:
        before = lane.end_heights
        for flight in lane.close_flights(deep):
            for i in range(flight.first, flight.last + 1):
                rise = float(lane.heights[i] - before[i - 1])
                run = float(lane.breaks[i + 1] - lane.breaks[i])
                if not any(abs(s.rise - rise) < SAME and abs(s.run - run) < SAME for s in found):
                    found.append(Staircase(rise, run))
    if len(found) <= MOST:
        return found
    keys = np.array([[s.rise, s.run, s.slope] for s in found])
    picked = {int(k) for k in (*keys.argmin(axis=0), *keys.argmax(axis=0))}
    return [found[k] for k in sorted(picked)]
