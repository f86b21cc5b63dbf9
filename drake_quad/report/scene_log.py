"""scene.lcmlog: the scene of a run as an LCM log, which Meldis and any LCM tool replay."""

import struct
from collections.abc import Iterable
from pathlib import Path

from drake_quad.report.run_files import Run, read_run
from drake_quad.report.scene_messages import Message, scene_messages
from drake_quad.whole_files import write_whole

SCENE_LOG = "scene.lcmlog"
SYNC_WORD = 0xEDA1DA01  # each event of an LCM log begins with it


def write_scene_log(run: Run | str | Path, *, fps: float = 30.0) -> Path:
    """Writes `scene.lcmlog` beside the run's other files, and returns its path.

    Meldis plays it, given the file as its LCM:
    `LCM_DEFAULT_URL=file:///…/scene.lcmlog python -m pydrake.visualization.meldis`.

    Raises:
        InputError: The directory holds no run.
    """
    run = run if isinstance(run, Run) else read_run(run)
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
