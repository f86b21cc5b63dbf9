"""A simulated robot's process, with its clock and its end of the bus."""

from typing import Any

import numpy as np

from drake_quad.bus.faults import BusFaults, FaultyBus
from drake_quad.bus.messages import DRIVES_DAMP, DRIVES_FOLLOW, DRIVES_HOLD
from drake_quad.bus.processes import BusChoice, Stop, Tell, each_period, open_bus
from drake_quad.bus.real_time import NS, WallClock, real_time, thread_ids
from drake_quad.bus.robot_side import RobotLoop, RobotSide
from drake_quad.bus.safety import SafetyMode
from drake_quad.bus.trace import ROBOT_PERIOD, Trace
from drake_quad.simulation.prepared import PreparedScenario

DRIVES = {DRIVES_DAMP: "damping", DRIVES_FOLLOW: "following", DRIVES_HOLD: "holding"}


def simulate_robot(
    prepared: PreparedScenario,
    robot: RobotSide,
    choice: BusChoice,
    *,
    faults: BusFaults,
    seed: int,
    duration: float | None,
    stop: Stop,
    tell: Tell,
    fifo: bool = False,
    trace: Trace | None = None,
) -> dict[str, Any]:
    """The robot's process: physics by the clock, until it is told to end.

    Args:
        prepared: Mission that `prepare_for_bus` returned.
        robot: The robot in its physics.
        choice: The bus.
        faults: What goes wrong on it.
        seed: Seed of the draws that decide which messages go wrong.
        duration: How long [s]; None: until it is stopped.
        stop: Asked whether a person wants it to end.
        tell: Told of every change of what the drives do.
        fifo: Whether real-time priority is asked for. A simulation that is slower than the
            wall clock then leaves a core to nothing else.
        trace: Takes where the robot is, a row every ROBOT_PERIOD; see `trace.ROBOT`.

    Returns:
        What the drives did and where the robot went: what robot.json holds.
    """
    clock, others = WallClock(choice.rate), thread_ids()
    bus = open_bus(choice, clock, prepared, robot=True)
    receiving = thread_ids() - others
    if faults.any:
        bus = FaultyBus(bus, faults, clock, np.random.default_rng(seed))
    loop = RobotLoop(robot, bus, clock)
    start = robot.base
    changes: list[dict[str, Any]] = []
    before = (DRIVES_DAMP, SafetyMode.DAMPING)
    tell(f"on {choice.bus}, interface {choice.interface}, domain {choice.domain}: sending")

    def tick() -> bool:
        nonlocal before
        loop.tick()
        command = loop.guard.command
        mode = SafetyMode.DAMPING if command is None else SafetyMode(command.mode)
        if (loop.guard.drives, mode) != before:
            before = (loop.guard.drives, mode)
            change = {
                "time": robot.time,
                "wall_ns": clock.now_ns(),
                "drives": DRIVES[loop.guard.drives],
                "mode": mode.name.lower(),
                "reason": loop.guard.reason if loop.guard.drives == DRIVES_DAMP else "",
                "base": robot.base.tolist(),
            }
            changes.append(change)
            tell(f"{robot.time:8.3f} s  {change['drives']} ({change['mode']}) {change['reason']}")
        if trace is not None and robot.time >= len(trace) * ROBOT_PERIOD:
            trace.add(time=robot.time, drives=loop.guard.drives, **robot.truth())
        over = duration is not None and robot.time >= duration
        return not (over or stop())

    try:
        with real_time(first=fifo, threads=receiving) as given:
            begun = clock.now_ns()
            given_up = each_period(clock, robot.period, tick)
            wall = (clock.now_ns() - begun) / NS
    finally:
        bus.close()
    return {
        "simulated_time": robot.time,
        "real_time_factor": robot.time / wall if wall > 0.0 else None,
        "start": start.tolist(),
        "end": robot.base.tolist(),
        "drives": changes,
        "real_time": {**given, "time_given_up": given_up, **loop.times.figures()},
    }
