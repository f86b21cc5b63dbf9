"""How near thighs come to stairs: as near as their collision shapes do in Drake."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import Body
from pydrake.systems.framework import DiagramBuilder
from rig import URL, course_of, flat_walk, paper_robot

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.planning.clearance import check_shanks, check_thighs, thigh_clearance
from drake_quad.planning.motion_plan import evaluate
from drake_quad.planning.problem import Task
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.read_outline import ROUND
from drake_quad.terrain.drake_geometry import AddCourse
from drake_quad.terrain.elements import Element

COURSE = course_of(
    Element("floor", length=3.0),
    Element("stairs", going="up", rise=0.2, run=0.35, count=4),
    Element("floor", length=3.0),
)


class Drake:
    """The robot on the course, asked for distances of its thighs' own shapes."""

    def __init__(self) -> None:
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
        AddRobot(self.plant, URL)
        AddCourse(self.plant, COURSE, friction=0.8)
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.root = self.diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)

    def room(self, body: FloatArray, q: FloatArray) -> list[float]:
        """Of each thigh from the course [m]."""
        robot, plant = paper_robot(), self.plant
        X = RigidTransform(RotationMatrix.MakeYRotation(body[3]), body[:3])
        plant.SetFreeBodyPose(self.context, plant.GetBodyByName(robot.trunk), X)
        for name, angle in zip(robot.joint_names, q.ravel(), strict=True):
            plant.GetJointByName(name).set_angle(self.context, angle)
        query = plant.get_geometry_query_input_port().Eval(self.context)
        ground = plant.GetCollisionGeometriesForBody(plant.world_body())

        def nearest(thigh: Body) -> float:
            return min(
                query.ComputeSignedDistancePairClosestPoints(mine, other).distance
                for mine in plant.GetCollisionGeometriesForBody(thigh)
                for other in ground
            )

        return [
            nearest(plant.GetJointByName(name).child_body()) for name in robot.joint_names[1::3]
        ]


DRAKE = Drake()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_thighs_are_as_near_to_stairs_as_drake_has_it(seed: int) -> None:
    """In any pose above them; what is inside them is told as inside."""
    rng = np.random.default_rng(seed)
    body = np.array([rng.uniform(2.0, 5.0), 0.0, rng.uniform(1.0, 2.0), rng.uniform(-0.5, 0.5), 0])
    q = np.stack([rng.uniform(-0.2, 0.2, 4), rng.uniform(-1.5, 1.5, 4), np.zeros(4)], axis=-1)
    found = thigh_clearance(paper_robot(), COURSE.lanes[0], body[None], q[None])[0]
    for told, true in zip(found, DRAKE.room(body, q), strict=True):
        if true > 0.8:  # nobody asks how far
            assert told > 0.8
        elif true > 0.0:
            assert told == pytest.approx(true, abs=2e-3)
        else:
            assert told < 2e-3


def test_boxes_are_looked_at_along_all_edges_of_both_sides() -> None:
    """Each corner of a box, and from one to the next never along more than one edge."""
    assert len({tuple(corner) for corner in ROUND}) == 8
    assert np.all(np.abs(np.diff(ROUND, axis=0)).sum(axis=1) == 2)


def test_a_plan_in_which_a_thigh_comes_into_the_ground_is_refused() -> None:
    """With which, and how far; a plan that keeps them off is not."""
    robot, plan = paper_robot(), flat_walk()
    task = Task(kind="walk", name="walk 1", lane=0, goal=5.0)
    samples = evaluate(robot, plan, np.linspace(0.0, plan.duration, 50))
    course = course_of(Element("floor", length=20.0))
    check_thighs(robot, course, task, samples)
    low = replace(samples, body=samples.body - [0.0, 0.0, 0.6, 0.0, 0.0])
    with pytest.raises(PlanningError, match=r"the thigh of .* inside the stairs") as caught:
        check_thighs(robot, course, task, low)
    assert caught.value.data["room"] < 0.0


def test_a_plan_in_which_a_shank_comes_into_the_ground_is_refused() -> None:
    """A flat walk is one; with a step in its way, right ahead of where a foot stands, it is not."""
    robot, plan = paper_robot(), flat_walk()
    task = Task(kind="walk", name="walk 1", lane=0, goal=5.0)
    samples = evaluate(robot, plan, np.linspace(0.0, plan.duration, 50))
    check_shanks(robot, course_of(Element("floor", length=20.0)), task, samples)
    step = course_of(
        Element("floor", length=2.0),
        Element("block", length=0.4, height=0.3),
        Element("floor", length=5.0),
    )
    with pytest.raises(PlanningError, match=r"the knee or shank of .* inside the stairs") as caught:
        check_shanks(robot, step, task, samples)
    assert caught.value.data["room"] < 0.0
