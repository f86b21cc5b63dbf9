"""The search for a pattern's best gait, by what room it leaves on endless staircases."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, differential_evolution

from drake_quad.design.candidate import Grid, bounds, make_grid
from drake_quad.design.evaluate import NAMES, evaluate, lacking_room, wanted_room
from drake_quad.design.shape import Shape
from drake_quad.design.staircase import Staircase
from drake_quad.gait.legs import FloatArray
from drake_quad.planning.pattern import Pattern
from drake_quad.robot.robot_model import RobotModel, leg_length

CLEARANCE = 0.02  # of swing feet, of a leg of one metre
GENERATIONS = {1: 80, 2: 160}  # of a search, by places a tread
UNUSUAL = 0.05  # that a gait unlike the usual one costs
ROUNDING = 1e-9  # between two ways to the same number
# What surely is a gait: all slacks are positive, as their mean cannot make up for one that is not.
SURELY = -0.35
# What lacks so much after so much of its search will not be one: of several hundred searches none
# came back from half of that.
HOPELESS, AFTER = 0.6, 0.4


@dataclass(frozen=True)
class Way:
    """A way of differential evolution (Storn and Price 1997).

    Attributes:
        seed: A design is the same each time.
        strategy: As scipy names it.
        recombination: How likely a parameter is another.
        members: Of the population.
    """

    seed: int
    strategy: str
    recombination: float
    members: int


QUICK = Way(1, "best1bin", 0.7, 40)
AGAIN = Way(2, "best1bin", 0.7, 40)
# Settles later: finds more where a robot is at its limits (eleven such searches, four seeds each).
THOROUGH = Way(2, "currenttobest1bin", 0.9, 60)
WAYS = (QUICK, AGAIN, THOROUGH)  # in turn, until one leads to a good gait


def swing_clearance(robot: RobotModel) -> float:
    """By which swing feet are to clear what they pass [m]."""
    return CLEARANCE * min(leg_length(robot), 1.0)


class Search:
    """What candidates of a pattern lack of full room, for a search that keeps the better of two.

    Attributes:
        rivals: (C,) what the search has in their places already: of candidates that lack more, no
            more is found out than that.
    """

    def __init__(
        self,
        robot: RobotModel,
        shape: Shape,
        pattern: Pattern,
        flights: Sequence[Staircase],
        wanted: FloatArray | None = None,
    ) -> None:
        self._robot, self._shape, self._pattern, self._flights = robot, shape, pattern, flights
        self._wanted = wanted_room(robot) if wanted is None else wanted
        self.rivals: FloatArray | None = None

    def __call__(self, x: FloatArray) -> FloatArray:
        """What is lacking (C,), for parameters in columns (7 or 9, C)."""
        grid = make_grid(self._robot, self._pattern, x.T)
        lower, upper, usual = bounds(self._pattern)
        unusual = UNUSUAL * np.mean(((x.T - usual) / (upper - lower)) ** 2, axis=1)
        enough = None if self.rivals is None else self.rivals - unusual + ROUNDING
        room = least_room(self._robot, self._shape, grid, self._flights, enough, self._wanted)
        return np.asarray(unusual + lacking_room(room, self._wanted))

    def least(
        self,
        first: FloatArray,
        way: Way,
        *,
        enough: float = -np.inf,
        hopeless: float = np.inf,
    ) -> FloatArray:
        """The parameters that lack least, from a first population on.

        Args:
            first: The population, in rows.
            way: How to search.
            enough: Ends as soon as no more than that is lacking.
            hopeless: Ends if more than that is lacking when AFTER of it is over.
        """
        most, generation = GENERATIONS[self._pattern.per_tread], 0

        def callback(intermediate_result: OptimizeResult) -> bool:
            nonlocal generation
            generation += 1
            self.rivals = intermediate_result.population_energies.copy()
            best = float(self.rivals.min())
            return best <= enough or (best > hopeless and generation >= AFTER * most)

        self.rivals = None
        result = differential_evolution(
            self,
            bounds(self._pattern)[:2].T.tolist(),
            init=first,
            maxiter=most,
            rng=np.random.default_rng(way.seed),
            polish=False,
            vectorized=True,
            updating="deferred",
            strategy=way.strategy,
            recombination=way.recombination,
            callback=callback,
        )
        return np.asarray(result.x)


def least_room(
    robot: RobotModel,
    shape: Shape,
    grid: Grid,
    flights: Sequence[Staircase],
    enough: FloatArray | None = None,
    wanted: FloatArray | None = None,
) -> FloatArray:
    """The least room on any of the flights, (C, 7) by NAMES; `enough`, `wanted`: see `evaluate`."""
    room = np.full((len(grid), len(NAMES)), np.inf)
    wanted = wanted_room(robot) if wanted is None else wanted
    enough = np.full(len(grid), np.inf) if enough is None else enough
    for stairs in flights:
        length = grid.stance_length if stairs.rise == 0.0 else None
        on = lacking_room(room, wanted) <= enough
        room[on] = evaluate(
            robot, shape, grid.take(on), stairs, clearance=swing_clearance(robot),
            stance_length=length, found=room[on], enough=enough[on], wanted=wanted,
        )  # fmt: skip
    return room
