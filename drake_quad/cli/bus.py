"""The commands of a robot's bus: `control`, a controller's side, `simulate`, a robot's; replays."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

import drake_quad as dq
from drake_quad.cli.common import (
    MESSAGES,
    JsonOption,
    ScenarioArgument,
    SetOption,
    claim,
    claim_file,
    interruptible,
    stem,
)
from drake_quad.errors import InputError

BusOption = Annotated[
    str,
    typer.Option(help="`lcm`, `unitree`, or your own: FILE.py:CLASS, whose file is executed."),
]
InterfaceOption = Annotated[
    str | None, typer.Option(help="Network interface; by default lo, which is this machine alone.")
]
DomainOption = Annotated[int, typer.Option(help="DDS domain; for LCM it is added to the port.")]
RateOption = Annotated[
    float, typer.Option(help="Slow motion of both sides, for a busy machine; 1 is real time.")
]
BusyOption = Annotated[
    bool,
    typer.Option(
        "--busy-wait",
        help="Wait for each deadline with a core busy: it is kept more exactly, and a core less is "
        "there for others.",
    ),
]
FifoOption = Annotated[
    bool, typer.Option("--fifo/--no-fifo", help="Real-time priority, if it is allowed.")
]


def control(
    scenario: ScenarioArgument = "flat_walk",
    *,
    bus: BusOption = "lcm",
    interface: InterfaceOption = None,
    domain: DomainOption = 1,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run",
            help="Only listen: print each second what the robot's joints and IMU show, and what "
            "it would do; until Ctrl-C.",
        ),
    ] = False,
    i_am_ready: Annotated[
        bool,
        typer.Option(
            "--i-am-ready",
            help="You confirm that a robot may move. It should hang on a hoist.",
        ),
    ] = False,
    soft_stop: Annotated[
        bool,
        typer.Option(
            "--soft-stop",
            help="At Ctrl-C a robot that stands or walks sits down first, in 3.5 s, and then its "
            "drives damp; a second Ctrl-C damps at once, as the first does without this.",
        ),
    ] = False,
    contacts: Annotated[
        str | None,
        typer.Option(
            help="Which feet bear is told by the `feet`'s sensors, or felt by the `joints`; as the "
            "scenario has it (sensors.contacts) unless given."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Directory for control.json, and control.html, a page of its figures."),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(
            help="MCAP file for all that came and was answered, which `bus-replay` runs again; it "
            "is kept in memory until the end, 1 MB a second."
        ),
    ] = None,
    rate: RateOption = 1.0,
    busy_wait: BusyOption = False,
    fifo: FifoOption = True,
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a scenario's controller on a robot's bus: it stands up, walks and sits down.

    No real robot has walked with it yet. Read docs/bus.md before you connect one.
    """
    from drake_quad.bus.bus_log import check_recording
    from drake_quad.bus.processes import (
        BusChoice,
        check_choice,
        control as run_control,
        prepare_for_bus,
    )

    choice = BusChoice(bus=bus, interface=interface or "lo", domain=domain, rate=rate)
    check_choice(choice, named=interface is not None, ready=i_am_ready)
    if out is not None:
        claim(out)
    claim_file(record, "--record", reads=[scenario])
    if record is not None:
        check_recording(record)
    fields = [*(overrides or []), *([f"sensors.contacts={contacts}"] if contacts else [])]
    prepared = prepare_for_bus(scenario, fields, MESSAGES.print)
    with interruptible(MESSAGES) as stop:
        result = run_control(prepared, choice, stop=stop, tell=_tell, dry_run=dry_run, fifo=fifo,
                             record=record, soft_stop=soft_stop, busy_wait=busy_wait)  # fmt: skip
    _leave(result, out, "control.json", as_json=as_json)
    if out is not None:
        page = dq.write_bus_page(result, out / "control.html", name=stem(scenario))
        MESSAGES.print(Text(f"look at {page}"), soft_wrap=True)
    if not result["log_written"]:
        raise typer.Exit(2)
    done = result["outcome"] in ("goal_reached", "listened: would have stood up")
    raise typer.Exit(0 if done else 1)


def simulate(
    scenario: ScenarioArgument = "flat_walk",
    *,
    bus: BusOption = "lcm",
    interface: InterfaceOption = None,
    domain: DomainOption = 1,
    i_am_ready: Annotated[
        bool,
        typer.Option(
            "--i-am-ready", help="Publish false states on this network, where others may hear them."
        ),
    ] = False,
    duration: Annotated[
        float | None, typer.Option(help="How long to simulate, in s; by default until Ctrl-C.")
    ] = None,
    loss: Annotated[float, typer.Option(help="Share of messages that are lost.")] = 0.0,
    delay: Annotated[float, typer.Option(help="How late every message is, in s.")] = 0.0,
    jitter: Annotated[float, typer.Option(help="How much later it may be besides, in s.")] = 0.0,
    reorder: Annotated[float, typer.Option(help="Share of messages that others overtake.")] = 0.0,
    freeze_at: Annotated[
        float | None, typer.Option(help="When the sensors freeze, in s; by default never.")
    ] = None,
    fault_seed: Annotated[int, typer.Option(help="Seed of the bus's faults.")] = 0,
    mjcf: Annotated[
        Path | None,
        typer.Option(
            help="MuJoCo, with this MJCF of the robot, is the robot's side in place of Drake's "
            "physics: its masses, joint friction and feet; steps of 2 ms."
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Directory for robot.json.")] = None,
    rate: RateOption = 1.0,
    fifo: FifoOption = False,
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate a robot that listens on a bus, paced to the wall clock."""
    from drake_quad.bus.faults import BusFaults
    from drake_quad.bus.processes import BusChoice, check_choice, prepare_for_bus
    from drake_quad.bus.robot_process import simulate_robot
    from drake_quad.bus.robot_side import RobotSide, SimulatedRobot
    from drake_quad.bus.trace import ROBOT, Trace

    choice = BusChoice(bus=bus, interface=interface or "lo", domain=domain, rate=rate)
    check_choice(choice, named=interface is not None, ready=i_am_ready)
    for name, share in (("loss", loss), ("reorder", reorder)):
        if not 0.0 <= share <= 1.0:
            raise _wrong(name, share, "give a share from 0 to 1")
    for name, time in (("delay", delay), ("jitter", jitter), ("duration", duration),
                       ("freeze-at", freeze_at)):  # fmt: skip
        if time is not None and not 0.0 <= time < 1e6:
            raise _wrong(name, time, "give seconds, from 0 to a million")
    if mjcf is not None:
        from drake_quad.bus.mjcf_side import MjcfSide, check_mjcf

        check_mjcf(mjcf)
    if out is not None:
        claim(out)
    prepared = prepare_for_bus(scenario, overrides or [], MESSAGES.print)
    robot: RobotSide = SimulatedRobot(prepared) if mjcf is None else MjcfSide(mjcf, prepared)
    faults = BusFaults(loss=loss, delay=delay, jitter=jitter, reorder=reorder, freeze_at=freeze_at)
    trace = None if out is None else Trace(ROBOT)
    with interruptible(MESSAGES) as stop:
        result = simulate_robot(
            prepared, robot, choice, faults=faults, seed=fault_seed, duration=duration, stop=stop,
            tell=_tell, fifo=fifo, trace=trace,
        )  # fmt: skip
    if out is not None and trace is not None:
        trace.write(out / "robot.parquet")
    _leave(result, out, "robot.json", as_json=as_json)


def bus_replay(
    log: Annotated[Path, typer.Argument(help="MCAP file that `control --record` has written.")],
    *,
    table: Annotated[
        Path | None,
        typer.Option(
            help="Parquet file for what the controller knew and wanted in its walk, a row a tick."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Give a controller again all that came over a bus, and compare what it answers.

    Exit status 1 if any command differs from the log in any bit.
    """
    from drake_quad.bus.bus_log import read_bus_log, replay_bus_log
    from drake_quad.bus.trace import CONTROLLER, Trace

    claim_file(table, "--table", reads=[log])
    trace = None if table is None else Trace(CONTROLLER)
    found = replay_bus_log(read_bus_log(log), trace)
    if table is not None and trace is not None:
        trace.write(table)
    if as_json:
        print(json.dumps(found))
    elif found["same"]:
        print(f"{found['commands']} commands, {found['duration']:.1f} s: all the same to the bit")
        if not found["outcome"]:
            print("the log ends before the controller did")
    elif found["commands"] == 0:
        print("no command is in this log, or the controller asks for something else at once")
    else:
        print(f"the same until command {found['first_difference']} of {found['commands']}")
    raise typer.Exit(0 if found["same"] else 1)


def _wrong(option: str, value: object, remedy: str) -> InputError:
    return InputError(source=f"--{option}", field=option, value=value, remedy=remedy)


def _tell(line: str) -> None:
    MESSAGES.print(line, highlight=False, soft_wrap=True)


def _leave(result: dict[str, Any], out: Path | None, name: str, *, as_json: bool) -> None:
    """Writes the file, and prints the result."""
    if out is not None:
        from drake_quad.util.files import write_whole

        text = json.dumps(result, indent=2) + "\n"
        write_whole(out / name, lambda path: path.write_text(text, encoding="utf-8"))
    if as_json:
        print(json.dumps(result))
        return
    if "outcome" in result:
        print(result["outcome"])
    print(time_kept(result["real_time"]))


def time_kept(times: dict[str, Any]) -> str:
    """How well a loop kept its time, in a line for people; all figures are in the JSON."""
    if "period_ms" not in times:
        return f"{times['ticks']} ticks"
    work, age = times["work_ms"], times["state_age_ms"]
    line = (
        f"{times['ticks']} ticks, {times['overrun_share']:.2%} of them late by half a period; "
        f"99.9 % within {times['jitter_ms']['p99_9']:.2f} ms of their time; a tick took "
        f"{work['median']:.2f} ms (99.9 %: {work['p99_9']:.2f} ms)"
    )
    if age:
        line += f"; states were {age['median']:.1f} ms old when answered"
    if (times["time_stolen"] or 0.0) > 0.0:
        line += f"; this machine's host kept its cores from it for {times['time_stolen']:.2f} s"
    return line
