"""The body's program keeps what it claims: margins, guard, sway, rest at both ends, symmetry."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.schedule import wave_schedule
from drake_quad.gait.swing import Swing
from drake_quad.gait.workspace import Workspace, wave_desired_configuration
from drake_quad.math.curves import BodySpline
from drake_quad.planning import body_qp
from drake_quad.planning.body_problem import BodyProblem
from drake_quad.planning.body_qp import BodySolution, solve_body
from drake_quad.planning.contact_plan import ContactPlan, Step, sample_times
from drake_quad.robot.legs import Leg
from drake_quad.stability.support_polygon import stability_margins

TABLE_I = Workspace(R_x=0.76, R_y=0.5, P_x=0.8, P_y=0.54)
STRIDE, CYCLE, CYCLES, WAIT = 1.0, 8.0, 2, 2.0  # the paper's speed: 1 m in 8 s
NO_LIMIT = 10.0  # [m]
SOLVER = 1e-4  # [m] of what the solver's tolerance leaves


def wave_contacts(beta: float) -> ContactPlan:
    """Two cycles of the paper's wave along W's x, from and to a stand on four feet."""
    table = wave_schedule(duty_factor=beta, cycle_time=CYCLE)
    places = wave_desired_configuration(TABLE_I, stroke=STRIDE * beta, duty_factor=beta)
    feet = np.column_stack([places, np.zeros(4)])
    start, steps = feet.copy(), []
    for cycle in range(CYCLES):
        for leg, lift_off, touchdown in table.swing_intervals():
            to, t = feet[leg.row] + [STRIDE, 0.0, 0.0], WAIT + cycle * CYCLE
            duration = touchdown - lift_off
            swing = Swing(feet[leg.row], to, duration, 0.5 * duration, 0.05)
            steps.append(Step(leg, t + lift_off, t + touchdown, swing))
            feet[leg.row] = to
    return ContactPlan(start, tuple(steps), 2 * WAIT + CYCLES * CYCLE)


def massless(beta: float, **changes: object) -> BodyProblem:
    """The program of a robot with massless legs, whose centre of mass is the body's centre."""
    contacts = wave_contacts(beta)
    times = sample_times(contacts)
    n, end = len(times), WAIT + CYCLES * CYCLE
    x = np.interp(times, [0.0, WAIT, end, end + WAIT], [0.0, 0.0, CYCLES * STRIDE, CYCLES * STRIDE])
    problem = BodyProblem(
        contacts=contacts,
        times=times,
        nominal=np.column_stack([x, np.zeros(n)]),
        heading=np.tile([1.0, 0.0], (n, 1)),
        com_gain=np.ones(2),
        com_offset=np.zeros((n, 2)),
        com_offset_acceleration=np.zeros((n, 2)),
        com_height=np.full(n, 0.8),
        reach_centres=TABLE_I.centres,
        reach=np.full(2, NO_LIMIT),
        max_ahead=10.0,
        max_shift=0.1,
        margin_desired=1.0,
        zmp_margin_desired=1.0,
        guard=0.0,
    )
    return replace(problem, **changes)  # type: ignore[arg-type]


@cache
def solved(beta: float) -> tuple[BodyProblem, BodySolution]:
    problem = massless(beta)
    return problem, solve_body(problem)


def path_of(problem: BodyProblem, solution: BodySolution) -> BodySpline:
    rest = np.zeros((len(solution.control), 3))
    return BodySpline(problem.knot, np.column_stack([solution.control, rest]))


def margins(
    problem: BodyProblem, solution: BodySolution, times: FloatArray, *, lean: float = 0.0
) -> FloatArray:
    """Margins of c - lean c̈ over the feet that stand at `times`."""
    body = path_of(problem, solution).samples(times)[:, :, :2]
    offset = np.stack([np.interp(times, problem.times, o) for o in problem.com_offset.T], axis=-1)
    com = problem.com_gain * (body[:, 0] - lean * body[:, 2]) + offset
    feet, standing = problem.contacts.feet_at(times)
    return stability_margins(com, feet[..., :2], standing)


def dense(problem: BodyProblem) -> FloatArray:
    return np.linspace(0.0, problem.contacts.duration, 4000)


@pytest.mark.parametrize("beta", [0.80, 0.85, 0.90])
def test_margin_claimed_is_kept_at_the_samples_and_all_but_kept_between(beta: float) -> None:
    """At the sampled times the margin is what the program says, between them 2 mm less at most."""
    problem, solution = solved(beta)
    at_samples = margins(problem, solution, problem.times)
    assert at_samples.min() == pytest.approx(solution.margin, abs=SOLVER)
    assert margins(problem, solution, dense(problem)).min() >= solution.margin - 2e-3


@pytest.mark.parametrize("beta", [0.80, 0.85, 0.90])
def test_zero_moment_points_margin_is_kept_at_the_samples(beta: float) -> None:
    """The zero-moment point c - h/g c̈ of what is planned stays as far inside as is said."""
    problem, solution = solved(beta)
    lean = float(problem.com_height[0]) / GRAVITY
    found = margins(problem, solution, problem.times, lean=lean)
    assert found.min() >= solution.zmp_margin - 10 * SOLVER


def test_no_path_keeps_a_margin_at_a_duty_factor_of_three_quarters() -> None:
    """At β = 0.75 the zero is inherent: two triangles that follow share a diagonal alone."""
    problem, solution = solved(0.75)
    assert solution.margin == pytest.approx(0.0, abs=SOLVER)
    assert np.abs(margins(problem, solution, problem.times).min()) <= 10 * SOLVER


@pytest.mark.parametrize(("beta", "best"), [(0.80, 0.06), (0.85, 0.10), (0.90, 0.116)])
def test_sway_of_a_hand_gives_the_margin_that_sway_alone_can_and_more(
    beta: float, best: float
) -> None:
    """With 0.1 m of sway, and a body free to hurry and tarry, it beats the best of sway alone."""
    problem, solution = solved(beta)
    y = path_of(problem, solution).samples(dense(problem))[:, 0, 1]
    assert np.abs(y).max() <= 0.1 + 2e-3
    assert solution.margin >= best


def test_room_to_sway_gives_margin() -> None:
    """Each 5 cm that the body may go to the sides give the wave at β = 0.8 a centimetre or more."""
    still, little, more = (
        solve_body(massless(0.80, max_shift=shift, zmp_margin_desired=-NO_LIMIT)).margin
        for shift in (0.0, 0.05, 0.1)
    )
    assert still + 0.01 < little and little + 0.01 < more


def test_no_more_margin_is_asked_for_than_desired() -> None:
    """With enough of it the program spends what is left on a calmer path."""
    _, best = solved(0.85)
    problem = massless(0.85, margin_desired=0.05, zmp_margin_desired=0.05)
    enough = solve_body(problem)
    assert enough.margin == pytest.approx(0.05, abs=SOLVER)

    def effort(solution: BodySolution) -> float:
        return float(np.sum(path_of(problem, solution).samples(dense(problem))[:, 2] ** 2))

    assert effort(enough) < effort(best)


@pytest.mark.parametrize("beta", [0.75, 0.85])
def test_path_is_at_rest_at_both_ends_and_where_it_was_told_to_be(beta: float) -> None:
    """It begins and ends in its nominal places, without velocity or acceleration."""
    problem, solution = solved(beta)
    path = path_of(problem, solution)
    for t, place in ((0.0, problem.nominal[0]), (problem.contacts.duration, problem.nominal[-1])):
        sample = path.sample(t)[:, :2]
        np.testing.assert_allclose(sample[0], place, atol=1e-4)
        np.testing.assert_allclose(sample[1:], 0.0, atol=1e-3)


def test_path_jumps_in_nothing_up_to_the_acceleration() -> None:
    """The acceleration changes no faster than its greatest slope allows, and stays moderate."""
    problem, solution = solved(0.85)
    times = dense(problem)
    acceleration = path_of(problem, solution).samples(times)[:, 2, :2]
    steps = np.abs(np.diff(acceleration, axis=0)).max()
    slope = np.abs(np.diff(solution.control, n=3, axis=0)).max() / problem.knot**3
    assert steps <= slope * (times[1] - times[0]) + 1e-9
    assert np.abs(acceleration).max() < 1.0


def test_guard_keeps_the_margin_before_lift_off_and_after_touchdown() -> None:
    """Three feet hold the robot already `guard` before the fourth lifts, and still after."""
    guard = 0.15
    problem = massless(0.85, guard=guard)
    solution = solve_body(problem)
    body = path_of(problem, solution)

    def worst(solution_margin: float, extra: float) -> float:
        found = []
        for phase in problem.contacts.phases:
            if phase.step is None:
                continue
            t = problem.times
            t = t[(t >= phase.start - extra - 1e-9) & (t <= phase.end + extra + 1e-9)]
            xy = body.samples(t)[:, 0, :2]
            feet = np.tile(phase.feet[:, :2], (len(t), 1, 1))
            found.append(stability_margins(xy, feet, np.tile(phase.standing, (len(t), 1))).min())
        return float(min(found)) - solution_margin

    assert worst(solution.margin, guard) == pytest.approx(0.0, abs=SOLVER)
    assert solution.margin <= solved(0.85)[1].margin + SOLVER


def test_legs_mass_is_taken_into_account() -> None:
    """Margins hold for a centre of mass that moves less than the body, and apart from it."""
    base = massless(0.85)
    wobble = 0.03 * np.sin(2 * np.pi * base.times / CYCLE)
    offset = np.column_stack([wobble, 0.02 - wobble]) + 0.3 * base.nominal
    acceleration = np.gradient(np.gradient(offset, base.times, axis=0), base.times, axis=0)
    problem = replace(
        base,
        com_gain=np.array([0.7, 0.65]),
        com_offset=offset,
        com_offset_acceleration=np.clip(acceleration, -0.1, 0.1),
    )
    solution = solve_body(problem)
    assert solution.margin > 0.05
    found = margins(problem, solution, problem.times)
    assert found.min() == pytest.approx(solution.margin, abs=SOLVER)


def mirrored(contacts: ContactPlan) -> ContactPlan:
    """The same steps seen in a mirror: left and right exchanged."""
    flip, rows = np.array([1.0, -1.0, 1.0]), [1, 0, 3, 2]
    steps = []
    for step in contacts.steps:
        s = step.swing
        swing = Swing(s.p_start * flip, s.p_end * flip, s.duration, s.apex_time, s.apex_z)
        steps.append(Step(Leg(step.leg.mirrored), step.lift_off, step.touchdown, swing))
    return ContactPlan(contacts.feet[rows] * flip, tuple(steps), contacts.duration)


def test_mirrored_steps_give_the_mirrored_path() -> None:
    """Left and right are alike."""
    problem, solution = solved(0.85)
    other = solve_body(replace(problem, contacts=mirrored(problem.contacts)))
    assert other.margin == pytest.approx(solution.margin, abs=SOLVER)
    np.testing.assert_allclose(other.control, solution.control * [1.0, -1.0], atol=1e-2)


def test_turned_course_gives_the_turned_path() -> None:
    """No direction of the world is special."""
    problem, solution = solved(0.85)
    R = np.array([[0.6, -0.8], [0.8, 0.6]])
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    steps = tuple(
        Step(s.leg, s.lift_off, s.touchdown,
             Swing(turn @ s.swing.p_start, turn @ s.swing.p_end, s.swing.duration,
                   s.swing.apex_time, s.swing.apex_z))
        for s in problem.contacts.steps
    )  # fmt: skip
    contacts = ContactPlan(problem.contacts.feet @ turn.T, steps, problem.contacts.duration)
    other = solve_body(
        replace(
            problem,
            contacts=contacts,
            nominal=problem.nominal @ R.T,
            heading=problem.heading @ R.T,
        )
    )
    assert other.margin == pytest.approx(solution.margin, abs=SOLVER)
    np.testing.assert_allclose(other.control, solution.control @ R.T, atol=1e-2)


def test_feet_in_one_line_have_no_path() -> None:
    """A support polygon without an inside is refused, with the reason."""
    problem = massless(0.85)
    feet = np.column_stack([[0.5, 0.2, -0.2, -0.5], np.zeros(4), np.zeros(4)])
    contacts = ContactPlan(feet, (), problem.contacts.duration)
    with pytest.raises(PlanningError, match="one line"):
        solve_body(replace(problem, contacts=contacts))


@pytest.mark.parametrize("beta", [0.75, 0.85])
def test_few_rows_give_the_path_that_all_rows_give(
    beta: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What comes in round by round, or is begun with, makes no difference to what is found."""
    problem, solution = solved(beta)
    again = solve_body(problem, start=solution)
    other = solve_body(problem, start=solve_body(massless(0.9)))
    monkeypatch.setattr(body_qp, "NEAR", np.inf)
    whole = solve_body(problem, start=solution)
    for found in (solution, again, other):
        assert found.margin == pytest.approx(whole.margin, abs=1e-6)
        np.testing.assert_allclose(found.control, whole.control, atol=1e-4)


@pytest.mark.parametrize("beta", [0.75, 0.85])
def test_a_tighter_solution_has_no_more_margin(
    beta: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the solver stops, less than a micrometre of margin is left to find."""
    problem, solution = solved(beta)
    monkeypatch.setattr(body_qp, "DUALITY_GAP", 1e-11)
    assert solution.margin == pytest.approx(solve_body(problem).margin, abs=1e-6)
