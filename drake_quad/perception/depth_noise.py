"""Errors of a stereo depth camera, as functions of the true depth and a seeded generator.

A stereo camera measures disparity, d = f B / z, and most of its errors are alike in disparity
wherever the surface is: noise that neighbours share (they are matched by one window), a smooth
pattern that stays (lenses), an offset (the angle between the imagers). So depth errs by
z^2 sigma / (f B) (Intel, "Tuning depth cameras for best performance"). Edges err in ways of their
own: the near side grows (the matching window), what only one imager sees has no depth (the
shadow), and pixels in between lie on neither side.
"""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import scipy  # its part ndimage is loaded at its first use: most runs have no camera

from drake_quad.common import FloatArray
from drake_quad.jit import jit
from drake_quad.perception.camera_model import CameraModel, StereoCamera
from drake_quad.perception.stereo_edges import (
    Mask,
    between_nodes,
    grow_near_sides,
    list_flying,
    mark_shadows,
)

NODES_PER_LENGTH = 1.0  # of a smooth field: a coarser grid than the pixels gives it sooner


@dataclass(frozen=True, kw_only=True)
class StereoNoise:
    """Figures of a stereo camera's errors, in pixels of its own resolution; zero is none.

    Attributes:
        white: Deviation of the disparity noise [px].
        correlation: Distance over which neighbours share it [px].
        pattern: Deviation of the smooth pattern that stays [px].
        pattern_length: Distance over which the pattern changes [px].
        offset: Deviation of the constant offset of disparity [px].
        tilt: Deviation of the mounting's error about each axis [rad].
        fattening: Growth of the near side at edges, at most [px].
        flying: Share of pixels at edges that lie between both sides.
        shadow: Whether what one imager alone sees is lost.
        holes: Share of pixels without depth elsewhere, in the mean.
        step: Smallest step of disparity [px].
    """

    white: float = 0.08
    correlation: float = 2.0
    pattern: float = 0.05
    pattern_length: float = 80.0
    offset: float = 0.1
    tilt: float = float(np.radians(0.25))
    fattening: float = 3.0
    flying: float = 0.3
    shadow: bool = True
    holes: float = 0.03
    step: float = 1.0 / 32.0


IDEAL_DEPTH = StereoNoise(
    white=0.0, pattern=0.0, offset=0.0, tilt=0.0, fattening=0.0, flying=0.0, shadow=False,
    holes=0.0, step=0.0,
)  # fmt: skip
STEREO_NOISE = StereoNoise()


@dataclass(frozen=True)
class CameraErrors:
    """What is wrong with one camera for as long as it is not calibrated anew.

    Attributes:
        pattern: Error of disparity of each pixel [px], (height, width).
        offset: Error of disparity of all of them [px].
        tilt: The mounting's error about C's axes x, y, z [rad], (3,).
    """

    pattern: FloatArray
    offset: float
    tilt: FloatArray


def draw_camera_errors(
    noise: StereoNoise, camera: StereoCamera, model: CameraModel, generator: np.random.Generator
) -> CameraErrors:
    """Draws one camera's errors that stay.

    Args:
        noise: The figures.
        camera: The camera.
        model: Intrinsics of the images that are made, whose pixels may be larger.
        generator: The source of what is random.
    """
    ratio = camera.model.fx / model.fx
    field = draw_field((model.height, model.width), noise.pattern_length / ratio, generator)
    return CameraErrors(
        pattern=noise.pattern * field.at_pixels(model.height, model.width),
        offset=noise.offset * float(generator.standard_normal()),
        tilt=noise.tilt * generator.standard_normal(3),
    )


@dataclass(frozen=True)
class SmoothField:
    """A field of unit deviation, bilinear between nodes.

    Attributes:
        nodes: Its values at the nodes, (rows, columns).
        skip: Pixels from one node to the next.
    """

    nodes: FloatArray
    skip: int

    def at_pixels(self, height: int, width: int) -> FloatArray:
        """The value at each pixel, (height, width)."""
        values = np.empty((height, width))
        fill_between(self.nodes, self.skip, values)
        return values


def draw_field(
    shape: tuple[int, int], length: float, generator: np.random.Generator
) -> SmoothField:
    """Draws a field whose values are alike over `length` pixels.

    Args:
        shape: Rows and columns of the image.
        length: Standard deviation of the Gaussian that smooths white noise [px].
        generator: The source of what is random.
    """
    skip = max(1, round(length / NODES_PER_LENGTH))
    rows, columns = shape[0] // skip + 2, shape[1] // skip + 2
    # Going straight from node to node smooths, too: as a Gaussian of variance skip^2 / 6 would.
    sigma = length if skip == 1 else float(np.sqrt((length / skip) ** 2 - 1.0 / 6.0))
    white = generator.standard_normal((rows, columns))
    if sigma <= 0.05:
        return SmoothField(white, skip)
    field = scipy.ndimage.gaussian_filter(white, sigma, mode="wrap")
    # The deviation that smoothing leaves, for a kernel that is summed in both directions, and what
    # is lost between nodes, in the mean over their squares.
    x = np.arange(-int(4 * sigma + 0.5), int(4 * sigma + 0.5) + 1)
    kernel = np.exp(-0.5 * (x / sigma) ** 2)
    kernel /= kernel.sum()
    left = float((kernel**2).sum())
    if skip > 1:
        alike = float((kernel[1:] * kernel[:-1]).sum()) / left
        left *= (2.0 * skip**2 + 1.0 + (skip**2 - 1.0) * alike) / (3.0 * skip**2)
    return SmoothField(field / left, skip)


@jit
def fill_between(nodes: FloatArray, skip: int, values: FloatArray) -> None:
    """Writes a field's value at each pixel, see `between_nodes`.

    Args:
        nodes: Its values at the nodes, (rows, columns).
        skip: Pixels from one node to the next.
        values: Receives the values, (height, width).
    """
    for v in range(values.shape[0]):
        for u in range(values.shape[1]):
            values[v, u] = between_nodes(nodes, skip, v, u)


@jit
def find_disparity(depth: FloatArray, scale: float, disparity: FloatArray, lost: Mask) -> None:
    """Writes disparities; 0 where there is no depth, and these pixels are lost.

    Args:
        depth: Distances along the optical axis [m], (height, width); inf where none.
        scale: Disparity times depth [px m].
        disparity: Receives them [px], (height, width).
        lost: Receives 1 where there is none and 0 elsewhere, (height, width).
    """
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            z = depth[v, u]
            there = z > 0.0 and z < np.inf
            disparity[v, u] = scale / z if there else 0.0
            lost[v, u] = 0 if there else 1


@jit
def report_depth(
    disparity: FloatArray,
    scale: float,
    step: float,
    bounds: tuple[float, float],
    holes: tuple[FloatArray, int, float],
    lost: Mask,
    depth: FloatArray,
) -> None:
    """Writes what the camera reports of disparities that it measures.

    Args:
        disparity: The disparities [px], (height, width).
        scale: Disparity times depth [px m].
        step: Smallest step of disparity [px]; 0 for none.
        bounds: The nearest and the farthest distance that it reports [m].
        holes: Nodes and skip of a field, and above which value of it there is a hole.
        lost: Pixels that have no depth are 1, (height, width).
        depth: Receives distances [m], (height, width); 0 where there is none.
    """
    nodes, skip, hole = holes
    for v in range(disparity.shape[0]):
        for u in range(disparity.shape[1]):
            measured = disparity[v, u]
            if step > 0.0:
                measured = step * np.rint(measured / step)
            depth[v, u] = 0.0
            if lost[v, u] == 1 or measured <= 0.0:
                continue
            if hole < np.inf and between_nodes(nodes, skip, v, u) > hole:
                continue
            found = scale / measured
            if bounds[0] <= found <= bounds[1]:
                depth[v, u] = found


def add_noise(
    depth: FloatArray,
    *,
    noise: StereoNoise,
    errors: CameraErrors,
    camera: StereoCamera,
    model: CameraModel,
    generator: np.random.Generator,
) -> FloatArray:
    """What the camera reports where the truth is `depth`.

    Args:
        depth: True distances along the optical axis [m], (height, width); inf where none.
        noise: The figures.
        errors: This camera's errors that stay.
        camera: The camera.
        model: Intrinsics of the image.
        generator: The source of what is random in this image.

    Returns:
        Distances [m], (height, width); 0 where there is none.
    """
    true = np.ascontiguousarray(depth, dtype=np.float64)
    shape, ratio = true.shape, camera.model.fx / model.fx
    scale = camera.disparity_scale()
    disparity, lost = np.empty(shape), np.empty(shape, dtype=np.uint8)
    find_disparity(true, scale, disparity, lost)
    if noise.shadow:
        mark_shadows(disparity / ratio, lost)
    if noise.fattening > 0.0:
        field, grown = draw_field(shape, 6.0 / ratio, generator), np.empty(shape)
        grow_near_sides(disparity, noise.fattening / ratio, field.nodes, field.skip, grown, lost)
        disparity = grown
    if noise.flying > 0.0:
        rows = np.empty((disparity.size, 4))
        rows = rows[: list_flying(disparity, rows)]
        chosen, place = generator.random((2, len(rows)))
        rows, place = rows[chosen < noise.flying], place[chosen < noise.flying]
        at = rows[:, :2].astype(int)
        disparity[at[:, 0], at[:, 1]] = rows[:, 2] + (rows[:, 3] - rows[:, 2]) * place
    if noise.white > 0.0:
        field = draw_field(shape, noise.correlation / ratio, generator)
        disparity += noise.white * field.at_pixels(*shape)
    disparity += errors.pattern
    disparity += errors.offset
    holes: tuple[FloatArray, int, float] = (errors.pattern, 1, np.inf)
    if noise.holes > 0.0:
        field = draw_field(shape, 4.0 / ratio, generator)
        holes = (field.nodes, field.skip, NormalDist().inv_cdf(1.0 - noise.holes))
    found = np.empty(shape)
    report_depth(
        disparity, scale, noise.step, (camera.nearest, camera.farthest), holes, lost, found
    )
    return found
