"""Parametric stairs as a camera sees them: what a ray meets, and how that depends on the stairs.

Seen along their yaw, stairs are a profile: nosings at places s_1 < ... < s_n ahead of the camera,
treads at heights h_0 ... h_n over it (below it: negative). A pixel's ray (x, y, z) of unit depth
goes forward by c = x cos(yaw) + y sin(yaw) and up by z, so it meets a tread at inverse depth z / h
and a riser at c / s: inverse depths are linear in the ray, and their derivatives are simple.
"""

from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.jit import inlined, jit

# Parameters follow the n places and the n + 1 heights in this order.
YAW, OVERHANG, PITCH, ROLL, OFFSET, EDGE_BIAS, RISE, RUN = range(8)
NUISANCES = 8
NOTHING = -1
FOOT_OF_RISER, FACE, TREAD = 1, 2, 0  # a surface is 3 i + one of these
MOST_STEPS = 14
HEIGHT_ERROR = 0.003  # [m] by which a surface may be off where pixels are counted for or against it
ROW_ERROR = 0.25  # [rows] by which a pixel's own place errs: edges grow, blocks have one middle


EDGE_SHARED = 0.2  # [rows] by which all edges of one nosing may err alike
EDGE_GATE = 0.12  # [m] how far from a nosing the near side of an edge may lie


class Pixels(NamedTuple):
    """Pixels as the kernels take them, tilt and roll of the parameters already in the rays.

    Attributes:
        rays: (k, 3) in L.
        rho: Measured inverse depths (k,).
        sigma: Their deviations (k,).
        gain: What the shared offset adds (k,).
        nodes: Node of the pattern's grid up and left of each pixel, and the shares of the next
            column and the next row, (k, 3).
        row_step: Change of a ray from one row to the next (3,).
    """

    rays: FloatArray
    rho: FloatArray
    sigma: FloatArray
    gain: FloatArray
    nodes: FloatArray
    row_step: FloatArray


class EdgeRays(NamedTuple):
    """Silhouette edges as the kernels take them.

    Attributes:
        rays: (k, 3) in L, tilt and roll of the parameters already in them.
        near: Inverse depths of their near sides (k,).
        row_step: Change of a ray from one row to the next (3,).
    """

    rays: FloatArray
    near: FloatArray
    row_step: FloatArray


class Equations(NamedTuple):
    """Normal equations A delta = b that kernels add to; of A the lower half alone.

    Attributes:
        A: (p, p).
        b: (p,).
        totals: Cost, what was looked at, inliers, sum of weighted squares, sum of weights (5,).
    """

    A: FloatArray
    b: FloatArray
    totals: FloatArray


def parameter_count(steps: int) -> int:
    """How many parameters stairs of so many steps have, the pattern's nodes apart."""
    return 2 * steps + 1 + NUISANCES


@jit
def meet(
    m: float, theta: FloatArray, n: int, up: float, is_open: float, thickness: float, last: float
) -> int:
    """Which surface a ray of slope m (upward per forward) meets.

    Args:
        m: Slope of the ray.
        theta: The parameters.
        n: Steps.
        up: 1 if the stairs go up, else 0.
        is_open: 1 if there is nothing between treads, else 0.
        thickness: Thickness of treads with an overhang or open risers [m].
        last: Length of the last tread that is believed [m].

    Returns:
        3 i + TREAD, 3 i + FOOT_OF_RISER, 3 i + FACE, or NOTHING.
    """
    over = theta[2 * n + 1 + OVERHANG]
    for i in range(1, n + 1):
        s, low, high = theta[i - 1], theta[n + i - 1], theta[n + i]
        y = m * s
        if y < low:
            return 3 * (i - 1)
        if up > 0.5 and y <= high:
            # Without an overhang both parts of a riser are one plane, and still told apart: so its
            # pixels say that there is none, and a fit does not go to and fro to the prior's.
            if y >= high - thickness:
                return 3 * i + FACE
            if is_open > 0.5:
                return NOTHING
            y = m * (s + over)
            if y < low:
                return 3 * (i - 1)
            if y <= high - thickness:
                return 3 * i + FOOT_OF_RISER
            return NOTHING
    if m < 0.0 and theta[2 * n] < 0.0 and theta[2 * n] / m < theta[n - 1] + last:
        return 3 * n
    return NOTHING


@jit
def inverse_depth(surface: int, c: float, z: float, theta: FloatArray, n: int) -> float:
    """The inverse depth at which a ray (forward c, up z) meets a surface."""
    i, kind = surface // 3, surface % 3
    if kind == TREAD:
        return z / theta[n + i]
    if kind == FACE:
        return c / theta[i - 1]
    return c / (theta[i - 1] + theta[2 * n + 1 + OVERHANG])


@inlined
def slack(
    surface: int, step_c: float, step_z: float, theta: FloatArray, n: int, sigma: float
) -> float:
    """A pixel's deviation [1/m], with what an error of its row makes of a grazed surface."""
    i = surface // 3
    change = step_z / theta[n + i] if surface % 3 == TREAD else step_c / theta[i - 1]
    return sqrt(sigma * sigma + (ROW_ERROR * change) ** 2)


@jit
def accumulate(
    pixels: Pixels,
    theta: FloatArray,
    shape: FloatArray,
    columns: float,
    cutoff: float,
    equations: Equations,
) -> None:
    """Adds the pixels' part to the normal equations.

    Args:
        pixels: The pixels.
        theta: The parameters (p,).
        shape: Steps, up, open, thickness, last: see `meet`.
        columns: Nodes in a row of the pattern's grid; 0 for no pattern.
        cutoff: Residual beyond which a pixel is an outlier, in deviations (Tukey's).
        equations: Added to.
    """
    rays, rho, sigma, gain, nodes, row_step = pixels
    A, b, totals = equations
    n = int(shape[0])
    up, is_open, thickness, last = shape[1], shape[2], shape[3], shape[4]
    base = 2 * n + 1
    cy, sy = cos(theta[base + YAW]), sin(theta[base + YAW])
    over, offset = theta[base + OVERHANG], theta[base + OFFSET]
    step_c, step_z = row_step[0] * cy + row_step[1] * sy, row_step[2]
    grid, across = base + NUISANCES, int(columns)
    at, J = np.empty(10, dtype=np.int64), np.empty(10)
    for k in range(rays.shape[0]):
        x, y, z = rays[k, 0], rays[k, 1], rays[k, 2]
        c = x * cy + y * sy
        if c < 0.02:
            continue
        m = z / c
        surface = meet(m, theta, n, up, is_open, thickness, last)
        if surface < 0:
            continue
        p = inverse_depth(surface, c, z, theta, n)
        width = 0.8 * abs((step_z * c - z * step_c) / (c * c))
        clear = True
        for side in range(2):
            beside = meet(
                m + (width if side == 0 else -width), theta, n, up, is_open, thickness, last
            )
            # A block across the line where two surfaces meet is on neither, near as they may be.
            if beside != surface:
                clear = False
        if not clear:
            continue
        error = p + offset * gain[k]
        deviation = slack(surface, step_c, step_z, theta, n, sigma[k])
        used = 1
        at[0], J[0] = base + OFFSET, gain[k]
        if across > 0:
            node, right, below = grid + int(nodes[k, 0]), nodes[k, 1], nodes[k, 2]
            at[1], J[1] = node, (1.0 - right) * (1.0 - below) * gain[k]
            at[2], J[2] = node + 1, right * (1.0 - below) * gain[k]
            at[3], J[3] = node + across, (1.0 - right) * below * gain[k]
            at[4], J[4] = node + across + 1, right * below * gain[k]
            used = 5
            for e in range(1, 5):
                error += J[e] * theta[at[e]]
        r = (rho[k] - error) / deviation
        totals[1] += 1.0
        if abs(r) >= cutoff:
            totals[0] += cutoff * cutoff / 6.0
            continue
        t = 1.0 - (r / cutoff) ** 2
        totals[0] += cutoff * cutoff / 6.0 * (1.0 - t * t * t)
        totals[2] += 1.0
        weight = t * t
        totals[3] += weight * r * r
        totals[4] += weight
        i, kind = surface // 3, surface % 3
        if kind == TREAD:
            h = theta[n + i]
            at[used], J[used] = n + i, -z / (h * h)
            at[used + 1], J[used + 1] = base + PITCH, -x / h
            at[used + 2], J[used + 2] = base + ROLL, y / h
            used += 3
        else:
            s = theta[i - 1] + (over if kind == FOOT_OF_RISER else 0.0)
            at[used], J[used] = i - 1, -c / (s * s)
            at[used + 1], J[used + 1] = base + YAW, (y * cy - x * sy) / s
            at[used + 2], J[used + 2] = base + PITCH, z * cy / s
            at[used + 3], J[used + 3] = base + ROLL, -z * sy / s
            used += 4
            if kind == FOOT_OF_RISER:
                at[used], J[used] = base + OVERHANG, -c / (s * s)
                used += 1
        for e in range(used):
            J[e] /= deviation
        for e in range(used):
            w = weight * J[e]
            b[at[e]] += w * r
            for f in range(e + 1):
                i, j = at[e], at[f]
                if i < j:
                    i, j = j, i
                A[i, j] += w * J[f]


@jit
def accumulate_edges(
    silhouettes: EdgeRays,
    theta: FloatArray,
    shape: FloatArray,
    sigma: float,
    cutoff: float,
    equations: Equations,
) -> None:
    """Adds the silhouette edges' part: each is the slope at which a nosing is seen.

    Args:
        silhouettes: The edges.
        theta: The parameters (p,).
        shape: What `accumulate` takes.
        sigma: Deviation of an edge's place [rows].
        cutoff: Tukey's, in deviations.
        equations: Added to.
    """
    edges, near, row_step = silhouettes
    A, b, totals = equations
    n = int(shape[0])
    up = shape[1] > 0.5
    base = 2 * n + 1
    cy, sy = cos(theta[base + YAW]), sin(theta[base + YAW])
    bias = theta[base + EDGE_BIAS]
    step_c, step_z = row_step[0] * cy + row_step[1] * sy, row_step[2]
    at, J = np.empty(6, dtype=np.int64), np.empty(6)
    nosings, counts = np.empty(edges.shape[0], dtype=np.int64), np.zeros(n)
    for k in range(edges.shape[0]):
        nosings[k] = nosing_of(edges[k], near[k], step_z, step_c, theta, shape)
        if nosings[k] >= 0:
            counts[nosings[k]] += 1.0
    for k in range(edges.shape[0]):
        which = nosings[k]
        if which < 0:
            continue
        x, y, z = edges[k, 0], edges[k, 1], edges[k, 2]
        c = x * cy + y * sy
        top = n + which + 1 if up else n + which
        m = z / c
        dm = abs((step_z * c - z * step_c) / (c * c))
        place, height = theta[which], theta[top]
        r = (m - height / place - bias * dm) / (sigma * dm)
        totals[1] += 1.0
        if abs(r) >= cutoff:
            totals[0] += cutoff * cutoff / 6.0
            continue
        t = 1.0 - (r / cutoff) ** 2
        totals[0] += cutoff * cutoff / 6.0 * (1.0 - t * t * t)
        totals[2] += 1.0
        # A nosing's edges tell no more together than what they share allows.
        weight = t * t / (1.0 + counts[which] * (EDGE_SHARED / sigma) ** 2)
        at[0], J[0] = which, -height / (place * place)
        at[1], J[1] = top, 1.0 / place
        at[2], J[2] = base + EDGE_BIAS, dm
        at[3], J[3] = base + YAW, z * (y * cy - x * sy) / (c * c)
        at[4], J[4] = base + PITCH, (x * c + z * z * cy) / (c * c)
        at[5], J[5] = base + ROLL, -(y * c + z * z * sy) / (c * c)
        for e in range(6):
            J[e] /= sigma * dm
        for e in range(6):
            b[at[e]] += weight * J[e] * r
            for f in range(e + 1):
                i, j = at[e], at[f]
                if i < j:
                    i, j = j, i
                A[i, j] += weight * J[e] * J[f]


@jit
def nosing_of(
    edge: FloatArray, near: float, step_z: float, step_c: float, theta: FloatArray,
    shape: FloatArray,
) -> int:  # fmt: skip
    """Which nosing a silhouette edge may be that of, counted from 0; -1 for none.

    Args:
        edge: Its ray (3,) in L.
        near: Inverse depth of its near side.
        step_z: Change of a ray's height from one row to the next.
        step_c: Change of a ray along the climb from one row to the next.
        theta: The parameters (p,).
        shape: What `accumulate` takes.
    """
    n = int(shape[0])
    up = shape[1] > 0.5
    base = 2 * n + 1
    c = edge[0] * cos(theta[base + YAW]) + edge[1] * sin(theta[base + YAW])
    z = edge[2]
    if c < 0.02 or near <= 0.0:
        return -1
    s, h = c / near, z / near
    best, which, top = EDGE_GATE, -1, 0
    for q in range(n):
        high = n + q + 1 if up else n + q
        away = abs(s - theta[q]) + abs(h - theta[high])
        if away < best:
            best, which, top = away, q, high
    if which < 0:
        return -1
    seen, dm = theta[top] / theta[which], abs((step_z * c - z * step_c) / (c * c))
    behind = meet(seen + 1.5 * dm, theta, n, shape[1], shape[2], shape[3], shape[4])
    if behind >= 0:  # no silhouette where what lies behind is as near
        far = inverse_depth(behind, c, z + (seen - z / c) * c, theta, n)
        if near - far < 0.04:
            return -1
    return which
