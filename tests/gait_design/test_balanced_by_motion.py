"""Gaits that are balanced by their motion: what is asked of them, and what is said of them."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from design_rig import COUNT, RUN, designed, found
from rig import URL, paper_robot

from drake_quad.cli.check_answer import certificate_words
from drake_quad.errors import InputError
from drake_quad.feasibility import check_report
from drake_quad.feasibility.check import check_flight, check_preference
from drake_quad.feasibility.check_picture import draw_check
from drake_quad.feasibility.check_report import feasibility_report
from drake_quad.feasibility.result import Feasibility
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.preference import (
    KEPT,
    GaitPreference,
    RequiredMargins,
    required_margins,
)
from drake_quad.gait_design.quicken import quicken
from drake_quad.gait_design.tempo import (
    ZMP_EVERY,
    balanced_by_motion,
    least_margin,
    least_zmp_margin,
    usual_tempo,
)
from drake_quad.planning.motion_plan import evaluate
from drake_quad.planning.zmp import sample_zmp
from drake_quad.stability.margin_kinds import FRICTION
from drake_quad.stability.safety import safe_margin
from drake_quad.stability.support_polygon import stability_margin
from drake_quad.terrain.elements import Stairs
from drake_quad.util.numbers import whole_millimetres

MOVING = GaitPreference(balance="dynamic")


@lru_cache
def moving() -> Designed:
    """The rig's gait, or what is quicker and balanced by its motion."""
    return quicken(designed(), paper_robot(), MOVING)


def test_the_zero_moment_points_margin_is_what_counts() -> None:
    """It is kept, for safety or as a share of the slow gait's, whatever the static margin."""
    robot = paper_robot()
    safe = safe_margin(robot)
    assert required_margins(MOVING, robot, 0.002, 0.08) == RequiredMargins(safe, safe)
    share = replace(MOVING, prefer="balanced")
    assert required_margins(share, robot, 0.002, 0.08) == RequiredMargins(KEPT * 0.08, KEPT * 0.08)
    given = replace(MOVING, min_margin=0.013)
    assert required_margins(given, robot, 0.08, 0.08) == RequiredMargins(0.013, 0.013)
    assert MOVING.quick and MOVING.less_margin and MOVING.steps() == (MOVING,)
    assert not GaitPreference().dynamic


def test_a_scenario_stays_as_it_was() -> None:
    """The one that is balanced by its motion is another; its feet lift as soon as they can."""
    scenario = designed().scenario
    other = balanced_by_motion(scenario)
    assert (scenario.body.balance, other.body.balance) == ("static", "dynamic")
    assert other.controller.lift_off_margin == 0.0 < scenario.controller.lift_off_margin
    robot = paper_robot()
    still = usual_tempo(scenario.gait, robot)
    assert usual_tempo(scenario.gait, robot, moving=True).switch < 0.5 * still.switch


@pytest.mark.long
def test_a_gait_balanced_by_its_motion_is_quicker_and_keeps_the_point_within_the_feet() -> None:
    """The plan's margin is that of its zero-moment point; its static margin may be negative."""
    robot, quick = paper_robot(), moving()
    assert quick.scenario.body.balance == "dynamic" and quick.plan.dynamic
    answer = Feasibility(quick.scenario, quick, "", {}, robot, preference=MOVING, slow=designed())
    assert answer.fulfilled and answer.balanced_by_motion and answer.certificate is None
    assert answer.speed is not None and answer.slow_pace is not None
    slow = answer.slow_pace.slowest
    assert slow is not None and answer.speed > 2.0 * slow.speed
    least = min(
        float(sample_zmp(robot, plan.contacts, plan.body, 0.005).margin.min())
        for plan in quick.plan.plans
        if plan.contacts.steps
    )
    assert quick.margin >= safe_margin(robot)
    assert least - 1e-3 <= quick.margin <= least  # as a foot lifts it may be a little less
    for plan in (p for p in quick.plan.plans if p.contacts.steps):
        seen = sample_zmp(robot, plan.contacts, plan.body, ZMP_EVERY)
        step = plan.contacts.steps[-1]
        at = np.array([np.interp(step.lift_off, seen.times, z) for z in seen.zmp.T])
        others = [leg for leg in range(4) if leg != step.leg.row]
        feet = plan.contacts.feet_at(np.array([step.lift_off + 1e-6]))[0][0, others, :2]
        assert least_zmp_margin(robot, plan) <= stability_margin(at, feet) + 1e-4
    bound = answer.bound
    assert bound is not None and bound.limit != "margin"


@pytest.mark.long
def test_the_answer_says_how_it_is_balanced() -> None:
    """The zero-moment point's margin in the first line; the static one beside what is left."""
    robot, quick = paper_robot(), moving()
    answer = Feasibility(quick.scenario, quick, "", {}, robot, preference=MOVING, slow=designed())
    question = {"rise": 0.12, "run": RUN, "count": COUNT}
    told = feasibility_report(answer, robot, source=URL, asked=question)
    words = f"its zero-moment point at least {whole_millimetres(quick.margin)} mm within its feet"
    assert words in told["answer"] and "static" not in told["answer"]
    assert told["plan"]["balance"] == "dynamic" and told["certificate"] is None
    assert told["pace"]["wish"]["balance"] == "dynamic"
    times = np.linspace(0.0, 1.0, 3001)
    static = min(
        min(
            float(evaluate(robot, plan, plan.duration * times).margin.min()),
            least_margin(robot, plan),
        )
        for plan in quick.plan.plans
        if plan.contacts.steps
    )
    assert told["slacks"]["margin"]["on_course"] == pytest.approx(static, abs=5e-4)
    assert static < quick.margin
    lines = " ".join(certificate_words(told))
    assert ("could not stand still" in lines) == (static < 0.0)
    figure = draw_check(quick, robot)
    assert "zero-moment" in str(figure.get_suptitle())
    assert figure.axes[-1].get_ylim()[0] <= min(1e3 * static, 0.0)
    assert "zero-moment" in answer._repr_html_()


def test_where_no_such_gait_is_found_the_answer_says_so() -> None:
    """The gait found for margin is kept, and is not what was asked for."""
    check = replace(found(), preference=MOVING)
    assert not check.fulfilled
    question = {"rise": 0.12, "run": RUN, "count": COUNT}
    told = feasibility_report(check, paper_robot(), source=URL, asked=question)
    assert told["answer"].startswith("Yes, but not balanced by motion: ")
    assert told["plan"]["balance"] == "static"


@pytest.mark.long
def test_a_speed_that_the_slow_gait_has_is_still_balanced_by_motion() -> None:
    """What is asked for is how it is balanced, too."""
    slow = designed()
    quick = quicken(slow, paper_robot(), replace(MOVING, speed=0.02))
    assert quick.plan.dynamic


def test_no_proof_about_static_gaits_answers_a_question_about_others() -> None:
    """A proof that no static gait climbs a wall says nothing of gaits balanced by their motion."""
    wall = Stairs(rise=1.3, run=0.25, count=2)
    for preference, proven in ((GaitPreference(), True), (MOVING, False)):
        answer = check_flight(URL, wall, preference=preference, nearest=False, robot=paper_robot())
        assert not answer.feasible and (answer.proof is not None) is proven


def test_a_wish_that_is_not_met_on_level_ground_is_said_so() -> None:
    """There is no speed on a flight, but the answer's first line still says so."""
    check = replace(found(), preference=MOVING)
    question = {"rise": 0.12, "run": RUN, "count": COUNT}
    told = feasibility_report(check, paper_robot(), source=URL, asked=question)
    level = told | {"pace": told["pace"] | {"speed": None}}
    assert check_report._answer(level).startswith("Yes, but not balanced by motion: ")


def test_what_does_not_go_together_is_refused() -> None:
    """One line that names the option, and what would be right."""
    for preference, margin, named in (
        (GaitPreference(balance="moving"), "hull", "--balance: balance = 'moving'"),
        (MOVING, FRICTION, f"--margin: margin = '{FRICTION}'"),
    ):
        with pytest.raises(InputError) as error:
            check_preference(preference, margin)
        assert named in str(error.value) and "give" in str(error.value)
