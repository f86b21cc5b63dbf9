"""A robot's own MJCF walks, and on stairs, under our controller, which knows its messages alone.

    python -m benchmarks.bus_mjcf go2 --mjcf go2.xml --seeds 10

The robot's side is MuJoCo with the file given: its masses, joint friction and feet, 2 ms steps. The
controller's robot is the one that drake_quad knows by its name, which is another file. In lock
step, a tick of one side after a tick of the other, through the bytes of Unitree's LowState and
LowCmd; the state is estimated, and the feet felt by the joints (`--contacts feet`: sensed).

    python -m benchmarks.bus_mjcf go2 --mjcf go2.xml --loss 0.05 --delay 0.01 --jitter 0.005

Messages are then lost and late both ways, by the clock of the lock step: a machine that is busy
cannot make it worse, and the same seed gives the same run. `tick_ms` is how long a tick of the
controller took in the walk, median, 99 % and 99.9 %, the messages' bytes with it.
"""

import argparse
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.bus.control_loop import ControlLoop
from drake_quad.bus.drift import allow_for_drift
from drake_quad.bus.faults import BusFaults, FaultyBus
from drake_quad.bus.joint_map import joint_map
from drake_quad.bus.messages import CommandMessage, StateMessage
from drake_quad.bus.mjcf_side import MjcfSide
from drake_quad.bus.processes import load_for_bus
from drake_quad.bus.real_time import NS, ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.bus.robot_side import DriveGuard
from drake_quad.bus.safety import SafetyMode
from drake_quad.bus.unitree_messages import (
    decode_low_cmd,
    encode_low_cmd,
    encode_low_state,
)
from drake_quad.bus.unitree_states import LowStateReader
from drake_quad.simulation.prepare import PreparedScenario, prepare

SCENARIO = """
description: A walk, and stairs up and down, over a bus
robot: {{model: {robot}}}
design: auto
course:
  - {{kind: floor, length: {floor}, width: 2.0}}
"""
STAIRS = """\
  - {{kind: stairs, going: up, rise: {rise}, run: {run}, count: {count}}}
  - {{kind: landing, length: 1.6}}
  - {{kind: stairs, going: down, rise: {rise}, run: {run}, count: {count}}}
  - {{kind: floor, length: 1.5}}
"""
START = "start: {distance: 0.8}\n"


class UnitreeBytes(LoopbackBus):
    """A bus within the process on which every message goes through Unitree's bytes.

    Args:
        prepared: The scenario.
        clock: The lock step's.
        clockless: Whether LowStates have no `tick`, as the maker's simulator leaves it.
    """

    def __init__(self, prepared: PreparedScenario, clock: ManualClock, *, clockless: bool) -> None:
        super().__init__(clock.now_ns)
        self._joints, self._clockless = joint_map(prepared.robot), clockless
        self._reader = LowStateReader(self._joints)

    def publish_state(self, state: StateMessage) -> None:
        """Sends a LowState."""
        stamp_ns = state.time_ns
        sent = replace(state, time_ns=0) if self._clockless else state
        come = self._reader.read(
            encode_low_state(sent, self._joints), 0, sender=state.session, sent_ns=stamp_ns
        )
        assert come.message is not None and not come.fault
        super().publish_state(come.message)

    def publish_command(self, command: CommandMessage) -> None:
        """Sends a LowCmd; a writer's number and a sequence are DDS's own."""
        come = decode_low_cmd(
            encode_low_cmd(command, self._joints), 0, self._joints,
            session=command.session, sequence=command.sequence,
        )  # fmt: skip
        assert come.message is not None and not come.fault
        super().publish_command(replace(come.message, time_ns=command.time_ns))


def run(text: str, mjcf: Path, seed: int, given: argparse.Namespace) -> dict[str, Any]:
    """One run, from damped to damped."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk.yaml"
        path.write_text(text)
        fields = [f"simulation.seed={seed}", f"sensors.contacts={given.contacts}", *given.set]
        scenario = allow_for_drift(load_for_bus(str(path), fields), fields, source=str(path))
        prepared = prepare(scenario)
    clock = ManualClock()
    bus = UnitreeBytes(prepared, clock, clockless=given.pace != 1.0)
    side, guard = MjcfSide(mjcf, prepared, friction=given.friction), DriveGuard()
    loop = ControlLoop(prepared, bus, clock)
    faults = BusFaults(loss=given.loss, delay=given.delay, jitter=given.jitter)
    end = FaultyBus(bus, faults, clock, np.random.default_rng(seed))  # the robot's
    period_ns, sequence = round(loop.period * NS), 0
    places: list[list[float]] = []
    ticks: list[float] = []  # how long each took in the walk [ms]
    while not loop.outcome and loop.time < given.limit:
        side.advance(guard.judge(end, clock.now_ns()), guard.command)
        sequence += 1
        end.publish_state(side.sense(1, sequence, clock.now_ns(), guard.drives))
        walks, begun = loop.mode == SafetyMode.WALKING, time.perf_counter()
        loop.tick()
        if walks:
            ticks.append(1e3 * (time.perf_counter() - begun))
        if len(loop.events) > len(places):
            places.append(side.base.round(3).tolist())
        clock.sleep_until(clock.now_ns() + round(period_ns / given.pace))
    return {
        "robot": prepared.robot.name,
        "seed": seed,
        "contacts": given.contacts,
        "loss": given.loss,
        "delay": given.delay,
        "jitter": given.jitter,
        "pace": given.pace,
        "outcome": loop.outcome or f"not at the goal after {given.limit:g} s",
        "touched": sorted(side.others),
        "trunk": places,
        "end": side.base.round(3).tolist(),
        "seconds": round(loop.time, 1),
        "largest_step": round(loop.largest_step, 4),
        "tick_ms": [round(float(t), 3) for t in np.percentile(ticks or [0.0], [50, 99, 99.9])],
        "events": [f"{e.time:.1f} {e.mode} {e.reason}".strip() for e in loop.events],
    }


def add_course_options(parser: argparse.ArgumentParser) -> None:
    """Options of the course, of what is drawn, and of what goes wrong on the bus."""
    parser.add_argument("--floor", type=float, default=3.3, help="length before the stairs [m]")
    parser.add_argument("--rise", type=float, default=0.10)
    parser.add_argument("--run", type=float, default=0.30)
    parser.add_argument("--count", type=int, default=4, help="steps; 0: the floor alone")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--contacts", choices=("feet", "joints"), default="joints")
    parser.add_argument("--loss", type=float, default=0.0, help="share of messages lost, each way")
    parser.add_argument("--delay", type=float, default=0.0, help="of messages each way [s]")
    parser.add_argument("--jitter", type=float, default=0.0, help="at most so much later [s]")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")


def course_text(given: argparse.Namespace) -> str:
    """The scenario that is asked for; its robot is found from any folder."""
    file = Path(given.robot)
    robot = file.resolve() if file.is_file() else given.robot
    text = SCENARIO.format(robot=json.dumps(str(robot)), floor=given.floor)
    if given.count:
        text += STAIRS.format(rise=given.rise, run=given.run, count=given.count)
    return text + START


def main() -> None:
    """Prints a line of JSON a run."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("robot", help="robot by its name, as drake_quad knows it")
    parser.add_argument("--mjcf", type=Path, required=True, help="the robot's own MJCF")
    add_course_options(parser)
    parser.add_argument("--friction", type=float, default=0.6)
    parser.add_argument(
        "--pace",
        type=float,
        default=1.0,
        help="seconds of the robot's side in one of the time stamps; it then sends no clock",
    )
    parser.add_argument("--limit", type=float, default=900.0)
    given = parser.parse_args()
    text = course_text(given)
    for seed in range(given.first, given.first + given.seeds):
        print(json.dumps(run(text, given.mjcf, seed, given)), flush=True)


if __name__ == "__main__":
    main()
