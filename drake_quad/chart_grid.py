"""The grid of a chart: which rises and runs are looked at."""

from dataclasses import dataclass
from math import floor, inf

from drake_quad.check_ask import check_numbers
from drake_quad.errors import InputError
from drake_quad.terrain_check_stairs import RISE_MAX, RUN_MAX

MOST_CELLS = 10_000
FINEST = 1e-4  # [m] to which values are rounded: steps below it would give some of them twice
MOST = {"rise": RISE_MAX, "run": RUN_MAX}


@dataclass(frozen=True)
class Span:
    """Values from one to another, both counted, a step apart [m]."""

    first: float
    last: float
    step: float

    def values(self, name: str) -> list[float]:
        """The values of `name`, rise or run [m], to the tenth of a millimetre.

        Raises:
            InputError: If the span, of option --`name`-..., is none.
        """
        most = MOST[name]
        for word, value, bound in (
            ("from", self.first, most), ("to", self.last, most), ("step", self.step, inf)
        ):  # fmt: skip
            if not (FINEST <= value <= bound and value < inf):
                to = f"{FINEST:g} or more" if bound == inf else f"{FINEST:g} to {bound:g}"
                raise _wrong(f"--{name}-{word}", value, f"give metres, {to}")
        if self.last < self.first:
            remedy = f"give no less than --{name}-from, {self.first:g}"
            raise _wrong(f"--{name}-to", self.last, remedy)
        count = int((self.last - self.first) / self.step + 1e-6) + 1
        if count > MOST_CELLS:
            remedy = f"makes {count} columns or rows: give more"
            raise _wrong(f"--{name}-step", self.step, remedy)
        # From a whole tenth: or the finest steps would round to some values twice, to others never.
        first = FINEST * floor(self.first / FINEST + 1e-6)
        return [round(first + k * self.step, 4) for k in range(count)]


def grid_of(rises: Span, runs: Span, count: int) -> list[tuple[float, float]]:
    """Rise and run of every cell [m], run by run.

    Raises:
        InputError: If there can be no such stairs, or they are too many.
    """
    up, along = rises.values("rise"), runs.values("run")
    check_numbers(up[0], along[0], count)
    cells = len(up) * len(along)
    if cells > MOST_CELLS:
        remedy = f"{cells} cells are too many, more than {MOST_CELLS}: give a larger step"
        raise _wrong("--rise-step", rises.step, remedy)
    return [(rise, run) for run in along for rise in up]


def _wrong(option: str, value: float, remedy: str) -> InputError:
    """What is said of an option that cannot be."""
    return InputError(source=option, field=option[2:], value=value, remedy=remedy)
