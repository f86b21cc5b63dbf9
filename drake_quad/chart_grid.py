"""The grid of a chart: which rises and runs are looked at."""

from dataclasses import dataclass
from math import isfinite

from drake_quad.check_ask import check_numbers
from drake_quad.errors import InputError

MOST_CELLS = 10_000


@dataclass(frozen=True)
class Span:
    """Values from one to another, both counted, a step apart [m]."""

    first: float
    last: float
    step: float

    def values(self, name: str) -> list[float]:
        """The values [m], to the tenth of a millimetre.

        Raises:
            InputError: If the span, of option --`name`-..., is none.
        """
        bounds = (("from", self.first), ("to", self.last), ("step", self.step))
        for word, value in bounds:
            if not (isfinite(value) and value > 0.0):
                option = f"--{name}-{word}"
                remedy = "give metres, more than 0"
                raise InputError(source=option, field=option[2:], value=value, remedy=remedy)
        if self.last < self.first:
            option = f"--{name}-to"
            remedy = f"give no less than --{name}-from, {self.first:g}"
            raise InputError(source=option, field=option[2:], value=self.last, remedy=remedy)
        count = int((self.last - self.first) / self.step + 1e-6) + 1
        if count > MOST_CELLS:
            option = f"--{name}-step"
            remedy = f"makes {count} columns or rows: give more"
            raise InputError(source=option, field=option[2:], value=self.step, remedy=remedy)
        return [round(self.first + k * self.step, 4) for k in range(count)]


def grid_of(rises: Span, runs: Span, count: int) -> list[tuple[float, float]]:
    """Rise and run of every cell [m], run by run.

    Raises:
        InputError: If there can be no such stairs, or they are too many.
    """
    cells = [(rise, run) for run in runs.values("run") for rise in rises.values("rise")]
    if len(cells) > MOST_CELLS:
        remedy = f"{len(cells)} cells are too many: give a larger step"
        raise InputError(source="--rise-step", field="step", value=rises.step, remedy=remedy)
    try:
        for rise, run in cells:
            check_numbers(rise, run, count)
    except InputError as error:
        span = {"--rise": rises, "--run": runs}.get(error.source)
        if span is None:
            raise
        option = f"{error.source}-to"  # a first value that is not positive was found above
        raise InputError(
            source=option, field=option[2:], value=span.last, remedy=error.remedy
        ) from None
    return cells
