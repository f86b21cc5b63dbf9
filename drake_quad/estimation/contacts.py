"""What the contacts of one instant come to, foot by foot."""

from drake_quad.common import FloatArray
from drake_quad.jit import jit

# Columns of the sums, a row a foot: force in W (3) [N]; normal force times place in W (3) [N m];
# normal force [N]; the greatest slip [m/s]. The last row is for all that is no foot: how many
# contacts [0], and the greatest normal force among them [N] [1].
FORCE, MOMENT, WEIGHT, SLIP = 0, 3, 6, 7
SUMS = (5, 8)
NO_FOOT = 4


@jit
def add_contact(
    sums: FloatArray,
    row: int,
    sign: float,
    force: FloatArray,
    normal: FloatArray,
    place: FloatArray,
    slip: float,
) -> None:
    """Adds one contact.

    Args:
        sums: See SUMS.
        row: The foot's; NO_FOOT if it is none.
        sign: 1 if `force` acts on the foot, -1 if on what it touches.
        force: In W (3,) [N].
        normal: The contact's normal in W (3,).
        place: In W (3,) [m].
        slip: Tangential speed [m/s].
    """
    pressed = abs(force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2])
    if row == NO_FOOT:
        sums[row, 0] += 1.0
        sums[row, 1] = max(sums[row, 1], pressed)
        return
    for i in range(3):
        sums[row, FORCE + i] += sign * force[i]
        sums[row, MOMENT + i] += pressed * place[i]
    sums[row, WEIGHT] += pressed
    sums[row, SLIP] = max(sums[row, SLIP], slip)


@jit
def conclude(
    sums: FloatArray,
    threshold: float,
    bearing: FloatArray,
    force: FloatArray,
    position: FloatArray,
    slip: FloatArray,
    others: FloatArray,
) -> None:
    """Writes what the sums come to; the place of a foot that touches nothing stays.

    Args:
        sums: See SUMS; all contacts are in it.
        threshold: Normal force above which a foot bears [N].
        bearing: Result (4,): 1 where a foot bears.
        force: Result (12,) in W [N].
        position: Result (12,): where the forces act in W [m].
        slip: Result (4,) [m/s].
        others: Result (2,): how many contacts of anything but feet; the greatest force there [N].
    """
    for k in range(4):
        weight = sums[k, WEIGHT]
        bearing[k] = 1.0 if weight > threshold else 0.0
        slip[k] = sums[k, SLIP]
        for i in range(3):
            force[3 * k + i] = sums[k, FORCE + i]
            if weight > 1e-9:
                position[3 * k + i] = sums[k, MOMENT + i] / weight
    others[0], others[1] = sums[NO_FOOT, 0], sums[NO_FOOT, 1]
