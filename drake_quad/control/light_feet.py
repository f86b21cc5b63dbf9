"""How hard a lightly loaded foot is to be pressed down, so that it does not lose the ground.

Whatever moves the centre of pressure (a clock that waits, a kick) takes load from the feet on the
other side. The program of forces would take nearly all of it, and what the robot does is no force
program to the newton: such a foot comes off the ground for moments, and with it goes the static
margin. But coming to rest takes no more than a centre of pressure that is beyond the capture point,
so a foot keeps a part of what it would bear with the robot at rest over that.

For the same reason a light foot is to give little along the ground: it would slip.
"""

import numpy as np

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray

REST_SHARE = 0.5  # of what a foot would bear at rest that it keeps,
MOST_TIMES = 2.0  # up to so many times `least_force`: with three a body could hardly be steered
EVEN_SHARE = 0.25  # of the weight, of four feet that bear the same
LEAST_BORNE = 0.02  # that a foot is taken to bear at least
LINE = 1e-8  # [m^4] determinant of feet that stand in a line, or nearly


@compiled
def rest_shares(places: FloatArray, load: FloatArray, x: float, y: float) -> FloatArray:
    """What of the weight each foot would bear at rest (4,), the sum of squares by load the least.

    Of three feet under full load these are the centre of mass's barycentric coordinates. Zero
    where the feet stand in a line, or are fewer than three.

    Args:
        places: The feet (4, 3) in W [m].
        load: How much each may carry, 0 to 1, (4,).
        x: Of the centre of mass in W, or of where it comes to rest [m].
        y: The same.
    """
    s = sx = sy = sxx = sxy = syy = 0.0
    for k in range(4):
        dx, dy = places[k, 0] - x, places[k, 1] - y
        s += load[k]
        sx += load[k] * dx
        sy += load[k] * dy
        sxx += load[k] * dx * dx
        sxy += load[k] * dx * dy
        syy += load[k] * dy * dy
    # Of the equations of force and moments, the first column of the inverse, by its adjugate.
    a, b, c = sxx * syy - sxy * sxy, sxy * sy - sx * syy, sx * sxy - sxx * sy
    det = s * a + sx * b + sy * c
    shares = np.zeros(4)
    if det < LINE:
        return shares
    for k in range(4):
        dx, dy = places[k, 0] - x, places[k, 1] - y
        shares[k] = load[k] * (a + b * dx + c * dy) / det
    return shares


@compiled
def least_normals(
    shares: FloatArray, load: FloatArray, weight: float, always: float, most: float
) -> FloatArray:
    """The normal forces that the feet push with at least (4,) [N].

    Args:
        shares: See `rest_shares`.
        load: How much each foot may carry, 0 to 1, (4,).
        weight: Of the robot [N].
        always: Of a foot under full load, whatever its share [N].
        most: Of one, however much it would bear [N].
    """
    least = np.empty(4)
    for k in range(4):
        kept = min(REST_SHARE * shares[k] * weight, most * load[k])
        least[k] = max(kept, always * load[k])
    return least


@compiled
def along_prices(shares: FloatArray) -> FloatArray:
    """What each foot's force along the ground costs, over that of a foot with its even share (4,).

    By the least sum of squares all feet would give the same along the ground, and a light foot
    would use all of its friction where a heavy one uses little. Prices that go with the inverse
    square of what a foot bears make it the sum of squares of the friction used, |f_t| / f_n.

    Args:
        shares: See `rest_shares`. All zero, where they are not known: all feet cost the same.
    """
    prices = np.ones(4)
    if not shares.any():
        return prices
    for k in range(4):
        part = EVEN_SHARE / max(shares[k], LEAST_BORNE)
        prices[k] = part * part
    return prices
