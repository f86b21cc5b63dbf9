"""What a person gives in Python: it is checked as a file is, copied, and never silently ignored."""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rig import paper_robot

import drake_quad as dq
from drake_quad.perception.camera_model import D435
from drake_quad.robot.model import differing_field
from drake_quad.scenario.config import PushConfig

STAIRS = dq.Stairs(0.1, 0.4, 2)


def walk() -> dq.Scenario:
    """A scenario that somebody may change."""
    return dq.load_scenario("flat_walk")


def refused(call: Callable[[], object]) -> str:
    """The one line with which a call is refused."""
    with pytest.raises(dq.InputError) as error:
        call()
    line = str(error.value)
    assert "\n" not in line and len(line) < 600
    return line


def test_a_robot_that_was_changed_in_python_is_refused() -> None:
    """The answer would be that of its file; the line names the field, down to a part's."""
    robot = dq.load_robot("paper_quadruped")
    weak = replace(robot, effort=0.01 * robot.effort)
    long = replace(robot, geometry=replace(robot.geometry, shank=1.1 * robot.geometry.shank))
    assert differing_field(robot, dq.load_robot("paper_quadruped")) is None
    for changed, name in ((weak, "effort"), (long, "geometry.shank")):
        line = refused(lambda changed=changed: dq.check_stairs(changed, STAIRS))  # type: ignore[misc]
        assert f": {name} = 'not as in its file': " in line and ".robot.yaml" in line


def test_overrides_apply_to_a_scenario_object_too() -> None:
    """As to a file; a field that is none is refused; the object itself stays as it was."""
    scenario = walk()
    assert dq.plan(scenario, ["gait.duty_factor=0.9"]).scenario.gait.duty_factor == 0.9
    assert dq.plan("flat_walk", "gait.duty_factor=0.9").scenario.gait.duty_factor == 0.9
    assert scenario == walk()
    assert "no such field" in refused(lambda: dq.plan(scenario, ["no.such=1"]))


def test_what_was_planned_stays_when_the_scenario_is_changed() -> None:
    """A loop over a parameter of one object leaves each plan with its own."""
    scenario, plans = walk(), {}
    for factor in (0.85, 0.9):
        scenario.gait.duty_factor = factor
        plans[factor] = dq.plan(scenario)
    assert [plans[f].scenario.gait.duty_factor for f in plans] == list(plans)
    assert plans[0.85].plan.margin < plans[0.9].plan.margin


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("gait.pattern", "trott", "did you mean trot?"),
        ("simulation.mode", "Kinematic", "did you mean kinematic?"),
        ("gait.cycle_tme", 3.0, "did you mean cycle_time?"),
        ("gait.cycle_time", "5", "must be a number, without quotes"),
        ("gait.duty_factor", 5.0, "must be"),
        ("simulation.friction", -1, "must be more than 0"),
        ("simulation.seed", -1, "must not be negative"),
        ("controller.kp", -100.0, "must not be negative"),
        ("certify.margin", None, "must be a number"),
        ("gait", 3, "must be a mapping"),
        ("course", [STAIRS], "must be a mapping"),
    ],
)
def test_a_scenario_changed_in_python_is_checked_as_a_file_is(
    path: str, value: Any, words: str
) -> None:
    """Whether it is planned, run, proven or saved: in one line that names the field."""
    scenario: Any = walk()
    *parts, name = path.split(".")
    holder = scenario
    for part in parts:
        holder = getattr(holder, part)
    setattr(holder, name, value)
    for call in (dq.plan, dq.simulate, dq.certify, lambda s: dq.save_scenario(s, "x.yaml")):
        line = refused(lambda call=call: call(scenario))  # type: ignore[misc]
        assert f"scenario: {path}" in line and words in line


def test_numbers_of_numpy_and_dicts_are_taken() -> None:
    """What means the same in a file is the same in Python."""
    scenario: Any = walk()
    scenario.gait.duty_factor, scenario.simulation.seed = np.float64(0.9), np.int64(3)
    scenario.course = [{"kind": "floor", "length": 6.0}]
    force: Any = np.array([1.0, 0.0, 0.0])
    scenario.disturbances.pushes = [PushConfig(time=1.0, force=force)]
    taken = dq.plan(scenario).scenario
    assert (taken.gait.duty_factor, taken.simulation.seed) == (0.9, 3)
    assert taken.course[0] == dq.Element("floor", length=6.0)
    assert taken.disturbances.pushes[0].force == [1.0, 0.0, 0.0]
    elements: Any = np.array([dq.Element("floor", length=2.0)], dtype=object)
    assert len(dq.build_course(elements).lanes) == 1


@pytest.mark.parametrize(
    "call",
    [
        lambda: dq.check_stairs("paper_quadruped", (0.1, 0.4, 2)),  # type: ignore[arg-type]
        lambda: dq.check_stairs(None, STAIRS),  # type: ignore[arg-type]
        lambda: dq.chart_stairs("paper_quadruped", [0.1], dq.Span(0.3, 0.3, 0.1)),  # type: ignore[arg-type]
        lambda: dq.check_course("paper_quadruped", 3),  # type: ignore[arg-type]
        lambda: dq.plan(paper_robot()),  # type: ignore[arg-type]
        lambda: dq.simulate(STAIRS),  # type: ignore[arg-type]
        lambda: dq.certify(None),  # type: ignore[arg-type]
        lambda: dq.load_robot(paper_robot()),  # type: ignore[arg-type]
        lambda: dq.load_run(walk()),  # type: ignore[arg-type]
        lambda: dq.write_report(walk()),  # type: ignore[arg-type]
        lambda: dq.save_scenario("flat_walk", "x.yaml"),  # type: ignore[arg-type]
        lambda: dq.build_course([{"kind": "floor"}]),  # type: ignore[list-item]
        lambda: dq.build_course(dq.Element("floor", length=2.0)),  # type: ignore[arg-type]
    ],
)
def test_what_is_of_another_kind_is_refused_by_its_kind(call: Callable[[], object]) -> None:
    """Not by an attribute that it lacks, and without all that it holds."""
    assert "must be" in refused(call)


def test_names_are_taken_where_scenarios_are() -> None:
    """To prove and to report a plan takes a scenario's name as well as its plan."""
    assert dq.certify("flat_walk").least == dq.certify(dq.plan(walk())).least
    assert dq.report_plan("flat_walk")["feasible"] is True


def test_a_plans_margin_is_that_of_what_moves() -> None:
    """The smallest of the tasks' margins; standing still has none."""
    plan = dq.plan("flat_walk").plan
    margins = np.array([task.margin for task in plan.plans])
    assert np.isnan(margins[0]) and plan.margin == np.nanmin(margins)


def test_a_yes_that_is_not_what_was_asked_for_says_so() -> None:
    """A plan slower than the speed that was asked for is not shown as a plain yes."""
    answer = dq.check_stairs("paper_quadruped", STAIRS, prefer="margin", thorough=False)
    quick = replace(answer, preference=replace(answer.preference, speed=5.0))
    assert "; yes, static margin" in repr(answer)
    for shown in (repr(quick), quick._repr_html_()):
        assert "yes, but not at 5 m/s" in shown


def test_results_go_to_other_processes() -> None:
    """A scenario with Drake's settings, and an answer, come back from a pickle as they were."""
    scenario = walk()
    scenario.simulation.plant.time_step = 0.002
    again = pickle.loads(pickle.dumps(scenario))
    assert again == scenario and again.simulation.plant.time_step == 0.002
    assert again != walk()


def test_several_processes_need_no_main_guard(tmp_path: Path) -> None:
    """A plain script may ask for them at its top: the processes do not run the script again."""
    script = tmp_path / "script.py"
    script.write_text(
        "from drake_quad.util.parallel import map_in_processes\n"
        "print('once')\n"
        "print(map_in_processes(abs, [(-1,), (2,), (-3,)], workers=2))\n"
        "print(__file__, __spec__)\n",
        encoding="utf-8",
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines() == ["once", "[1, 2, 3]", f"{script} None"], done.stderr


def test_threads_begin_processes_without_the_script_too(tmp_path: Path) -> None:
    """As a sweep does: none of them runs the script again, and `python -m` keeps what it is."""
    script = tmp_path / "script.py"
    script.write_text(
        "from threading import Thread\n"
        "from drake_quad.sweep.executors import Worker\n"
        "print('once', flush=True)\n"
        "threads = [Thread(target=Worker) for _ in range(4)]\n"
        "[thread.start() for thread in threads]\n"
        "[thread.join() for thread in threads]\n"
        "print(__spec__ is not None and __spec__.name)\n",
        encoding="utf-8",
    )
    done = subprocess.run(
        [sys.executable, "-m", "script"], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.stdout.splitlines() == ["once", "script"], done.stderr


def test_a_file_is_written_through_a_link_and_never_in_place_of_a_device(tmp_path: Path) -> None:
    """A link stays a link; a pipe, or a device, is no file that could be replaced."""
    real, link, pipe = (tmp_path / name for name in ("real.yaml", "link.yaml", "pipe.yaml"))
    real.write_text("x", encoding="utf-8")
    link.symlink_to(real)
    os.mkfifo(pipe)
    dq.save_scenario(walk(), link)
    assert link.is_symlink() and dq.load_scenario(real) == walk()
    assert "is no file" in refused(lambda: dq.save_scenario(walk(), pipe))
    assert pipe.is_fifo()


def test_an_image_in_which_stairs_are_looked_for_in_vain_is_refused() -> None:
    """Degrees for radians, millimetres for metres, another size, a name for a camera.

    An image without any depth shows no stairs.
    """
    model = D435.model
    depth = np.full((model.height, model.width), 1.5)
    cases: list[tuple[Any, Any, float, str]] = [
        (depth, model, 28.6, "must be radians"),
        (1000.0 * depth, model, 0.5, "give metres"),
        (depth[:100], model, 0.5, f"must be an array of {model.height} by {model.width}"),
        (depth, "d435", 0.5, "must be a CameraModel"),
    ]
    for image, camera, pitch, words in cases:
        line = refused(
            lambda image=image, camera=camera, pitch=pitch: dq.see_stairs(  # type: ignore[misc]
                image, camera, pitch=pitch
            )
        )
        assert words in line


def test_a_run_without_a_sample_ends_with_its_reason() -> None:
    """So does one whose own controller fails at once."""
    short = dq.plan("flat_walk", ["simulation.log_period=0.5"])
    assert dq.simulate(short, stop=lambda: True).outcome == "stopped"


def test_a_column_that_the_log_has_not_is_refused(tmp_path: Path) -> None:
    """By its name, with the one that is most like it; a run read back says how it ended."""
    result = dq.simulate(dq.plan("flat_walk"), stop=lambda: True)
    run = dq.load_run(result.save(tmp_path))
    assert (run.outcome, run.reason) == (result.outcome, result.reason)
    assert run.log["margin"].shape == (len(run.log),) and len(repr(run.log)) < 100
    assert "margin" in run.log and list(run.log) == list(run.log.columns)
    assert "did you mean margin?" in refused(lambda: run.log["margn"])
    assert "holds words" in refused(lambda: run.log["segment"])


def test_no_controller_of_ones_own_is_ignored() -> None:
    """A replay of the plan has none, and says so."""
    planned = dq.plan("flat_walk", ["simulation.mode=kinematic"])
    assert "no controller" in refused(lambda: dq.simulate(planned, tracking="whole_body"))


def test_files_are_written_where_text_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A path may be text, and begin with `~`; what cannot be written is told in one line."""
    monkeypatch.setenv("HOME", str(tmp_path))
    dq.save_scenario(walk(), "~/a/walk.yaml")
    assert dq.load_scenario(str(tmp_path / "a" / "walk.yaml")) == walk()
    dq.report_plan("flat_walk", out="~/plans")
    assert (tmp_path / "plans" / "plan.json").is_file()
    result = dq.simulate(dq.plan("flat_walk"), stop=lambda: True)
    assert result.save("~/runs/a") == tmp_path / "runs" / "a"
    rows = dq.write_joint_table(str(tmp_path / "runs" / "a"), "~/joints.csv")
    assert rows == result.table.num_rows and (tmp_path / "joints.csv").is_file()
    assert "cannot be written" in refused(lambda: dq.save_scenario(walk(), tmp_path))
