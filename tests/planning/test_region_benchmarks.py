"""The benchmarks of the regions run, and say what they are there to say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.build import course_of
from drake_quad.scenario.load import parse_scenario


def test_no_stance_disagrees(load: Any) -> None:
    """A few random stances are as the independent program has them."""
    found = load("region").compare(12, seed=4)
    assert found["disagreements"] == 0 and found["stances"] == 12
    assert found["worst"] < 1e-7


def test_each_query_is_timed(load: Any) -> None:
    """Each has a median no greater than its 99th percentile, and all take time."""
    for name, times in load("region").measure(4).items():
        assert 0.0 < times["median"] <= times["p99"], name


def test_the_picture_shows_where_regions_differ(
    load: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On level treads not at all; on a nosing, with weak drives and in motion they do."""
    load("region_picture").main([str(tmp_path / "regions.png")])
    assert (tmp_path / "regions.png").stat().st_size > 10_000
    rows = capsys.readouterr().out.splitlines()[2:]
    assert len(rows) == 8
    for line in rows:
        assert ("level treads" in line) == line.endswith("| 0 mm |")


def test_drawn_stances_can_be_stood_in(load: Any) -> None:
    """Legs reach, feet stand on the ground, and there is a push to ask for."""
    push_budget = load("push_budget")
    scenario = parse_scenario(push_budget.SCENARIO, source="push_budget")
    robot = load_robot(scenario.robot.model)
    course = course_of(scenario, foot_radius=robot.foot_radius)
    random, seen = np.random.default_rng(3), set[bool]()
    for _ in range(6):
        trial = push_budget.draw(random, robot, course, 0.8)
        feet, seen = trial.stance.feet, seen | {trial.on_stairs}
        ground = course.height(feet[:, 0], feet[:, 1])
        np.testing.assert_allclose(feet[:, 2], ground + robot.foot_radius, atol=1e-9)
        _, excess, _ = pose_robot(robot, trial.stance.body[None], feet[None])
        assert excess.max() == 0.0 and trial.budget >= push_budget.LEAST
    assert seen == {True, False}


@pytest.mark.parametrize(("kind", "seed", "index"), [("ik", 2, 114), ("whole_body", 1, 22)])
def test_light_feet_keep_the_ground(load: Any, kind: str, seed: int, index: int) -> None:
    """Pushed back till it all but stands on its rear feet, it ends where it was, on all four.

    Front feet that press on what they find raise the robot's front until it falls: these two did.
    """
    bench = load("push_budget").Bench(kind, seed)
    trial = bench.trial(index)
    assert trial.on_stairs and trial.way[0] < 0.0
    end = bench.push(trial, 0.9)
    assert end.survived and end.feet == 4


def test_table_counts_toppled_and_not_survived_apart(load: Any) -> None:
    """By ground, with the exact bound: none of 20 is at most 16.8 %, two-sided at 95 %.

    What was not held unpushed is neither.
    """
    push_budget = load("push_budget")
    rows = [
        {"on_stairs": k % 2 == 0, "toppled": False, "survived": k != 4, "ratio": 0.5 + 0.01 * k,
         "stood": True}
        for k in range(40)
    ]  # fmt: skip
    fallen = {"on_stairs": False, "toppled": True, "survived": False, "ratio": 9.0, "stood": False}
    level, stairs, every = push_budget.table([*rows, fallen]).splitlines()[2:]
    assert level == "| level | 1 | 20 | 0 | 16.8 % | 0 | 20 | 0.70 | 0.51 to 0.89 |"
    assert stairs.startswith("| stairs | 0 | 20 | 0 | 16.8 % | 1 | 20 |")
    assert every.startswith("| all | 1 | 40 | 0 | 8.8 % | 1 | 40 |")


def test_end_is_survived_upright_on_three_feet_only(load: Any) -> None:
    """Not on two, and not toppled."""
    End = load("push_stances").End
    assert End(stood=True, toppled=False, feet=3, slid=0.0).survived
    assert not End(stood=True, toppled=False, feet=2, slid=0.0).survived
    assert not End(stood=True, toppled=True, feet=4, slid=0.0).survived


def test_a_trial_is_the_same_whichever_were_drawn_before(load: Any) -> None:
    """So that they can be run in pieces."""
    push_budget = load("push_budget")
    one, other = push_budget.Bench("ik", 3), push_budget.Bench("ik", 3)
    one.trial(0)
    first, second = one.trial(1), other.trial(1)
    assert first.budget == second.budget and np.array_equal(first.way, second.way)
    assert 0.0 < first.budget <= first.pendulums
