"""A run as the LCM messages that Meldis shows: the scene, then frame by frame where all of it is.

The forces on the feet are not among them: Meldis draws 10 N as a metre, so that the arrows of a
robot that stands are longer than the course, and lets nobody change it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from pydrake.geometry import DrakeVisualizer, DrakeVisualizerParams, Role
from pydrake.lcm import DrakeLcm

from drake_quad.report.run_files import Run
from drake_quad.report.scene import MakeReplayScene, shown_samples

LOAD, DRAW = "DRAKE_VIEWER_LOAD_ROBOT", "DRAKE_VIEWER_DRAW"


@dataclass(frozen=True)
class Message:
    """One LCM message.

    Attributes:
        time: When in the run, from its first frame on [s].
        channel: LCM's.
        data: Encoded.
    """

    time: float
    channel: str
    data: bytes


def scene_messages(run: Run, *, fps: float = 30.0) -> Iterator[Message]:
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
