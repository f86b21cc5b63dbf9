"""What came to a controller over a bus, when it looked, and what it answered: kept, and run again.

A log is MCAP. It holds, in their order, all that the controller's loop asked of its clock and of
its bus, and its answers; given these again the loop goes the same way, with the same commands to
the bit. It is kept in memory while the loop runs, some 1 MB a second, and written at its end.
"""

import json
from base64 import b64decode, b64encode
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

from drake_quad.bus.bus_controller import BusController
from drake_quad.bus.control_loop import ControlLoop
from drake_quad.bus.messages import (
    CommandMessage,
    Received,
    StateMessage,
    decode_command,
    decode_state,
    encode_command,
    encode_state,
)
from drake_quad.bus.real_time import NS, Clock
from drake_quad.bus.robot_bus import RobotBus
from drake_quad.bus.safety import SafetyMode
from drake_quad.bus.trace import Trace
from drake_quad.errors import InputError
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.plan_job import PlanJob, PlanMaker
from drake_quad.scenario.load import parse_scenario, scenario_text
from drake_quad.simulation.prepare import PreparedScenario, prepare
from drake_quad.util.files import read_given, write_whole

NOW, STATES, COMMANDS, ANSWER, STOP = "/now", "/states", "/commands", "/answer", "/stop"
PLAN = "/plan"  # whether a plan that was asked for had been made
SIT = "/sit"  # as STOP, and the robot sits down first
TOPICS = (NOW, STATES, COMMANDS, ANSWER, STOP, PLAN, SIT)
KINDS = {NOW: int, STOP: str, SIT: str, PLAN: bool}  # of what is kept as it is
SCENARIO, HEADER = "scenario.yaml", "header.json"  # attachments
LARGEST = 2**31  # [bytes] of a file that is read
LARGEST_CHUNK = 2**26  # [bytes] unpacked; in ours it is 1 MiB
UNPACKED = 2**30  # [bytes] all chunks together

Event = tuple[str, Any]


class BusRecorder:
    """A clock, a bus and a maker of plans that note all that is asked of them, and what they say.

    Args:
        bus: Bus that is used.
        clock: Clock that is used.
        maker: Maker of plans that is used; without one plans are made when they are asked for.
    """

    def __init__(self, bus: RobotBus, clock: Clock, maker: PlanMaker | None = None) -> None:
        self._bus, self._clock, self._maker = bus, clock, maker
        self.events: list[Event] = []

    def now_ns(self) -> int:
        """The time [ns]."""
        now = self._clock.now_ns()
        self.events.append((NOW, now))
        return now

    def sleep_until(self, time_ns: int) -> None:
        """Waits; what is asked for next says how long it was."""
        self._clock.sleep_until(time_ns)

    def publish_state(self, state: StateMessage) -> None:
        """A controller sends none."""
        self._bus.publish_state(state)

    def publish_command(self, command: CommandMessage) -> None:
        """Sends a command."""
        self._bus.publish_command(command)
        self.events.append((ANSWER, encode_command(command)))

    def receive_states(self) -> list[Received[StateMessage]]:
        """The states since the last call."""
        found = self._bus.receive_states()
        self.events.append((STATES, found))
        return found

    def receive_commands(self) -> list[Received[CommandMessage]]:
        """The commands since the last call."""
        found = self._bus.receive_commands()
        self.events.append((COMMANDS, found))
        return found

    def ask(self, job: PlanJob) -> MotionPlan | None:
        """The plan, or None while it is being made.

        Raises:
            PlanningError: There is none.
        """
        made = True
        try:
            plan = job.make() if self._maker is None else self._maker.ask(job)
            made = plan is not None
        finally:
            self.events.append((PLAN, made))
        return plan

    def note_stop(self, reason: str, *, sit: bool = False) -> None:
        """Notes that the loop is told to stop before its next tick, as `ControlLoop.stop`."""
        self.events.append((SIT if sit else STOP, reason))

    def close(self) -> None:
        """Closes the bus."""
        self._bus.close()


def _plain(topic: str, value: Any) -> Any:
    """An event's value as JSON has it."""
    if topic == ANSWER:
        return b64encode(value).decode()
    if topic not in (STATES, COMMANDS):
        return value
    encode = encode_state if topic == STATES else encode_command
    return [
        [one.time_ns, one.fault,
         None if one.message is None else b64encode(encode(one.message)).decode()]
        for one in value
    ]  # fmt: skip


def _event(topic: str, plain: Any) -> Event:
    """The event that was written so.

    Raises:
        ValueError: None is written so.
    """
    if topic == ANSWER:
        return topic, b64decode(plain)
    if topic not in (STATES, COMMANDS):
        if type(plain) is not KINDS[topic]:
            raise ValueError(f"{topic} holds {plain!r}")
        return topic, plain
    decode: Any = decode_state if topic == STATES else decode_command
    found = []
    for time, fault, data in plain:
        message = None if data is None else decode(b64decode(data), int(time)).message
        if message is None and not fault:
            raise ValueError(f"{topic} holds a message that is none, and no fault")
        found.append(Received(message, int(time), str(fault)))
    return topic, found


def check_recording(path: Path) -> None:
    """Sees that a log could be written, before a robot moves for it.

    Raises:
        InputError: The package `mcap` is not installed.
    """
    if find_spec("mcap") is None:
        remedy = "needs the package mcap: pip install mcap"
        raise InputError(source="--record", field="mcap", value=str(path), remedy=remedy)


def write_bus_log(
    path: Path, prepared: PreparedScenario, events: list[Event], session: int
) -> None:
    """Writes a log.

    Args:
        path: The file.
        prepared: Scenario of the loop.
        events: Events of a BusRecorder.
        session: The loop's number as a sender.

    Raises:
        InputError: The file cannot be written.
    """
    from mcap.writer import CompressionType, Writer

    def write(to: Path) -> None:
        with to.open("wb") as file:
            writer = Writer(file, compression=CompressionType.ZSTD)
            writer.start(profile="", library="drake_quad")
            schema = writer.register_schema("drake_quad.BusEvent", "jsonschema", b"{}")
            channels = {topic: writer.register_channel(topic, "json", schema) for topic in TOPICS}
            now = 0
            for k, (topic, value) in enumerate(events):
                now = value if topic == NOW else now
                data = json.dumps(_plain(topic, value), separators=(",", ":")).encode()
                writer.add_message(channels[topic], now, data, now, k)
            text = scenario_text(prepared.scenario).encode()
            writer.add_attachment(0, 0, SCENARIO, "application/yaml", text)
            header = json.dumps({"session": session}).encode()
            writer.add_attachment(0, 0, HEADER, "application/json", header)
            writer.finish()

    write_whole(path, write, option="--record")


@dataclass(frozen=True, eq=False)
class BusLog:
    """A log as it was read.

    Attributes:
        scenario: Text of the scenario.
        session: The loop's number as a sender.
        events: All that it asked and answered, in order.
    """

    scenario: str
    session: int
    events: list[Event]


def read_bus_log(path: Path) -> BusLog:
    """Reads a log.

    Raises:
        InputError: It is none.
    """

    def fail(remedy: str) -> InputError:
        return InputError(source=str(path), field="bus log", value=path.name, remedy=remedy)

    if find_spec("mcap") is None:
        raise fail("needs the package mcap: pip install mcap")
    try:
        data = read_given(path, most=LARGEST)
    except OSError as problem:
        reason = f"cannot be read: {problem.strerror}"
        raise fail(f"{reason}; give a file that `control --record` has written") from None
    try:
        kept, messages = _unpack(data)
        found = [(number, _event(topic, json.loads(told))) for number, topic, told in messages]
        text, session = kept[SCENARIO].decode(), int(json.loads(kept[HEADER])["session"])
    except Exception as problem:  # of the reader's own kinds, and of a file that is another's
        raise fail(f"is no log that `control --record` has written: {problem!r}"[:200]) from None
    return BusLog(text, session, [event for _, event in sorted(found, key=lambda one: one[0])])


def _unpack(data: bytes) -> tuple[dict[str, bytes], list[tuple[int, str, bytes]]]:
    """Attachments by their names, and number, topic and data of every message, in one pass.

    A few bytes can claim to unpack to any number: what chunks would come to is looked at first.
    """
    import zstandard
    from mcap.records import Attachment, Channel, Chunk, Message
    from mcap.stream_reader import StreamReader, breakup_chunk

    kept: dict[str, bytes] = {}
    topics: dict[int, str] = {}
    messages: list[tuple[int, str, bytes]] = []
    unpacked = 0
    for record in StreamReader(BytesIO(data), emit_chunks=True).records:
        parts = [record]
        if isinstance(record, Chunk):
            size = len(record.data)
            if record.compression:  # a frame that does not tell its size has -1
                size = zstandard.frame_content_size(record.data)
            unpacked += size
            if not 0 <= size <= LARGEST_CHUNK or unpacked > UNPACKED:
                raise ValueError(f"it unpacks to {unpacked} bytes, {size} of these at once")
            parts = breakup_chunk(record, validate_crc=True)
        for part in parts:
            if isinstance(part, Attachment):
                kept[part.name] = part.data
            elif isinstance(part, Channel):
                topics[part.id] = part.topic
            elif isinstance(part, Message) and topics[part.channel_id] in TOPICS:
                messages.append((part.sequence, topics[part.channel_id], part.data))
    return kept, messages


class _Over(Exception):  # noqa: N818  nothing went wrong
    """The log is at its end, or the loop asks for something else than it did."""


class BusReplay:
    """A clock and a bus that say again what they said; answers are compared.

    Args:
        log: The log.

    Attributes:
        compared: How many commands were compared.
        different: Number of the first that is another to the bit; None if there is none.
    """

    def __init__(self, log: BusLog) -> None:
        self._events = [event for event in log.events if event[0] not in (STOP, SIT)]
        # The reason, and whether it sits down, by how many of these events come before.
        self._stops: dict[int, tuple[str, bool]] = {}
        before = 0
        for topic, value in log.events:
            if topic in (STOP, SIT):
                self._stops[before] = value, topic == SIT
            before += topic not in (STOP, SIT)
        self._next = 0
        self._job: PlanJob | None = None
        self.compared = 0
        self.different: int | None = None

    @property
    def stop_due(self) -> tuple[str, bool] | None:
        """Why the loop was told to stop before this tick, and whether to sit; None: it was not."""
        return self._stops.get(self._next)

    def _again(self, topic: str) -> Any:
        """What was said next, to a question of this topic.

        Raises:
            _Over: There is no more, or something else was asked then.
        """
        if self._next == len(self._events):
            raise _Over
        asked, value = self._events[self._next]
        if asked != topic:
            self.different = self.compared if self.different is None else self.different
            raise _Over
        self._next += 1
        return value

    def now_ns(self) -> int:
        """The time [ns]."""
        return int(self._again(NOW))

    def sleep_until(self, time_ns: int) -> None:
        """Does not wait."""

    def publish_state(self, state: StateMessage) -> None:
        """A controller sends none."""

    def publish_command(self, command: CommandMessage) -> None:
        """Compares the command with the one that was sent."""
        before = self._again(ANSWER)
        if self.different is None and encode_command(command) != before:
            self.different = self.compared
        self.compared += 1

    def receive_states(self) -> list[Received[StateMessage]]:
        """The states that came then."""
        found: list[Received[StateMessage]] = self._again(STATES)
        return found

    def receive_commands(self) -> list[Received[CommandMessage]]:
        """The commands that came then."""
        found: list[Received[CommandMessage]] = self._again(COMMANDS)
        return found

    def ask(self, job: PlanJob) -> MotionPlan | None:
        """The plan, made anew, when it had been made: of the first job of its key, as then.

        Raises:
            PlanningError: There is none.
        """
        if self._job is None or self._job.key != job.key:
            self._job = job
        if not self._again(PLAN):
            return None
        first, self._job = self._job, None
        return first.make()

    def close(self) -> None:
        """Has nothing to close."""


def replay_bus_log(log: BusLog, trace: Trace | None = None) -> dict[str, Any]:
    """Gives the log to a loop made anew, and compares what it answers.

    Args:
        log: The log.
        trace: Takes what the controller knew and wanted in a walk, a row a tick; see `CONTROLLER`.

    Returns:
        `commands`, how many were compared; `same`, whether all of them, and there are some, are the
        same to the bit; `first_difference`, the number of the first that is not, or None;
        `duration` of the log [s].

    Raises:
        InputError: Its scenario cannot be run here.
        PlanningError: Its scenario has no plan.
    """
    prepared = prepare(parse_scenario(log.scenario, source=SCENARIO), source=SCENARIO)
    replay, loop = BusReplay(log), None
    with suppress(_Over):
        loop = ControlLoop(prepared, replay, replay, maker=replay, session=log.session)
        while not loop.outcome:
            if replay.stop_due is not None:
                reason, sit = replay.stop_due
                loop.stop(reason, sit=sit)
            loop.tick()
            if trace is not None and loop.mode == SafetyMode.WALKING and loop.newest is not None:
                assert isinstance(loop.controller, BusController)
                trace.add(
                    time=loop.newest.time_ns / NS, mode=int(loop.mode), **loop.controller.known()
                )
    times = [value for topic, value in log.events if topic == NOW]
    return {
        "commands": replay.compared,
        "same": replay.different is None and replay.compared > 0,
        "first_difference": replay.different,
        "outcome": "" if loop is None else loop.outcome,
        "duration": (times[-1] - times[0]) / NS if times else 0.0,
    }
