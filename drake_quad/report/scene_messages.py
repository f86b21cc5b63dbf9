"""A run as the LCM messages that Meldis shows: the scene, frame by frame, and the foot forces."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from drake import (  # type: ignore[import-untyped]
    lcmt_contact_results_for_viz,
    lcmt_point_pair_contact_info_for_viz,
)
from pydrake.geometry import DrakeVisualizer, DrakeVisualizerParams, Role
from pydrake.lcm import DrakeLcm

from drake_quad.gait.legs import SHORT_NAMES, FloatArray
from drake_quad.report.run_files import Run
from drake_quad.report.scene import MakeReplayScene, shown_samples

LOAD, DRAW, CONTACTS = "DRAKE_VIEWER_LOAD_ROBOT", "DRAKE_VIEWER_DRAW", "CONTACT_RESULTS"
LEAST_FORCE = 1.0  # [N] below this a foot has no arrow


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
    forces, places = run.log.feet("force"), run.log.feet("position")
    lcm = DrakeLcm("memq://")
    caught: list[tuple[str, bytes]] = []
    for channel in (LOAD, DRAW):
        lcm.Subscribe(channel, lambda data, channel=channel: caught.append((channel, bytes(data))))
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
        # The order of channels is not that of publishing, and a scene is loaded before it is drawn.
        for channel, data in sorted(caught, key=lambda pair: pair[0] != LOAD):
            yield Message(time, channel, data)
        caught.clear()
        yield Message(time, CONTACTS, encode_forces(time, forces[sample], places[sample]))


def encode_forces(time: float, forces: FloatArray, places: FloatArray) -> bytes:
    """Returns the forces on the feet as Drake's contact results, encoded.

    Args:
        time: [s].
        forces: (4, 3) on each foot, in W [N].
        places: (4, 3) where they act, in W [m].
    """
    message = lcmt_contact_results_for_viz()
    message.timestamp = round(1e6 * time)
    for leg, force, place in zip(SHORT_NAMES, forces, places, strict=True):
        if not np.linalg.norm(force) > LEAST_FORCE:  # nan is no force either
            continue
        info = lcmt_point_pair_contact_info_for_viz()
        info.timestamp = message.timestamp
        info.body1_name, info.body2_name = f"foot {leg}", "course"
        info.contact_point = place.tolist()
        info.contact_force = force.tolist()
        info.normal = [0.0, 0.0, 1.0]
        message.point_pair_contact_info.append(info)
    message.num_point_pair_contacts = len(message.point_pair_contact_info)
    encoded: bytes = message.encode()
    return encoded
