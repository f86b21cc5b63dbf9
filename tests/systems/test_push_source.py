"""PushSource: the impulse that was ordered, in the direction that was ordered, at no cost else."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput
from rig import URL, feet_of, model_layout, paper_robot, state_from_joints

from drake_quad.common import FloatArray
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.state import make_layout
from drake_quad.systems.disturbances import Push, PushSource

STEP = 0.001  # [s]
# The plant's steps keep momentum up to their own error; a step of push too many gives 0.04.
TOLERANCE = 1e-3  # [kg m/s]


class Counting(PushSource):
    """Counts how often its list of forces is made."""

    calls = 0

    def _calc_forces(self, context, output) -> None:  # type: ignore[no-untyped-def]
        type(self).calls += 1
        super()._calc_forces(context, output)


def push(time: float, force: tuple[float, float, float], **other: object) -> Push:
    return Push(time=time, duration=0.05, force_H=force, **{"body": "trunk", **other})  # type: ignore[arg-type]


def floating(*pushes: Push, kind: type[PushSource] = PushSource) -> Diagram:
    """The robot without weight and ground, and the pushes on it."""
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(STEP))
    AddRobot(plant, URL)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    source = builder.AddNamedSystem(
        "push_source",
        kind(
            pushes=pushes,
            bodies=[plant.GetBodyByName(p.body).index() for p in pushes],
            layout=make_layout(plant, paper_robot()),
            time_step=STEP,
        ),
    )
    builder.Connect(plant.get_state_output_port(), source.GetInputPort("robot_state"))
    builder.Connect(
        source.GetOutputPort("applied_spatial_force"),
        plant.get_applied_spatial_force_input_port(),
    )
    zero = builder.AddSystem(ConstantVectorSource(np.zeros(plant.num_actuators())))
    builder.Connect(zero.get_output_port(), plant.get_actuation_input_port())
    LogVectorOutput(source.GetOutputPort("push_force"), builder, STEP).set_name("log")
    return builder.Build()


def momentum_after(diagram: Diagram, duration: float, *, yaw: float = 0.0) -> FloatArray:
    """Linear momentum (3,) in W that the robot, at rest at first, has [kg m/s]."""
    simulator = Simulator(diagram)
    plant = diagram.GetSubsystemByName("plant")
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    q = np.tile([0.0, 0.6, -1.2], (4, 1))
    body = np.array([0.0, 0.0, 1.0, 0.0, yaw])
    plant.SetPositionsAndVelocities(
        context, state_from_joints(body, q, layout=make_layout(plant, paper_robot()))
    )
    simulator.AdvanceTo(duration)
    h = plant.CalcSpatialMomentumInWorldAboutPoint(context, [0.0, 0.0, 0.0])
    return np.array(h.translational())


@pytest.mark.parametrize("time", [0.0, STEP, 0.02, 0.0204])
@pytest.mark.parametrize("body", ["trunk", "FL_shank"])
def test_the_robot_gets_the_pushs_impulse(time: float, body: str) -> None:
    """Force times duration is what the whole robot's momentum grows by, whenever it begins."""
    diagram = floating(push(time, (40.0, -30.0, 20.0), body=body))
    np.testing.assert_allclose(momentum_after(diagram, 0.15), [2.0, -1.5, 1.0], atol=TOLERANCE)


def test_a_push_acts_in_its_time_and_not_before_or_after() -> None:
    """Nothing moves until it begins; half-way the robot has half of it; later all, for good."""
    diagram = floating(push(0.02, (40.0, 0.0, 0.0)))
    for duration, share in ((0.02, 0.0), (0.021, 0.02), (0.045, 0.5), (0.07, 1.0), (0.2, 1.0)):
        np.testing.assert_allclose(
            momentum_after(diagram, duration), [2.0 * share, 0.0, 0.0], atol=TOLERANCE
        )


@pytest.mark.parametrize("yaw", [0.0, 0.7, np.pi / 2, -2.5])
def test_directions_are_the_robots_own(yaw: float) -> None:
    """A robot that heads elsewhere is pushed elsewhere by as much."""
    found = momentum_after(floating(push(0.01, (40.0, 20.0, 10.0))), 0.1, yaw=yaw)
    c, s = np.cos(yaw), np.sin(yaw)
    np.testing.assert_allclose(found, [2.0 * c - 1.0 * s, 2.0 * s + 1.0 * c, 0.5], atol=TOLERANCE)


def test_pushes_add_up_and_follow_each_other() -> None:
    """Two that overlap, and one that begins as another ends, give the sum of their impulses."""
    pushes = (
        push(0.01, (40.0, 0.0, 0.0)),
        push(0.03, (0.0, 20.0, 0.0)),
        push(0.06, (0.0, 0.0, 10.0)),
    )
    diagram = floating(*pushes)
    np.testing.assert_allclose(momentum_after(diagram, 0.2), [2.0, 1.0, 0.5], atol=TOLERANCE)


def test_the_force_is_told_as_it_acts() -> None:
    """`push_force` is the sum of the forces that act, and zero otherwise."""
    diagram = floating(push(0.01, (40.0, 0.0, 0.0)), push(0.03, (5.0, 20.0, 0.0)))
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.1)
    log = diagram.GetSubsystemByName("log").FindLog(simulator.get_context())
    impulse = log.data().sum(axis=1) * STEP
    np.testing.assert_allclose(impulse, [0.05 * 45.0, 0.05 * 20.0, 0.0], atol=TOLERANCE)
    assert np.all(log.data()[:, log.sample_times() > 0.081] == 0.0)
    assert np.max(log.data()[0]) == 45.0


def test_where_on_the_body_it_acts_turns_the_robot() -> None:
    """A push to the left ahead of the middle turns to the left, one behind it to the right."""
    for x, sign in ((0.3, 1.0), (-0.3, -1.0)):
        diagram = floating(push(0.0, (0.0, 40.0, 0.0), p_BP=(x, 0.0, 0.0)))
        simulator = Simulator(diagram)
        simulator.AdvanceTo(0.05)
        plant = diagram.GetSubsystemByName("plant")
        context = plant.GetMyContextFromRoot(simulator.get_context())
        state = plant.GetPositionsAndVelocities(context)
        assert sign * make_layout(plant, paper_robot()).read(state).w_WB[2] > 0.05


def test_between_its_events_it_costs_nothing() -> None:
    """The list of forces is made anew where a push begins or ends, and at no other step."""
    Counting.calls = 0
    diagram = floating(push(0.05, (40.0, 0.0, 0.0)), kind=Counting)
    Simulator(diagram).AdvanceTo(0.3)
    assert 1 <= Counting.calls <= 4  # 300 steps


def test_without_pushes_there_is_no_force() -> None:
    """An empty list, and zero told."""
    assert np.all(momentum_after(floating(), 0.05) == 0.0)


def test_two_contexts_do_not_share_a_push() -> None:
    """One that is past the push leaves another, not yet there, untouched."""
    diagram = floating(push(0.02, (40.0, 0.0, 0.0)))
    early = Simulator(diagram)
    early.AdvanceTo(0.01)
    Simulator(diagram).AdvanceTo(0.05)
    source = diagram.GetSubsystemByName("push_source")
    context = source.GetMyContextFromRoot(early.get_context())
    assert np.all(source.GetOutputPort("push_force").Eval(context) == 0.0)


def test_a_continuous_plants_push_begins_at_its_very_time() -> None:
    """Without steps nothing is rounded: the force is there from `time` to the end."""
    source = PushSource(
        pushes=[push(0.0123, (40.0, 0.0, 0.0))],
        bodies=[BodyIndex(1)],
        layout=model_layout(),
        time_step=0.0,
    )
    simulator = Simulator(source)
    state = state_from_joints(np.array([0.0, 0.0, 1.0, 0.0, 0.0]), np.zeros((4, 3)))
    assert feet_of(state).shape == (4, 3)
    source.GetInputPort("robot_state").FixValue(simulator.get_mutable_context(), state)
    for t, force in ((0.0122, 0.0), (0.0125, 40.0), (0.0622, 40.0), (0.0625, 0.0)):
        simulator.AdvanceTo(t)
        assert source.GetOutputPort("push_force").Eval(simulator.get_context())[0] == force
