"""A bus's log runs again: the same messages, the same commands to the bit."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from bus_rig import PERIOD_NS, short_walk
from command import drake_quad, refused
from mcap.writer import CompressionType, Writer
from rig import LatePlans

from drake_quad.bus.bus_log import (
    ANSWER,
    STATES,
    BusLog,
    BusRecorder,
    _event,
    read_bus_log,
    replay_bus_log,
    write_bus_log,
)
from drake_quad.bus.control_loop import LISTENS, ControlLoop
from drake_quad.bus.faults import BusFaults, FaultyBus
from drake_quad.bus.real_time import ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.bus.robot_side import RobotLoop, SimulatedRobot
from drake_quad.bus.safety import SafetyMode
from drake_quad.bus.trace import CONTROLLER, ROBOT, Trace
from drake_quad.errors import InputError

STOPPED_AT = 400  # ticks of walking after which a person stops it


TRUTH = Trace(ROBOT)  # of the robot of `log`


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Standing up and a little walk over a bus that loses and delays messages; then Ctrl-C.

    The walk's plan is made anew, for the feet stand a little elsewhere, and comes late.
    """
    folder = tmp_path_factory.mktemp("log")
    prepared, clock = short_walk("joints"), ManualClock()
    bus = LoopbackBus(clock.now_ns)
    faults = BusFaults(loss=0.05, delay=0.004, jitter=0.004, reorder=0.05, freeze_at=None)
    side = SimulatedRobot(prepared)
    robot = RobotLoop(side, FaultyBus(bus, faults, clock, np.random.default_rng(3)), clock)
    plans = LatePlans()
    recorder = BusRecorder(bus, clock, plans)
    loop = ControlLoop(prepared, recorder, recorder, maker=recorder)
    walked = 0
    while not loop.outcome:
        robot.tick()
        TRUTH.add(time=side.time, drives=robot.guard.drives, **side.truth())
        if walked >= STOPPED_AT:
            loop.stop("interrupted")
            recorder.note_stop("interrupted")
        loop.tick()
        clock.sleep_until(clock.now_ns() + PERIOD_NS)
        walked += loop.mode == SafetyMode.WALKING
        assert loop.time < 30.0
    assert walked >= STOPPED_AT and loop.outcome == "stopped: interrupted"
    assert plans.asked == 3
    path = folder / "bus.mcap"
    write_bus_log(path, prepared, recorder.events, loop.session)
    return path


@pytest.fixture(scope="module")
def kept(log: Path) -> BusLog:
    """What the file holds; nothing changes it."""
    return read_bus_log(log)


@pytest.fixture(scope="module")
def found(kept: BusLog) -> dict[str, Any]:
    """What comes of it as it runs again."""
    return replay_bus_log(kept)


def test_a_controller_made_anew_answers_the_same_to_the_bit(
    kept: BusLog, found: dict[str, Any]
) -> None:
    """All commands, from damping over standing up and walking to damping, are what they were."""
    answers = sum(topic == ANSWER for topic, _ in kept.events)
    assert found["same"] and found["first_difference"] is None
    assert found["commands"] == answers > 2000
    assert found["duration"] == pytest.approx(LISTENS + answers * 0.002, rel=0.01)


def test_what_the_controller_knew_can_be_laid_beside_where_the_robot_was(kept: BusLog) -> None:
    """At the same times of the robot's: base and feet within 10 mm, and feet that bear in both.

    But for where the robot stood up: the controller takes it to be where the scenario has it.
    """
    trace = Trace(CONTROLLER)
    found = replay_bus_log(kept, trace)
    assert found["same"] and len(trace) >= STOPPED_AT  # it looks, and changes nothing
    knew, was = trace.table(), TRUTH.table()
    for table, parts in ((knew, CONTROLLER), (was, ROBOT)):
        assert table.column_names == [name for names in parts.values() for name in names]
    times = was["time"].to_numpy()
    row = np.searchsorted(times, knew["time"].to_numpy() - 1e-6)
    np.testing.assert_allclose(times[row], knew["time"].to_numpy(), atol=1e-6)
    for name in (*CONTROLLER["pose"], *CONTROLLER["feet"]):
        off = (was[name].to_numpy()[row] - knew[name].to_numpy())[2:]  # it begins with its first
        assert np.abs(off).max() < 0.03 and np.abs(off - off[0]).max() < 0.01, name
    both = [was[name].to_numpy()[row] == knew[name].to_numpy() for name in CONTROLLER["bearing"]]
    assert np.mean(both) > 0.95
    wanted = np.stack([knew[name].to_numpy() for name in CONTROLLER["body_desired"][:3]])
    base = np.stack([knew[name].to_numpy() for name in CONTROLLER["pose"][:3]])
    assert np.abs(wanted - base)[:, 2:].max() < 0.02 and np.ptp(knew["gait_time"].to_numpy()) > 0.4


def test_the_table_of_a_log_is_written(log: Path, tmp_path: Path) -> None:
    """`bus-replay --table` has a row for every tick of the walk; never in place of the log."""
    table = tmp_path / "knew.parquet"
    done = drake_quad("bus-replay", str(log), "--table", str(table), cwd=tmp_path)
    assert done.returncode == 0 and pq.read_table(table).num_rows >= STOPPED_AT
    assert "is read by this command" in refused(
        drake_quad("bus-replay", str(log), "--table", str(log), cwd=tmp_path)
    )


def test_what_was_sensed_otherwise_is_answered_otherwise(kept: BusLog) -> None:
    """A joint that is a nanoradian elsewhere, from one tick of the walk on, is told with its place.

    Without this the comparison could pass whatever it is given.
    """
    begun = sum(topic == ANSWER for topic, _ in kept.events) - STOPPED_AT
    answered, events = 0, []
    for topic, value in kept.events:
        answered += topic == ANSWER
        if topic == STATES and answered >= begun:
            value = [
                replace(one, message=replace(one.message, position=one.message.position + 1e-9))
                for one in value
            ]
        events.append((topic, value))
    found = replay_bus_log(BusLog(kept.scenario, kept.session, events))
    assert not found["same"]
    assert begun - 1000 < found["first_difference"] < begun + 100


def test_a_log_that_is_none_is_refused(tmp_path: Path) -> None:
    """One line with the file and what it ought to be; nothing else happens."""
    path = tmp_path / "no.mcap"
    path.write_bytes(b"not a log")
    line = refused(drake_quad("bus-replay", str(path), cwd=tmp_path))
    assert "no.mcap" in line and "control --record" in line
    assert "control --record" in refused(drake_quad("bus-replay", "nowhere.mcap", cwd=tmp_path))


@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_a_log_that_never_ends_is_refused_at_once(tmp_path: Path, kind: str) -> None:
    """A pipe without a writer is not waited for, a device not read."""
    path = tmp_path / "no.mcap"
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    with pytest.raises(InputError, match=f"it is a {kind}.*control --record"):
        read_bus_log(path)


@pytest.mark.parametrize(("size", "count"), [(2**27, 1), (2**26, 17)])
def test_a_log_that_unpacks_to_very_much_is_refused(tmp_path: Path, size: int, count: int) -> None:
    """A small file, before it takes any memory: one large chunk, and many that are not."""
    path = tmp_path / "no.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD, chunk_size=size)
        writer.start(profile="", library="")
        schema = writer.register_schema("drake_quad.BusEvent", "jsonschema", b"{}")
        channel = writer.register_channel("/now", "json", schema)
        for k in range(count):
            writer.add_message(channel, k, bytes(size - 60), k, k)
        writer.finish()
    assert path.stat().st_size < 2**20
    with pytest.raises(InputError, match=r"unpacks to \d+ bytes"):
        read_bus_log(path)


def test_a_log_that_was_cut_says_so(kept: BusLog, found: dict[str, Any]) -> None:
    """All that is there is the same, and the loop has not ended by then."""
    assert found["outcome"] == "stopped: interrupted"
    half = replay_bus_log(BusLog(kept.scenario, kept.session, kept.events[:3000]))
    assert half["same"] and half["outcome"] == ""


def test_a_log_with_a_bit_turned_is_refused(log: Path, tmp_path: Path) -> None:
    """Wherever in its chunks it is: one line, and never a comparison of what nobody sent."""
    data = log.read_bytes()
    for share in (0.2, 0.5, 0.8):
        spoilt = bytearray(data)
        spoilt[int(share * len(data))] ^= 4
        path = tmp_path / "spoilt.mcap"
        path.write_bytes(spoilt)
        with pytest.raises(InputError, match="is no log that `control --record` has written"):
            read_bus_log(path)


@pytest.mark.parametrize(
    ("topic", "plain"),
    [
        ("/now", "abc"),
        ("/now", None),
        ("/plan", 1),
        ("/stop", 5),
        ("/states", [[5, "", None]]),
        ("/states", 7),
        ("/answer", 7),
    ],
)
def test_events_that_nobody_wrote_are_refused(topic: str, plain: object) -> None:
    """A value of another kind is an error as it is read, and not a failure later."""
    with pytest.raises((ValueError, TypeError)):
        _event(topic, plain)
