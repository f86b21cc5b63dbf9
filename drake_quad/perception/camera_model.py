"""A pinhole depth camera: intrinsics, rays of pixels, presets.

Frame C is the camera's: x to the right, y down, z along the optical axis. The level frame L has
C's origin, z up, and x along the camera's heading. A pixel's index is the place of its centre, as
in OpenCV and librealsense: pixel u looks along (u - cx) / fx. Drake's renderers (and libfreenect2)
place the centre of pixel u at u + 0.5, so their principal point is greater by half a pixel; taking
the one for the other moves a floor at 1 m by millimetres.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import InputError

MOST_PIXELS = 4096  # a side; no depth camera has more


@dataclass(frozen=True, kw_only=True)
class CameraModel:
    """Intrinsics of a pinhole camera without distortion.

    Attributes:
        width: Pixels in a row.
        height: Rows.
        fx: Focal length across [px].
        fy: Focal length down [px].
        cx: Column of the principal point, where 0 is the centre of the first pixel.
        cy: Row of the principal point, likewise.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @property
    def drake_principal_point(self) -> tuple[float, float]:
        """The principal point as Drake's `CameraInfo` wants it [px]."""
        return self.cx + 0.5, self.cy + 0.5

    def decimated(self, factor: int) -> "CameraModel":
        """The model of an image whose pixels are squares of `factor` by `factor` of this one's."""
        return CameraModel(
            width=self.width // factor,
            height=self.height // factor,
            fx=self.fx / factor,
            fy=self.fy / factor,
            cx=(self.cx + 0.5) / factor - 0.5,
            cy=(self.cy + 0.5) / factor - 0.5,
        )

    def turned(self) -> "CameraModel":
        """The model of the same camera held upright: a quarter of a turn about its optical axis.

        Its left imager, whose images these are, is then below the other one.
        """
        return CameraModel(
            width=self.height, height=self.width, fx=self.fy, fy=self.fx,
            cx=self.cy, cy=self.width - 1.0 - self.cx,
        )  # fmt: skip

    def rays(self) -> FloatArray:
        """Each pixel's ray in C, of unit depth: (height, width, 3)."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        x, y = (u - self.cx) / self.fx, (v - self.cy) / self.fy
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    def deproject(self, depth: FloatArray) -> FloatArray:
        """The points that a depth image shows.

        Args:
            depth: Distance along the optical axis [m], (height, width).

        Returns:
            Points in C [m], (height, width, 3).
        """
        return np.asarray(self.rays() * depth[..., np.newaxis])

    def check(self, *, source: str) -> None:
        """Sees that the figures can be those of a depth camera.

        Args:
            source: What the message names as their source.

        Raises:
            InputError: A figure is not finite or out of bounds; it tells the bounds.
        """
        side = max(self.width, self.height)
        bounds = {
            "width": (self.width, 16, MOST_PIXELS),
            "height": (self.height, 16, MOST_PIXELS),
            "fx": (self.fx, 0.2 * self.width, 20.0 * side),
            "fy": (self.fy, 0.2 * self.height, 20.0 * side),
            "cx": (self.cx, 0.0, self.width),
            "cy": (self.cy, 0.0, self.height),
        }
        for name, (value, least, most) in bounds.items():
            if not (math.isfinite(value) and least <= value <= most):
                size = f"{self.width} by {self.height}"
                remedy = f"must be from {least:g} to {most:g} px for an image of {size}"
                raise InputError(source=source, field=name, value=value, remedy=remedy)


def make_camera(*, width: int, height: int, horizontal_view: float) -> CameraModel:
    """A camera with square pixels and its principal point in the middle.

    Args:
        width: Pixels in a row.
        height: Rows.
        horizontal_view: Angle between the first and the last column's outer edges [rad].
    """
    f = 0.5 * width / math.tan(0.5 * horizontal_view)
    return CameraModel(
        width=width, height=height, fx=f, fy=f, cx=0.5 * width - 0.5, cy=0.5 * height - 0.5
    )


def level_rotation(*, pitch: float, roll: float = 0.0) -> FloatArray:
    """The rotation R_LC of a camera that looks down.

    Args:
        pitch: Angle of the optical axis below the horizon [rad].
        roll: Angle about the optical axis, right side down positive [rad].

    Returns:
        R_LC, (3, 3): it turns vectors of C into L.
    """
    c, s = math.cos(pitch), math.sin(pitch)
    # L's axes (forward, left, up) of C's (right, down, optical) at roll 0
    R = np.array([[0.0, -s, c], [-1.0, 0.0, 0.0], [0.0, -c, -s]])
    a, b = math.cos(roll), math.sin(roll)
    return np.asarray(R @ np.array([[a, -b, 0.0], [b, a, 0.0], [0.0, 0.0, 1.0]]))


@dataclass(frozen=True, kw_only=True)
class StereoCamera:
    """A stereo camera as it is sold.

    Attributes:
        name: The product.
        model: Intrinsics at the resolution that its maker recommends.
        baseline: Distance between its two imagers [m].
        nearest: Shortest distance that it measures [m].
        farthest: Longest distance that is used [m].
    """

    name: str
    model: CameraModel
    baseline: float
    nearest: float
    farthest: float

    def disparity_scale(self) -> float:
        """Disparity times depth, f B [px m], in pixels of `model`."""
        return self.model.fx * self.baseline


# Intel, "RealSense product family D400 series datasheet" (337029): baselines 50 and 95 mm, nearest
# distances at 848 x 480; 848 x 480 is the recommended resolution ("Tuning depth cameras for best
# performance"); the field of view of 90 degrees is that of "Subpixel linearity improvement".
D435 = StereoCamera(
    name="D435",
    model=make_camera(width=848, height=480, horizontal_view=0.5 * math.pi),
    baseline=0.050,
    nearest=0.20,
    farthest=6.0,
)
D455 = StereoCamera(
    name="D455",
    model=make_camera(width=848, height=480, horizontal_view=0.5 * math.pi),
    baseline=0.095,
    nearest=0.40,
    farthest=6.0,
)
