"""`drake-quad replay`: a finished run again, in a browser through Meshcat, or in Meldis."""

import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.lcm import DrakeLcm

from drake_quad.errors import InputError
from drake_quad.report.replay import AddReplay, quiet_meshcat
from drake_quad.report.run_files import Run, read_run
from drake_quad.report.scene_messages import LOAD, Message, scene_messages

RELOAD_PERIOD = 1.0  # [s] between repeats of the scene, for a Meldis that was started later
VIEWERS = ("meshcat", "meldis")


def say(text: str) -> None:
    """Tells a person on stderr: stdout is for results."""
    print(text, file=sys.stderr)


def play(
    directory: Run | str | Path,
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
        directory: The run's, or the run.
        viewer: `meshcat` serves it at an address that is told; `meldis` publishes it on LCM, for a
            Meldis that is already there or comes later.
        speed: How much faster than it happened it plays.
        loop: Whether it starts again at its end.
        fps: Frames a second of the run.
        port: Of Meshcat; one that is free if none.
        lcm_url: For Meldis; LCM's default if empty.
        tell: What says to the person where to look.

    Raises:
        InputError: The directory holds no run or none to show, or a setting that cannot be.
    """
    if viewer not in VIEWERS:
        raise _refuse("viewer", viewer, f"must be {' or '.join(VIEWERS)}")
    if not speed > 0.0:
        raise _refuse("speed", speed, "must be positive")
    if not fps > 0.0:
        raise _refuse("fps", fps, "must be positive")
    run = directory if isinstance(directory, Run) else read_run(directory)
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
    """Publishes each message at its time; the scene's load message again now and then.

    Args:
        messages: In time order.
        publish: Takes channel and data.
        speed: How much faster than the messages' own times.
        clock: The time now [s].
        sleep: Waits for so long [s].
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
    run: Run,
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
