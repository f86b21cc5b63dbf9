"""What `drake-quad control` makes of its options, up to the loop that it begins."""

from pathlib import Path

import pytest
from command import drake_quad, refused

from drake_quad.bus import processes
from drake_quad.cli.bus import control
from drake_quad.errors import InputError
from drake_quad.simulation.prepare import PreparedScenario

WALK = """
description: Standing for a while
course:
  - {kind: floor, length: 4.0, width: 2.0}
start: {distance: 1.0}
mission:
  - {kind: stand, duration: 0.2}
"""


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
    path.write_text(WALK + f"sensors: {{contacts: {of_the_scenario}}}\n")
    begun: list[str] = []

    class Begun(Exception):  # noqa: N818  nothing went wrong
        """The loop was about to begin."""

    def loop(prepared: PreparedScenario, *_: object, **__: object) -> object:
        begun.append(prepared.scenario.sensors.contacts)
        raise Begun

    monkeypatch.setattr(processes, "ControlLoop", loop)
    monkeypatch.setattr(processes, "open_bus", lambda *_, **__: None)
    with pytest.raises(Begun):
        control(str(path), contacts=option)
    assert begun == [expected]


@pytest.mark.parametrize("design", ["auto", "given"])
def test_a_designed_gait_keeps_its_own_period(design: str, tmp_path: Path) -> None:
    """A bus has the state estimated in any case; a period is set only where no design sets it."""
    path = tmp_path / "walk.yaml"
    path.write_text(WALK + f"robot: {{model: paper_quadruped}}\ndesign: {design}\n")
    scenario = processes.load_for_bus(str(path), [])
    assert scenario.estimator.kind == "ekf" and scenario.design == design
    assert (scenario.controller.period == 0.002) == (design == "given")
    with pytest.raises(InputError, match=r"controller\.period"):
        processes.load_for_bus(str(path), ["design=auto", "controller.period=0.002"])


def test_contacts_that_nothing_tells_are_refused(tmp_path: Path) -> None:
    """One line with field, value and what there is, before any bus is opened."""
    line = refused(drake_quad("control", "flat_walk", "--contacts", "hands", cwd=tmp_path))
    assert "sensors.contacts" in line and "hands" in line and "joints" in line
