"""What slipping feet tell of the ground: how much friction the forces may count on."""

from math import sqrt

from drake_quad.compiled import compiled
from drake_quad.gait.legs import FloatArray

SLIPPING = 0.06  # [m/s] along the ground, above which a foot that carries slips
CARRIES = 0.5  # of a full load
LEAST = 0.15  # friction coefficient below which nothing could be stood on anyway
LOSES = 0.1  # [s] in which it falls by a factor of e while the foot slips
REGAINS = 30.0  # [s] in which it comes back, linearly, from nothing to all that is assumed


@compiled
def answer_slip(
    friction: FloatArray,
    velocity: FloatArray,
    load: FloatArray,
    normal: FloatArray,
    assumed: float,
    period: float,
) -> None:
    """Goes on a tick with the friction that each foot's force stays within.

    A foot that slips has less friction under it than its force asked for: the less it is asked
    for, the sooner it stands, and the other feet make the rest. What is lost is regained slowly,
    for the next place may be as slippery.

    Args:
        friction: Coefficient foot by foot (4,); changed in place.
        velocity: Of the feet in W (4, 3) [m/s].
        load: How much each is to carry, 0 to 1, (4,).
        normal: Of the ground under each (4, 3): less than standing on it takes is never assumed.
        assumed: The coefficient that it begins with and never exceeds.
        period: Of the controller [s].
    """
    for k in range(4):
        speed2 = velocity[k, 0] * velocity[k, 0] + velocity[k, 1] * velocity[k, 1]
        if load[k] > CARRIES and speed2 > SLIPPING * SLIPPING:
            slope = sqrt(normal[k, 0] * normal[k, 0] + normal[k, 1] * normal[k, 1]) / normal[k, 2]
            least = min(max(LEAST, slope), assumed)
            friction[k] = max(friction[k] * (1.0 - period / LOSES), least)
        else:
            friction[k] = min(friction[k] + assumed * period / REGAINS, assumed)
