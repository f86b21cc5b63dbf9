"""What a gait is to be good at, margin or speed, and which margins a quick gait has to keep."""

from dataclasses import dataclass, replace

from drake_quad.errors import InputError
from drake_quad.robot.model import RobotModel
from drake_quad.scenario.motion_config import PREFER
from drake_quad.stability.safety import safe_margin
from drake_quad.util.numbers import is_finite_real

USUAL = "balanced"  # of PREFER, where nothing is asked for
BALANCE = ("static", "dynamic")
KEPT = 0.8  # of the margin of the gait that was found for margin: what `balanced` keeps
LEAST_MARGIN = 0.010  # [m] that `speed` keeps at least


@dataclass(frozen=True)
class GaitPreference:
    """What a gait is to be good at.

    Attributes:
        prefer: One of PREFER: the most margin; the quickest that keeps KEPT of that margin; or the
            quickest that keeps the margin with which a run counts as safe, and LEAST_MARGIN.
        speed: Speed on the flights that is enough [m/s]; it then has the margin that is left.
        min_margin: Margin that the plan is to keep, instead of what `prefer` says [m].
        balance: `static`, or `dynamic`: the margin that counts is that of the zero-moment point,
            and the robot need not be able to stand still at every time.
    """

    prefer: str = "margin"
    speed: float | None = None
    min_margin: float | None = None
    balance: str = BALANCE[0]

    @classmethod
    def asked(
        cls,
        prefer: str | None = None,
        speed: float | None = None,
        min_margin: float | None = None,
        balance: str = BALANCE[0],
    ) -> "GaitPreference":
        """The preference of a person who may have said nothing, or a part of it.

        Args:
            prefer: One of PREFER. If None, it is USUAL where nothing else is asked for. A speed, a
                margin or the balance that is asked for stands alone: less margin may be kept then.
            speed: Speed on the flights that is enough [m/s].
            min_margin: Margin that the plan is to keep [m].
            balance: One of BALANCE.
        """
        if prefer is None:
            alone, nothing = cls("margin", speed, min_margin, balance), cls("margin")
            return cls(USUAL) if alone == nothing else alone
        return cls(prefer, speed, min_margin, balance)

    @property
    def dynamic(self) -> bool:
        """Whether the gait is balanced by its motion."""
        return self.balance == "dynamic"

    @property
    def quick(self) -> bool:
        """Whether the gait's times are to be chosen at all."""
        given = self.speed is not None or self.min_margin is not None
        return self.prefer != "margin" or given or self.dynamic

    @property
    def less_margin(self) -> bool:
        """Whether it may have much less margin than the gait that was found for margin."""
        return self.quick and (
            self.prefer != "balanced" or self.min_margin is not None or self.dynamic
        )

    def steps(self) -> tuple["GaitPreference", ...]:
        """Preferences that are sought one after the other, each from what was found before.

        Much speed is sought from a balanced gait on: where times are as short as that, and one more
        step fails on the whole course, that gait is still there.
        """
        given = self.speed is not None or self.min_margin is not None or self.dynamic
        if self.prefer == "speed" and not given:
            return replace(self, prefer="balanced"), self
        return (self,)

    def check(self) -> None:
        """Makes sure that its values can be used.

        Raises:
            InputError: The error names the option, its value and what would be right.
        """
        for option, value, choices in (
            ("prefer", self.prefer, PREFER),
            ("balance", self.balance, BALANCE),
        ):
            if value not in choices:
                remedy = f"give {', '.join(choices[:-1])} or {choices[-1]}"
                raise InputError(source=f"--{option}", field=option, value=value, remedy=remedy)
        for option, figure, unit in (
            ("speed", self.speed, "m/s"),
            ("min-margin", self.min_margin, "metres"),
        ):
            if figure is not None and not (is_finite_real(figure) and figure > 0.0):
                remedy = f"give {unit}, more than 0"
                field = option.replace("-", "_")
                raise InputError(source=f"--{option}", field=field, value=figure, remedy=remedy)

    def least_margin(self, robot: RobotModel, margin: float) -> float:
        """The margin that a plan is to keep [m], where the gait found for margin has `margin`."""
        if self.min_margin is not None:
            return self.min_margin
        safe = max(safe_margin(robot), LEAST_MARGIN)
        slow = self.speed is None and not self.dynamic
        fast = self.prefer == "speed" or (self.prefer == "margin" and not slow)
        return min(safe, margin) if fast else KEPT * margin


@dataclass(frozen=True)
class RequiredMargins:
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

    def more(self, by: float) -> "RequiredMargins":
        """So much more of both [m]."""
        return RequiredMargins(self.margin + by, self.zmp_margin + by)


def required_margins(
    preference: GaitPreference, robot: RobotModel, margin: float, zmp_margin: float
) -> RequiredMargins:
    """What a quick plan is to keep, of the margins of the gait that was found for margin.

    Args:
        preference: What the gait is to be good at.
        robot: The robot.
        margin: Static margin of that gait [m].
        zmp_margin: Its margin of the zero-moment point [m].
    """
    if preference.dynamic:  # a plan's margin then is that of its zero-moment point
        least = preference.least_margin(robot, zmp_margin)
        return RequiredMargins(least, least)
    least = preference.least_margin(robot, margin)
    return RequiredMargins(least, min(least, preference.least_margin(robot, zmp_margin)))
