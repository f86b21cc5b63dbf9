"""Safety beside the goal: one definition, by one threshold that every page and command has."""

from dataclasses import replace
from typing import Any

import pytest
from rig import paper_robot

from drake_quad.gait_design.objective import targets_for
from drake_quad.report.overlay import margin_colour
from drake_quad.report.style import BAD, GOOD, WARN
from drake_quad.robot.model import leg_length
from drake_quad.runs.summary_lines import safety_line
from drake_quad.stability.safety import judge_safety, margin_words, safe_margin

GOOD_RUN: dict[str, Any] = {
    "outcome": "goal_reached",
    "simulation": "physics",
    "margin": {"minimum": 0.071},
    "time_under_three_feet": 0.0,
    "nonfoot_contact_samples": 0,
    "swing_hit_samples": 0,
    "swing_force_max": 2.0,
    "slip_max": 0.0012,
    "pushes": [],
}


def test_a_run_that_lacks_nothing_is_safe() -> None:
    """With the figures that say so; a kick that was withstood is told, none as well."""
    safety = judge_safety(GOOD_RUN, 0.03)
    assert safety.safe is True and safety.lacks == ()
    assert safety.words.startswith("safe: margin 0.071 m (wanted 0.030)")
    assert "no kick was tried" in safety.words
    kicked = {**GOOD_RUN, "pushes": [{"recovered": True}, {"recovered": True}]}
    assert "2 of 2 kicks withstood" in judge_safety(kicked, 0.03).words


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"outcome": "fell"}, "the goal was not reached (fell)"),
        ({"margin": {"minimum": 0.029}}, "margin 0.029 m (wanted 0.030)"),
        ({"margin": {"minimum": -9.0}}, "not borne by its feet"),
        ({"margin": {"minimum": None}}, "margin not measured"),
        ({"margin": "x"}, "margin not measured"),
        ({"time_under_three_feet": 0.05}, "0.05 s on fewer than three feet"),
        ({"nonfoot_contact_samples": 3}, "other contacts in 3 samples"),
        ({"nonfoot_contact_time": 0.004}, "other contacts for 0.004 s"),
        ({"nonfoot_contact_time": None}, "contacts not measured"),
        (
            {"swing_hit_samples": 2, "swing_force_max": 218.4},
            "swing feet hit something with 218 N",
        ),
        ({"swing_hit_samples": None}, "what swing feet touch not measured"),
        ({"slip_max": 0.0111}, "slip 11.1 mm (at most 10)"),
        ({"slip_max": True}, "slip not measured"),
        ({"speed_ratio_max": 1.08}, "a joint turned at 108% of its speed limit"),
        ({"pushes": [{"recovered": True}, {"recovered": False}]}, "1 of 2 kicks withstood"),
        ({"pushes": [{"recovered": True}, {}]}, "1 of 2 kicks withstood"),
    ],
)
def test_each_lack_alone_makes_a_run_unsafe(change: dict[str, Any], word: str) -> None:
    """Reached or not: it is named, and nothing else is."""
    safety = judge_safety({**GOOD_RUN, **change}, 0.03)
    assert safety.safe is False and len(safety.lacks) == 1
    assert safety.lacks[0].startswith(word) and safety.words == f"not safe: {safety.lacks[0]}"


def test_a_margin_is_told_in_metres_or_as_no_foot() -> None:
    """Less than none by a rounding error is told as none, and what stands for no foot in words."""
    told = [margin_words(m) for m in (0.0712, -5e-11, -0.0126, -9.0)]
    assert told == ["0.071 m", "0.000 m", "-0.013 m", "not borne by its feet"]


def test_a_kick_that_never_came_is_not_held_against_a_run() -> None:
    """It is told, and the others decide."""
    later = {"recovered": None}
    none = judge_safety({**GOOD_RUN, "pushes": [later]}, 0.03)
    assert none.safe is True and "1 of 1 kicks never came" in none.words
    assert "withstood" not in none.words and "tried" not in none.words
    one = judge_safety({**GOOD_RUN, "pushes": [{"recovered": True}, later]}, 0.03)
    assert one.safe is True and "1 of 1 kicks withstood, 1 of 2 kicks never came" in one.words
    lost = judge_safety({**GOOD_RUN, "pushes": [{"recovered": False}, later]}, 0.03)
    assert lost.lacks == ("0 of 1 kicks withstood",)


def test_a_replay_without_physics_proves_nothing() -> None:
    """Whatever its figures."""
    safety = judge_safety({**GOOD_RUN, "simulation": "kinematic"}, 0.03)
    assert safety.safe is None and "kinematic" in safety.words


def test_the_threshold_goes_with_the_leg_and_is_one() -> None:
    """Half of what is wanted on paper; below it the replay is amber, below 0 red."""
    robot = paper_robot()
    safe = safe_margin(robot)
    assert safe == pytest.approx(0.0304, abs=1e-4)
    assert targets_for(robot).margin == 2.0 * safe == 0.05 * leg_length(robot)
    small = replace(robot, geometry=replace(robot.geometry, thigh=0.5 * robot.geometry.thigh,
                                            shank=0.5 * robot.geometry.shank))  # fmt: skip
    assert safe_margin(small) == pytest.approx(0.5 * safe)
    colours = [margin_colour(m, safe) for m in (safe, 0.999 * safe, 0.0, -1e-9)]
    assert colours == [GOOD, WARN, WARN, BAD]


def test_the_console_tells_it_by_the_summary_alone() -> None:
    """By the threshold that the summary has; of an older run's, which has none, nothing."""
    told = {**GOOD_RUN, "safety": {"margin_wanted": 0.08}}
    assert safety_line(told).startswith("not safe: margin 0.071 m (wanted 0.080)")
    assert safety_line(GOOD_RUN) == "" == safety_line({**GOOD_RUN, "safety": "x"})
