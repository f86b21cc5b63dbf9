"""The log of a run has the schema's columns, and says what the plan and the loggers said."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pyarrow as pa
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RollPitchYaw
from rig import (
    flat_course,
    flat_walk,
    model_layout,
    model_plant,
    paper_robot,
    rotations,
    spin_plan,
    stand_plan,
)

from drake_quad.common import FloatArray
from drake_quad.control.ports import CATCH_SIZE, SIZE, Catch, GaitPhase, Mode
from drake_quad.math.curves import BodySpline
from drake_quad.math.rotations import roll_pitch_yaw
from drake_quad.planning.motion_plan import MotionPlan, evaluate
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.log import log_table, state_names
from drake_quad.runs.planned_columns import Ground, planned_figures
from drake_quad.runs.schema import SIGNALS
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.kinematic_replay import kinematic_logs
from drake_quad.simulation.run import simulate
from drake_quad.stability.support_polygon import stability_margins

PERIOD = 0.01  # [s]


def swaying_plan() -> MotionPlan:
    """A stand whose body moves in all that it can: x, y, z, pitch and yaw at once."""
    stand = stand_plan(4.0, index=3)
    control = np.array(stand.body.control)
    sway = np.sin(np.linspace(0.0, 2 * np.pi, len(control)))[:, None]
    control += [0.0, 0.0, 0.0, 0.0, 0.2] + sway * [0.03, 0.02, 0.02, 0.06, 0.1]
    return replace(stand, body=BodySpline(stand.body.knot, control))


@cache
def plans() -> tuple[MotionPlan, ...]:
    """A stand, a walk, a spin, a sway; they need not follow one another for a log."""
    return stand_plan(0.5), flat_walk(), spin_plan(-np.pi / 4), swaying_plan()


@cache
def logs(*, massless: bool = False) -> tuple[FloatArray, dict[str, FloatArray]]:
    return kinematic_logs(paper_robot(), model_layout(), plans(), PERIOD, massless_legs=massless)


def table_of(
    times: FloatArray, found: dict[str, FloatArray], known: tuple[MotionPlan, ...]
) -> pa.Table:
    plant = model_plant()
    return log_table(
        paper_robot(),
        model_layout(),
        times=times,
        logs=found,
        plans=known,
        ground=Ground(flat_course(), 0.8),
        state_names=state_names(plant.GetPositionNames(), plant.GetVelocityNames()),
    )


@cache
def table() -> pa.Table:
    return table_of(*logs(), plans())


def column(name: str) -> np.ndarray:
    return np.asarray(table().column(name).to_numpy(zero_copy_only=False))


def columns(*names: str) -> np.ndarray:
    return np.stack([column(name) for name in names], axis=-1)


@cache
def full_table() -> pa.Table:
    """The same with all that some controllers log beside it, a number of its own in each place."""
    times, found = logs()
    n = len(times)
    more = {"state_estimated": model_layout().size, "deviation": 9, "slip_estimated": 4,
            "healthy": 1, "landmark": 4, "felt": 4, "qp_state": 2, "carried": 3, "friction": 4,
            "further_margins": 6, "nonfoot_depth": 1, "foot_depth": 4,
            "least_margins": 2, "contact_totals": 3}  # fmt: skip
    counted = {k: np.arange(n * size, dtype=float).reshape(n, size) for k, size in more.items()}
    return table_of(times, {**found, **counted}, plans())


def test_the_log_has_the_columns_of_the_schema() -> None:
    """All of them, each once, in the schema's order, where everything is logged."""
    plant = model_plant()
    names = {
        "joint": paper_robot().joint_names,
        "position": plant.GetPositionNames(),
        "velocity": plant.GetVelocityNames(),
    }
    expected = [column for signal in SIGNALS for column in signal.columns(names)]
    assert full_table().column_names == expected and len(set(expected)) == len(expected)


def test_what_is_not_estimated_or_learned_has_no_columns() -> None:
    """A controller that is told its state, and has no program, logs none of either."""
    missing = set(full_table().column_names) - set(table().column_names)
    assert {"base_estimated_yaw", "FL_felt", "qp_unsolved", "carried_force"} <= missing
    assert set(table().column_names) < set(full_table().column_names)


def test_estimates_are_taken_from_their_own_places() -> None:
    """Place and velocity are those of the estimated state; deviations are in the filter's order."""
    made, layout = full_table(), model_layout()
    k = 11

    def numbers(name: str) -> list[float]:
        return [made.column(f"{name}_{axis}")[k].as_py() for axis in "xyz"]

    first = k * layout.size
    assert numbers("base_estimated") == [first + layout.q_base + i for i in (4, 5, 6)]
    assert numbers("v_estimated") == [first + layout.v_base + i for i in (3, 4, 5)]
    for part, name in enumerate(("turn", "v", "base")):
        assert numbers(f"deviation_{name}") == [9 * k + 3 * part + i for i in range(3)]
    assert made.column("qp_unsolved")[k].as_py() == 2 * k
    assert made.column("carried_moment_y")[k].as_py() == 3 * k + 2
    assert made.column("RL_friction_estimated")[k].as_py() == 4 * k + 2


@pytest.mark.parametrize("scale", [1.0, -1.0, 0.5])
def test_roll_pitch_and_yaw_are_drakes(scale: float) -> None:
    """Of any quaternion, of either sign and of any length, as Drake has them."""
    rng = np.random.default_rng(1)
    quaternions = rng.normal(size=(50, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    expected = [RollPitchYaw(Quaternion(q)).vector() for q in quaternions]
    np.testing.assert_allclose(roll_pitch_yaw(scale * quaternions), expected, atol=1e-9)


def test_times_are_evenly_spaced_over_all_tasks() -> None:
    """A row each period, from 0 to the end, also across the tasks' joints."""
    t = column("t")
    np.testing.assert_allclose(np.diff(t), PERIOD, atol=1e-9)
    assert t[0] == 0.0
    assert t[-1] == pytest.approx(sum(p.duration for p in plans()), abs=3 * PERIOD)


def test_gait_columns_are_the_plans() -> None:
    """Task, time, segment and swing leg of each row are those of the plan at that gait time."""
    for k in range(0, table().num_rows, 53):
        plan = plans()[int(column("task")[k])]
        t = float(column("gait_time")[k])
        segment = plan.segments[plan.segment_index(t)]
        assert column("segment")[k] == segment.name
        assert column("segment_kind")[k] == segment.kind
        step = plan.contacts.phase(t).step
        assert column("swing_leg")[k] == (0 if step is None else int(step.leg))
        phase = plan.sample(t).swing_phase
        expected = 0.0 if np.isnan(phase) else phase
        assert column("swing_phase")[k] == pytest.approx(expected, abs=1e-9)
    assert set(column("task")) == {0, 1, 2, 3}


def test_state_is_the_plans_pose_and_its_velocity_is_the_derivative() -> None:
    """Positions put the feet where they are desired; velocities are the positions' rates."""
    plant, robot, layout = model_plant(), paper_robot(), model_layout()
    context = plant.CreateDefaultContext()
    names = state_names(plant.GetPositionNames(), plant.GetVelocityNames())
    states = columns(*names)
    n = layout.num_positions
    for k in range(60, table().num_rows - 1, 211):
        plant.SetPositions(context, states[k, :n])
        for row, leg in enumerate(SHORT_NAMES):
            shank = plant.GetJointByName(robot.joint_names[3 * row + 2]).child_body()
            foot = shank.EvalPoseInWorld(context) @ np.array([0, 0, -robot.geometry.shank[row]])
            wanted = [column(f"{leg}_desired_{axis}")[k] for axis in "xyz"]
            np.testing.assert_allclose(foot, wanted, atol=1e-9)
        if column("task")[k - 1] != column("task")[k + 1]:
            continue
        rate = (states[k + 1, :n] - states[k - 1, :n]) / (2 * PERIOD)
        plant.SetPositions(context, states[k, :n])
        v = plant.MapQDotToVelocity(context, rate)
        np.testing.assert_allclose(states[k, n:], v, atol=0.02)


def test_replayed_base_is_on_its_plan() -> None:
    """Base pose and desired pose are one and the same."""
    place = columns(*(n for n in table().column_names if re.match(r"q_.*_trunk_[xyz]$", n)))
    np.testing.assert_allclose(place, columns(*(f"base_desired_{k}" for k in "xyz")))
    quaternion = columns(*(next(n for n in table().column_names if n.endswith(f"trunk_q{k}"))
                           for k in "wxyz"))  # fmt: skip
    np.testing.assert_allclose(np.linalg.norm(quaternion, axis=1), 1.0)
    body = np.zeros((len(place), 5))
    body[:, 3], body[:, 4] = column("base_desired_pitch"), column("base_desired_yaw")
    w, x, y, z = quaternion.T
    forward = np.stack([1 - 2 * (y**2 + z**2), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=-1)
    np.testing.assert_allclose(forward, rotations(body)[:, :, 0], atol=1e-9)


def test_replayed_contacts_are_the_plans_and_nothing_is_made_up() -> None:
    """Who bears is who is to stand; forces, torques and the pressure's margin are not numbers."""
    for leg in SHORT_NAMES:
        np.testing.assert_array_equal(column(f"{leg}_bearing"), column(f"{leg}_standing_planned"))
        for axis in "xyz":
            assert np.all(np.isnan(column(f"{leg}_force_{axis}")))
        ground = column(f"{leg}_desired_z") - column(f"{leg}_position_z")
        np.testing.assert_allclose(ground, paper_robot().foot_radius)
    for joint in paper_robot().joint_names:
        assert np.all(np.isnan(column(f"tau_{joint}")))
    assert np.all(np.isnan(column("zmp_margin")))


def test_margins_of_a_replay_are_the_plans() -> None:
    """Measured and planned margin are the same number, the whole robot's."""
    np.testing.assert_allclose(column("margin"), column("margin_planned"), atol=1e-12)
    s = evaluate(paper_robot(), plans()[1], column("gait_time")[column("task") == 1])
    np.testing.assert_allclose(column("margin")[column("task") == 1], s.margin, atol=1e-12)


def test_papers_margins_are_the_body_centres() -> None:
    """With massless legs both margins are those of the body's centre."""
    _, found = logs(massless=True)
    body = found["body_desired"][:, :2]
    feet = found["feet_desired"].reshape(-1, 4, 3)[..., :2]
    expected = stability_margins(body, feet, found["standing"] > 0.5)
    np.testing.assert_allclose(found["margin"][:, 0], expected, atol=1e-12)
    planned = planned_figures(paper_robot(), found["gait_phase"], plans(), massless_legs=True)
    np.testing.assert_allclose(planned["margin_planned"], expected, atol=1e-12)
    assert np.abs(found["margin"] - logs()[1]["margin"]).max() > 0.01


def test_rows_of_a_task_without_a_plan_are_kept_without_names() -> None:
    """A run that ends before its next plan is there loses no sample."""
    times, found = logs()
    short = table_of(times, found, plans()[:1])
    assert short.num_rows == table().num_rows
    names = short.column("segment").to_numpy(zero_copy_only=False)
    margin = short.column("margin_planned").to_numpy()
    unknown = short.column("task").to_numpy() > 0
    assert set(names[unknown]) == {""} and np.all(np.isnan(margin[unknown]))
    assert np.all(np.isfinite(margin[~unknown]))


def test_planned_margin_is_at_the_gait_clocks_time_and_not_the_walls() -> None:
    """Where the clock waits, the plan's margin waits with it."""
    phase = np.zeros((3, SIZE))
    phase[:, GaitPhase.TASK] = 1
    phase[:, GaitPhase.TIME] = [4.0, 4.0, 4.1]
    found = planned_figures(paper_robot(), phase, plans())["margin_planned"]
    expected = evaluate(paper_robot(), plans()[1], np.array([4.0, 4.0, 4.1])).margin
    np.testing.assert_array_equal(found, expected)
    assert found[0] == found[1] != found[2]


REVISED = (stand_plan(0.5), flat_walk(), replace(spin_plan(-np.pi / 4), revision=1),
           replace(swaying_plan(), revision=2), flat_walk())  # fmt: skip


def revised_rows() -> FloatArray:
    """A clock that is in each plan of REVISED, and is between them."""
    rows = [  # task, revision, time, mode, the plan that it follows
        (0, 0, 0.2, Mode.RUN, 0), (1, 0, 5.0, Mode.RUN, 1), (1, 0, 5.0, Mode.CATCH, 1),
        (1, 0, 5.0, Mode.SETTLE, 1), (1, 1, 5.0, Mode.REPLAN, 1), (1, 1, 0.0, Mode.RUN, 2),
        (1, 1, 6.0, Mode.SETTLE, 2), (1, 2, 6.0, Mode.REPLAN, 2), (1, 2, 1.0, Mode.RUN, 3),
        (2, 0, 0.0, Mode.RUN, 4), (2, 0, 9.0, Mode.RUN, 4),
    ]  # fmt: skip
    return np.array(rows, dtype=float)


def revised_phase() -> FloatArray:
    rows = revised_rows()
    phase = np.zeros((len(rows), SIZE))
    phase[:, [GaitPhase.TASK, GaitPhase.REVISION, GaitPhase.TIME, GaitPhase.MODE]] = rows[:, :4]
    phase[:, GaitPhase.SEGMENT] = 99  # whatever the clock takes it to be
    return phase


def test_planned_margin_is_of_the_plan_that_was_followed_then() -> None:
    """Of several plans of a task each counts in its own time; while one is made, the one before."""
    found = planned_figures(paper_robot(), revised_phase(), REVISED)["margin_planned"]
    for margin, (*_, time, _, plan) in zip(found, revised_rows().tolist(), strict=True):
        own = evaluate(paper_robot(), REVISED[int(plan)], np.array([time])).margin[0]
        assert margin == own
    for k, wrong in ((4, 2), (7, 3)):  # the plan that is being made has another there
        time = revised_rows()[[k], 2]
        assert found[k] != evaluate(paper_robot(), REVISED[wrong], time).margin[0]


def test_segments_of_a_plan_made_anew_are_its_own() -> None:
    """By its own time, with names of the plan that was followed then, and the clock's mode."""
    rows, phase = revised_rows(), revised_phase()
    n = len(rows)
    times, found = logs()
    short = {**{name: values[:n] for name, values in found.items()}, "gait_phase": phase}
    short["catch"] = np.zeros((n, CATCH_SIZE))
    short["catch"][2, Catch.LEG] = 3
    made = table_of(times[:n], short, REVISED).to_pydict()
    for k, (task, _, time, mode, index) in enumerate(rows.tolist()):
        plan = REVISED[int(index)]
        assert made["segment"][k] == plan.segments[plan.segment_index(time)].name
        assert (made["task"][k], made["plan_revision"][k]) == (int(task), plan.revision)
        assert made["gait_mode"][k] == Mode(int(mode)).name.lower()
    assert made["catch_leg"] == [0, 0, 3, *([0] * (n - 3))]


@cache
def pushed() -> pa.Table:
    """A kick that has to be caught, as the transition begins, and 1.5 s of the way back."""
    scenario = load_scenario("flat_walk", [
        "controller.kind=whole_body", "controller.period=0.002",
        "mission=[{kind: walk, distance: 2.0}]",
        "disturbances.pushes=[{time: 2.5, speed: 0.6, direction_deg: 90.0}]",
    ])  # fmt: skip
    now = [0.0]
    return simulate(
        scenario, progress=lambda t, _: now.__setitem__(0, t), stop=lambda: now[0] > 6.4
    ).table


@pytest.mark.long
def test_log_of_a_pushed_run_follows_the_plan_made_anew() -> None:
    """After the recovery the measured margin is that of the new plan, within 20 mm."""
    made = pushed().to_pydict()
    mode, revision = np.array(made["gait_mode"]), np.array(made["plan_revision"])
    order = [word for k, word in enumerate(mode) if k == 0 or mode[k - 1] != word]
    assert order[0] == "run" and order[-3:] == ["settle", "replan", "run"] and "catch" in order
    assert np.all(np.array(made["catch_leg"])[mode == "catch"] > 0) and revision[-1] == 1
    back = (revision == 1) & (np.array(made["gait_time"]) > 0.2)
    assert set(np.array(made["segment"], dtype=object)[back]) == {"recovery"}
    assert np.all(np.diff(np.array(made["gait_time"])[revision == 1]) >= 0.0)
    off = np.array(made["margin"]) - np.array(made["margin_planned"])
    assert np.mean(np.abs(off[back]) < 0.02) > 0.95
    assert np.all(np.array(made["catch_leg"])[mode != "catch"] == 0)


def test_torque_columns_are_in_the_joints_own_names() -> None:
    """Loggers have the plant's order of actuators; the columns name the joints."""
    times, found = logs()
    plant = model_plant()
    layout = replace(model_layout(), actuators=np.roll(model_layout().actuators, 5))
    made = log_table(
        paper_robot(),
        layout,
        times=times,
        logs={**found, "torque": np.tile(np.arange(12.0), (len(times), 1))},
        plans=plans(),
        state_names=state_names(plant.GetPositionNames(), plant.GetVelocityNames()),
    )
    for k, joint in enumerate(paper_robot().joint_names):
        assert np.all(made.column(f"tau_{joint}").to_numpy() == layout.actuators[k])


def test_columns_of_names_are_drakes() -> None:
    """`q_` and `v_` before the plant's own names."""
    plant = model_plant()
    names = state_names(plant.GetPositionNames(), plant.GetVelocityNames())
    assert len(names) == 37 and len(set(names)) == 37
    assert names[7] == f"q_{plant.GetPositionNames()[7]}" and names[19].startswith("v_")
