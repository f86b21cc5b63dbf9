"""Which value each trial of a study has: study and index decide it, on any machine alike."""

from collections.abc import Sequence
from math import ceil, floor
from typing import Any

import numpy as np

from drake_quad.sweep.study import Study, Vary

WIDEST = 4.0  # standard deviations at which a normal distribution is cut off
DRAWN = ("uniform", "log_uniform", "normal", "integers", "choice")
GRID = ("values", "linspace", "cases")
Value = Any  # what a scenario's field can hold: a number, text, a list, ...


def distribution_of(vary: Vary) -> str:
    """The one of DRAWN and GRID that is given; in a checked study it is just one."""
    return next(way for way in (*DRAWN, *GRID) if getattr(vary, way) is not None)


def axis_values(vary: Vary) -> list[Value]:
    """The values of an axis of the grid, in order; for `cases` their names."""
    if vary.cases is not None:
        return list(vary.cases)
    if vary.linspace is not None:
        first, last, count = vary.linspace
        return [float(value) for value in np.linspace(first, last, int(count))]
    return list(vary.values or [])


def draw(vary: Vary, u: float) -> Value:
    """The value at `u` in [0, 1) of the distribution: the inverse of its cumulative function."""
    if vary.choice is not None:
        return vary.choice[int(u * len(vary.choice))]
    if vary.integers is not None:
        first, last = vary.integers
        return first + int(u * (last - first + 1))
    if vary.uniform is not None:
        low, high = vary.uniform
        value = low + u * (high - low)
    elif vary.log_uniform is not None:
        low, high = vary.log_uniform
        value = low * float(np.exp(u * np.log(high / low)))
    else:
        from scipy.special import ndtri  # see Draws._sequence

        assert vary.normal is not None
        mean, deviation = vary.normal
        # ndtri(0) is minus infinity: no draw is farther out than WIDEST
        value = mean + deviation * float(np.clip(ndtri(u), -WIDEST, WIDEST))
    return float(value) if vary.step is None else _rounded(value, vary)


def _rounded(value: float, vary: Vary) -> float:
    """The nearest whole multiple of `step` between the ends of the distribution."""
    assert vary.step is not None
    count = round(value / vary.step)
    ends = vary.uniform or vary.log_uniform
    if ends is not None:
        within = multiples_within(ends, vary.step)
        if within:
            count = min(max(count, within[0]), within[-1])
    # 0.003 itself, and not 3 * 0.001, which is another number
    return float(f"{count * vary.step:.12g}")


def multiples_within(ends: Sequence[float], step: float) -> range:
    """The whole numbers whose product with `step` lies between the two ends."""
    # Ends that are multiples themselves count, whatever their last digits are.
    low, high = (round(end / step, 9) for end in ends)
    return range(ceil(low), floor(high) + 1)


def support_of(vary: Vary) -> list[Value]:
    """Values that stand for all possible ones: both ends, or each element of a list."""
    if vary.choice is not None:
        return list(vary.choice)
    if distribution_of(vary) in GRID:
        return axis_values(vary)
    return [draw(vary, 0.0), draw(vary, 1.0 - 2.0**-53)]


class Draws:
    """The draws of a checked study.

    A trial is a cell of the grid and a number of draws in it. Trials go through all cells before
    any cell has its next trial, so that the first trials of a study are a smaller study.

    Args:
        study: The study.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.axes = [vary for vary in study.vary if distribution_of(vary) in GRID]
        self.drawn = [vary for vary in study.vary if distribution_of(vary) in DRAWN]
        self._values = [axis_values(vary) for vary in self.axes]
        self.cells = int(np.prod([len(v) for v in self._values], dtype=np.int64))
        self.count = self.cells * study.trials  # number of all trials
        self._sobol: dict[int, np.ndarray] = {}  # by cell

    def values(self, index: int) -> list[Value]:
        """The trial's values, in the order of `study.vary`; for `cases` the name."""
        cell = index % self.cells
        places = np.unravel_index(cell, [len(values) for values in self._values])
        of_axis = {
            id(vary): values[int(place)]
            for vary, values, place in zip(self.axes, self._values, places, strict=True)
        }
        points = dict(zip(map(id, self.drawn), self._point(index), strict=True))
        return [
            of_axis[id(vary)] if id(vary) in of_axis else draw(vary, points[id(vary)])
            for vary in self.study.vary
        ]

    def seed(self, index: int) -> int:
        """The trial's own `simulation.seed`."""
        return int(self._generator(self._number(index)).integers(2**31))

    def _number(self, index: int) -> int:
        return index // self.cells if self.study.draws == "common" else index

    def _generator(self, number: int) -> np.random.Generator:
        seed = np.random.SeedSequence(self.study.seed, spawn_key=(number,))
        return np.random.default_rng(seed)

    def _point(self, index: int) -> list[float]:
        """A point of the unit cube, a coordinate for each of `drawn`."""
        if not self.drawn:
            return []
        if self.study.sampling == "sobol":
            cell = 0 if self.study.draws == "common" else index % self.cells
            if cell not in self._sobol:
                self._sobol[cell] = self._sequence(cell)
            return [float(u) for u in self._sobol[cell][index // self.cells]]
        generator = self._generator(self._number(index))
        generator.integers(2**31)  # this number is the trial's seed
        return [float(u) for u in generator.random(len(self.drawn))]

    def _sequence(self, cell: int) -> np.ndarray:
        """A cell's Sobol sequence (N, d), Owen-scrambled by the study's seed and the cell's number.

        Each cell has its own: every second point of one sequence lies in half of the space.
        """
        key = (cell,) if cell else ()
        generator = np.random.default_rng(np.random.SeedSequence(self.study.seed, spawn_key=key))
        from scipy.stats import qmc  # takes half a second, which most processes can save

        sequence = qmc.Sobol(len(self.drawn), scramble=True, rng=generator)
        return np.asarray(sequence.random_base2((self.study.trials - 1).bit_length()))
