"""How much each foot may carry: load ramps, lightly loaded feet, slip.

Whatever moves the centre of pressure (a clock that waits, a kick) takes load from the feet on the
other side. The program of forces would take nearly all of it, and what the robot does is no force
program to the newton: such a foot comes off the ground for moments, and with it goes the static
margin. But coming to rest takes no more than a centre of pressure that is beyond the capture point,
so a foot keeps a part of what it would bear with the robot at rest over that.

For the same reason a light foot is to give little along the ground: it would slip.
"""

from math import sqrt

import numpy as np

from drake_quad.common import BoolArray, FloatArray
from drake_quad.control.base_tracking import smooth_step
from drake_quad.jit import jit
from drake_quad.planning.phase_table import END, START, phase_index, swing_rows

# How much of a full load a foot carries that has landed, as a swing ends: by its least force it
# counts as bearing then, even where its share of the weight is none.
LANDED_LOAD = 0.35
# Of a full load: with so little left a foot lifts off within hundredths of a second. Before that,
# one that does not bear is brought back, or its stance would end more than a tolerance too early.
GIVEN_AWAY = 0.02
LOST_LOAD = 0.1  # how much of a full load is left to a foot that lost the ground


@jit
def foot_load(phases: FloatArray, t: float, unload_time: float) -> FloatArray:
    """How much each of the four feet may carry at a time: none in the air, all in mid-stance.

    A foot takes its load up after touchdown, and gives it away before lift-off, over
    `unload_time` or the time there is on four feet, whichever is shorter. It begins with what it
    has carried since it landed: the clock passes a touchdown with the foot on the ground.

    Args:
        phases: The plan's phases, see `phase_table`.
        t: Gait time [s].
        unload_time: Time over which a foot takes its load up or gives it away [s].
    """
    load = np.ones(4)
    index = phase_index(phases, t)
    swings = swing_rows(phases[index])
    if swings[0] >= 0:
        for k in swings:
            if k >= 0:
                load[k] = 0.0
        return load
    start, end = phases[index, START], phases[index, END]
    ramp = min(unload_time, end - start)
    if index > 0:
        for k in swing_rows(phases[index - 1]):
            if k >= 0:
                load[k] *= max(smooth_step((t - start) / ramp), LANDED_LOAD)
    if index + 1 < len(phases):
        for k in swing_rows(phases[index + 1]):
            if k >= 0:
                load[k] *= smooth_step((end - t) / ramp)
    return np.maximum(load, 1e-4)


@jit
def leaving_feet(phases: FloatArray, t: float) -> BoolArray:
    """Which feet (4,) stand at a time [s], and are the next to lift off."""
    leaving = np.zeros(4, dtype=np.bool_)
    index = phase_index(phases, t)
    if swing_rows(phases[index])[0] < 0 and index + 1 < len(phases):
        for k in swing_rows(phases[index + 1]):
            if k >= 0:
                leaving[k] = True
    return leaving


@jit
def correct_load(
    load: FloatArray,
    standing: BoolArray,
    bearing: FloatArray,
    landed: FloatArray,
    regained: FloatArray,
) -> None:
    """Changes the plan's loads (4,) for swing feet that have landed, and for lost ground.

    Args:
        load: Changed in place.
        standing: Who is to stand (4,).
        bearing: 1 where a foot is sensed to bear (4,).
        landed: 1 for a swing foot that has landed before its time (4,).
        regained: Share of its load to which each foot has come back, or NEVER (4,).
    """
    held = 0
    for k in range(4):
        if landed[k] > 0.5 and not standing[k]:
            load[k] = LANDED_LOAD
        if load[k] > 0.0 and not (standing[k] and bearing[k] < 0.5):
            held += 1
    if held > 1:
        for k in range(4):
            if standing[k]:
                back = regained[k] if bearing[k] > 0.5 else 0.0
                load[k] = min(load[k], LOST_LOAD + (1.0 - LOST_LOAD) * back)


@jit
def caught_load(standing: BoolArray, bearing: FloatArray) -> FloatArray:
    """Loads (4,) while a push is caught: of the feet that are to stand, those that bear."""
    load, bears = np.zeros(4), False
    for k in range(4):
        if standing[k] and bearing[k] > 0.5:
            load[k], bears = 1.0, True
    if not bears:
        # Thrown off the ground there is nothing to share: be ready on all that are to stand.
        for k in range(4):
            load[k] = 1.0 if standing[k] else 0.0
    return load


REST_SHARE = 0.5  # of what a foot would bear at rest that it keeps,
MOST_TIMES = 2.0  # up to so many times `least_force`: with three a body could hardly be steered
EVEN_SHARE = 0.25  # of the weight, of four feet that bear the same
LEAST_BORNE = 0.02  # that a foot is taken to bear at least
LINE = 1e-8  # [m^4] determinant of feet that stand in a line, or nearly


@jit
def static_load_shares(places: FloatArray, load: FloatArray, x: float, y: float) -> FloatArray:
    """What of the weight each foot would bear at rest (4,), the sum of squares by load the least.

    Of three feet under full load these are the centre of mass's barycentric coordinates. Zero
    where the feet stand in a line, or are fewer than three.

    Args:
        places: The feet (4, 3) in W [m].
        load: How much each may carry, 0 to 1, (4,).
        x: Place in W of the centre of mass, or of where it comes to rest [m].
        y: Its other coordinate [m].
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


SURE_SHARE = 0.03  # of the weight on each of the others, with which they surely hold the robot


@jit
def hold_load(
    load: FloatArray, leaving: FloatArray, places: FloatArray, x: float, y: float
) -> None:
    """Gives feet back what they gave away, as far as the others cannot hold the robot at rest.

    For a clock that waits at a lift-off: its feet would bear nothing there, and a robot over too
    little of the others' support, or over two feet, would tip over while it waits.

    Args:
        load: How much each foot may carry, 0 to 1, (4,); changed in place.
        leaving: 1 for the feet that are to lift off, and bear, (4,).
        places: The feet (4, 3) in W [m].
        x: Place in W of the centre of mass [m].
        y: Its other coordinate [m].
    """
    if not np.any(leaving > 0.5):
        return
    others, least = np.empty(4), 1.0
    for k in range(4):
        others[k] = 0.0 if leaving[k] > 0.5 else load[k]
    shares = static_load_shares(places, others, x, y)
    for k in range(4):
        if others[k] > 0.0:
            least = min(least, shares[k])
    back = smooth_step((SURE_SHARE - least) / SURE_SHARE)
    for k in range(4):
        if leaving[k] > 0.5:
            load[k] = max(load[k], back)


@jit
def min_normal_forces(
    shares: FloatArray, load: FloatArray, weight: float, always: float, most: float
) -> FloatArray:
    """The normal forces that the feet push with at least (4,) [N].

    Args:
        shares: Shares of the weight, see `static_load_shares`.
        load: How much each foot may carry, 0 to 1, (4,).
        weight: Robot weight [N].
        always: Least normal force of a foot under full load, whatever its share [N].
        most: Greatest such force, however much the foot would bear [N].
    """
    least = np.empty(4)
    for k in range(4):
        kept = min(REST_SHARE * shares[k] * weight, most * load[k])
        least[k] = max(kept, always * load[k])
    return least


@jit
def tangential_prices(shares: FloatArray) -> FloatArray:
    """What each foot's force along the ground costs, over that of a foot with its even share (4,).

    By the least sum of squares all feet would give the same along the ground, and a light foot
    would use all of its friction where a heavy one uses little. Prices that go with the inverse
    square of what a foot bears make it the sum of squares of the friction used, |f_t| / f_n.

    Args:
        shares: As `static_load_shares` gives them; all zero where they are not known: then all feet
            cost the same.
    """
    prices = np.ones(4)
    if not shares.any():
        return prices
    for k in range(4):
        part = EVEN_SHARE / max(shares[k], LEAST_BORNE)
        prices[k] = part * part
    return prices


SLIPPING = 0.06  # [m/s] along the ground, above which a foot that carries slips
CARRIES = 0.5  # of a full load
LEAST = 0.15  # friction coefficient below which nothing could be stood on anyway
LOSES = 0.1  # [s] in which it falls by a factor of e while the foot slips
REGAINS = 30.0  # [s] in which it comes back, linearly, from nothing to all that is assumed


@jit
def update_friction(
    friction: FloatArray,
    velocity: FloatArray,
    load: FloatArray,
    normal: FloatArray,
    assumed: float,
    period: float,
) -> None:
    """Goes on a tick with the friction that each foot's force stays within.

    A foot that slips has less friction under it than its force took: the less is demanded
    for, the sooner it stands, and the other feet make the rest. What is lost is regained slowly,
    for the next place may be as slippery.

    Args:
        friction: Coefficient foot by foot (4,); changed in place.
        velocity: Velocities of the feet in W (4, 3) [m/s].
        load: How much each is to carry, 0 to 1, (4,).
        normal: Ground normals under the feet (4, 3): less friction than standing there takes is
            never assumed.
        assumed: The coefficient that it begins with and never exceeds.
        period: Control period [s].
    """
    for k in range(4):
        speed2 = velocity[k, 0] * velocity[k, 0] + velocity[k, 1] * velocity[k, 1]
        if load[k] > CARRIES and speed2 > SLIPPING * SLIPPING:
            slope = sqrt(normal[k, 0] * normal[k, 0] + normal[k, 1] * normal[k, 1]) / normal[k, 2]
            least = min(max(LEAST, slope), assumed)
            friction[k] = max(friction[k] * (1.0 - period / LOSES), least)
        else:
            friction[k] = min(friction[k] + assumed * period / REGAINS, assumed)
