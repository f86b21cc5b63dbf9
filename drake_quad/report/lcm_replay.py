"""A run as LCM messages: a log file of them, and a live replay in Meldis.

The forces on the feet are not among them: Meldis draws 10 N as a metre, so that the arrows of a
robot that stands are longer than the course, and lets nobody change it.
"""

import struct
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pydrake.geometry import DrakeVisualizer, DrakeVisualizerParams, Meshcat, MeshcatParams, Role
from pydrake.lcm import DrakeLcm

from drake_quad.errors import InputError
from drake_quad.report.replay import AddReplay, quiet_meshcat
from drake_quad.report.scene import MakeReplayScene, shown_samples
from drake_quad.runs.reader import RecordedRun, run_of
from drake_quad.util.files import write_whole

LOAD, DRAW = "DRAKE_VIEWER_LOAD_ROBOT", "DRAKE_VIEWER_DRAW"

SCENE_LOG = "scene.lcmlog"
SYNC_WORD = 0xEDA1DA01  # each event of an LCM log begins with it

RELOAD_PERIOD = 1.0  # [s] between repeats of the scene, for a Meldis that was started later
VIEWERS = ("meshcat", "meldis")


@dataclass(frozen=True)
class Message:
    """One LCM message.

    Attributes:
        time: Time since the first frame of the run [s].
        channel: Channel of LCM.
        data: The encoded message.
    """

    time: float
    channel: str
    data: bytes


def scene_messages(run: RecordedRun, *, fps: float = 30.0) -> Iterator[Message]:
    """Yields the run's messages in time order; the first loads the scene.

    A run without samples gives none.
    """
    samples = shown_samples(run, fps)
    lcm = DrakeLcm("memq://")
    caught: dict[str, bytes] = {}
    lcm.Subscribe(LOAD, lambda data: caught.update({LOAD: bytes(data)}))
    lcm.Subscribe(DRAW, lambda data: caught.update({DRAW: bytes(data)}))
    parameters = DrakeVisualizerParams(publish_period=1.0 / fps, role=Role.kIllustration)
    scene = MakeReplayScene(
        run,
        lambda builder, scene_graph: DrakeVisualizer.AddToBuilder(
            builder, scene_graph, lcm, parameters
        ),
    )
    for sample in samples:
        time = float(run.log.t[sample] - run.log.t[samples[0]])
        scene.show(sample, time=time)
        while lcm.HandleSubscriptions(0):
            pass
        for channel in (LOAD, DRAW):  # whatever the order of arrival: loaded, then drawn
            if channel in caught:
                yield Message(time, channel, caught.pop(channel))


def write_scene_log(run: RecordedRun | str | Path, *, fps: float = 30.0) -> Path:
    """Writes `scene.lcmlog` beside the run's other files, and returns its path.

    Meldis plays it, given the file as its LCM:
    `LCM_DEFAULT_URL=file:///…/scene.lcmlog python -m pydrake.visualization.meldis`.

    Raises:
        InputError: The directory holds no run.
    """
    run = run_of(run)
    path = run.directory / SCENE_LOG
    write_whole(path, lambda p: write_lcm_log(p, scene_messages(run, fps=fps)))
    return path


def write_lcm_log(path: Path, messages: Iterable[Message]) -> None:
    """Writes messages as an LCM log, an event each, stamped with its time in the run.

    Drake's own way, DrakeLcm on a file:// URL, stamps events with the wall clock of the writing:
    the log would play as fast as it was written.
    """
    with path.open("wb") as file:
        for number, message in enumerate(messages):
            channel = message.channel.encode("ascii")
            file.write(
                struct.pack(
                    ">IqqII",
                    SYNC_WORD,
                    number,
                    round(1e6 * message.time),
                    len(channel),
                    len(message.data),
                )
            )
            file.write(channel)
            file.write(message.data)


def say(text: str) -> None:
    """Prints to stderr, because stdout is for results."""
    print(text, file=sys.stderr)


def play(
    directory: RecordedRun | str | Path,
    viewer: str = "meshcat",
    *,
    speed: float = 1.0,
    loop: bool = False,
    fps: float = 30.0,
    port: int | None = None,
    lcm_url: str = "",
    tell: Callable[[str], None] = say,
) -> None:
    """Replays a run until it ends (Meldis, without `loop`) or until Ctrl-C, which ends it quietly.

    Args:
        directory: The run, or its directory.
        viewer: `meshcat` serves the run at an address that is printed; `meldis` publishes it on
            LCM, for a Meldis that runs already or starts later.
        speed: Ratio of the replay's speed to real time.
        loop: Whether it starts again at its end.
        fps: Frames per second of the run.
        port: Port of Meshcat; None takes a free one.
        lcm_url: URL of LCM for Meldis; LCM's default if empty.
        tell: Function that prints where to look.

    Raises:
        InputError: The directory holds no run or none to show, or a setting that cannot be.
    """
    if viewer not in VIEWERS:
        raise _refuse("viewer", viewer, f"must be {' or '.join(VIEWERS)}")
    if not speed > 0.0:
        raise _refuse("speed", speed, "must be positive")
    if not fps > 0.0:
        raise _refuse("fps", fps, "must be positive")
    run = run_of(directory)
    if not len(run.log):
        raise _refuse("log", str(run.directory), "holds no sample to replay")
    try:
        if viewer == "meshcat":
            _serve(run, speed=speed, loop=loop, fps=fps, port=port, tell=tell)
        else:
            tell("Publishing on LCM; watch with: python -m pydrake.visualization.meldis")
            lcm = DrakeLcm(lcm_url)
            messages = list(scene_messages(run, fps=fps))
            publish_in_time(messages, lcm.Publish, speed=speed)
            while loop:
                publish_in_time(messages, lcm.Publish, speed=speed)
    except KeyboardInterrupt:
        tell("")


def publish_in_time(
    messages: Iterable[Message],
    publish: Callable[[str, bytes], None],
    *,
    speed: float = 1.0,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Publishes each message at its time, and repeats the message that loads the scene.

    Args:
        messages: The messages, in time order.
        publish: Function of channel and data.
        speed: Ratio of the replay's speed to the messages' own times.
        clock: Function that returns the time [s].
        sleep: Function that waits for a time [s].
    """
    begin, loaded, load = clock(), 0.0, b""
    for message in messages:
        due = message.time / speed
        wait = begin + due - clock()
        if wait > 0.0:
            sleep(wait)
        if message.channel == LOAD:
            load, loaded = message.data, due
        elif load and due >= loaded + RELOAD_PERIOD:
            publish(LOAD, load)
            loaded = due
        publish(message.channel, message.data)


def _serve(
    run: RecordedRun,
    *,
    speed: float,
    loop: bool,
    fps: float,
    port: int | None,
    tell: Callable[[str], None],
) -> None:
    """Serves the recording until the process is interrupted."""
    with quiet_meshcat():
        try:
            meshcat = Meshcat(MeshcatParams(port=port, show_stats_plot=False))
        except RuntimeError as problem:
            raise _refuse("port", port, str(problem).splitlines()[0]) from None
    AddReplay(meshcat, run, fps=fps, speed=speed, loop=loop)
    tell(f"Replay at {meshcat.web_url()} (Ctrl-C ends)")
    while True:
        time.sleep(1.0)


def _refuse(field: str, value: object, remedy: str) -> InputError:
    return InputError(source="replay", field=field, value=value, remedy=remedy)
