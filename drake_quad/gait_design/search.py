"""Differential evolution of a gait's parameters, for one pattern of footholds."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.gait_design.candidates import (
    CandidateBatch,
    Staircase,
    candidate_bounds,
    make_candidates,
)
from drake_quad.gait_design.objective import (
    NAMES,
    evaluate_candidates,
    objective,
    wanted_with_tolerance,
)
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.robot.model import LinkOutline, RobotModel, leg_length

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
class SearchSettings:
    """Settings of differential evolution (Storn and Price 1997).

    Attributes:
        seed: Seed of the generator: a design is the same each time.
        strategy: The strategy's name in scipy.
        recombination: Probability that a parameter is taken from the mutant.
        members: Number of members of the population.
    """

    seed: int
    strategy: str
    recombination: float
    members: int


QUICK = SearchSettings(1, "best1bin", 0.7, 40)
AGAIN = SearchSettings(2, "best1bin", 0.7, 40)
# Settles later: finds more where a robot is at its limits (eleven such searches, four seeds each).
THOROUGH = SearchSettings(2, "currenttobest1bin", 0.9, 60)
SEARCH_SETTINGS = (QUICK, AGAIN, THOROUGH)  # in turn, until one leads to a good gait


def swing_clearance(robot: RobotModel) -> float:
    """Clearance of swing feet from what they pass [m]."""
    return CLEARANCE * min(leg_length(robot), 1.0)


def latin_hypercube(count: int, axes: int, generator: np.random.Generator) -> FloatArray:
    """Points in the unit cube (count, axes), one in each of `count` slices along every axis.

    These are the numbers of `scipy.stats.qmc.LatinHypercube` (McKay, Beckman and Conover 1979).
    To import that takes half a second, which is as much as a whole search.
    """
    inside = generator.uniform(size=(count, axes))
    slices = np.tile(np.arange(1, count + 1), (axes, 1))
    for along in slices:
        generator.shuffle(along)
    return np.asarray((slices.T - inside) / count)


class Search:
    """Objective of a pattern's candidates, for a search that keeps the better of two.

    Attributes:
        rivals: (C,) what the search has in their places already: of candidates that lack more, no
            more is found out than that.
    """

    def __init__(
        self,
        robot: RobotModel,
        shape: LinkOutline,
        pattern: FootholdPattern,
        flights: Sequence[Staircase],
        wanted: FloatArray | None = None,
    ) -> None:
        self._robot, self._shape, self._pattern, self._flights = robot, shape, pattern, flights
        self._wanted = wanted_with_tolerance(robot) if wanted is None else wanted
        self.rivals: FloatArray | None = None

    def __call__(self, x: FloatArray) -> FloatArray:
        """What is lacking (C,), for parameters in columns (7 or 9, C)."""
        grid = make_candidates(self._robot, self._pattern, x.T)
        lower, upper, usual = candidate_bounds(self._pattern)
        unusual = UNUSUAL * np.mean(((x.T - usual) / (upper - lower)) ** 2, axis=1)
        enough = None if self.rivals is None else self.rivals - unusual + ROUNDING
        rows = least_clearance(self._robot, self._shape, grid, self._flights, enough, self._wanted)
        return np.asarray(unusual + objective(rows, self._wanted))

    def least(
        self,
        first: FloatArray,
        way: SearchSettings,
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
        from scipy.optimize import differential_evolution  # a third of a second

        most, generation = GENERATIONS[self._pattern.per_tread], 0

        def callback(intermediate_result: Any) -> bool:  # an OptimizeResult
            nonlocal generation
            generation += 1
            self.rivals = intermediate_result.population_energies.copy()
            best = float(self.rivals.min())
            return best <= enough or (best > hopeless and generation >= AFTER * most)

        self.rivals = None
        result = differential_evolution(
            self,
            candidate_bounds(self._pattern)[:2].T.tolist(),
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


def least_clearance(
    robot: RobotModel,
    shape: LinkOutline,
    grid: CandidateBatch,
    flights: Sequence[Staircase],
    enough: FloatArray | None = None,
    wanted: FloatArray | None = None,
) -> FloatArray:
    """Smallest slacks on any of the flights, (C, 7) by NAMES.

    `enough` and `wanted` are those of `evaluate_candidates`.
    """
    rows = np.full((len(grid), len(NAMES)), np.inf)
    wanted = wanted_with_tolerance(robot) if wanted is None else wanted
    enough = np.full(len(grid), np.inf) if enough is None else enough
    for stairs in flights:
        length = grid.stance_length if stairs.rise == 0.0 else None
        on = objective(rows, wanted) <= enough
        rows[on] = evaluate_candidates(
            robot, shape, grid.take(on), stairs, clearance=swing_clearance(robot),
            stance_length=length, found=rows[on], enough=enough[on], wanted=wanted,
        )  # fmt: skip
    return rows
