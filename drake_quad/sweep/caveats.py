"""What has to be said beside a rate wherever it stands: console, report, published sections."""

from typing import Any

KINEMATIC = "Kinematic trials are among them: no physics, so they prove nothing."
SHARED = (
    "All cells have the same draws: bounds hold in each alone, and may be too narrow over several."
)


def caveats_of(told: dict[str, Any]) -> list[str]:
    """Sentences without which the rate would say more than was found.

    Args:
        told: The findings of a sweep, as of `tell`.
    """
    lines = []
    if not told["complete"]:
        lines.append(f"{told['trials']} of the {told['asked']} trials of the study are done.")
    if told["given_up"]:
        lines.append(
            f"{told['given_up']} that began before others of them are not done: those that end "
            "early are more of these than of all."
        )
    if told["kinematic"]:
        lines.append(KINEMATIC)
    if told["sharing"] > 1:
        lines.append(SHARED)
    if told["repeats"]:
        lines.append(
            f"{told['repeats']} came out exactly as another of the same cell: nothing in them is "
            "random, they are no evidence of their own, and the bounds are too narrow."
        )
    return lines
