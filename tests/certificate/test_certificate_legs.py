"""Legs, masses and torques over cells: the planner's own values lie in the enclosures."""

import sys
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from certificate_rig import checker, paper_shank, prepared
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.tree import JacobianWrtVariable
from rig import model_plant, paper_robot

from drake_quad.certificate.cells import Cells, Pieces, cut_pieces, make_cells
from drake_quad.certificate.kinematics import (
    enclose_feet,
    enclose_frame,
    enclose_knees,
    enclose_legs,
    enclose_moments,
    enclose_shank_axes,
    make_chain,
)
from drake_quad.certificate.statics import enclose_statics, find_support
from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.robot.kinematics import calc_knees
from drake_quad.robot.model import RobotModel

PLACES = np.array([-1.0, -0.6, 0.0, 0.37, 1.0])


@cache
def cells_of(name: str) -> tuple[Pieces, Cells]:
    """The pieces of a shipped scenario's plan, and every seventh of them as a cell, half of it."""
    pieces = cut_pieces(prepared(name).plan.plans)
    which = np.arange(0, len(pieces.start), 7)
    return pieces, make_cells(pieces, which, np.full(len(which), 0.2), np.full(len(which), 0.7))


def variant(kind: str) -> RobotModel:
    """The shipped robot with other knees, hips and masses."""
    robot, rng = paper_robot(), np.random.default_rng(3)
    if kind == "shipped":
        return robot
    signs = {"forward": np.ones(4), "mixed": np.array([-1.0, 1.0, 1.0, -1.0])}.get(
        kind, -np.ones(4)
    )
    offset = np.zeros(4) if kind == "no offset" else robot.geometry.offset
    raised = np.array([-0.08, -0.05, 0.01, -0.08]) * (kind == "raised")
    return replace(
        robot,
        geometry=replace(robot.geometry, knee_sign=signs, offset=offset, raised=raised),
        link_com=robot.link_com + rng.uniform(-0.05, 0.05, (4, 3, 3)),
        trunk_com=np.array([0.03, -0.02, 0.05]),
    )


def moved(cells: Cells, place: float) -> tuple[FloatArray, FloatArray]:
    """Body (N, 5) and swing foot (N, 3) at one place of every cell, by the polynomials alone."""
    powers = place ** np.arange(6)
    return cells.body @ powers[:4], cells.foot @ powers


def feet_at(pieces: Pieces, cells: Cells, swing_foot: FloatArray, place: float) -> FloatArray:
    """All feet (N, 4, 3) at one place of every cell, given where the swing foot is."""
    feet = np.array(pieces.feet[cells.piece])
    w = 0.5 * (cells.low + cells.high) + place * 0.5 * (cells.high - cells.low)
    feet[..., :2] += w[:, None, None] * pieces.roll[cells.piece]
    rows = np.flatnonzero(pieces.swing[cells.piece] >= 0)
    feet[rows, pieces.swing[cells.piece][rows]] = swing_foot[rows]
    return feet


@pytest.mark.parametrize("kind", ["shipped", "forward", "mixed", "no offset", "raised"])
@pytest.mark.parametrize("name", ["case_study", "spin_both_ways"])
def test_values_at_any_time_are_in_the_enclosures(kind: str, name: str) -> None:
    """Angles, knees, shanks' axes, centre of mass, of robots of any kind of knee."""
    robot, (pieces, cells) = variant(kind), cells_of(name)
    frame, feet = enclose_frame(cells), enclose_feet(pieces, cells)
    legs = enclose_legs(robot, frame, feet)
    knees = enclose_knees(robot, frame, legs)
    axes = enclose_shank_axes(frame, legs)
    com = enclose_moments(robot, frame, legs).com
    for place in PLACES:
        body, swing_foot = moved(cells, place)
        places = feet_at(pieces, cells, swing_foot, place)
        q, excess, c = pose_robot(robot, body, places)
        assert excess.max() == 0.0
        R = rotations(body)
        k = body[:, None, :3] + np.einsum("nij,nlj->nli", R, calc_knees(robot.geometry, q))
        pitch, a = q[..., 1] + q[..., 2], q[..., 0]
        x = np.stack([np.cos(pitch), np.sin(a) * np.sin(pitch), -np.cos(a) * np.sin(pitch)], -1)
        x = np.einsum("nij,nlj->nli", R, x)
        for found, values in ((legs.angles, q), (knees, k), (axes, x)):
            for j, enclosure in enumerate(found):
                assert np.all(values[..., j] >= enclosure.lower - 1e-12)
                assert np.all(values[..., j] <= enclosure.upper + 1e-12)
        for j, enclosure in enumerate(com):
            assert np.all(np.abs(c[:, [j]] - enclosure.centre) <= enclosure.radius + 1e-12)


@pytest.mark.parametrize("kind", ["shipped", "forward", "mixed", "no offset", "raised"])
def test_checker_bounds_hold_the_same_values(kind: str) -> None:
    """Its balls and triangles: angles, knees and shanks' axes of the same legs, by other bounds."""
    checker()
    bounds = sys.modules["certificate_bounds"]
    robot, (pieces, cells) = variant(kind), cells_of("case_study")
    g = robot.geometry
    theirs = SimpleNamespace(
        thighs=g.thigh, shanks=g.shank, offsets=g.offset, knee_signs=g.knee_sign, hips=g.p_BH,
        raised=g.raised,
    )  # fmt: skip
    count = len(cells.half)
    middle, swing_foot = moved(cells, 0.0)
    places = feet_at(pieces, cells, swing_foot, 0.0)
    at = np.linspace(-1.0, 1.0, 21)
    grid = [moved(cells, p) for p in at]
    body_off = np.max([np.abs(b - middle) for b, _ in grid], axis=0)
    feet = [feet_at(pieces, cells, f, p) for (_, f), p in zip(grid, at, strict=True)]
    for leg in range(4):
        off = np.max([np.linalg.norm(f[:, leg] - places[:, leg], axis=1) for f in feet], axis=0)
        state = bounds.move_leg(theirs, np.full(count, leg), middle, body_off, places[:, leg], off)
        for (body, _), f in zip(grid, feet, strict=True):
            q, _, _ = pose_robot(robot, body, f)
            known = np.all(np.isfinite(state.off), axis=1)
            assert known.mean() > 0.9
            far = np.abs(q[known, leg] - state.q[known])
            assert np.all(far <= state.off[known] + 1e-9)
            R = rotations(body)
            knee = body[:, :3] + np.einsum("nij,nj->ni", R, calc_knees(g, q)[:, leg])
            far = np.linalg.norm(knee[known] - state.knee[known], axis=1)
            assert np.all(far <= state.knee_off[known] + 1e-9)


def test_torques_are_drakes() -> None:
    """With the witness's forces Drake's statics need these torques, and none to hold the base."""
    robot, (pieces, cells) = paper_robot(), cells_of("case_study")
    frame, feet = enclose_frame(cells), enclose_feet(pieces, cells)
    legs = enclose_legs(robot, frame, feet)
    moments = enclose_moments(robot, frame, legs)
    statics = enclose_statics(robot, find_support(pieces, cells), frame, legs, moments)
    plant = model_plant()
    context = plant.CreateDefaultContext()
    joints = [plant.GetJointByName(name) for name in robot.joint_names]
    for n in range(0, len(cells.half), 25):
        body = cells.body[n, :, 0]
        pose = RigidTransform(RollPitchYaw(0.0, body[3], body[4]), body[:3])
        trunk = plant.GetBodyByName(robot.trunk)
        plant.SetFloatingBaseBodyPoseInWorldFrame(context, trunk, pose)
        for k, joint in enumerate(joints):
            joint.set_angle(context, legs.angles[k % 3].centre[n, k // 3])
        tau = -plant.CalcGravityGeneralizedForces(context)
        for leg in range(4):
            J = plant.CalcJacobianTranslationalVelocity(
                context,
                JacobianWrtVariable.kV,
                joints[3 * leg + 2].child_body().body_frame(),
                np.array([0.0, 0.0, -robot.geometry.shank[leg]]),
                plant.world_frame(),
                plant.world_frame(),
            )
            tau -= J.T @ [0.0, 0.0, statics.witness[n, leg] * robot.mass * 9.81]
        ours = [statics.torques[k % 3].centre[n, k // 3] for k in range(12)]
        assert np.allclose(tau[:6], 0.0, atol=1e-9)
        assert np.allclose([tau[j.velocity_start()] for j in joints], ours, atol=1e-9)


def test_points_of_shanks_move_no_farther_than_told() -> None:
    """Any point of the chain, by the same combination of knee, foot and axis, at any time."""
    robot, (pieces, cells) = paper_robot(), cells_of("case_study")
    frame, feet = enclose_frame(cells), enclose_feet(pieces, cells)
    legs = enclose_legs(robot, frame, feet)
    chain = make_chain(
        paper_shank(), enclose_knees(robot, frame, legs), feet, enclose_shank_axes(frame, legs)
    )
    low, _, _ = chain.parts()
    moves = chain.moves()
    for place in PLACES:
        body, swing_foot = moved(cells, place)
        places = feet_at(pieces, cells, swing_foot, place)
        q, _, _ = pose_robot(robot, body, places)
        R = rotations(body)
        knees = body[:, None, :3] + np.einsum("nij,nlj->nli", R, calc_knees(robot.geometry, q))
        at = low[:, :, 0, None] * knees[:, :, None] + low[:, :, 1, None] * places[:, :, None]
        centre = np.einsum("lps,nlsi->nlpi", low, chain.points.centre)
        if np.any(low[..., 2] != 0.0):
            pytest.skip("the shipped robot's shanks are no longer straight")
        assert np.all(np.linalg.norm(at - centre, axis=-1) <= moves[..., None] + 1e-12)
