"""The paper's statements beside what we find: what a finding is, and all of them in order."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from drake_quad.gait.transition import Transition


class Verdict(StrEnum):
    """What our numbers say of a statement."""

    CONFIRMED = "confirmed"
    CONDITIONAL = "confirmed with a condition"
    CONTRADICTED = "contradicted"


@dataclass(frozen=True, eq=False)
class Finding:
    """One statement of the paper, and what we find.

    Attributes:
        key: A name for it, unique.
        statement: What the paper says, in short.
        where: Section or equation.
        template: What we find, with `numbers` in its braces.
        numbers: The figures, by name; SI units, degrees where the text has them.
        figures: The numbers of the figures that show it.
        verdict: Whether it holds.
    """

    key: str
    statement: str
    where: str
    template: str
    numbers: Mapping[str, float]
    figures: tuple[int, ...]
    verdict: Verdict

    def __post_init__(self) -> None:
        # A rounding error of a hair must not decide between 0.000 and -0.000 on the page.
        exact = {key: round(float(value), 9) + 0.0 for key, value in self.numbers.items()}
        object.__setattr__(self, "numbers", MappingProxyType(exact))

    @property
    def found(self) -> str:
        """What we find, with its figures."""
        return self.template.format(**self.numbers)


def margins_of(transition: Transition) -> dict[str, float]:
    """Returns the margins of a transition's steps [m] as `m1`, `m2`, ..."""
    return {f"m{k}": step.margin for k, step in enumerate(transition.steps, start=1)}


def order_of(transition: Transition) -> str:
    """Returns the order of a transition's legs as the paper writes it, for example `2-3-4-1-3`."""
    return "-".join(str(int(leg)) for leg in transition.order)
