"""The shortest time at a gait's switches that leaves enough margin, by secants."""

from collections.abc import Callable
from math import inf, isfinite

TRIALS = 5  # at most
NEAR = 0.04  # of a time: no other is tried so near to it
CLOSE_TIMES = 0.2  # of a time: a shorter one that was not enough is near it


def seek_switch(
    trial: Callable[[float], float],
    first: float,
    least: float,
    *,
    near: float,
    most: float = inf,
    known: dict[float, float] | None = None,
) -> float:
    """The shortest time at switches with which enough margin is left, by secants.

    Args:
        trial: The margin [m] beyond what is to be kept with such a time [s]; it mostly grows
            with it.
        first: The time to begin with [s].
        least: The shortest that is tried [s].
        near: So much more margin than is to be kept is near enough [m].
        most: The longest that is tried [s].
        known: Margins of times that were tried before [m]; those tried here are added.

    Returns:
        The shortest that was tried and left enough [s]; infinite if none did.
    """
    known = {} if known is None else known
    switch = min(max(first, least), max(most, least))
    for _ in range(TRIALS):
        if switch not in known:
            known[switch] = trial(switch)
        best = min((t for t, m in known.items() if m >= 0.0), default=inf)
        low = max((t for t, m in known.items() if m < 0.0 and t < best), default=None)
        if best <= least:
            break
        # A margin that is near enough may belong to a time that is not, far above one that is too
        # short by a little.
        close = low is None or best - low < CLOSE_TIMES * best
        if best < inf and known[best] <= near and close:
            break
        if best == inf:
            if max(known) >= most or _falls_short(known, most):
                break
            switch = min(1.4 * max(known), most)
        elif low is None:
            switch = max(0.75 * best, least)
        elif best - low < NEAR * best:
            break
        else:  # between them, a little to the safe side
            under, over = -known[low], known[best]
            share = under / (under + over) if 0.0 < under < inf else 0.75
            switch = low + min(max(1.1 * share, 0.25), 0.85) * (best - low)
    return min((t for t, m in known.items() if m >= 0.0), default=inf)


def _falls_short(known: dict[float, float], most: float) -> bool:
    """Whether a margin that goes on growing as between the last two times is negative at `most`.

    A margin grows ever more slowly with time: it is at most so large there. The zero-moment point's
    is hardly larger for a longer wait, where legs throw the body about as they swing.

    Args:
        known: Margins of the times that were tried [m].
        most: The longest time that is tried [s].
    """
    last = sorted(known)[-2:]
    if len(last) < 2 or not all(isfinite(known[t]) for t in last):
        return False
    before, after = (known[t] for t in last)
    return after + (after - before) / (last[1] - last[0]) * (most - last[1]) < 0.0
