"""The body's path over a contact plan: its margin, ends, height, reach and speed."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from rig import flat_course, paper_robot, rotations, stairs_course, stance_at, walk_plan

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.workspace import Workspace
from drake_quad.math.curves import BodySpline
from drake_quad.planning import plan_body as body_search, task as task_module
from drake_quad.planning.body_reference import BodyReference, body_pitch, level_pose, robot_stance
from drake_quad.planning.contact_plan import ContactPlan, sample_times
from drake_quad.planning.motion_plan import MotionPlan, pose_robot
from drake_quad.planning.plan_body import plan_body
from drake_quad.planning.problem import PlanSettings, Task
from drake_quad.planning.task import plan_task
from drake_quad.planning.walk_footsteps import plan_walk_footsteps
from drake_quad.planning.zmp import sample_zmp
from drake_quad.stability.support_polygon import stability_margins

SETTINGS = PlanSettings()
UNIFORM = PlanSettings(uniform_body=True)
SLOPED = PlanSettings(pitch_along_slope=0.7)
# 1 m in 2 s: too quick for the centre of mass to be over three feet at every switch.
QUICK = PlanSettings(
    dynamic=True, duty_factor=0.76, cycle_time=1.88, switch_wait=0.06, body_height=0.88
)
PAPERS_GAIT = PlanSettings(
    duty_factor=0.75,
    workspace=Workspace(R_x=0.76, R_y=0.5, P_x=0.8, P_y=0.54),
    stance_stagger=0.0,
    on_centre=False,
)


@cache
def laid(settings: PlanSettings) -> tuple[ContactPlan, BodyReference]:
    """Steps and route of a walk over three stairs."""
    course = stairs_course()
    task = Task(kind="walk", name="walk", lane=0, goal=6.25)
    contacts, route, _ = plan_walk_footsteps(
        paper_robot(), course, settings, task, stance_at(course, settings)
    )
    return contacts, route


@cache
def rolled(settings: PlanSettings) -> tuple[BodySpline, ContactPlan, float]:
    return plan_body(paper_robot(), *laid(settings), settings)


def planned(settings: PlanSettings) -> tuple[BodySpline, float]:
    path, _, margin = rolled(settings)
    return path, margin


def margins(settings: PlanSettings, times: FloatArray) -> FloatArray:
    """Of the whole robot's centre of mass."""
    _, contacts, _ = rolled(settings)
    feet, standing = contacts.feet_at(times)
    _, _, com = pose_robot(paper_robot(), planned(settings)[0].samples(times)[:, 0], feet)
    return stability_margins(com[:, :2], feet[..., :2], standing)


def dense(settings: PlanSettings, count: int = 4000) -> FloatArray:
    return np.linspace(0.0, laid(settings)[0].duration, count)


@pytest.mark.parametrize("settings", [SETTINGS, SLOPED], ids=["level", "slope"])
def test_margin_is_what_is_said_at_the_samples_and_all_but_that_between(
    settings: PlanSettings,
) -> None:
    """The whole robot, legs and all, keeps the margin returned, but for 3 mm between samples."""
    _, margin = planned(settings)
    times = sample_times(laid(settings)[0])
    assert margins(settings, times).min() == pytest.approx(margin, abs=1e-9)
    assert margins(settings, dense(settings)).min() >= margin - 3e-3
    assert margin > 0.05


@pytest.mark.parametrize("settings", [SETTINGS, SLOPED, UNIFORM], ids=["level", "slope", "uniform"])
def test_path_leads_from_the_routes_start_to_its_end(settings: PlanSettings) -> None:
    """It begins and ends there, level with the route's yaw, and at rest."""
    contacts, route = laid(settings)
    path, _ = planned(settings)
    for t, k in ((0.0, 0), (contacts.duration, -1)):
        sample = path.sample(t)
        np.testing.assert_allclose(sample[0, :2], route.xy[k], atol=2e-3)
        assert sample[0, 4] == pytest.approx(route.yaw[k], abs=1e-6)
        np.testing.assert_allclose(sample[1], 0.0, atol=5e-3)


@pytest.mark.parametrize("settings", [SETTINGS, SLOPED, UNIFORM], ids=["level", "slope", "uniform"])
def test_body_is_at_its_height_over_the_ground_it_is_over(settings: PlanSettings) -> None:
    """Its z is the mean ground's plus the body's height; it pitches only if asked to."""
    _, route = laid(settings)
    body = planned(settings)[0].samples(dense(settings, 500))[:, 0]
    height, slope = route.ground(body[:, :2])
    # The spline rounds the corners that the ground's line has over every nosing.
    np.testing.assert_allclose(body[:, 2], height + settings.body_height, atol=0.01)
    expected = -settings.pitch_along_slope * np.arctan(slope)
    np.testing.assert_allclose(body[:, 3], expected, atol=0.03)
    if settings.pitch_along_slope:
        assert body[:, 3].min() < -0.15  # nose up while it climbs


def test_uniform_path_is_the_route_itself() -> None:
    """The paper's body runs at constant speed, starts and stops at once, and does not sway."""
    _, route = laid(UNIFORM)
    times = dense(UNIFORM, 800)
    xy, yaw = route.at(times)
    body = planned(UNIFORM)[0].samples(times)[:, 0]
    np.testing.assert_allclose(body[:, :2], xy, atol=2e-3)
    np.testing.assert_allclose(body[:, 4], yaw, atol=1e-6)
    speed = np.hypot(*planned(UNIFORM)[0].samples(times)[:, 1, :2].T)
    moving = speed > 0.01
    assert speed[moving].max() < 1.05 * SETTINGS.stride / SETTINGS.cycle_time


def test_optimised_path_has_more_margin_than_the_uniform_one() -> None:
    """That is what it is for."""
    assert planned(SETTINGS)[1] > planned(UNIFORM)[1] + 0.03


def test_standing_feet_stay_in_their_boxes_if_the_stroke_leaves_room() -> None:
    """Seen from the body, each is in its workspace, widened by the stagger."""
    settings = PlanSettings(stride=0.8)  # a stroke of 0.68 m in boxes of 0.8 m
    plan = walk_plan(flat_course(8.0), goal=5.75, settings=settings)
    times = sample_times(plan.contacts)
    body = plan.body.samples(times)[:, 0]
    feet, standing = plan.contacts.feet_at(times)
    p_BF = np.einsum("nij,nki->nkj", rotations(body), feet - body[:, None, :3])[..., :2]
    box = settings.workspace
    half = 0.5 * np.array([box.R_x, box.R_y + settings.stance_stagger])
    over = np.abs(p_BF - box.centres) - half
    assert over[standing].max() <= 2e-3


def test_body_stays_within_its_shift_of_the_route() -> None:
    """Across the heading it is never further from its nominal place than `max_shift`."""
    _, route = laid(SETTINGS)
    times = dense(SETTINGS)
    xy, _ = route.at(times)
    aside = planned(SETTINGS)[0].samples(times)[:, 0, 1] - xy[:, 1]
    assert np.abs(aside).max() <= SETTINGS.max_shift + 5e-3


def test_sample_times_hold_an_even_grid_and_every_switch() -> None:
    """Sorted, no further apart than asked, with each lift-off and touchdown among them."""
    contacts, _ = laid(SETTINGS)
    times = sample_times(contacts, 0.1)
    assert times[0] == 0.0 and times[-1] == pytest.approx(contacts.duration)
    assert np.all(np.diff(times) > 0.0) and np.diff(times).max() <= 0.1 + 1e-9
    for step in contacts.steps:
        for t in (step.lift_off, step.touchdown):
            assert np.abs(times - t).min() < 1e-8


@pytest.mark.parametrize("stagger", [0.0, 0.12, -0.1])
def test_stagger_sets_front_and_rear_feet_apart_and_keeps_the_mean_width(stagger: float) -> None:
    """Rear feet stand further out by the stagger; the stance stays symmetric."""
    settings = PlanSettings(
        stance_stagger=stagger, workspace=Workspace(R_x=0.8, R_y=0.5, P_x=0.75, P_y=0.54)
    )
    feet = robot_stance(settings)
    np.testing.assert_allclose(feet[[0, 2]], feet[[1, 3]] * [1.0, -1.0])
    width = np.abs(feet[:, 1])
    np.testing.assert_allclose(width[2:] - width[:2], stagger)
    assert width.mean() == pytest.approx(0.27)
    np.testing.assert_allclose(np.abs(feet[:, 0]), 0.375)


def test_level_pose_is_upright_at_the_bodys_height() -> None:
    """x, y, z, pitch, yaw of a body at rest."""
    pose = level_pose(np.array([1.0, -2.0]), 0.3, 0.78, SETTINGS)
    np.testing.assert_allclose(pose, [1.0, -2.0, 0.78 + SETTINGS.body_height, 0.0, 0.3])


def test_dynamic_path_keeps_the_zero_moment_point_inside_at_any_instant() -> None:
    """Sampled five times as densely as it was planned, within 5 mm of the margin returned."""
    path, contacts, margin = rolled(QUICK)
    assert margin > 0.05
    zmp = sample_zmp(paper_robot(), contacts, path, 0.002)
    assert zmp.margin.min() > margin - 5e-3


def test_dynamic_path_lets_the_centre_of_mass_leave_the_feet() -> None:
    """That is what it gives up for the speed, and a static one of the same gait does not."""
    static = replace(QUICK, dynamic=False)
    assert margins(QUICK, dense(QUICK)).min() < 0.0
    path, contacts, _ = rolled(static)
    assert margins(static, dense(static)).min() > margins(QUICK, dense(QUICK)).min()
    quick = sample_zmp(paper_robot(), rolled(QUICK)[1], planned(QUICK)[0], 0.005).margin.min()
    assert sample_zmp(paper_robot(), contacts, path, 0.005).margin.min() < quick


def wave_margins(settings: PlanSettings) -> tuple[FloatArray, FloatArray]:
    """Static margins in the wave, and the time from the nearest diagonal switch [s]."""
    contacts, _ = laid(settings)
    times = dense(settings)
    steps = contacts.steps[4:]  # after the transition
    switches = np.array([s.lift_off - 0.5 * settings.switch_wait for s in steps[1::2]])
    apart = np.abs(times[:, None] - switches).min(axis=1)
    within = (times > steps[0].lift_off) & (times < steps[-1].touchdown)
    return margins(settings, times)[within], apart[within]


def test_without_a_wait_the_papers_gait_has_no_margin_at_the_diagonal_switches() -> None:
    """The path exists, its margin is zero there, and positive a moment before and after."""
    margin, apart = wave_margins(PAPERS_GAIT)
    assert margin[apart < 0.01].max() < 5e-3
    assert margin.min() > -1e-3
    assert margin[apart > 0.3].min() > 0.02


def test_margin_of_the_papers_gait_grows_with_its_waits() -> None:
    """None to 8 cm in a second on four feet at the two switches of a cycle."""
    least = [
        wave_margins(replace(PAPERS_GAIT, switch_wait=wait))[0].min()
        for wait in (0.0, 0.3, 0.6, 1.0)
    ]
    assert np.all(np.diff(least) > 5e-3)
    assert least[2] > 0.06


@pytest.mark.parametrize("slope", [-2.0, -0.3, 0.0, 0.3, 2.0])
@pytest.mark.parametrize("share", [0.0, 0.8, 1.2])
def test_body_tilts_with_the_slope_but_never_as_far_as_a_robot_that_has_fallen(
    slope: float, share: float
) -> None:
    """Nose up where the ground rises; what stops a run as fallen is at 40°."""
    pitch = float(body_pitch(share, slope))
    assert abs(pitch) <= min(share * abs(np.arctan(slope)), np.radians(40.0) - 0.05) + 1e-12
    assert pitch == -float(body_pitch(share, -slope)) and pitch * slope <= 0.0
    if abs(slope) < 0.5:
        assert pitch == pytest.approx(-share * np.arctan(slope))


def test_a_path_that_cannot_beat_another_is_left_before_limits_are_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What takes longest is spared; a path that may be better is the same as without."""
    path, margin = planned(SETTINGS)
    again, _, same = plan_body(paper_robot(), *laid(SETTINGS), SETTINGS, beat=margin - 0.01)
    assert same == margin and np.array_equal(again.control, path.control)
    monkeypatch.setattr(body_search, "keep_limits", lambda *_: pytest.fail("limits were looked at"))
    with pytest.raises(PlanningError, match="another path has a margin of"):
        plan_body(paper_robot(), *laid(SETTINGS), SETTINGS, beat=margin + 0.01)


@pytest.mark.parametrize("better", [True, False, None])
def test_a_walk_through_the_centres_is_taken_only_if_it_is_better(
    better: bool | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a plan there, the one that there is stays."""
    course = stairs_course()
    plan, asked = walk_plan(flat_course(), goal=2.0), list[tuple[bool, float | None]]()

    def plan_gait(*given: Any, beat: float | None = None, **_: object) -> MotionPlan:
        asked.append((given[1].via_centres, beat))
        if not given[1].via_centres:
            return plan
        if better is None:
            raise PlanningError("no plan")
        return replace(plan, margin=plan.margin + (0.01 if better else -0.01))

    monkeypatch.setattr(task_module, "_plan_gait", plan_gait)
    monkeypatch.setattr(task_module, "MARGIN_ENOUGH", np.inf)
    monkeypatch.setattr(task_module, "_held_up_first", lambda *_: True)
    monkeypatch.setattr(task_module, "_same_steps", lambda *_: False)
    walk = Task(kind="walk", name="walk", lane=0, goal=6.25)
    found = plan_task(paper_robot(), course, SETTINGS, walk, stance_at(course, SETTINGS), index=0)
    assert found.margin == plan.margin + (0.01 if better else 0.0)
    assert asked[-1] == (True, plan.margin)
