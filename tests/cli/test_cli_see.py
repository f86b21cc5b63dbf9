"""The command `see`: a rendered image of stairs, and files that are no depth images."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from command import drake_quad, refused
from PIL import Image

from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.perception.camera_model import D435, level_rotation

MODEL = D435.model.decimated(2)


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    places, heights = 0.8 + 0.3 * np.arange(4), 0.16 * np.arange(5)
    scene = Scene("up", places, heights, 0.0, 0.0, (0.8, 0.8), build_boxes(places, heights))
    depth = render(scene, MODEL, level_rotation(pitch=np.radians(35.0)), 0.95)
    units = np.where(np.isfinite(depth), 1000.0 * depth, 0.0)
    path = tmp_path_factory.mktemp("see") / "depth.png"
    Image.fromarray(np.round(units).astype(np.uint16)).save(path)
    return path


def test_a_rendered_flight_is_told_with_a_picture(image: Path, tmp_path: Path) -> None:
    """Rise and run are within their intervals of the truth, and the picture is written."""
    picture = tmp_path / "seen.png"
    done = drake_quad(
        "see", str(image), "--intrinsics", "d435", "--tilt", "35", "--json", "--picture",
        str(picture), cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["stairs"] and told["going"] == "up" and told["count_least"] >= 3
    for name, true in (("rise", 0.16), ("run", 0.30)):
        assert abs(told[name]["value"] - true) < told[name]["half_width"] < 0.02
    assert Image.open(picture).size[0] > 500


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--intrinsics", "1,2,3"], "four numbers"),
        (["--intrinsics", "1e9,400,212,120"], "fx"),
        (["--intrinsics", "400,400,212,nan"], "cy"),
        (["--intrinsics", "kinect_v2"], "kinect_v2"),
        (["--intrinsics", "d435", "--scale", "0"], "--scale"),
        (["--intrinsics", "d435", "--scale", "0.1"], "between 0.15 and 4 m"),
        (["--intrinsics", "d435", "--tilt", "-50"], "must be from -40 to 89"),
        (["--intrinsics", "d435", "--tilt-error", "nan"], "--tilt-error"),
        (["--intrinsics", "d435", "--picture", "seen.txt"], "seen.txt"),
    ],
)
def test_what_cannot_be_is_refused(
    image: Path, tmp_path: Path, options: list[str], named: str
) -> None:
    """One line that names what was given, and status 2."""
    done = drake_quad("see", str(image), "--tilt", "35", *options, cwd=tmp_path)
    assert named in refused(done)


def test_files_that_are_no_depth_images_are_refused(tmp_path: Path) -> None:
    """Text, colour, an empty image, a pipe and a device: one line each, and no waiting."""
    text, colour, empty, pipe = (tmp_path / name for name in ("a.png", "b.png", "c.png", "d"))
    text.write_text("no image")
    Image.new("RGB", (64, 64)).save(colour)
    Image.fromarray(np.zeros((64, 64), dtype=np.uint16)).save(empty)
    os.mkfifo(pipe)
    options = ["--intrinsics", "60,60,32,32", "--tilt", "30"]
    assert "16 bits" in refused(drake_quad("see", str(text), *options, cwd=tmp_path))
    assert "16 bits" in refused(drake_quad("see", str(colour), *options, cwd=tmp_path))
    assert "depth" in refused(drake_quad("see", str(empty), *options, cwd=tmp_path))
    assert "pipe" in refused(drake_quad("see", str(pipe), *options, cwd=tmp_path))
    assert "device" in refused(drake_quad("see", "/dev/zero", *options, cwd=tmp_path))


# The images of Shiaoming/stair-perception are not ours to hand on.
REAL = Path(os.environ.get("DRAKE_QUAD_REAL_STAIRS", "")) / "0001_depth.png"


@pytest.mark.skipif(not REAL.is_file(), reason="DRAKE_QUAD_REAL_STAIRS names no folder with it")
@pytest.mark.parametrize("tilt", ["26.96", "30"])
def test_a_real_flight_of_five_steps_is_told(tilt: str, tmp_path: Path) -> None:
    """A real image has its five steps, and its authors' rise and run within narrow intervals.

    They give 0.110 and 0.277 m; there is no tape measure's truth. The IMU's tilt is 26.96 degrees,
    and any tilt that is as far off as it is serves as well.
    """
    options = ["--intrinsics", "kinect_v2", "--tilt", tilt, "--json"]
    done = drake_quad("see", str(REAL), *options, cwd=tmp_path)
    told = json.loads(done.stdout)
    assert told["stairs"] and told["going"] == "up" and told["count_least"] == 5
    for name, theirs in (("rise", 0.110), ("run", 0.277)):
        assert abs(told[name]["value"] - theirs) < told[name]["half_width"] <= 0.015
