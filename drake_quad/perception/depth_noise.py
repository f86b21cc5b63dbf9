"""Errors of a stereo depth camera, as functions of the true depth and a seeded generator.

A stereo camera measures disparity, d = f B / z, and most of its errors are alike in disparity
wherever the surface is: noise that neighbours share (they are matched by one window), a smooth
pattern that stays (lenses), an offset (the angle between the imagers). So depth errs by
z^2 sigma / (f B) (Intel, "Tuning depth cameras for best performance"). Edges err in ways of their
own: the near side grows (the matching window), what only one imager sees has no depth (the
shadow), and pixels in between lie on neither side.
"""

from dataclasses import dataclass

import numpy as np
import scipy  # its part ndimage is loaded at its first use: most runs have no camera

from drake_quad.common import BoolArray, FloatArray
from drake_quad.perception.camera_model import CameraModel, StereoCamera

EDGE_JUMP = 1.0  # [px] of disparity between the two sides of an edge


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
        holes: Share of pixels without depth elsewhere.
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
    shape = (model.height, model.width)
    field = smooth_field(shape, noise.pattern_length / ratio, generator)
    return CameraErrors(
        pattern=noise.pattern * field,
        offset=noise.offset * float(generator.standard_normal()),
        tilt=noise.tilt * generator.standard_normal(3),
    )


def smooth_field(
    shape: tuple[int, int], length: float, generator: np.random.Generator
) -> FloatArray:
    """A field of unit deviation whose values are alike over `length` pixels.

    Args:
        shape: Its rows and columns.
        length: Standard deviation of the Gaussian that smooths it [px].
        generator: The source of what is random.
    """
    # A long length on a coarser grid gives the same field sooner.
    skip = max(1, int(length / 3.0))
    rows, columns = shape[0] // skip + 8, shape[1] // skip + 8
    sigma = length / skip
    white = generator.standard_normal((rows, columns))
    field = scipy.ndimage.gaussian_filter(white, sigma, mode="wrap") if sigma > 0.05 else white
    if sigma > 0.05:  # the deviation that smoothing leaves, for a kernel summed in both directions
        x = np.arange(-int(4 * sigma + 0.5), int(4 * sigma + 0.5) + 1)
        kernel = np.exp(-0.5 * (x / sigma) ** 2)
        kernel /= kernel.sum()
        field = field / float((kernel**2).sum())
    if skip == 1:
        return np.asarray(field[: shape[0], : shape[1]])
    v = np.arange(shape[0]) / skip
    u = np.arange(shape[1]) / skip
    i, j = v.astype(int), u.astype(int)
    a, b = (v - i)[:, np.newaxis], (u - j)[np.newaxis, :]
    lines = (1 - b) * field[:, j] + b * field[:, j + 1]  # of the coarser grid, which has fewer
    between, next_line = lines[i], lines[i + 1]
    between *= 1 - a
    next_line *= a
    between += next_line
    return np.asarray(between)


def edges_of(disparity: FloatArray) -> BoolArray:
    """Which pixels lie at an edge: the disparity of a slanted plane has no second difference."""
    twice, edge = 2.0 * disparity, np.zeros(disparity.shape, dtype=np.bool_)
    bent = disparity[2:] - twice[1:-1]
    bent += disparity[:-2]
    edge[1:-1] = np.abs(bent, out=bent) > EDGE_JUMP
    across = disparity[:, 2:] - twice[:, 1:-1]
    across += disparity[:, :-2]
    edge[:, 1:-1] |= np.abs(across, out=across) > EDGE_JUMP
    return edge


def shadowed(disparity: FloatArray) -> BoolArray:
    """Which pixels of the left imager the right one does not see, (height, width) of bool.

    Args:
        disparity: Disparity in pixels of this image, (height, width).
    """
    columns = np.arange(disparity.shape[1])
    seen_at = columns - disparity
    nearest = np.minimum.accumulate(seen_at[:, ::-1], axis=1)[:, ::-1]
    ahead = np.full_like(nearest, np.inf)
    ahead[:, :-1] = nearest[:, 1:]
    return np.asarray(seen_at > ahead + 0.5)


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
    shape, ratio = depth.shape, camera.model.fx / model.fx
    scale = camera.disparity_scale()
    with np.errstate(divide="ignore", invalid="ignore"):
        disparity = np.where(np.isfinite(depth) & (depth > 0.0), scale / depth, 0.0)
    lost = disparity <= 0.0
    if noise.shadow:
        lost |= shadowed(disparity / ratio)
    if noise.fattening > 0.0:
        reach = noise.fattening / ratio
        share = np.clip(0.5 + 0.5 * smooth_field(shape, 6.0 / ratio, generator), 0.0, 1.0)
        grown = scipy.ndimage.grey_dilation(disparity, size=(2 * int(np.ceil(reach)) + 1,) * 2)
        # A growth of less than a pixel happens to a share of the pixels along an edge.
        chance = reach / np.ceil(reach)
        beside = scipy.ndimage.maximum_filter(edges_of(disparity), 2 * int(np.ceil(reach)) + 1)
        near = beside & (grown - disparity > EDGE_JUMP) & (share < chance)
        disparity = np.where(near, grown, disparity)
        lost &= ~near
    if noise.flying > 0.0:
        high = scipy.ndimage.maximum_filter(disparity, 3)
        low = scipy.ndimage.minimum_filter(disparity, 3)
        edge = scipy.ndimage.maximum_filter(edges_of(disparity), 3) & (high - low > EDGE_JUMP)
        mixed = low + (high - low) * generator.random(shape)
        disparity = np.where(edge & (generator.random(shape) < noise.flying), mixed, disparity)
    if noise.white > 0.0:
        disparity = disparity + noise.white * smooth_field(
            shape, noise.correlation / ratio, generator
        )
    disparity = disparity + errors.pattern + errors.offset
    if noise.holes > 0.0:
        field = smooth_field(shape, 4.0 / ratio, generator)
        lost |= field > np.quantile(field, 1.0 - noise.holes)
    if noise.step > 0.0:
        disparity = noise.step * np.round(disparity / noise.step)
    with np.errstate(divide="ignore"):
        found = scale / np.maximum(disparity, 1e-9)
    lost |= (disparity <= 0.0) | (found < camera.nearest) | (found > camera.farthest)
    return np.where(lost, 0.0, found)
