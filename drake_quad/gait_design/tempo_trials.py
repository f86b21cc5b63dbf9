"""The trials of a gait's times that are compared with each other."""

from dataclasses import dataclass, field

from drake_quad.gait_design.designed import Walks
from drake_quad.gait_design.tempo import TempoTrial


@dataclass(eq=False)
class Trials:
    """The trials with one ratio of swings, at one height of the body, whose paths seek one margin.

    Attributes:
        known: The trials, by time at the switches [s].
        first: The first one that there is a plan of, which is of the whole mission.
        critical: The tasks that later ones are of, by their places in the mission; those first
            that had the least margin.
        cut_has_more: By how much a trial on the course cut short kept more than the course itself
            did, which others are taken to do, too [m].
    """

    known: dict[float, TempoTrial | None] = field(default_factory=dict)
    first: TempoTrial | None = None
    critical: tuple[int, ...] = ()
    cut_has_more: float = 0.0

    @property
    def walks(self) -> Walks | None:
        """The tasks that are planned for the next trial, and how they begin; None if all are."""
        if self.first is None or not self.critical:
            return None
        plans = self.first.designed.plan.plans
        return tuple((k, plans[k - 1].end) for k in self.critical)
