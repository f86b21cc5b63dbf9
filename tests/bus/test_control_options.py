"""What `drake-quad control` makes of its options, up to the loop that it begins."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from bus_rig import SHORT_WALK
from command import drake_quad, refused

from drake_quad.bus import processes
from drake_quad.cli.bus import control
from drake_quad.errors import InputError
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


def test_a_gait_designed_for_stairs_allows_for_drift(tmp_path: Path) -> None:
    """By 30 mm in place and 10 mm in height, or by what a person says; the level asks for none."""
    stairs = "  - {kind: stairs, going: up, rise: 0.1, run: 0.4, count: 2}\n"
    floor = "  - {kind: floor, length: 3.0}\n"
    path = tmp_path / "climb.yaml"

    def allowed(course: str, *fields: str) -> tuple[float, float]:
        path.write_text(f"robot: {{model: paper_quadruped}}\ndesign: auto\ncourse:\n{course}")
        gait = processes.load_for_bus(str(path), list(fields)).gait
        return gait.map_error_place, gait.map_error_height

    assert allowed(floor + stairs + floor) == (0.03, 0.01)
    assert allowed(floor + stairs + floor, "gait.map_error_place=0.04") == (0.04, 0.01)
    assert allowed(floor + stairs + floor, "gait.map_error_height=0") == (0.03, 0.0)
    assert allowed(floor) == (0.0, 0.0)


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
    with pytest.raises(InputError, match=r"drake_quad\[mcap\]"):
        control("flat_walk", record=tmp_path / "bus.mcap")
    assert not (tmp_path / "bus.mcap").exists()
