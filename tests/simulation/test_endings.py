"""How runs end badly, and files that cannot be: each says so, and leaves what was there."""

import json
import re
from importlib import resources
from pathlib import Path

import pytest
from command import drake_quad, refused

from drake_quad.errors import InputError
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import at_goal, simulate
from drake_quad.util.files import write_whole

STAND = ["start.distance=2", "mission=[{kind: stand, duration: 2}]"]


def weakened(tmp_path: Path, pattern: str, replacement: str) -> str:
    """The paper's robot with something in its file replaced."""
    text = (resources.files("drake_quad_models") / "paper_quadruped.urdf").read_text()
    path = tmp_path / "weak.urdf"
    path.write_text(re.sub(pattern, replacement, text))
    return f"robot.model={path}"


def test_a_robot_that_collapses_fell(tmp_path: Path) -> None:
    """With joints of 20 Nm it sinks to the ground in a stand: `fell`, not at the goal."""
    model = weakened(tmp_path, r'effort="[^"]*"', 'effort="20"')
    result = simulate(load_scenario("flat_walk", [*STAND, model, "design=given"]))
    assert result.outcome == "fell" and "trunk" in result.reason


@pytest.mark.parametrize("mode", ["physics", "kinematic"])
def test_a_run_says_first_what_may_be_wrong_in_the_robots_file(tmp_path: Path, mode: str) -> None:
    """A thigh without mass is told before the simulation; a file without a doubt tells nothing."""
    told: list[str] = []
    model = weakened(tmp_path, r'(<link name="FL_thigh">)\s*<inertial>(?s:.*?)</inertial>', r"\1")
    for given in ([model], []):
        begun = len(told)
        simulate(
            load_scenario("flat_walk", [*STAND, *given, f"simulation.mode={mode}"]),
            tell=told.append, progress=lambda *_: told.append("simulated"),
        )  # fmt: skip
        doubts = [k for k, line in enumerate(told[begun:]) if "doubtful" in line]
        assert bool(doubts) == bool(given)
        assert all("FL_thigh" in told[begun + k] for k in doubts)
        if doubts and "simulated" in told:
            assert max(doubts) < told[begun:].index("simulated")


@pytest.mark.parametrize("height", [0.1, 0.2, 0.3, 2.0])
def test_a_body_height_out_of_reach_is_blamed_itself(height: float) -> None:
    """Where the legs cannot even stand it is the body's height that is wrong, not the stairs."""
    with pytest.raises(InputError) as caught:
        prepare(load_scenario("case_study", [f"gait.body_height={height}"]))
    assert caught.value.field == "gait.body_height"


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    """When the disk is full what was there before stays, and nothing half is left."""

    def fill(path: Path) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    (tmp_path / "log").write_text("whole")
    with pytest.raises(InputError, match="No space left"):
        write_whole(tmp_path / "log", fill)
    assert [p.name for p in tmp_path.iterdir()] == ["log"]
    assert (tmp_path / "log").read_text() == "whole"


def test_a_cut_log_has_no_report(tmp_path: Path) -> None:
    """`report` of a cut log is refused, and a report that was there stays."""
    (tmp_path / "summary.json").write_text(json.dumps({"outcome": "goal_reached"}))
    (tmp_path / "log.parquet").write_bytes(b"PAR1 but not for long")
    (tmp_path / "report.html").write_text("old")
    assert "log.parquet" in refused(drake_quad("report", str(tmp_path), cwd=tmp_path))
    assert (tmp_path / "report.html").read_text() == "old"


@pytest.mark.parametrize(
    "override",
    ["gait.cycle_time=1e6", "controller.period=100", "gait.stride=1e-9", "course[0].length=1e6",
     "mission=[{kind: stand, duration: 1e9}]", "mission=[{kind: walk, distance: -1}]"],
)  # fmt: skip
def test_absurd_values_are_refused_at_once(override: str) -> None:
    """Values that would take all memory, or never end, are slips of the pen."""
    with pytest.raises(InputError):
        load_scenario("flat_walk", [override])


def test_a_plan_at_its_end_is_not_yet_the_goal() -> None:
    """The clock alone does not decide: a base 0.2 m off the end of its plan has not reached it."""
    result = simulate(load_scenario("flat_walk", [*STAND, "simulation.mode=kinematic"]))
    assert at_goal(result.table, "done") == ("goal_reached", "done")
    name = "base_desired_x"
    moved = result.table.set_column(
        result.table.column_names.index(name), name, [result.table[name].to_numpy() + 0.2]
    )
    assert at_goal(moved, "done")[0] == "stopped"
    assert at_goal(result.table.slice(0, 0), "done")[0] == "stopped"
