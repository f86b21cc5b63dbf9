"""What a gait is wished to be good at, and what margin a quick gait is to keep."""

from dataclasses import dataclass, replace

from drake_quad.errors import InputError
from drake_quad.robot.model import RobotModel
from drake_quad.stability.safety import safe_margin
from drake_quad.util.numbers import is_finite_real

PREFER = ("margin", "balanced", "speed")
KEPT = 0.8  # of the margin of the gait that was found for margin: what `balanced` keeps
LEAST_MARGIN = 0.010  # [m] that `speed` keeps at least


@dataclass(frozen=True)
class Wish:
    """What a gait is to be good at.

    Attributes:
        prefer: One of PREFER: the most margin; the quickest that keeps KEPT of that margin; or the
            quickest that keeps the margin with which a run counts as safe.
        speed: Speed on the flights that is enough [m/s]; it then has the margin that is left.
        min_margin: Margin that the plan is to keep, instead of what `prefer` says [m].
    """

    prefer: str = "margin"
    speed: float | None = None
    min_margin: float | None = None

    @property
    def quick(self) -> bool:
        """Whether the gait's times are to be chosen at all."""
        return self.prefer != "margin" or self.speed is not None or self.min_margin is not None

    @property
    def less_margin(self) -> bool:
        """Whether it may have much less margin than the gait that was found for margin."""
        return self.quick and (self.prefer != "balanced" or self.min_margin is not None)

    def steps(self) -> tuple["Wish", ...]:
        """Wishes that are sought one after the other, each from what was found before.

        Much speed is sought from a balanced gait on: where times are as short as that, and one more
        step fails on the whole course, that gait is still there.
        """
        if self.prefer == "speed" and self.speed is None and self.min_margin is None:
            return replace(self, prefer="balanced"), self
        return (self,)

    def check(self) -> None:
        """Makes sure that there can be such a wish.

        Raises:
            InputError: The error names the option, its value and what would be right.
        """
        if self.prefer not in PREFER:
            remedy = f"give {', '.join(PREFER[:-1])} or {PREFER[-1]}"
            raise InputError(source="--prefer", field="prefer", value=self.prefer, remedy=remedy)
        for option, value, unit in (
            ("speed", self.speed, "m/s"),
            ("min-margin", self.min_margin, "metres"),
        ):
            if value is not None and not (is_finite_real(value) and value > 0.0):
                remedy = f"give {unit}, more than 0"
                field = option.replace("-", "_")
                raise InputError(source=f"--{option}", field=field, value=value, remedy=remedy)

    def least_margin(self, robot: RobotModel, margin: float) -> float:
        """The margin that a plan is to keep [m], where the gait found for margin has `margin`."""
        if self.min_margin is not None:
            return self.min_margin
        safe = max(safe_margin(robot), LEAST_MARGIN)
        fast = self.prefer == "speed" or (self.prefer == "margin" and self.speed is not None)
        return min(safe, margin) if fast else KEPT * margin


@dataclass(frozen=True)
class Kept:
    """What a quick plan is to keep.

    Attributes:
        margin: Static margin [m].
        zmp_margin: Margin of the zero-moment point [m].
    """

    margin: float
    zmp_margin: float

    def spare(self, margin: float, zmp_margin: float) -> float:
        """How much more than that there is, of the one that has less [m]."""
        return min(margin - self.margin, zmp_margin - self.zmp_margin)

    def more(self, by: float) -> "Kept":
        """So much more of both [m]."""
        return Kept(self.margin + by, self.zmp_margin + by)


def what_is_kept(wish: Wish, robot: RobotModel, margin: float, zmp_margin: float) -> Kept:
    """What a quick plan is to keep, of the margins of the gait that was found for margin.

    Args:
        wish: What the gait is to be good at.
        robot: The robot.
        margin: Static margin of that gait [m].
        zmp_margin: Its margin of the zero-moment point [m].
    """
    least = wish.least_margin(robot, margin)
    return Kept(least, min(least, wish.least_margin(robot, zmp_margin)))
