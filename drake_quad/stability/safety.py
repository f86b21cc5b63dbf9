"""Whether a run was safe, beyond having reached its goal: one definition, and one threshold.

A margin is a length, and what is little of it depends on the robot's size: SAFE_SHARE of a leg is
enough while it walks. Designs are wanted with twice as much on paper, for physics takes some of it.
Report, replay, console and designs all have it from here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any

from drake_quad.robot.model import RobotModel, leg_length

SAFE_SHARE = 0.025  # of a leg's length: 0.030 m of the shipped robot
PAPER_FACTOR = 2.0
MOST_SLIP = 0.01  # [m] of a standing foot
NO_SUPPORT = -1.0  # [m] a log has it, or less, instead of a margin where no foot bears


@dataclass(frozen=True)
class Safety:
    """The verdict on a run.

    Attributes:
        safe: Whether nothing is lacking; None of a kinematic replay, which proves nothing.
        lacks: What is, a few words each.
        kept: What is as it should be, a few words each.
    """

    safe: bool | None
    lacks: tuple[str, ...]
    kept: tuple[str, ...]

    @property
    def words(self) -> str:
        """The verdict in a line."""
        if self.safe is None:
            return "nothing is known of its safety: a kinematic replay has no physics"
        parts = self.kept if self.safe else self.lacks
        return f"{'safe' if self.safe else 'not safe'}: {', '.join(parts)}"


def safe_margin(robot: RobotModel) -> float:
    """The least static margin of a run that counts as safe [m]."""
    return SAFE_SHARE * leg_length(robot)


def planned_margin(robot: RobotModel) -> float:
    """The least static margin that a plan is wanted to have [m]."""
    return PAPER_FACTOR * safe_margin(robot)


def margin_words(margin: float) -> str:
    """A margin with its unit [m]; or, where a log has NO_SUPPORT for it, why there is none.

    No foot bore; or the feet together did not press on the ground, and there was no zero-moment
    point.
    """
    if margin <= NO_SUPPORT:
        return "not borne by its feet"
    # A margin of a rounding error below zero is no negative one.
    return f"{round(margin, 6) + 0.0:.3f} m"


def judge_safety(summary: Mapping[str, Any], wanted: float) -> Safety:
    """The verdict on a run from its summary, in which a figure that is not there is a fault.

    Args:
        summary: What summary.json holds.
        wanted: The margin that is wanted, of `safe_margin` [m].
    """
    if summary.get("simulation") == "kinematic":
        return Safety(None, (), ())
    lacks: list[str] = []
    kept: list[str] = []

    def put(good: bool, words: str) -> None:
        (kept if good else lacks).append(words)

    outcome = str(summary.get("outcome"))
    if outcome != "goal_reached":
        lacks.append(f"the goal was not reached ({outcome})")
    margin = summary.get("margin")
    least = _number(margin if isinstance(margin, Mapping) else {}, "minimum")
    form = f"margin {{:.3f}} m (wanted {wanted:.3f})"
    lost = least <= NO_SUPPORT
    put(least >= wanted, margin_words(least) if lost else _figure("margin", form, least))
    under = _number(summary, "time_under_three_feet")
    words = _figure("feet that bear", "{:.2f} s on fewer than three feet", under)
    put(under == 0.0, "three feet carried load throughout" if under == 0.0 else words)
    figure, form = "nonfoot_contact_time", "other contacts for {:.3f} s"
    if figure not in summary:  # older runs counted samples alone
        figure, form = "nonfoot_contact_samples", "other contacts in {:.0f} samples"
    touched, none = _number(summary, figure), "nothing but feet touched"
    put(touched == 0.0, none if touched == 0.0 else _figure("contacts", form, touched))
    if "swing_hit_samples" in summary:  # older runs did not count them
        hits, force = _number(summary, "swing_hit_samples"), _number(summary, "swing_force_max")
        words = _figure(
            "what swing feet touch", f"swing feet hit something with {force:.0f} N", hits
        )
        put(hits == 0.0, "swing feet hit nothing" if hits == 0.0 else words)
    slip = _number(summary, "slip_max")
    most = f" (at most {1e3 * MOST_SLIP:g})"
    put(slip <= MOST_SLIP, _figure("slip", "slip {:.1f} mm", 1e3 * slip) + most)
    speed = _number(summary, "speed_ratio_max")
    if speed > 1.0:  # nothing in the simulation keeps joints from it
        lacks.append(f"a joint turned at {speed:.0%} of its speed limit")
    listed = summary.get("pushes")
    kicks = [k for k in listed if isinstance(k, Mapping)] if isinstance(listed, list) else []
    # The summary has null for a kick that the run did not come to: it proves nothing, either way.
    came = [kick for kick in kicks if kick.get("recovered", False) is not None]
    stood = sum(kick.get("recovered") is True for kick in came)
    if came:
        put(stood == len(came), f"{stood} of {len(came)} kicks withstood")
    if never := len(kicks) - len(came):
        kept.append(f"{never} of {len(kicks)} kicks never came")
    if not kicks:
        kept.append("no kick was tried")
    return Safety(not lacks, tuple(lacks), tuple(kept))


def _number(values: Mapping[str, Any], name: str) -> float:
    """A figure, nan where there is none: then no comparison holds."""
    value = values.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        return nan
    return float(value)


def _figure(name: str, form: str, value: float) -> str:
    """The figure in its words, or that there is none."""
    return form.format(value) if isfinite(value) else f"{name} not measured"
