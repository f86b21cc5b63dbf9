"""`drake-quad check --changes`: the least change of a robot or of stairs that makes it a yes."""

import io
from typing import Any

import pytest
from design_rig import RUN, asked
from hypothesis import given, strategies as st
from rich.console import Console
from rig import URL, paper_robot

import drake_quad as dq
from drake_quad.cli.check_answer import print_next
from drake_quad.errors import InputError
from drake_quad.feasibility import work_out
from drake_quad.feasibility.changes import (
    KINDS_OF_CHANGE,
    Case,
    Change,
    find_change,
    kinds_for,
    least_amount,
)
from drake_quad.feasibility.check import check_flight
from drake_quad.feasibility.check_request import CheckRequest, run_check
from drake_quad.feasibility.result import Feasibility
from drake_quad.robot.variants import with_torque
from drake_quad.terrain.elements import RUN_MAX, Stairs

KINDS = sorted(KINDS_OF_CHANGE)


@pytest.mark.parametrize("name", KINDS)
@given(share=st.floats(0.001, 1.2))
def test_the_least_amount_is_found_to_the_finest_step(name: str, share: float) -> None:
    """It works, less by two of the finest steps does not, and it takes few trials."""
    kind, tried = KINDS_OF_CHANGE[name], []
    border = share * kind.amounts[-1]

    def works(amount: float) -> bool:
        tried.append(amount)
        return amount >= border

    least = least_amount(works, kind)
    assert len(tried) <= 12 and all(0.0 < amount <= kind.amounts[-1] for amount in tried)
    if border > kind.amounts[-1]:
        assert least is None
    else:
        assert least is not None and least >= border
        assert least - 2.0 * kind.fine < border or least == kind.fine


def test_what_can_only_help_is_given_up_after_one_trial() -> None:
    """If the most of it is not enough, less of it is not tried."""
    tried: list[float] = []
    kind = KINDS_OF_CHANGE["torque"]
    assert least_amount(lambda amount: tried.append(amount) or False, kind) is None  # type: ignore[func-returns-value]
    assert tried == [kind.amounts[-1]]


def test_a_change_is_planned_on_the_whole_flight_in_the_end() -> None:
    """Short flights are tried first; if the whole one wants more, a little more is given."""
    case, counts = Case(paper_robot(), Stairs(0.2, RUN, 9)), []

    def climbs(changed: Case) -> float | None:
        counts.append(changed.stairs.count)
        enough = 0.12 if changed.stairs.count == 9 else 0.14
        return 0.03 if changed.stairs.rise <= enough else None

    found = find_change(climbs, case, "rise")
    assert set(counts[:-1]) <= {4, 9} and counts[-1] == 9 and counts.count(9) == MOST_TRIALS
    assert found.after is None and found.margin is None  # 0.14 and two finest steps less: too high

    def less(changed: Case) -> float | None:
        enough = 0.135 if changed.stairs.count == 9 else 0.14
        return 0.03 if changed.stairs.rise <= enough else None

    found = find_change(less, case, "rise")
    assert found.before == 0.2 and found.margin == 0.03
    assert found.after is not None and 0.13 <= found.after <= 0.135
    assert found.share == pytest.approx(found.after / 0.2 - 1.0)


MOST_TRIALS = 3  # of the whole flight: the least amount, and two finest steps more


def test_a_landing_is_changed_only_if_it_was_given() -> None:
    """By default it is as long as the robot needs; treads end where stairs do."""
    robot = paper_robot()
    assert "landing" not in kinds_for(Case(robot, Stairs(0.2, RUN, 4)))
    assert "landing" in kinds_for(Case(robot, Stairs(0.2, RUN, 4), landing=1.0))
    assert "run" not in kinds_for(Case(robot, Stairs(0.2, RUN_MAX, 4)))


@pytest.mark.long
def test_a_robot_too_weak_for_stairs_is_told_the_torque_that_is_enough() -> None:
    """With a tenth less than that the planner finds nothing, with that it finds a plan."""
    strong, stairs = paper_robot(), Stairs(0.15, 0.32, 2)
    weak = with_torque(strong, 0.3)

    def climbs(case: Case) -> float | None:
        return check_flight(
            URL, case.stairs, nearest=False, thorough=False, robot=case.robot
        ).margin  # fmt: skip

    case = Case(weak, stairs)
    assert climbs(case) is None
    found = find_change(climbs, case, "torque")
    assert found.after is not None and found.margin is not None and found.share is not None
    assert climbs(Case(with_torque(weak, 1.0 + found.share), stairs)) == found.margin
    assert climbs(Case(with_torque(weak, 0.9 * (1.0 + found.share)), stairs)) is None


TOLD = [
    Change("legs", "length of the legs (thigh and shank)", "m", 1.22, 1.281, 1.708, 0.031),
    Change("torque", "torque of all joints (here the knees')", "Nm", 300.0, None, 900.0, None),
]


def test_the_command_tells_the_changes_instead_of_the_nearest_stairs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A row each, with what was tried in vain; JSON has the same figures."""
    monkeypatch.setattr(Feasibility, "changes", lambda *_, **__: TOLD)
    monkeypatch.setattr(Feasibility, "nearest", lambda *_, **__: pytest.fail("sought"))
    monkeypatch.setattr(work_out, "check_flight", asked)
    told: dict[str, Any] = run_check(CheckRequest(URL, rise=1.9, run=RUN), changes=True)
    kinds = [one["kind"] for one in told["changes"]]
    assert told["nearest"] is None and kinds == ["legs", "torque"]
    assert told["changes"][0]["share"] == pytest.approx(0.05)
    console = Console(file=io.StringIO(), width=150)
    print_next(told, console)
    printed = console.file.getvalue()  # type: ignore[attr-defined]
    for words in ("1.220 m", "1.281 m", "+5 %", "31 mm", "no plan up to 900.0 Nm"):
        assert words in printed
    assert "--changes" not in printed
    print_next({**told, "changes": None}, console)
    assert "the same with --changes" in console.file.getvalue()  # type: ignore[attr-defined]


def test_changes_are_of_a_flight_and_not_of_a_scenarios_course() -> None:
    """The option is refused before any work, in a line that says what to do."""
    with pytest.raises(InputError, match="leave it out"):
        run_check(CheckRequest(URL, scenario="case_study"), changes=True)


def test_a_yes_needs_no_change() -> None:
    """Nothing is sought where there is a plan, or no flight was asked about."""
    yes = dq.check_stairs(paper_robot().source or URL, Stairs(0.1, 0.4, 1), thorough=False)
    assert yes.feasible and yes.changes() == []
