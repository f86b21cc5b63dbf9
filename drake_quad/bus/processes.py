"""The controller's process, with its clock and its bus; `robot_process.py` has the robot's."""

import socket
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_quad.bus.bus_log import BusRecorder, write_bus_log
from drake_quad.bus.buses import BUSES, BusEnd, find_bus
from drake_quad.bus.control_loop import ControlLoop, Event
from drake_quad.bus.drift import PLACE_ERROR, allow_for_drift
from drake_quad.bus.joint_map import joint_map
from drake_quad.bus.lcm_bus import LOOPBACK
from drake_quad.bus.plan_process import PlanProcess
from drake_quad.bus.real_time import NS, Clock, WallClock, real_time, thread_ids
from drake_quad.bus.robot_bus import RobotBus
from drake_quad.errors import InputError, PlanningError
from drake_quad.planning.plan_job import TaskJob
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.precompile import kernels_for, precompiling
from drake_quad.simulation.prepare import PreparedScenario, prepare

RELEASES = 10  # times that drives are told to damp by a loop that ends by an error
# Of a period, for which a loop sleeps that else is busy: the system stops processes of real-time
# priority that take more than 95 % of a core.
RESTS = 0.125
LATE = 0.1  # [s] behind, beyond which a loop gives up catching up
ESTIMATED = ("estimator.kind=ekf",)  # before what a person sets
FIELDS = (*ESTIMATED, "controller.period=0.002")  # where no design sets the period

Tell = Callable[[str], None]
Stop = Callable[[], bool]


@dataclass(frozen=True, kw_only=True)
class BusChoice:
    """Which bus, and where.

    Attributes:
        bus: Name of the bus, see `find_bus`.
        interface: The machine's network interface; `lo` stays within the machine.
        domain: DDS's domain; on LCM, how many ports further on.
        rate: Seconds of both sides' clocks in a second of the machine's.
    """

    bus: str = "lcm"
    interface: str = LOOPBACK
    domain: int = 1
    rate: float = 1.0


def check_choice(choice: BusChoice, *, named: bool, ready: bool) -> None:
    """Refuses what could move a robot unasked, or nothing at all.

    Args:
        choice: What was asked for.
        named: Whether the interface was given by a person.
        ready: Whether `--i-am-ready` was.

    Raises:
        InputError: What is missing, or wrong.
    """

    def fail(option: str, value: object, remedy: str) -> InputError:
        return InputError(source=f"--{option}", field=option, value=value, remedy=remedy)

    find_bus(choice.bus)
    if choice.bus not in BUSES and not ready:
        remedy = "nobody knows where your own bus leads: give --i-am-ready, too (see docs/bus.md)"
        raise fail("bus", choice.bus, remedy)
    known = [name for _, name in socket.if_nameindex()]
    if choice.interface not in known:
        raise fail("interface", choice.interface, f"this machine has {', '.join(known)}")
    if choice.interface != LOOPBACK and not (named and ready):
        missing = " and ".join(
            [*([] if named else ["--interface"]), *([] if ready else ["--i-am-ready"])]
        )
        remedy = f"a robot may be there: give {missing}, too (see docs/bus.md)"
        raise fail("interface", choice.interface, remedy)
    if not 0 <= choice.domain <= 230:
        raise fail("domain", choice.domain, "give a number from 0 to 230")
    if not 0.0 < choice.rate <= 1.0:
        raise fail("rate", choice.rate, "give more than 0, and at most 1")
    if choice.rate != 1.0 and choice.interface != LOOPBACK:
        raise fail("rate", choice.rate, "a robot keeps time: give 1")


def load_for_bus(name: str, fields: list[str]) -> Scenario:
    """The scenario with FIELDS set, as far as no design fills them in, and then a person's own.

    Raises:
        InputError: As of `load_scenario`.
    """
    scenario: Scenario = load_scenario(name, [*ESTIMATED, *fields])
    return scenario if scenario.design == "auto" else load_scenario(name, [*FIELDS, *fields])


def prepare_for_bus(name: str, fields: list[str], tell: Tell | None = None) -> PreparedScenario:
    """The scenario read, planned, and its kernels compiled.

    Args:
        name: A shipped scenario's, or a file.
        fields: What a person sets of it.
        tell: Told in a line of what takes a while.

    Raises:
        InputError: It cannot be run on a bus.
        PlanningError: It has no plan.
    """
    scenario = load_for_bus(name, fields)
    if scenario.estimator.kind != "ekf":
        raise InputError(
            source=name, field="estimator.kind", value=scenario.estimator.kind,
            remedy="nobody tells a robot's controller its state: give ekf",
        )  # fmt: skip
    if scenario.estimator.landmarks != "none":
        raise InputError(
            source=name, field="estimator.landmarks", value=scenario.estimator.landmarks,
            remedy="the bus carries no images: give none",
        )  # fmt: skip
    if scenario.simulation.mode != "physics":
        raise InputError(
            source=name, field="simulation.mode", value=scenario.simulation.mode,
            remedy="a bus has a robot at its other end: give physics",
        )  # fmt: skip
    if scenario.perception.map != "told":
        raise InputError(
            source=name, field="perception.map", value=scenario.perception.map,
            remedy="no camera's images are on the bus: give told",
        )  # fmt: skip
    if scenario.sensors.ground_normal != "map":
        raise InputError(
            source=name, field="sensors.ground_normal", value=scenario.sensors.ground_normal,
            remedy="no foot's normals are on the bus: give map",
        )  # fmt: skip
    with precompiling(
        kernels_for(scenario.controller.kind, "ekf", scenario.sensors.contacts), tell
    ) as wait:
        allowing = allow_for_drift(scenario, fields, source=name)
        try:
            prepared = prepare(allowing, source=name)
        except (InputError, PlanningError):
            if allowing is scenario:
                raise
            if tell is not None:
                tell(f"no plan allows for stairs {PLACE_ERROR:g} m elsewhere: planned without that")
            allowing.gait.map_error_place = allowing.gait.map_error_height = 0.0
            prepared = prepare(allowing, source=name)
        wait()
    return prepared


def open_bus(
    choice: BusChoice, clock: Clock, prepared: PreparedScenario, *, robot: bool
) -> RobotBus:
    """An end of the bus.

    Args:
        choice: Which.
        prepared: The scenario, for how its robot's own file means the joints.
        clock: The receiver's.
        robot: Whether it is the robot's end, which hears commands alone; a controller hears both.

    Raises:
        InputError: What it needs is not installed, or it cannot be opened.
    """
    end = BusEnd(
        now_ns=clock.now_ns,
        robot=robot,
        interface=choice.interface,
        domain=choice.domain,
        joints=joint_map(prepared.robot),
    )
    return find_bus(choice.bus)(end)


def each_period(
    clock: Clock, period: float, tick: Callable[[], bool], *, busy: bool = False
) -> float:
    """Ticks by the clock's deadlines until told to end.

    Args:
        clock: The clock.
        period: Time between deadlines [s].
        tick: Told whether to go on.
        busy: Whether to wait for deadlines with the core busy, but for RESTS of each period. A core
            that sleeps takes up to milliseconds to wake, above all on a virtual machine.

    Returns:
        How much time was given up [s].
    """
    period_ns = round(period * NS)
    due, given_up, rest_ns = clock.now_ns(), 0, round(RESTS * period_ns)
    while tick():
        due += period_ns
        now = clock.now_ns()
        behind = now - due
        if behind > LATE * NS:
            given_up += behind
            due += behind
        elif behind < 0:
            clock.sleep_until(min(now + rest_ns, due) if busy else due)
            while clock.now_ns() < due:
                pass
    return given_up / NS


def _first_job(prepared: PreparedScenario) -> TaskJob:
    """The mission's first task, as it was planned."""
    robot, course = prepared.robot, prepared.course
    return TaskJob(robot, course, prepared.settings, prepared.tasks[0], prepared.stance, 0)


def control(
    prepared: PreparedScenario,
    choice: BusChoice,
    *,
    stop: Stop,
    tell: Tell,
    dry_run: bool = False,
    soft_stop: bool = False,
    busy_wait: bool = False,
    fifo: bool = True,
    record: Path | None = None,
) -> dict[str, Any]:
    """The controller's process, from damping to damping.

    Args:
        prepared: Mission that `prepare_for_bus` returned.
        choice: The bus.
        stop: Asked whether a person wants it to end.
        tell: Told of every change of mode.
        dry_run: Whether it only listens.
        soft_stop: Whether the robot sits down before its drives damp, where a person wants an end.
        busy_wait: Whether the loop waits for its deadlines with its core busy, see `each_period`.
        fifo: Whether real-time priority is asked for.
        record: File for a log of all that came and was answered; see `bus_log`.

    Returns:
        Outcome, changes of mode, and how well time was kept: what control.json holds.
    """
    with closing(PlanProcess(_first_job(prepared))) as plans:
        clock, others = WallClock(choice.rate), thread_ids()
        bus = open_bus(choice, clock, prepared, robot=False)
        receiving = thread_ids() - others  # a loop of real time on a busy machine waits for these
        recorder = None if record is None else BusRecorder(bus, clock, plans)
        loop = ControlLoop(
            prepared, recorder or bus, recorder or clock, maker=recorder or plans, silent=dry_run
        )
        tell("listening" if dry_run else f"on {choice.bus}, interface {choice.interface}, "
             f"domain {choice.domain}: waiting for the robot")  # fmt: skip
        shown, remarked, next_look, unwritten = 0, 0, 0.0, ""

        def tick() -> bool:
            nonlocal shown, remarked, next_look
            if stop():
                loop.stop("interrupted", sit=soft_stop)
                if recorder is not None:
                    recorder.note_stop("interrupted", sit=soft_stop)
            loop.tick()
            for remark in loop.remarks[remarked:]:
                tell(f"{loop.time:8.3f} s  note: {remark}")
            remarked = len(loop.remarks)
            for event in loop.events[shown:]:
                tell(_line(event))
            shown = len(loop.events)
            if not loop.events and loop.time >= next_look + 1.0 and not dry_run:
                next_look = loop.time + 1.0
                tell(f"{loop.time:8.3f} s  {loop.reason}")
            if dry_run and loop.time >= next_look:
                next_look = loop.time + 1.0
                for line in _seen_lines(loop, prepared.robot.joint_names):
                    tell(line)
            return not loop.outcome

        try:
            with real_time(first=fifo, threads=receiving) as given:
                given_up = each_period(clock, loop.period, tick, busy=busy_wait)
        except BaseException:  # Ctrl-C a second time, too
            for _ in range(RELEASES):  # a bus may lose messages
                loop.release()
                clock.sleep_until(clock.now_ns() + round(loop.period * NS))
            raise
        finally:
            bus.close()
            if recorder is not None and record is not None:
                unwritten = _write_log(record, prepared, recorder, loop)
                if unwritten:
                    tell(unwritten)
        return {
            "outcome": _listened(loop) if dry_run else loop.outcome,
            "dry_run": dry_run,
            "events": [asdict(event) for event in loop.events],
            "bus": asdict(choice),
            "contacts": prepared.scenario.sensors.contacts,
            "remarks": loop.remarks,
            "log_written": record is None or not unwritten,
            "states_lost": loop.lost,
            "ticks_held": loop.holds,
            "largest_step": loop.largest_step,
            "real_time": {**given, "time_given_up": given_up, **loop.times.figures()},
        }


def _seen_lines(loop: ControlLoop, names: Sequence[str]) -> list[str]:
    """What a loop that only listens knows of the robot, and what it would have it do."""
    state = loop.newest
    if state is None:
        return [f"{loop.time:8.3f} s  {loop.reason}"]
    lines = [
        f"{loop.time:8.3f} s  {1.0 / loop.interval:.0f} states a second, the trunk is tilted by "
        f"{np.degrees(loop.tilt):.1f}°; {loop.reason}"
    ]
    for first in range(0, 12, 3):
        leg = slice(first, first + 3)
        measured = zip(names[leg], state.position[leg], loop.first_posture[leg], strict=True)
        words = (f"{name} {q:+.2f} rad (first to {to:+.2f})" for name, q, to in measured)
        lines.append(12 * " " + ", ".join(words))
    return lines


def _listened(loop: ControlLoop) -> str:
    """How a loop that only listened ended."""
    if loop.newest is None:
        return "listened: no state has come"
    armed = "would have stood up" if loop.would_arm else f"would not have stood up: {loop.reason}"
    return f"listened: {armed}"


def _write_log(
    record: Path, prepared: PreparedScenario, recorder: BusRecorder, loop: ControlLoop
) -> str:
    """Writes the log; where that cannot be, says why: the loop's findings are not lost with it."""
    try:
        write_bus_log(record, prepared, recorder.events, loop.session)
    except InputError as problem:
        loop.remarks.append(f"the log was not written: {problem}")
        return loop.remarks[-1]
    return ""


def _line(event: Event) -> str:
    why = f": {event.reason}" if event.reason else ""
    return f"{event.time:8.3f} s  {event.mode.replace('_', ' ')}{why}"
