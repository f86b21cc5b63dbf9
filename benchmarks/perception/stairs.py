"""How well stairs are estimated from one depth image: errors, coverage, gross errors, time.

    python -m benchmarks.perception.stairs --scenes 240 --seed 1
    python -m benchmarks.perception.stairs --scenes 240 --seed 1000 --calibrate

Stairs are drawn (`scenes.draw_scene`), rendered exactly, and given a D435's errors; the camera's
own errors (offset, pattern, tilt) and the feet's height are drawn for each scene. Two cameras look:
0.95 m high, 35 degrees down (the paper's robot), and 0.32 m high, 15 degrees down (one like Go1);
both 45 degrees down from a landing. Images are of 424 x 240, half of the camera's resolution.
`--rows` keeps what was measured of each scene, with deviations as the fit has them; tables multiply
them by `calibration.FACTORS`, as beliefs do. `--read` makes tables of kept rows.
`--calibrate` prints the factors that make stated intervals hold, for `calibration.FACTORS`.
"""

import argparse
import json
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import markdown_table, provenance
from benchmarks.perception.scenes import Scene, draw_scene, render
from drake_quad.math.rotations import rotation_exp
from drake_quad.perception.calibration import (
    DOWN,
    FACTORS,
    QUANTITIES,
    deviation_factors,
    kind_of_stairs,
)
from drake_quad.perception.camera_model import D435, level_rotation
from drake_quad.perception.depth_frame import stereo_accuracy
from drake_quad.perception.depth_noise import STEREO_NOISE, add_noise, draw_camera_errors
from drake_quad.perception.stair_belief import NORMAL_95, StairBelief
from drake_quad.perception.stair_tracker import FOOT_SIGMA, CameraPose, StairTracker

MODEL = D435.model.decimated(2)
CAMERAS = {"paper": (0.95, 35.0), "go1": (0.32, 15.0)}  # height [m], angle below the horizon [deg]
LOOKS_DOWN = 45.0  # [deg] from a landing
KINDS = ("up", "down", "uneven", "open", "overhang", "none")
NEAR = 1.2  # [m] within which the next three nosings count
SHOWN = ("place", "height", "rise", "run", "yaw")
BOUNDS = {"place": 12.0, "height": 6.0, "rise": 4.0, "run": 6.0, "yaw": 0.5}  # of issue 35, 95 %


def see(scene: Scene, camera: str, generator: np.random.Generator) -> dict[str, Any]:
    """One scene seen by one camera, searched, and tracked once more from what the search found."""
    height, pitch = CAMERAS[camera]
    errors = draw_camera_errors(STEREO_NOISE, D435, MODEL, generator)
    R_LC = level_rotation(pitch=np.radians(LOOKS_DOWN if scene.kind == "down" else pitch))
    exact = render(scene, MODEL, R_LC @ rotation_exp(*errors.tilt), height)
    images = [
        add_noise(exact, noise=STEREO_NOISE, errors=errors, camera=D435, model=MODEL,
                  generator=generator)
        for _ in range(2)
    ]  # fmt: skip
    floor = FOOT_SIGMA * float(generator.standard_normal())
    feet = np.array([[0.1, 0.15, floor], [0.1, -0.15, floor]])
    pose = CameraPose(R_LC, np.array([0.0, 0.0, height]))
    tracker = StairTracker(model=MODEL, accuracy=stereo_accuracy(D435.disparity_scale()))
    begun = time.process_time()
    belief = tracker.update(images[0], pose, feet=feet)
    searched = time.process_time()
    tracked = None
    if belief is not None:
        tracked = tracker.update(images[1], pose, last=belief, feet=feet)
    row: dict[str, Any] = {
        "kind": scene.kind, "camera": camera, "found": belief is not None,
        "search": searched - begun,
        "track": time.process_time() - searched if belief is not None else None,
    }  # fmt: skip
    if tracked is not None:
        row.update(_errors(tracked, scene, height))
    return row


def _errors(belief: StairBelief, scene: Scene, camera_height: float) -> dict[str, Any]:
    """Errors and deviations (in mm and degrees), and whether anything is grossly wrong."""
    n = len(scene.places)
    told = kind_of_stairs(
        belief.places, belief.heights, overhang=belief.overhang, is_open=belief.is_open
    )
    factors = deviation_factors(told, camera_height=camera_height)
    if n == 0:
        return {"gross": True, "pairs": []}
    k = min(3, n, len(belief.places))
    rise, run = np.diff(scene.heights), np.diff(scene.places)
    place = belief.places[:k] - scene.places[:k]
    height = belief.heights[1 : k + 1] - scene.heights[1 : k + 1]
    pairs: list[tuple[str, float, float, bool]] = []
    for i in range(k):
        near = bool(scene.places[i] < NEAR)
        pairs.append(("place", 1e3 * place[i], 1e3 * belief.place_sigmas[i], near))
        pairs.append(("height", 1e3 * height[i], 1e3 * belief.height_sigmas[i + 1], near))
    near = bool(scene.places[0] < NEAR)
    seen = len(belief.places)
    mean_rise, mean_run = rise[:seen].mean(), run[: max(1, min(seen, n) - 1)].mean()
    pairs.append(("rise", 1e3 * (belief.rise - mean_rise), 1e3 * belief.sigma("rise"), near))
    pairs.append(("run", 1e3 * (belief.run - mean_run), 1e3 * belief.sigma("run"), near))
    turn = np.degrees(belief.yaw - scene.yaw)
    pairs.append(("yaw", turn, np.degrees(belief.sigma("yaw")), near))
    over = belief.overhang - scene.overhang
    pairs.append(("overhang", 1e3 * over, 1e3 * belief.sigma("overhang"), near))
    off = bool(
        np.any(np.abs(place) > 0.5 * run.min()) or np.any(np.abs(height) > 0.5 * abs(rise[0]))
    )
    return {
        "gross": off or belief.going_up != scene.going_up,
        "over": belief.count_least > n,
        "under": belief.count_most is not None and belief.count_most < n,
        "known": belief.count_most == belief.count_least,
        "told": told,
        # the fit's own deviations: what is calibrated
        "pairs": [(name, float(e), float(s) / factors[name], ok) for name, e, s, ok in pairs],
    }


def study(
    scenes: int, seed: int, cameras: Sequence[str], kept: Path | None = None
) -> list[dict[str, Any]]:
    """All scenes of a seed, in the order of kinds, by each camera; kept as they are done."""
    rows: list[dict[str, Any]] = []
    for i in range(scenes):
        for camera in cameras:
            generator = np.random.default_rng([seed, i])
            scene = draw_scene(KINDS[i % len(KINDS)], generator)
            rows.append(see(scene, camera, generator))
        if kept is not None:
            kept.write_text(json.dumps(rows))
    return rows


def _figure(values: Sequence[float]) -> str:
    if not values:
        return "-"
    sizes = np.abs(values)
    return f"{sizes.mean():.1f} / {np.quantile(sizes, 0.95):.1f}"


def _share(ratios: Sequence[float]) -> str:
    return f"{100 * np.mean(np.array(ratios) < NORMAL_95):.0f}" if ratios else "-"


def tables(rows: list[dict[str, Any]]) -> str:
    """The tables as Markdown."""
    parts = []
    header = [
        "camera, stairs",
        "scenes",
        "found",
        *(f"{q}" for q in SHOWN),
        "gross",
        "count over",
    ]
    errors, coverage = [], []
    for camera in CAMERAS:
        for kind in KINDS[:-1]:
            mine = [r for r in rows if r["camera"] == camera and r["kind"] == kind]
            told = [r for r in mine if "pairs" in r]
            if not mine:
                continue
            by: dict[str, list[tuple[float, float]]] = defaultdict(list)
            for r in told:
                for name, e, s, near in r["pairs"]:
                    if near:
                        by[name].append((e, s))
            errors.append([
                f"{camera}, {kind}", str(len(mine)), str(sum(r["found"] for r in mine)),
                *(_figure([e for e, _ in by[q]]) for q in SHOWN),
                str(sum(r["gross"] for r in told)),
                str(sum(r.get("over", False) or r.get("under", False) for r in told)),
            ])  # fmt: skip
            every: dict[str, list[float]] = defaultdict(list)
            for r in told:
                for name, e, s, _ in r["pairs"]:
                    every[name].append(abs(e) / (s * _factors(r)[name]))
            coverage.append([
                f"{camera}, {kind}",
                *(_share(every[q]) for q in SHOWN),
                str(sum(r.get("known", False) for r in told)),
            ])  # fmt: skip
    errors.append(["bound (95 %)", "", "", *(f"{BOUNDS[q]:g}" for q in SHOWN), "0", "0"])
    units = f"place, height, rise, run in mm, yaw in degrees; nosings within {NEAR} m."
    parts.append(f"Errors, mean / 95 %: {units}\n\n" + markdown_table(header, errors))
    coverage.append(["bound", *["93 to 97"] * len(SHOWN), ""])
    header = ["camera, stairs", *SHOWN, "count known"]
    title = "Share of truths within the stated 95 % intervals, all distances [%]."
    parts.append(f"{title}\n\n" + markdown_table(header, coverage))
    none = [r for r in rows if r["kind"] == "none"]
    search = [1e3 * r["search"] for r in rows]
    track = [1e3 * r["track"] for r in rows if r["track"] is not None]
    lost = sum(r["found"] and "pairs" not in r for r in rows)
    parts.append(
        f"Scenes without stairs: {len(none)}, in which stairs were told: "
        f"{sum(r['found'] for r in none)}. Found and then lost: {lost}. Processor time: a search "
        f"{np.median(search):.0f} ms (95 %: {np.quantile(search, 0.95):.0f}), a tracking frame "
        f"{np.median(track):.1f} ms (95 %: {np.quantile(track, 0.95):.1f})."
    )
    return "\n\n".join(parts)


def _factors(row: dict[str, Any]) -> dict[str, float]:
    return deviation_factors(row["told"], camera_height=CAMERAS[row["camera"]][0])


def calibration(rows: list[dict[str, Any]]) -> dict[str, dict[str, list[float]]]:
    """By what deviations would have to be multiplied for 95 % of the truths to be within.

    Of each kind of stairs as told, and each camera, the factors in the order of QUANTITIES.
    """
    found: dict[str, dict[str, list[float]]] = {}
    for told in FACTORS:
        for camera in CAMERAS:
            mine = [
                r for r in rows
                if not r.get("gross", True) and r["told"] == told
                and (r["camera"] == camera or told == DOWN)
            ]  # fmt: skip
            ratios: dict[str, list[float]] = {name: [] for name in QUANTITIES}
            for name, e, s, _ in (pair for r in mine for pair in r["pairs"]):
                ratios[name].append(abs(e) / s / NORMAL_95)
            found.setdefault(told, {})[f"{camera}, {len(mine)} scenes"] = [
                round(float(np.quantile(values, 0.95)), 2) for values in ratios.values()
            ]
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark and prints its tables, or factors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--camera", choices=[*CAMERAS, "both"], default="both")
    parser.add_argument("--calibrate", action="store_true")
    parser.add_argument("--rows", type=Path, help="Write what was measured of each scene.")
    parser.add_argument("--read", type=Path, help="Make tables of rows that were written so.")
    asked = parser.parse_args(arguments)
    cameras = list(CAMERAS) if asked.camera == "both" else [asked.camera]
    if asked.read is not None:
        rows = json.loads(asked.read.read_text())
    else:
        rows = study(asked.scenes, asked.seed, cameras, asked.rows)
    print(tables(rows))
    if asked.calibrate:
        print("\n" + json.dumps(calibration(rows), indent=1))
    print(f"\n{asked.scenes} scenes, seed {asked.seed}; {provenance('numba', 'scipy')}")


if __name__ == "__main__":
    main()
