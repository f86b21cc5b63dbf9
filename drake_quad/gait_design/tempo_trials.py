"""The trials of a gait's times that are compared with each other, and when to make no more."""

from dataclasses import dataclass, field

from drake_quad.gait_design.designed import Walks
from drake_quad.gait_design.tempo import TempoTrial

SLOWER = 0.97  # ratio of speeds by which a short flight's may be less than that of a long one
FALLEN = 2  # times at the switches with which a gait would fall over: then others would, too
NEVER = 3  # times without a plan, before there has been one, after which a gait is left


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


def most_speed(trial: TempoTrial) -> float:
    """The speed that a trial may have on the course itself [m/s]."""
    return trial.speed / SLOWER if trial.cut else trial.speed


@dataclass(eq=False)
class Failures:
    """The trials of a gait that had no plan, and when that is enough of them.

    Attributes:
        has_plan: Whether there was any plan, or is one with slow times.
        times: Swings (by ratio) and times at the switches [s] of those without.
        fallen: Times at the switches [s] with which the robot would fall over, however it sways, by
            how far its body is lowered (in legs).
    """

    has_plan: bool
    times: set[tuple[float, float]] = field(default_factory=set)
    fallen: dict[float, set[float]] = field(default_factory=dict)

    def add(self, stretch: float, switch: float, lowered: float, *, falls_over: bool) -> None:
        """Adds a trial without a plan.

        Args:
            stretch: Ratio of its swings.
            switch: Time at the switches [s].
            lowered: How far the body is lowered (in legs).
            falls_over: Whether the robot would fall over in all of its mission.
        """
        self.times.add((stretch, switch))
        if falls_over:
            self.fallen.setdefault(lowered, set()).add(switch)

    def forget(self, *, has_plan: bool) -> None:
        """Begins anew, because what is planned is another thing now; falls are remembered."""
        self.times.clear()
        self.has_plan = has_plan

    @property
    def hopeless(self) -> bool:
        """Whether no trial had a plan, with enough times that others would hardly have one."""
        return len(self.times) >= NEVER and not self.has_plan

    @property
    def doubtful(self) -> bool:
        """Whether no trial had a plan, with more than one time: one more is enough of any other."""
        return len(self.times) > 1 and not self.has_plan

    def always_falls(self, lowered: float) -> bool:
        """Whether the robot would fall over so low, whatever the times are."""
        return len(self.fallen.get(lowered, ())) >= FALLEN

    def falls(self, lowered: float, switch: float) -> bool:
        """Whether the robot would fall over so low with such a time at the switches [s]."""
        return switch in self.fallen.get(lowered, ())
