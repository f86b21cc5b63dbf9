"""What stairs a depth image in a file shows: reading it, and telling them in plain figures."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.perception.camera_model import (
    D435,
    D455,
    MOST_PIXELS,
    CameraModel,
    level_rotation,
)
from drake_quad.perception.depth_frame import (
    FARTHEST_DEPTH,
    NEAREST_DEPTH,
    DepthAccuracy,
    DepthFrame,
    prepare_frame,
    stereo_accuracy,
)
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_fit import StairPriors
from drake_quad.perception.stair_search import FoundStairs, find_stairs
from drake_quad.perception.stair_tracker import SEED, CameraPose, make_belief
from drake_quad.util.display import one_line
from drake_quad.util.files import MIB, read_given, user_path

MOST_IMAGE = 64 * MIB
# Of the stair images of Shiaoming/stair-perception: recovered from a point cloud and the depth
# image of the same instant, to 0.5 mm.
KINECT_V2 = CameraModel(width=512, height=424, fx=365.318, fy=365.318, cx=254.687, cy=208.548)
PRESETS = {"d435": D435.model, "d455": D455.model, "kinect_v2": KINECT_V2}
ONE = {"place": 1.0, "height": 1.0, "yaw": 1.0, "overhang": 1.0, "rise": 1.0, "run": 1.0}
# A camera that nobody has calibrated: what single images of a Kinect v2 show of it. Its depths bend
# in corners, and its IMU and level treads disagree by 3 degrees.
UNKNOWN = DepthAccuracy(depth=0.008, depth_offset=0.02, pattern=0.010, tilt=float(np.radians(2.0)))
UNKNOWN_SCALE = 0.01  # deviation of the factor by which all of its depths may be too long or short


@dataclass(frozen=True)
class SeenStairs:
    """What an image shows.

    Attributes:
        belief: The stairs; None if nothing speaks for any. W is the level frame L.
        frame: The image as it was looked at.
        found: The fit behind the belief; None without one.
    """

    belief: StairBelief | None
    frame: DepthFrame
    found: FoundStairs | None

    def __repr__(self) -> str:
        if self.belief is None:
            return one_line(self, "no stairs")
        many, way = self.belief.count_least, "up" if self.belief.going_up else "down"
        rise, run = self.belief.rise, self.belief.run
        return one_line(self, f"{many} or more steps {way}", f"{rise:.3f} m by {run:.3f} m")


def read_depth_image(path: str | Path, *, scale: float) -> FloatArray:
    """A depth image of 16 bits or more a pixel.

    Args:
        path: A PNG or TIFF file.
        scale: Metres of one unit of it.

    Returns:
        Distances along the optical axis [m], (height, width); 0 where there is none.

    Raises:
        InputError: It is no such image, has too many pixels, or cannot be read.
    """
    from PIL import Image

    def fail(field: str, value: object, remedy: str) -> InputError:
        return InputError(source=str(path), field=field, value=value, remedy=remedy)

    try:
        data = read_given(user_path(path), most=MOST_IMAGE)
    except OSError as error:
        reason = error.strerror or str(error)
        raise fail("file", str(path), f"cannot be read: {reason}; give a PNG or TIFF") from None
    remedy = "must be a depth image of 16 bits a pixel, as PNG or TIFF"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of damaged files: what is wrong is told below
            with Image.open(BytesIO(data), formats=("PNG", "TIFF")) as image:
                width, height = image.size
                if max(width, height) > MOST_PIXELS or min(width, height) < 16:
                    size = f"{width} by {height} pixels"
                    raise fail("size", size, f"must have from 16 to {MOST_PIXELS} pixels a side")
                if not (image.mode.startswith("I") or image.mode == "F"):
                    raise fail("pixels", image.mode, remedy)
                values = np.asarray(image, dtype=np.float64)
    except InputError:
        raise
    except Exception:  # whatever a damaged file makes of its reader
        raise fail("file", Path(path).name, remedy) from None
    values = np.where(np.isfinite(values) & (values > 0.0), values, 0.0) * scale
    if np.count_nonzero(values) < 0.02 * values.size:
        raise fail("depths", f"{np.count_nonzero(values)} pixels", "fewer than 2 % have a depth")
    _check_depths(values, fail, "--scale says how long a unit of the image is")
    return values


def parse_intrinsics(text: str, *, width: int, height: int) -> CameraModel:
    """Intrinsics from `fx,fy,cx,cy` in pixels, or of a camera by its name.

    Args:
        text: Four numbers with commas between, or one of `PRESETS`.
        width: The image's columns.
        height: Its rows.

    Raises:
        InputError: It is neither, or the figures cannot be those of an image of this size.
    """
    source, names = "--intrinsics", ", ".join(sorted(PRESETS))
    known = PRESETS.get(text.lower())
    if known is not None:
        ratio = width / known.width
        if abs(height / known.height - ratio) > 0.02 * ratio:
            told = (
                f"the camera's images are {known.width} by {known.height} pixels or in proportion"
            )
            remedy = f"{told}, and this one is {width} by {height}: give fx,fy,cx,cy"
            raise InputError(source=source, field="intrinsics", value=text, remedy=remedy)
        return CameraModel(
            width=width, height=height, fx=known.fx * ratio, fy=known.fy * ratio,
            cx=(known.cx + 0.5) * ratio - 0.5, cy=(known.cy + 0.5) * ratio - 0.5,
        )  # fmt: skip
    try:
        fx, fy, cx, cy = (float(part) for part in text.split(","))
    except ValueError:
        remedy = f"must be four numbers fx,fy,cx,cy in pixels, or one of {names}"
        raise InputError(source=source, field="intrinsics", value=text, remedy=remedy) from None
    model = CameraModel(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy)
    model.check(source=source)
    return model


def see_stairs(
    depth: FloatArray,
    model: CameraModel,
    *,
    pitch: float,
    roll: float = 0.0,
    camera_height: float | None = None,
    tilt_error: float = UNKNOWN.tilt,
    baseline: float | None = None,
) -> SeenStairs:
    """Looks for stairs in one image.

    Args:
        depth: Distances along the optical axis [m], (height, width); 0 where there is none.
        model: Intrinsics.
        pitch: Angle of the optical axis below the horizon [rad].
        roll: Angle about the optical axis, right side down positive [rad].
        camera_height: Height of the camera over the floor, to 2 cm [m]; None if it is not known.
        tilt_error: Deviation of pitch and roll [rad].
        baseline: Baseline of a stereo camera [m], whose errors are then taken for a D435's; None
            for a camera of which nothing is known but what `UNKNOWN` says.

    Raises:
        InputError: The image is not one of that camera, holds no depths in metres, or the angle
            is none in radians.
    """
    _check_seen(depth, model, pitch)
    known = UNKNOWN if baseline is None else stereo_accuracy(model.fx * baseline)
    accuracy = replace(known, tilt=tilt_error)
    pose = CameraPose(level_rotation(pitch=pitch, roll=roll), np.zeros(3))
    frame = prepare_frame(depth, model, pose.R_LC, accuracy)
    priors = StairPriors()
    if camera_height is not None:
        priors = replace(priors, floor=(-camera_height, 0.02))
    found = find_stairs(frame, priors, np.random.default_rng(SEED))
    if found is None:
        return SeenStairs(None, frame, None)
    belief = make_belief(found, pose, stamp=0.0, tilt=0.0, factors=ONE)
    if baseline is None:
        belief = scaled_by(belief, UNKNOWN_SCALE)
    return SeenStairs(belief, frame, found)


def _check_seen(depth: FloatArray, model: CameraModel, pitch: float) -> None:
    """Refuses an image in which stairs would be looked for in vain; see `see_stairs`.

    Raises:
        InputError: As there.
    """

    def fail(field: str, value: object, remedy: str) -> InputError:
        return InputError(source="see_stairs", field=field, value=value, remedy=remedy)

    if not isinstance(model, CameraModel):
        remedy = "must be a CameraModel, such as parse_intrinsics makes"
        raise fail("model", type(model).__name__, remedy)
    if not isinstance(depth, np.ndarray) or depth.shape != (model.height, model.width):
        told = getattr(depth, "shape", type(depth).__name__)
        raise fail("depth", told, f"must be an array of {model.height} by {model.width}")
    if not abs(pitch) <= 0.5 * np.pi:
        raise fail("pitch", pitch, "must be radians, from -1.571 to 1.571")
    if np.any(depth > 0.0):  # of one without any depth there is nothing to see
        _check_depths(depth, fail, "give metres")


def _check_depths(depth: FloatArray, fail: Callable[..., InputError], remedy: str) -> None:
    """Refuses an image of which hardly any pixel has a depth that a camera tells stairs by.

    Raises:
        InputError: It is such an image.
    """
    used = (depth > NEAREST_DEPTH) & (depth < FARTHEST_DEPTH)
    if np.count_nonzero(used) >= 0.02 * depth.size:
        return
    known = depth[depth > 0.0]
    told = f"{float(np.median(known)):.4g} m in the median" if known.size else "none"
    between = f"fewer than 2 % lie between {NEAREST_DEPTH:g} and {FARTHEST_DEPTH:g} m"
    raise fail("depths", told, f"{between}; {remedy}")


def scaled_by(belief: StairBelief, sigma: float) -> StairBelief:
    """The belief of a camera whose depths may all be too long, or too short, by one factor.

    The image cannot show that: larger stairs farther away look the same.

    Args:
        belief: The stairs, told from the camera.
        sigma: Deviation of the factor.
    """
    lengths = np.concatenate(
        [belief.places, belief.heights, [0.0, belief.overhang, belief.rise, belief.run]]
    )
    return replace(belief, covariance=belief.covariance + sigma**2 * np.outer(lengths, lengths))


def describe_seen(seen: SeenStairs) -> dict[str, Any]:
    """What is seen as plain figures in m and degrees; intervals are of 95 %."""
    belief = seen.belief
    if belief is None:
        return {"stairs": False}

    def interval(which: str, scale: float = 1.0) -> dict[str, float]:
        found = belief.estimate(which)
        return {"value": scale * found.value, "half_width": scale * found.half_width}

    return {
        "stairs": True,
        "going": "up" if belief.going_up else "down",
        "count_least": belief.count_least,
        "count_most": belief.count_most,
        "open": belief.is_open,
        "rise": interval("rise"),
        "run": interval("run"),
        "overhang": interval("overhang"),
        "yaw_deg": interval("yaw", float(np.degrees(1.0))),
        "places": [float(x) for x in belief.places],
        "heights": [float(x) for x in belief.heights],
    }
