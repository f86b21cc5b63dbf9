"""A run as a Meshcat recording: to be played, scrubbed, and kept as one HTML page."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import (
    Meshcat,
    MeshcatAnimation,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Role,
)

from drake_quad.report.camera import camera_pose
from drake_quad.report.motion import margins
from drake_quad.report.overlay import SAFE, Overlay
from drake_quad.report.run_files import Run, read_run
from drake_quad.report.scene import MakeReplayScene, shown_samples
from drake_quad.report.style import kind_colour
from drake_quad.report.templates import render

PREFIX = "scene"
SUN, SKY = 2.0, 1.1  # intensities of the two lights


def AddReplay(
    meshcat: Meshcat, run: Run | str | Path, *, fps: float = 10.0, speed: float = 1.0,
    loop: bool = False,
) -> int:  # fmt: skip
    """Publishes a run to Meshcat as a recording that plays in real time.

    Args:
        meshcat: Where to.
        run: The run, or its directory.
        fps: Frames a second of the run; Meshcat interpolates between them.
        speed: How much faster than it happened it plays.
        loop: Whether it starts again at its end.

    Returns:
        The number of frames.

    Raises:
        InputError: The directory holds no run.
    """
    run = run if isinstance(run, Run) else read_run(run)
    _set_stage(meshcat, run)
    samples = shown_samples(run, fps)
    parameters = MeshcatVisualizerParams(
        role=Role.kIllustration, prefix=PREFIX, publish_period=1.0 / fps
    )
    scene = MakeReplayScene(
        run,
        lambda builder, scene_graph: MeshcatVisualizer.AddToBuilder(
            builder, scene_graph, meshcat, parameters
        ),
    )
    if not samples:
        return 0
    overlay = Overlay(meshcat, run, samples)
    meshcat.StartRecording(frames_per_second=fps * speed, set_visualizations_while_recording=False)
    start = run.log.t[samples[0]]
    for sample in samples:
        time = float(run.log.t[sample] - start) / speed
        scene.show(sample, time=time)
        overlay.show(sample, time=time)
    meshcat.StopRecording()
    recording = meshcat.get_mutable_recording()
    mode = MeshcatAnimation.LoopMode
    recording.set_loop_mode(mode.kLoopRepeat if loop else mode.kLoopOnce)
    recording.set_repetitions(1_000_000 if loop else 1)
    recording.set_clamp_when_finished(True)
    meshcat.PublishRecording()
    return len(samples)


def make_replay_html(run: Run | str | Path, *, fps: float = 10.0) -> str:
    """Returns one HTML page, without need of a network, that replays the run in 3D.

    Below Meshcat's view is a bar: play, speed, time with the segments, the margin, a jump to the
    least margin, and a camera that follows the robot. A parent page may post `{seek: t}` to it.

    Raises:
        InputError: The directory holds no run.
    """
    run = run if isinstance(run, Run) else read_run(run)
    with quiet_meshcat():
        meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    frames = AddReplay(meshcat, run, fps=fps)
    page: str = meshcat.StaticHtml()
    if not frames:
        return page
    bar = render("replay_bar.html", data=_bar_data(run, fps))
    head, end, tail = page.rpartition("</body>")
    return f"{head}{bar}{end}{tail}"


@contextmanager
def quiet_meshcat() -> Iterator[None]:
    """Keeps Meshcat from telling an address at which nobody is meant to look."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)
    try:
        yield
    finally:
        logger.setLevel(level)


def _bar_data(run: Run, fps: float) -> dict[str, Any]:
    """What the bar tells: per frame the time, the segment and the margin."""
    samples = shown_samples(run, fps)
    t, margin, segment = run.log.t, margins(run), run.log.text("segment")
    names = list(dict.fromkeys(segment[k] for k in samples))
    least = float(t[np.nanargmin(margin)]) if np.any(np.isfinite(margin)) else None
    return {
        "t": [round(float(t[k]), 4) for k in samples],
        "margin": [round(float(m), 4) if np.isfinite(m) else None for m in margin[samples]],
        "segment": [names.index(segment[k]) for k in samples],
        "names": names,
        "bands": [
            {"name": b.name, "start": b.start, "end": b.end, "colour": kind_colour(b.kind)}
            for b in run.log.bands()
        ],
        "least": least,
        "safe": SAFE,
        "kinematic": run.kinematic,
    }


def _set_stage(meshcat: Meshcat, run: Run) -> None:
    """A plain background, and the camera where the whole course shows."""
    meshcat.Delete(PREFIX)
    meshcat.Delete("/replay")
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Background/<object>", "top_color", [0.93, 0.95, 0.97])
    meshcat.SetProperty("/Background/<object>", "bottom_color", [0.78, 0.81, 0.84])
    camera, target = camera_pose(run.course)
    meshcat.SetCameraPose(camera, target)
    # Meshcat's own lamps stand around the origin and fade within metres: a sun lights all of the
    # course alike, from the camera's left, so that tops, fronts and sides of the treads differ.
    for lamp in ("PointLightNegativeX", "PointLightPositiveX"):
        meshcat.SetProperty(f"/Lights/{lamp}", "visible", False)
    away = camera - target
    sun = np.array([away[0] + 0.8 * away[1], away[1] - 0.8 * away[0], 1.6 * np.linalg.norm(away)])
    meshcat.SetProperty("/Lights/FillLight/<object>", "position", list(target + sun))
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", SUN)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", SKY)
