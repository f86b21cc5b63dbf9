"""What deviations of a fit are multiplied by, so that stated intervals hold 95 of 100 truths.

A fit's own deviations follow from the camera's figures and from what is known of stairs before.
They leave out what the model does not have, such as edges that grow, and are too careful where
what is known before says less than the image. How far they are off depends on the stairs, and on
how high the camera is. So there are factors for each kind of stairs as the fit itself has it, and
for low and high cameras.
"""

import numpy as np

from drake_quad.common import FloatArray

QUANTITIES = ("place", "height", "yaw", "overhang", "rise", "run")
DOWN, OPEN, OVERHUNG, UNEVEN, EVEN = "down", "open", "overhang", "uneven", "even"
OVERHANGS = 0.006  # [m] from which treads are said to reach over the risers
UNLIKE = 0.0022  # [m], root mean square, from which steps are said to differ
LOOKED_AT = 4  # steps, the nearest, that this is judged by
LOW = 0.6  # [m] over the ground, below which a camera is low

# Of each kind, for a low camera and for a high one, in the order of QUANTITIES. Fitted by
# `python -m benchmarks.perception.stairs --scenes 1500 --calibrate` with seeds 1000 and 2000, on
# scenes which no test and no table uses. A low camera hardly sees stairs down: it has the high
# one's. An overhang that is not looked for, or near zero, keeps its deviation.
FACTORS: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    EVEN: ((1.05, 0.78, 1.06, 1.0, 0.60, 1.08), (1.02, 1.25, 1.11, 1.0, 0.89, 1.25)),
    UNEVEN: ((1.14, 1.04, 0.99, 1.0, 0.79, 1.14), (1.08, 1.19, 1.05, 1.0, 1.14, 1.26)),
    OVERHUNG: ((1.10, 0.80, 1.04, 0.93, 0.59, 1.11), (1.07, 1.30, 1.18, 0.96, 0.97, 1.31)),
    OPEN: ((1.12, 2.62, 1.01, 1.0, 0.94, 1.08), (0.99, 1.32, 1.04, 1.0, 0.96, 1.16)),
    DOWN: ((0.71, 1.06, 0.71, 1.0, 0.97, 0.74), (0.71, 1.06, 0.71, 1.0, 0.97, 0.74)),
}


def kind_of_stairs(
    places: FloatArray, heights: FloatArray, *, overhang: float, is_open: bool
) -> str:
    """The kind of stairs that a fit came to, a key of FACTORS.

    Args:
        places: Places of nosings along the climb, (n,) [m].
        heights: Heights of the ground before them and of the treads, (n + 1,) [m].
        overhang: Distance that treads reach over the risers below [m].
        is_open: Whether there is nothing between the treads.
    """
    if heights[-1] < heights[0]:
        return DOWN
    if is_open:
        return OPEN
    if overhang > OVERHANGS:
        return OVERHUNG
    apart = np.hypot(_unlike(places[:LOOKED_AT]), _unlike(heights[: LOOKED_AT + 1]))
    return UNEVEN if apart > UNLIKE else EVEN


def _unlike(values: FloatArray) -> float:
    """How far values are from being equally far apart, root mean square."""
    if len(values) < 3:
        return 0.0
    steps = np.arange(len(values), dtype=float)
    left = values - np.polyval(np.polyfit(steps, values, 1), steps)
    return float(np.sqrt(np.mean(left**2)))


def deviation_factors(kind: str, *, camera_height: float) -> dict[str, float]:
    """The factors by quantity.

    Args:
        kind: A kind of stairs, see `kind_of_stairs`.
        camera_height: Height of the camera over the ground before the first nosing [m].
    """
    low, high = FACTORS[kind]
    return dict(zip(QUANTITIES, low if camera_height < LOW else high, strict=True))
