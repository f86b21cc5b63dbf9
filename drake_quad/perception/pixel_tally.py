"""Compiled: what pixels say for and against each surface of stairs, and what each ray meets."""

from math import cos, sin, sqrt

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.perception.stair_profile import (
    HEIGHT_ERROR,
    TREAD,
    YAW,
    Pixels,
    inverse_depth,
    meet,
    slack,
)


@jit
def tally(
    pixels: Pixels, theta: FloatArray, shape: FloatArray, cutoff: float, table: FloatArray
) -> float:
    """Counts what speaks for and against each surface.

    Args:
        pixels: The pixels, offset and pattern taken out of their inverse depths.
        theta: The parameters (p,).
        shape: Steps, up, open, thickness, last.
        cutoff: Deviations within which a pixel agrees.
        table: (2, n + 1, 6), added to. [0, i] is riser i, [1, i] tread i: pixels that should see
            it; that do; that see something farther; something nearer; of the four rows over its
            nosing, those that lie in the riser's plane still; and how well those that should see
            it agree, each from 0 (at `cutoff`) to 1.

    Returns:
        The cost of all pixels: outliers, and those that meet nothing, count as `cutoff`.
    """
    rays, rho, sigma, row_step = pixels.rays, pixels.rho, pixels.sigma, pixels.row_step
    n = int(shape[0])
    up, is_open, thickness, last = shape[1], shape[2], shape[3], shape[4]
    base = 2 * n + 1
    cy, sy = cos(theta[base + YAW]), sin(theta[base + YAW])
    step_c, step_z = row_step[0] * cy + row_step[1] * sy, row_step[2]
    cost = 0.0
    for k in range(rays.shape[0]):
        z = rays[k, 2]
        c = rays[k, 0] * cy + rays[k, 1] * sy
        if c < 0.02:
            continue
        m = z / c
        measured = rho[k]
        dm = abs((step_z * c - z * step_c) / (c * c))
        for i in range(1, n + 1):
            above = (m - theta[n + i] / theta[i - 1]) / dm
            if above > 1.0 and above < 5.0 and up > 0.5:
                table[0, i, 4] += 1.0
                if abs(measured - c / theta[i - 1]) < cutoff * sigma[k]:
                    table[1, i, 4] += 1.0
        surface = meet(m, theta, n, up, is_open, thickness, last)
        if surface < 0:
            cost += cutoff * cutoff
            continue
        deviation = slack(surface, step_c, step_z, theta, n, sigma[k])
        deviation = sqrt(
            deviation**2
            + (
                HEIGHT_ERROR
                * inverse_depth(surface, c, z, theta, n)
                / (theta[n + surface // 3] if surface % 3 == TREAD else theta[surface // 3 - 1])
            )
            ** 2
        )
        r = (measured - inverse_depth(surface, c, z, theta, n)) / deviation
        cost += min(r * r, cutoff * cutoff)
        row = 1 if surface % 3 == TREAD else 0
        i = surface // 3
        table[row, i, 0] += 1.0
        table[row, i, 5] += max(0.0, 1.0 - (r / cutoff) ** 2)
        if abs(r) < cutoff:
            table[row, i, 1] += 1.0
        elif r < 0.0:
            table[row, i, 2] += 1.0
        else:
            table[row, i, 3] += 1.0
    return cost


@jit
def explain(
    rays: FloatArray, theta: FloatArray, shape: FloatArray, surface: FloatArray, depth: FloatArray
) -> None:
    """Writes the surface that each ray meets, and its inverse depth there (0 for nothing).

    Args:
        rays: (k, 3) in L, tilt and roll of `theta` already in them.
        theta: The parameters (p,).
        shape: Steps, up, open, thickness, last: see `meet`.
        surface: Receives the surfaces' numbers, (k,).
        depth: Receives inverse depths [1/m], (k,).
    """
    n = int(shape[0])
    base = 2 * n + 1
    cy, sy = cos(theta[base + YAW]), sin(theta[base + YAW])
    for k in range(rays.shape[0]):
        c = rays[k, 0] * cy + rays[k, 1] * sy
        surface[k], depth[k] = -1.0, 0.0
        if c < 0.02:
            continue
        found = meet(rays[k, 2] / c, theta, n, shape[1], shape[2], shape[3], shape[4])
        if found >= 0:
            surface[k] = found
            depth[k] = inverse_depth(found, c, rays[k, 2], theta, n)
