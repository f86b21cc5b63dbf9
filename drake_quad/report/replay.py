"""A run as a Meshcat recording: to be played, scrubbed, and kept as one HTML page."""

import base64
import binascii
import gc
import gzip
import json
import logging
import re
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

from drake_quad.report.axes import signed
from drake_quad.report.derived import find_least_margin
from drake_quad.report.overlay import OVERLAY, Overlay, Regions
from drake_quad.report.scene import MakeReplayScene, set_camera_and_lights, shown_samples
from drake_quad.report.style import kind_colour, render
from drake_quad.runs.reader import RecordedRun, run_of
from drake_quad.stability.margin_kinds import HULL
from drake_quad.stability.safety import NO_SUPPORT, safe_margin

PREFIX = "scene"

# Meshcat has its recording in data URLs; short ones are left as they are.
_BASE64 = re.compile(r"(?<=;base64,)[A-Za-z0-9+/]{400,}={0,2}")
# Of a recording in MessagePack: a keyframe's three or four numbers, each of 8 bytes after \xcb.
_RECORDING = b"\x83\xa4type\xadset_animation"
_KEYFRAME = re.compile(rb"(?<=\xa5value[\x93\x94])(?:\xcb.{8}){3,4}", re.DOTALL)
FINEST = 2.0**-20  # [m], and of a unit quaternion: a thousandth of a millimetre


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
    run = run_of(run)
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
    run = run_of(run)
    with quiet_meshcat():
        meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    frames = AddReplay(meshcat, run, fps=fps)
    page: str = meshcat.StaticHtml()
    # The scene, a cycle of references, holds it, too. If the collector comes by in another thread,
    # such as a progress bar's, Drake ends the program: Meshcat has to go where it was made.
    gc.collect()
    if not frames:
        return page
    bar = render("replay_bar.html", data=bar_data(run, fps))
    head, end, tail = page.rpartition("</body>")
    return f"{head}{bar}{end}{tail}"


def recorded_samples(run: RecordedRun, fps: float) -> list[int]:
    """The samples of a recording's frames: `fps` a second, and in any case that of least margin.

    A foot that loses the ground for less than a frame would not be seen otherwise.
    """
    samples, least = shown_samples(run, fps), find_least_margin(run)
    if samples and least is not None and np.all(np.isfinite(run.positions[least.sample])):
        nearest = int(np.argmin(np.abs(np.array(samples) - least.sample)))
        samples[nearest] = least.sample
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


def bar_data(run: RecordedRun, fps: float) -> dict[str, Any]:
    """What the bar tells: per frame the time, the segment, and the margin of the region shown."""
    samples, regions = recorded_samples(run, fps), Regions(run)
    margin, segment = regions.margin, run.log.text("segment")
    known = margin > NO_SUPPORT
    names = list(dict.fromkeys(segment[k] for k in samples))
    start = float(run.log.t[samples[0]])
    t = [round(start + frame / fps, 4) for frame in frame_numbers(run, samples, fps)]
    least = find_least_margin(run)
    return {
        "t": t,
        "margin": [round(float(margin[k]), 4) if known[k] else None for k in samples],
        "margin_name": regions.margin_name,
        "none": "no foot bears" if regions.kind == HULL else "no region of balance",
        "segment": [names.index(segment[k]) for k in samples],
        "names": names,
        "bands": [
            {"name": b.name, "start": b.start, "end": b.end, "colour": kind_colour(b.kind)}
            for b in run.log.bands()
        ],
        "least": None
        if least is None
        else {
            "t": t[int(np.argmin(np.abs(np.array(samples) - least.sample)))],
            "words": signed(least.sentence),
        },
        "safe": safe_margin(run.robot),
        "kinematic": run.kinematic,
    }


def round_recording(page: str) -> str:
    """The page with the numbers of its recording rounded to whole FINEST.

    Nobody sees so little move; and what is rounded ends in zeros, of which packing makes nothing.
    """

    def keyframes(raw: bytes) -> bytes:
        places = [found.span() for found in _KEYFRAME.finditer(raw)]
        numbers = b"".join(raw[start:end] for start, end in places)
        cells = np.frombuffer(numbers, dtype=[("mark", "S1"), ("value", ">f8")]).copy()
        cells["value"] = np.round(cells["value"] / FINEST) * FINEST
        rounded, fresh, at = bytearray(raw), cells.tobytes(), 0
        for start, end in places:
            rounded[start:end] = fresh[at : at + end - start]
            at += end - start
        return bytes(rounded)

    def recording(found: re.Match[str]) -> str:
        try:
            raw = base64.b64decode(found[0])
        except binascii.Error:
            return found[0]
        if not raw.startswith(_RECORDING):
            return found[0]
        return base64.b64encode(keyframes(raw)).decode()

    return _BASE64.sub(recording, page)


def pack(page: str) -> str:
    """The page in base64 of gzip: the lengths of its pieces as JSON, a line, then the pieces.

    Pieces are text and bytes in turn, text first; bytes are what base64 in the page stands for.
    """
    pieces, end = [], 0
    for found in _BASE64.finditer(page):
        try:
            raw = base64.b64decode(found[0])
        except binascii.Error:
            continue
        if base64.b64encode(raw).decode() != found[0]:  # it would not come back as it was
            continue
        pieces += [page[end : found.start()].encode(), raw]
        end = found.end()
    pieces.append(page[end:].encode())
    head = json.dumps([len(piece) for piece in pieces]).encode() + b"\n"
    packed = gzip.compress(head + b"".join(pieces), compresslevel=6, mtime=0)
    return base64.b64encode(packed).decode()


def unpack(packed: str) -> str:
    """The page that `pack` was given."""
    head, _, rest = gzip.decompress(base64.b64decode(packed)).partition(b"\n")
    text, at = [], 0
    for k, length in enumerate(json.loads(head)):
        piece = rest[at : at + length]
        text.append((base64.b64encode(piece) if k % 2 else piece).decode())
        at += length
    return "".join(text)
