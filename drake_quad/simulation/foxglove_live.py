"""A simulation live in Foxglove: a server in this process, and the system that feeds it."""

import json
from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem

from drake_quad.errors import InputError
from drake_quad.estimation.sensor_models import CONTACTS_SIZE, FORCES, PLACES, SLIPS
from drake_quad.runs.foxglove_messages import (
    SCHEMAS,
    Message,
    feet_entity,
    joints_message,
    margins_message,
    nanoseconds,
    scene_message,
    transforms_message,
)
from drake_quad.runs.foxglove_shapes import shown_entities
from drake_quad.simulation.diagram import Visualize
from drake_quad.systems.stability_monitor import MARGIN_PORTS

PERIOD = 0.02  # [s] between messages
HOST, PORT = "127.0.0.1", 8765
MARGIN_NAMES = ("margin", "zmp_margin")


class FoxgloveServer:
    """A server that Foxglove connects to, on this machine alone.

    Args:
        port: The port to listen at; 0 takes a free one.

    Attributes:
        port: The port that it listens at.
        asked: Whether somebody has begun to listen since the shapes were last sent.
    """

    def __init__(self, port: int = PORT) -> None:
        try:
            import foxglove
            from foxglove.websocket import ServerListener
        except ImportError:
            remedy = "needs the package foxglove-sdk: pip install foxglove-sdk"
            raise InputError(
                source="--foxglove", field="foxglove", value=True, remedy=remedy
            ) from None
        server = self

        class Listener(ServerListener):
            def on_subscribe(self, client: Any, channel: Any) -> None:
                server.asked = True

        self.asked = True
        self._context = foxglove.Context()
        self._channels = {
            topic: foxglove.Channel(
                topic, message_encoding="json", context=self._context,
                schema=foxglove.Schema(
                    name=name, encoding="jsonschema",
                    data=json.dumps({"title": name, **schema}).encode(),
                ),
            )
            for topic, (name, schema) in SCHEMAS.items()
        }  # fmt: skip
        try:
            self._server = foxglove.start_server(
                name="drake_quad", host=HOST, port=port, context=self._context,
                server_listener=Listener(),
            )  # fmt: skip
        except (OSError, RuntimeError) as error:
            remedy = f"cannot be listened at ({error}): end what listens there"
            raise InputError(source="--foxglove", field="port", value=port, remedy=remedy) from None
        self.port = int(self._server.port)

    def send(self, topic: str, time: int, message: Message) -> None:
        """Sends a message of a time [ns] to whoever listens."""
        self._channels[topic].log(json.dumps(message, allow_nan=False).encode(), log_time=time)

    def stop(self) -> None:
        """Ends it."""
        self._server.stop()


class FoxglovePublisher(LeafSystem):
    """Sends poses, joints, the feet's forces and the margins as a simulation goes on.

    Attributes:
        instance: The robot's instance in the plant.

    Input ports:
        body_poses: Poses of the plant's bodies (abstract).
        plant_state: [q; v] of the plant.
        net_actuation: Torques of the drives (12,), by actuator [Nm].
        contacts: See ContactMonitor.
        margins: See StabilityMonitor.
    """

    def __init__(self, server: FoxgloveServer, plant: MultibodyPlant, scene: SceneGraph) -> None:
        """Declares ports, and when to send.

        Args:
            server: Server that sends.
            plant: Plant with the robot and the course.
            scene: Its scene.
        """
        super().__init__()
        self._server, self._plant, self._scene = server, plant, scene
        base = min(plant.GetFloatingBaseBodies(), key=int)
        self.instance = plant.get_body(base).model_instance()
        self._bodies = [plant.get_body(i) for i in plant.GetBodyIndices(self.instance)]
        joints = [
            plant.get_joint_actuator(index).joint()
            for index in plant.GetJointActuatorIndices(self.instance)
        ]
        q, v = plant.num_positions(), plant.num_velocities()
        self._names = [joint.name() for joint in joints]
        self._rows = [joint.position_start() for joint in joints]
        self._speeds = [q + joint.velocity_start() for joint in joints]
        self.poses = self.DeclareAbstractInputPort(
            "body_poses", AbstractValue.Make([RigidTransform()])
        )
        self.state = self.DeclareVectorInputPort("plant_state", q + v)
        self.torque = self.DeclareVectorInputPort("net_actuation", len(joints))
        self.contacts = self.DeclareVectorInputPort("contacts", CONTACTS_SIZE)
        self.margins = self.DeclareVectorInputPort("margins", sum(MARGIN_PORTS.values()))
        self.DeclarePeriodicPublishEvent(PERIOD, 0.0, self._publish)

    def _publish(self, context: Context) -> None:
        time, plant, server = context.get_time(), self._plant, self._server
        at, poses = nanoseconds(time), self.poses.Eval(context)
        if server.asked:  # whoever comes late sees the robot and the course, too
            server.asked = False
            shapes = shown_entities(plant, self._scene.model_inspector(), time)
            server.send("/scene", at, scene_message(*shapes))
        links = [(body.name(), poses[int(body.index())]) for body in self._bodies]
        server.send("/tf", at, transforms_message(time, [
            (name, X.translation(), X.rotation().ToQuaternion().wxyz()) for name, X in links
        ]))  # fmt: skip
        x = self.state.Eval(context)
        q, v, torque = x[self._rows], x[self._speeds], self.torque.Eval(context)
        server.send("/joint_states", at, joints_message(time, self._names, q, v, torque))
        margins, felt = self.margins.Eval(context), self.contacts.Eval(context)
        server.send(
            "/margins", at, margins_message(time, dict(zip(MARGIN_NAMES, margins, strict=False)))
        )
        feet = feet_entity(
            time, felt[:4], felt[PLACES:SLIPS].reshape(4, 3), felt[FORCES:PLACES].reshape(4, 3),
            margins[0],
        )  # fmt: skip
        server.send("/scene", at, scene_message(feet))


def MakeFoxgloveViewer(server: FoxgloveServer) -> Visualize:
    """Returns what adds a FoxglovePublisher, with the monitors' ports, to a builder."""

    def add(builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        live = builder.AddNamedSystem("foxglove", FoxglovePublisher(server, plant, scene_graph))
        contact = builder.GetSubsystemByName("contact_monitor")
        stability = builder.GetSubsystemByName("stability_monitor")
        for source, port in (
            (plant.get_body_poses_output_port(), live.poses),
            (plant.get_state_output_port(), live.state),
            (plant.get_net_actuation_output_port(live.instance), live.torque),
            (contact.GetOutputPort("contacts"), live.contacts),
            (stability.GetOutputPort("margins"), live.margins),
        ):
            builder.Connect(source, port)

    return add
