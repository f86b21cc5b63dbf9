"""A simulation live in Foxglove: what is sent is what the robot does, and it changes nothing."""

import asyncio
import json
import threading
from typing import Any

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from rig import paper_robot
from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

import drake_quad as dq
from drake_quad.errors import InputError
from drake_quad.estimation.sensor_models import FORCES, PLACES
from drake_quad.robot.loader import AddRobot
from drake_quad.runs.foxglove_messages import SCHEMAS, Message
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation import foxglove_live
from drake_quad.simulation.foxglove_live import (
    PERIOD,
    FoxglovePublisher,
    FoxgloveServer,
    MakeFoxgloveViewer,
)
from drake_quad.simulation.run import simulate

STAND = "course: [{kind: floor, length: 3.0}]\nmission: [{kind: stand, duration: 0.3}]\n"


class Notes:
    """A server that keeps what it is to send."""

    def __init__(self) -> None:
        self.asked = True
        self.sent: list[tuple[str, int, Message]] = []

    def send(self, topic: str, time: int, message: Message) -> None:
        """Keeps it."""
        self.sent.append((topic, time, message))


def test_the_publisher_sends_what_its_ports_have() -> None:
    """Alone, through its ports: poses, joints by name, arrows of feet that bear, the margin."""
    builder = DiagramBuilder()
    plant, scene = AddMultibodyPlantSceneGraph(builder, 0.0)
    AddRobot(plant, paper_robot().url)
    plant.Finalize()
    notes: Any = Notes()
    system = FoxglovePublisher(notes, plant, scene)
    context, own = system.CreateDefaultContext(), plant.CreateDefaultContext()
    rng = np.random.default_rng(3)
    q = rng.normal(size=plant.num_positions())
    q[:4] /= np.linalg.norm(q[:4])
    state = np.concatenate([q, rng.normal(size=plant.num_velocities())])
    plant.SetPositionsAndVelocities(own, state)
    bodies = [plant.get_body(BodyIndex(k)) for k in range(plant.num_bodies())]
    poses = [plant.EvalBodyPoseInWorld(own, body) for body in bodies]
    contacts = np.zeros(34)
    contacts[:4] = [1, 0, 1, 1]
    contacts[FORCES:PLACES] = np.tile([0.0, 0.0, 100.0], 4)
    system.poses.FixValue(context, AbstractValue.Make(poses))
    system.state.FixValue(context, state)
    system.torque.FixValue(context, np.arange(12.0))
    system.contacts.FixValue(context, contacts)
    system.margins.FixValue(context, np.array([-0.01, 0.02, 0.0, 0.0, 0.0, 0.0]))
    simulator = Simulator(system, context)
    simulator.Initialize()
    simulator.AdvanceTo(PERIOD)
    topics = [topic for topic, _, _ in notes.sent]
    assert {time for _, time, _ in notes.sent} == {0, round(PERIOD * 1e9)}
    once = ["/tf", "/joint_states", "/margins", "/scene"]
    assert topics == ["/scene", *once, *once]  # the shapes at first alone
    shapes, tf, joints, margins, feet = (message for _, _, message in notes.sent[:5])
    assert {one["frame_id"] for one in shapes["entities"]} <= {
        one["child_frame_id"] for one in tf["transforms"]
    }
    for one in tf["transforms"]:
        p = plant.EvalBodyPoseInWorld(own, plant.GetBodyByName(one["child_frame_id"])).translation()
        np.testing.assert_allclose([one["translation"][k] for k in "xyz"], p, atol=1e-5)
    for name, angle, torque in zip(
        *(joints[k] for k in ("name", "position", "effort")), strict=True
    ):
        joint = plant.GetJointByName(name)
        assert angle == pytest.approx(q[joint.position_start()], abs=1e-6)
        assert torque == float(plant.GetJointActuatorByName(_drive(plant, name)).index())
    assert margins["margin"] == -0.01 and margins["zmp_margin"] == 0.02
    (drawn,) = feet["entities"]
    assert len(drawn["arrows"]) == 3 and drawn["lines"][0]["color"]["r"] == 0.8


def _drive(plant: Any, joint: str) -> str:
    """Name of the actuator of a joint."""
    for index in plant.GetJointActuatorIndices():
        if plant.get_joint_actuator(index).joint().name() == joint:
            return str(plant.get_joint_actuator(index).name())
    raise KeyError(joint)


def test_who_connects_sees_the_run_and_the_run_is_the_same() -> None:
    """By a WebSocket: every topic under its schema's name; the log is that of a run unseen."""
    heard: dict[str, list[Message]] = {}
    server = FoxgloveServer(port=0)
    scenario = parse_scenario(STAND, source="test", overrides=["simulation.realtime_rate=1.0"])
    ready = threading.Event()
    listener = threading.Thread(target=lambda: asyncio.run(_listen(server.port, heard, ready)))
    listener.start()
    assert ready.wait(20.0)
    seen = simulate(scenario, visualize=MakeFoxgloveViewer(server))
    server.stop()
    listener.join(20.0)
    assert set(heard) == set(SCHEMAS)
    frames = {one["child_frame_id"] for one in heard["/tf"][-1]["transforms"]}
    assert paper_robot().trunk in frames
    names = {one["id"] for message in heard["/scene"] for one in message["entities"]}
    assert {"course", "feet", paper_robot().trunk} <= names
    assert len(heard["/tf"]) >= 0.5 * 0.3 / PERIOD
    assert seen.table.equals(simulate(parse_scenario(STAND, source="test")).table)


async def _listen(port: int, heard: dict[str, list[Message]], ready: threading.Event) -> None:
    """Subscribes to all channels, and keeps what comes until the server ends."""
    protocol = Subprotocol("foxglove.sdk.v1")
    async with connect(f"ws://127.0.0.1:{port}", subprotocols=[protocol]) as link:
        topics: dict[int, str] = {}
        async for data in link:
            if isinstance(data, bytes):
                if data[0] == 1:
                    number = int.from_bytes(data[1:5], "little")
                    heard.setdefault(topics[number], []).append(json.loads(data[13:]))
                continue
            told = json.loads(data)
            if told["op"] == "advertise":
                for one in told["channels"]:
                    assert one["schemaName"] == SCHEMAS[one["topic"]][0]
                    topics[one["id"]] = one["topic"]
                asked = [{"id": k, "channelId": k} for k in topics]
                await link.send(json.dumps({"op": "subscribe", "subscriptions": asked}))
                if set(topics.values()) == set(SCHEMAS):
                    ready.set()


def test_a_port_that_is_taken_is_refused() -> None:
    """One line that names the option and the port."""
    first = FoxgloveServer(port=0)
    try:
        with pytest.raises(InputError, match=rf"--foxglove: port = {first.port}"):
            FoxgloveServer(port=first.port)
    finally:
        first.stop()


def test_the_viewer_is_asked_for_as_others_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """`make_viewers` starts a server, tells its address, and gives what adds the publisher."""
    started: list[FoxgloveServer] = []

    def start() -> FoxgloveServer:
        started.append(FoxgloveServer(port=0))
        return started[0]

    monkeypatch.setattr(foxglove_live, "FoxgloveServer", start)
    told: list[str] = []
    visualize = dq.make_viewers(foxglove=True, tell=told.append)
    assert visualize is not None and f"ws://127.0.0.1:{started[0].port}" in told[0]
    builder = DiagramBuilder()
    plant, scene = AddMultibodyPlantSceneGraph(builder, 0.0)
    AddRobot(plant, paper_robot().url)
    plant.Finalize()
    with pytest.raises(RuntimeError, match="contact_monitor"):  # which a simulation has
        visualize(builder, plant, scene)
    assert builder.HasSubsystemNamed("foxglove")
    started[0].stop()
