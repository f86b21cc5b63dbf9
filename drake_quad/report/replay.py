"""A run as a Meshcat recording: to be played, scrubbed, and kept as one HTML page."""

import logging
from collections.abc import Iterator, Sequence
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

from drake_quad.report.derived import margins
from drake_quad.report.html import render
from drake_quad.report.overlay import OVERLAY, Overlay
from drake_quad.report.scene import MakeReplayScene, set_camera_and_lights, shown_samples
from drake_quad.report.style import kind_colour
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.stability.safety import safe_margin

PREFIX = "scene"


def AddReplay(
    meshcat: Meshcat, run: RecordedRun | str | Path, *, fps: float = 10.0, speed: float = 1.0,
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
    run = run if isinstance(run, RecordedRun) else load_run(run)
    meshcat.Delete(PREFIX)
    meshcat.Delete(OVERLAY)
    set_camera_and_lights(meshcat, run.world)
    samples = recorded_samples(run, fps)
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
    for sample, frame in zip(samples, frame_numbers(run, samples, fps), strict=True):
        # Meshcat rounds a time down to its frame: a little more than the frame's own is safe.
        time = (frame + 0.25) / (fps * speed)
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


def make_replay_html(run: RecordedRun | str | Path, *, fps: float = 10.0) -> str:
    """Returns one HTML page, without need of a network, that replays the run in 3D.

    Below Meshcat's view is a bar: play, speed, time with the segments, the margin, a jump to the
    least margin, and a camera that follows the robot. A parent page may post `{seek: t}` to it.

    Raises:
        InputError: The directory holds no run.
    """
    run = run if isinstance(run, RecordedRun) else load_run(run)
    with quiet_meshcat():
        meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    frames = AddReplay(meshcat, run, fps=fps)
    page: str = meshcat.StaticHtml()
    if not frames:
        return page
    bar = render("replay_bar.html", data=_bar_data(run, fps))
    head, end, tail = page.rpartition("</body>")
    return f"{head}{bar}{end}{tail}"


def recorded_samples(run: RecordedRun, fps: float) -> list[int]:
    """The samples of a recording's frames: `fps` a second, and in any case that of least margin.

    A foot that loses the ground for less than a frame would not be seen otherwise.
    """
    samples, margin = shown_samples(run, fps), margins(run)
    if samples and np.any(np.isfinite(margin)):
        least = int(np.nanargmin(margin))
        if np.all(np.isfinite(run.positions[least])):
            nearest = int(np.argmin(np.abs(np.array(samples) - least)))
            samples[nearest] = least
    return samples


def frame_numbers(run: RecordedRun, samples: Sequence[int], fps: float) -> list[int]:
    """The frame that shows each sample, counted from the first sample's."""
    t = run.log.t[list(samples)]
    return [int(frame) for frame in np.round((t - t[0]) * fps)]


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


def _bar_data(run: RecordedRun, fps: float) -> dict[str, Any]:
    """What the bar tells: per frame the time, the segment and the margin."""
    samples = recorded_samples(run, fps)
    margin, segment = margins(run), run.log.text("segment")
    names = list(dict.fromkeys(segment[k] for k in samples))
    start = float(run.log.t[samples[0]])
    t = [round(start + frame / fps, 4) for frame in frame_numbers(run, samples, fps)]
    known = np.isfinite(margin[samples])
    least = t[int(np.nanargmin(margin[samples]))] if np.any(known) else None
    return {
        "t": t,
        "margin": [round(float(m), 4) if np.isfinite(m) else None for m in margin[samples]],
        "segment": [names.index(segment[k]) for k in samples],
        "names": names,
        "bands": [
            {"name": b.name, "start": b.start, "end": b.end, "colour": kind_colour(b.kind)}
            for b in run.log.bands()
        ],
        "least": least,
        "safe": safe_margin(run.robot),
        "kinematic": run.kinematic,
    }
