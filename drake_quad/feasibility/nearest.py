"""The nearest stairs that a robot climbs: lower steps, or deeper treads."""

from collections.abc import Callable
from dataclasses import replace
from math import floor
from typing import Any

from drake_quad.terrain.elements import DEFAULT_THICKNESS, RUN_MAX, Stairs

SEARCH_COUNT = 4  # steps of the flights that are tried in search of the nearest
LEAST_RISE = 0.02  # [m] below which nothing is called stairs
FINE = 0.01  # [m] to which the nearest rise is sought
SHRINK = 0.85  # ratio of the next rise to the last as long as nothing works
# Ratio and tries on treads like floors, which take long to plan; deeper ones are no easier.
SHRINK_DEEP = 0.6
TRIES, TRIES_DEEP = 30, 2
DEEPER = (1.15, 1.3, 1.5, 1.75, 2.0)  # ratios of deeper treads, tried if no rise works
VERIFY = 3  # rises that are tried on the flight's real number of steps


def nearest_stairs(
    climbs: Callable[[Stairs], bool], data: dict[str, Any], stairs: Stairs
) -> Stairs | None:
    """The nearest stairs that a robot climbs: a lower rise, or if none a deeper run.

    Args:
        climbs: Says whether stairs can be climbed.
        data: Figures behind the reason why `stairs` cannot be climbed.
        stairs: The stairs that cannot be climbed.

    Returns:
        Stairs of as many steps that are climbed; None if nothing was found.
    """
    rise, run, count = stairs.rise, stairs.run, stairs.count
    few = min(count, SEARCH_COUNT)
    # Treads with an overhang or over open risers are as thick as that.
    least = LEAST_RISE if stairs.closed else max(LEAST_RISE, DEFAULT_THICKNESS + 0.001)

    def works(rise: float) -> bool:
        return climbs(replace(stairs, rise=rise, count=few))

    hint, deep = data.get("nearest_rise"), "deep" in data
    if "nearest_rise" not in data or hint is not None:
        # Above a hint no rise works, not even on endless stairs, as far as it was sought.
        low = _down(SHRINK * rise if hint is None else hint)
        high = rise if hint is None else min(rise, low + FINE)
        tries = TRIES_DEEP if deep else TRIES
        while low >= least and tries > 0 and not works(low):
            low, high, tries = _down((SHRINK_DEEP if deep else SHRINK) * low), low, tries - 1
        if tries == 0:
            low = 0.0
        while low >= least and high - low > FINE + 1e-9:
            middle = _down(0.5 * (low + high))
            low, high = (middle, high) if works(middle) else (low, middle)
        for lower in range(VERIFY):
            found = replace(stairs, rise=round(low - lower * FINE, 3))
            if found.rise >= least and (few == count or climbs(found)):
                return found
    for times in () if deep else DEEPER:
        deeper = replace(stairs, run=round(times * run, 2))
        if deeper.run <= RUN_MAX and climbs(deeper):
            return deeper
    return None


def _down(rise: float) -> float:
    """A rise [m], rounded down to millimetres."""
    return floor(1000.0 * rise + 1e-6) / 1000.0
