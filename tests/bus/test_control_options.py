"""What `drake-quad control` makes of its options, up to the loop that it begins."""

import copy
import os
import signal
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace
from typing import Any, NoReturn

import numpy as np
import pytest
import typer
from bus_rig import SHORT_WALK, short_walk
from command import drake_quad, refused

from drake_quad.bus import processes, robot_process
from drake_quad.bus.faults import BusFaults
from drake_quad.cli.bus import control
from drake_quad.cli.common import MESSAGES, interruptible
from drake_quad.errors import InputError, PlanningError
from drake_quad.scenario.config import Scenario
from drake_quad.simulation.prepare import PreparedScenario


@pytest.mark.parametrize(
    ("of_the_scenario", "option", "expected"),
    [("feet", None, "feet"), ("feet", "joints", "joints"), ("joints", None, "joints")],
)
def test_the_loop_gets_what_tells_contacts(
    of_the_scenario: str, option: str | None, expected: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """`--contacts` goes before the scenario's own, and reaches the loop; without it that holds."""
    path = tmp_path / "walk.yaml"
    path.write_text(SHORT_WALK + f"sensors: {{contacts: {of_the_scenario}}}\n")
    begun: list[str] = []
    plans = SimpleNamespace(close=lambda: begun.append("closed"))

    class Begun(Exception):  # noqa: N818  nothing went wrong
        """The loop was about to begin."""

    def loop(prepared: PreparedScenario, *_: object, maker: object, **__: object) -> object:
        assert maker is plans  # who makes plans, so that the loop does not
        begun.append(prepared.scenario.sensors.contacts)
        raise Begun

    monkeypatch.setattr(processes, "ControlLoop", loop)
    monkeypatch.setattr(processes, "PlanProcess", lambda _: plans)
    monkeypatch.setattr(processes, "open_bus", lambda *_, **__: None)
    with pytest.raises(Begun):
        control(str(path), contacts=option)
    assert begun == [expected, "closed"]


def test_threads_that_a_bus_begins_come_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both sides wait for them in real time: they are told which, and no others."""
    end, given = Event(), list[set[int]]()
    begun: list[Thread] = []

    def opened(*_: object, **__: object) -> SimpleNamespace:
        begun.append(Thread(target=end.wait))
        begun[-1].start()
        return SimpleNamespace(close=lambda: None)

    def real_time(*, threads: set[int], **_: object) -> NoReturn:
        given.append(threads)
        raise Begun

    class Begun(Exception):  # noqa: N818  nothing went wrong
        """The loop was about to begin."""

    prepared, choice = short_walk(), processes.BusChoice()
    known: dict[str, Any] = {"stop": lambda: False, "tell": lambda _: None}
    loop = SimpleNamespace(period=0.002, release=lambda: None)
    for side in (processes, robot_process):
        monkeypatch.setattr(side, "open_bus", opened)
        monkeypatch.setattr(side, "real_time", real_time)
    monkeypatch.setattr(processes, "ControlLoop", lambda *_, **__: loop)
    monkeypatch.setattr(processes, "PlanProcess", lambda _: SimpleNamespace(close=lambda: None))
    robot: Any = SimpleNamespace(base=np.zeros(3), period=0.002, time=0.0)
    try:
        with pytest.raises(Begun):
            processes.control(prepared, choice, **known)
        with pytest.raises(Begun):
            robot_process.simulate_robot(
                prepared, robot, choice, faults=BusFaults(), seed=0, duration=None, **known
            )
    finally:
        end.set()
    assert given == [{thread.native_id} for thread in begun] and len(begun) == 2


@pytest.mark.parametrize("design", ["auto", "given"])
def test_a_designed_gait_keeps_its_own_period(design: str, tmp_path: Path) -> None:
    """A bus has the state estimated in any case; a period is set only where no design sets it."""
    path = tmp_path / "walk.yaml"
    path.write_text(SHORT_WALK + f"robot: {{model: paper_quadruped}}\ndesign: {design}\n")
    scenario = processes.load_for_bus(str(path), [])
    assert scenario.estimator.kind == "ekf" and scenario.design == design
    assert (scenario.controller.period == 0.002) == (design == "given")
    with pytest.raises(InputError, match=r"controller\.period"):
        processes.load_for_bus(str(path), ["design=auto", "controller.period=0.002"])


def test_a_gait_that_cannot_allow_for_drift_is_planned_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A person is told so, in a line; the gait is the same, its swings without the allowance."""
    path, tried = tmp_path / "climb.yaml", list[float]()
    told: list[str] = []
    path.write_text(SHORT_WALK + "robot: {model: paper_quadruped}\ndesign: auto\n")

    def planned(scenario: Scenario, **_: str) -> str:
        tried.append(scenario.gait.map_error_place)
        if tried[-1]:
            raise PlanningError("no swing")
        return "the plan"

    def allowed(scenario: Scenario, *_: object, **__: object) -> Scenario:
        found = copy.deepcopy(scenario)
        found.gait.map_error_place = 0.03
        return found

    monkeypatch.setattr(processes, "allow_for_drift", allowed)
    monkeypatch.setattr(processes, "prepare", planned)
    found: object = processes.prepare_for_bus(str(path), [], told.append)
    assert found == "the plan"
    assert tried == [0.03, 0.0] and any("0.03 m elsewhere" in line for line in told)


def test_contacts_that_nothing_tells_are_refused(tmp_path: Path) -> None:
    """One line with field, value and what there is, before any bus is opened."""
    line = refused(drake_quad("control", "flat_walk", "--contacts", "hands", cwd=tmp_path))
    assert "sensors.contacts" in line and "hands" in line and "joints" in line


def test_a_log_that_could_not_be_written_is_refused_before_a_robot_moves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the package mcap, `--record` is refused with how to get it; no bus is opened."""
    monkeypatch.setattr("drake_quad.bus.bus_log.find_spec", lambda _: None)
    monkeypatch.setattr(processes, "open_bus", lambda *_, **__: pytest.fail("a bus was opened"))
    with pytest.raises(InputError, match="pip install mcap"):
        control("flat_walk", record=tmp_path / "bus.mcap")
    assert not (tmp_path / "bus.mcap").exists()


def test_a_bus_has_no_normals_of_the_ground(tmp_path: Path) -> None:
    """A scenario whose feet feel the ground's tilt is refused before anything is planned."""
    path = tmp_path / "walk.yaml"
    path.write_text(SHORT_WALK + "robot: {model: paper_quadruped}\n")
    with pytest.raises(InputError, match=r"ground_normal = 'feet'.*give map"):
        processes.prepare_for_bus(str(path), ["sensors.ground_normal=feet"])


def test_a_bus_carries_no_images(tmp_path: Path) -> None:
    """A scenario whose estimate is corrected by a camera is refused, with the field's name."""
    path = tmp_path / "walk.yaml"
    path.write_text(SHORT_WALK + "robot: {model: paper_quadruped}\n")
    with pytest.raises(InputError, match=r"estimator\.landmarks.*give none"):
        processes.prepare_for_bus(str(path), ["estimator.landmarks=stairs"])


@pytest.mark.parametrize(
    ("choice", "named", "ready", "named_in_the_error"),
    [
        ({"interface": "eth0"}, True, False, "give --i-am-ready, too"),
        ({"interface": "eth0"}, False, True, "give --interface, too"),
        ({"interface": "eth0"}, False, False, "give --interface and --i-am-ready, too"),
        ({"interface": "eth9"}, True, True, "this machine has lo, eth0"),
        ({"interface": "eth0", "rate": 0.5}, True, True, "a robot keeps time"),
        ({"rate": 0.0}, True, True, "more than 0"),
        ({"rate": float("nan")}, True, True, "more than 0"),
        ({"domain": 231}, True, True, "from 0 to 230"),
    ],
)
def test_nothing_that_could_move_a_robot_is_done_unasked(
    choice: dict[str, Any], named: bool, ready: bool, named_in_the_error: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Off loopback a person names the interface and says that a robot may move."""
    monkeypatch.setattr("socket.if_nameindex", lambda: [(1, "lo"), (2, "eth0")])
    with pytest.raises(InputError, match=named_in_the_error):
        processes.check_choice(processes.BusChoice(**choice), named=named, ready=ready)
    processes.check_choice(processes.BusChoice(interface="eth0"), named=True, ready=True)
    processes.check_choice(processes.BusChoice(rate=0.5), named=False, ready=False)


def test_a_log_that_cannot_be_written_is_told_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line on the console and in the figures, and status 2; the figures are kept."""
    failed = InputError(source="--record", field="record", value="x", remedy="is a directory")

    def write(*_: object) -> None:
        raise failed

    monkeypatch.setattr(processes, "write_bus_log", write)
    loop: Any = SimpleNamespace(remarks=[], session=1)
    recorder: Any = SimpleNamespace(events=[])
    line = processes._write_log(tmp_path, short_walk(), recorder, loop)
    assert line == f"the log was not written: {failed}" and loop.remarks == [line]
    times = {"ticks": 3}
    known = {"outcome": "goal_reached", "log_written": False, "real_time": times, "events": []}
    monkeypatch.setattr(processes, "control", lambda *_, **__: known)
    monkeypatch.setattr(processes, "prepare_for_bus", lambda *_: None)
    with pytest.raises(typer.Exit) as ended:
        control("flat_walk")
    assert ended.value.exit_code == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_closed_terminal_is_a_polite_stop(number: signal.Signals) -> None:
    """Ctrl-C, a kill, or a terminal that is gone: the loop is asked to stop, and damps."""
    before = signal.getsignal(number)
    with interruptible(MESSAGES) as stop:
        assert not stop()
        os.kill(os.getpid(), number)
        assert stop()
    assert signal.getsignal(number) is before
