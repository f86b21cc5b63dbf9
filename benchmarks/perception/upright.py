"""How well intervals hold that a camera held upright gives of flights like `studies/unmapped.yaml`.

    python -m benchmarks.perception.upright --looks 100 --seed 700
    python -m benchmarks.perception.upright --looks 100 --seed 700 --attitude 0.56 --told 0.56

Each look draws a flight as that study does (3 to 6 steps of 0.10 to 0.18 m by 0.28 to 0.50 m,
turned by up to 5 degrees), how far ahead of the camera it begins (0.16 to 1.36 m), the camera's
height (0.97 m, to 10 mm) and a D435's errors. Images are rendered exactly, at the full resolution,
with the noise in the camera's own rows and columns. It takes a second a look, and needs no Drake.
With `--attitude` the robot's estimate of its attitude errs about both level axes by so many
degrees (one standard deviation), of which the fit is told `--told`.
"""

import argparse
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from benchmarks.common import markdown_table, provenance
from benchmarks.perception.scenes import Scene, build_boxes, render
from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.perception.depth_noise import (
    STEREO_NOISE,
    StereoNoise,
    add_noise,
    draw_camera_errors,
)
from drake_quad.perception.stair_belief import NORMAL_95, StairBelief
from drake_quad.perception.stair_tracker import CameraPose, StairTracker

HEIGHT, PITCH = 0.97, float(np.radians(35.0))  # [m], below the horizon
AHEAD = 0.64  # [m] of the camera before the body
MODEL = D435.model.turned()
FEET = np.array([[-0.24, 0.3, 0.0], [-0.24, -0.3, 0.0], [-1.04, 0.3, 0.0], [-1.04, -0.3, 0.0]])
QUANTITIES = ("place", "height", "yaw", "rise", "run")
Looks = dict[str, list[tuple[float, float]]]


def draw_flight(generator: np.random.Generator) -> Scene:
    """A flight of the study, 2 m wide, on a floor and before a landing as wide."""
    first = generator.uniform(0.8, 2.0) - AHEAD
    rise, run = generator.uniform(0.10, 0.18), generator.uniform(0.28, 0.50)
    n, yaw = int(generator.integers(3, 7)), float(np.radians(generator.uniform(-5.0, 5.0)))
    places, heights = first + run * np.arange(n), rise * np.arange(n + 1)
    boxes = build_boxes(places, heights, left=1.0, right=1.0, beyond=3.0, ground=False)
    boxes = np.vstack([boxes, (-3.0, -1.0, -0.5, float(places[0]), 1.0, 0.0)])
    return Scene("up", places, heights, yaw, 0.0, (1.0, 1.0), boxes)


def look(
    generator: np.random.Generator,
    noise: StereoNoise = STEREO_NOISE,
    *,
    attitude: float = 0.0,
    told: float = 0.0,
) -> tuple[Scene, StairBelief | None]:
    """A drawn flight, and what one image of it tells.

    Args:
        generator: The source of what is random.
        noise: The camera's errors.
        attitude: Deviation of the error of the estimated roll and pitch [rad]. The feet are where
            the estimate has them: the robot turns about the camera, so that its place is right.
        told: The deviation that the estimate is told to have [rad].
    """
    scene = draw_flight(generator)
    height = HEIGHT + 0.01 * float(generator.standard_normal())
    errors = draw_camera_errors(noise, D435, D435.model, generator)
    R_LC = level_rotation(pitch=PITCH)
    exact = render(scene, MODEL, R_LC @ rotation_exp(*errors.tilt), height)
    depth: FloatArray = add_noise(
        np.rot90(exact, -1), noise=noise, errors=errors, camera=D435, model=D435.model,
        generator=generator,
    )  # fmt: skip
    tracker = StairTracker(model=MODEL, accuracy=stereo_accuracy(D435.disparity_scale()))
    R_WL = np.eye(3)  # W as the estimate has it, from W as it is
    if attitude > 0.0:
        roll, pitch = (float(x) for x in attitude * generator.standard_normal(2))
        R_WL = rotation_exp(roll, pitch, 0.0)
    place = np.array([0.0, 0.0, height])
    pose = CameraPose(R_WL @ R_LC, place, np.array([told, told, 0.0]))
    feet = (FEET - place) @ R_WL.T + place
    return scene, tracker.update(np.ascontiguousarray(np.rot90(depth)), pose, feet=feet)


def errors_of(scene: Scene, belief: StairBelief) -> Looks:
    """Errors and deviations of what is told, in m and rad, by quantity."""
    n = min(len(belief.places), len(scene.places))
    true = scene.places[:n] / np.cos(belief.yaw - scene.yaw)  # along the believed line
    heights = scene.heights[1 : n + 1]
    found: Looks = {
        "place": list(zip(belief.places[:n] - true, belief.place_sigmas[:n], strict=True)),
        "height": list(
            zip(belief.heights[1 : n + 1] - heights, belief.height_sigmas[1 : n + 1], strict=True)
        ),
        "yaw": [(belief.yaw - scene.yaw, belief.sigma("yaw"))],
        "rise": [(belief.rise - heights[-1] / n, belief.sigma("rise"))],
        "run": [(belief.run - float(np.diff(true).mean()), belief.sigma("run"))],
    }
    return found


def study(
    looks: int, seed: int, *, attitude: float = 0.0, told: float = 0.0
) -> tuple[Looks, int, int]:
    """All looks of a seed: errors and deviations, how many were found, how many over-claimed."""
    rows: Looks = defaultdict(list)
    found = over = 0
    for i in range(looks):
        scene, belief = look(np.random.default_rng([seed, i]), attitude=attitude, told=told)
        if belief is None:
            continue
        found += 1
        over += belief.count_least > len(scene.places)
        for name, pairs in errors_of(scene, belief).items():
            rows[name] += pairs
    return rows, found, over


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark and prints its table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--looks", type=int, default=100)
    parser.add_argument("--seed", type=int, default=700)
    parser.add_argument("--attitude", type=float, default=0.0, help="degrees")
    parser.add_argument("--told", type=float, default=0.0, help="degrees")
    asked = parser.parse_args(arguments)
    attitude, told = (float(np.radians(angle)) for angle in (asked.attitude, asked.told))
    rows, found, over = study(asked.looks, asked.seed, attitude=attitude, told=told)
    table = []
    for name in QUANTITIES:
        error, sigma = np.array(rows[name]).T
        scale = float(np.degrees(1.0)) if name == "yaw" else 1e3
        inside = int(np.count_nonzero(np.abs(error) <= NORMAL_95 * sigma))
        table.append([
            name, f"{inside} of {len(error)}", f"{100.0 * inside / len(error):.1f}",
            f"{scale * error.mean():+.2f}", f"{scale * np.sqrt(np.mean(error**2)):.2f}",
            f"{np.mean(error / sigma):+.2f}", f"{np.std(error / sigma):.2f}",
        ])  # fmt: skip
    header = [
        "figure (mm, degrees)", "within 95 %", "%", "mean error", "root mean square",
        "mean in deviations", "spread in deviations",
    ]  # fmt: skip
    print(markdown_table(header, table))
    print(f"\nfound {found} of {asked.looks}, count over-claimed {over}; seed {asked.seed}; "
          f"{provenance('numba', 'scipy')}")  # fmt: skip


if __name__ == "__main__":
    main()
