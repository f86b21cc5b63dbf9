"""A plan's figures at many times, by other code than the certificate's: what must not be below it.

Margin, joint angles and centre of mass are the planner's own (`evaluate`); distances are taken at
points along the shanks, sample by sample; torques by differences of the centre of mass's height.
"""

from collections.abc import Callable
from typing import TypeVar, cast

import numba
import numpy as np

from drake_quad.certificate.obstacles import CAP, LEVEL, Obstacles
from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import MotionPlan, PlanSamples, evaluate
from drake_quad.robot.kinematics import calc_com, calc_jacobians, calc_knees
from drake_quad.robot.model import RobotModel, ShankProfile

F = TypeVar("F", bound=Callable[..., object])

CHUNK = 20000
POINTS = 4  # on every part of a shank
TORQUE_STEP = 100  # every how many samples torques are computed
TILTED = 5e-3  # [m] from a slope within which a foot stands on it
DIP = 2e-6  # [m] that a swing foot may be in its ground
GRAVITY = 9.81  # [m/s^2]


def sampled_minima(
    robot: RobotModel, shank: ShankProfile, plan: MotionPlan, obstacles: Obstacles, rate: float
) -> FloatArray:
    """The least of each claim's figure in every segment of a plan, at `rate` [Hz].

    Returns:
        (segments, 6): the sixth is how far swing feet are over their own ground, less what is
        allowed [m].
    """
    ends = np.array([s.end for s in plan.segments])
    least = np.full((len(ends), 6), np.inf)
    count = int(np.ceil(plan.duration * rate)) + 1
    times = np.linspace(0.0, plan.duration, count)
    rules = _rules(plan, obstacles, robot.foot_radius)
    for first in range(0, count, CHUNK):
        t = times[first : first + CHUNK]
        s = evaluate(robot, plan, t)
        q = s.q.reshape(-1, 12)
        figures = np.full((len(t), 6), np.inf)
        figures[:, 0] = s.margin
        figures[:, 1], figures[:, 5] = _feet(plan, s, obstacles, rules, robot.foot_radius)
        figures[:, 2] = _shanks(robot, shank, s, obstacles)
        figures[:, 3] = np.minimum(q - robot.q_lower, robot.q_upper - q).min(axis=1)
        figures[:, 3] = np.where(s.reach_excess.max(axis=1) > 0.0, -1.0, figures[:, 3])
        figures[::TORQUE_STEP, 4] = _torque_room(robot, s, slice(None, None, TORQUE_STEP))
        owner = np.minimum(np.searchsorted(ends, t), len(ends) - 1)
        np.minimum.at(least, owner, figures)
    return least


def _torque_room(robot: RobotModel, s: PlanSamples, which: slice) -> FloatArray:
    """What is left of torque limits where three feet stand, whose vertical forces are unique."""
    body, q, standing = s.body[which, 0], s.q[which], s.standing[which]
    feet, com = s.feet[which], s.com[which]
    up = rotations(body)[:, 2]  # W's z in B
    room = np.full(len(body), np.inf)
    three = np.flatnonzero(standing.sum(axis=1) == 3)
    gravity, step = np.zeros_like(q), 1e-6
    for leg in range(4):
        for j in range(3):
            high, low = q.copy(), q.copy()
            high[:, leg, j] += step
            low[:, leg, j] -= step
            rise = np.einsum("ni,ni->n", up, calc_com(robot, high) - calc_com(robot, low))
            gravity[:, leg, j] = robot.mass * GRAVITY * rise / (2.0 * step)
    J = calc_jacobians(robot.geometry, q)
    for k in three:
        mine = np.flatnonzero(standing[k])
        balance = np.vstack([np.ones(3), feet[k, mine, :2].T])
        share = np.zeros(4)
        share[mine] = np.linalg.solve(balance, [1.0, *com[k, :2]])
        force = robot.mass * GRAVITY * share[:, None] * up[k]
        torque = gravity[k] - np.einsum("lij,li->lj", J[k], force)
        room[k] = 1.0 - np.max(np.abs(torque.ravel()) / robot.effort)
    return room


def _rules(plan: MotionPlan, obstacles: Obstacles, radius: float) -> list[FloatArray | None]:
    """Of every swing (2, M): how near an obstacle counts, nan for its own ground; its floor."""
    rules: list[FloatArray | None] = []
    for phase in plan.contacts.phases:
        if phase.step is None:
            rules.append(None)
            continue
        ends = np.stack([phase.step.swing.p_start, phase.step.swing.p_end])
        if plan.contacts.roll is not None:  # it lifts off where it has rolled to
            rolled = plan.contacts.roll.at(np.array([phase.start]))[0]
            ends[0, :2] += rolled[phase.step.leg.row]
        d = _distances(ends, obstacles.centre, obstacles.axes, obstacles.half) - radius
        tilted = obstacles.axes[:, 2, 2] < 1.0
        level = np.abs(ends[:, 2, None] - radius - obstacles.top) <= LEVEL
        own = np.where(tilted, d <= TILTED, level).any(axis=0) & ~obstacles.face
        floor = np.minimum(d.min(axis=0), 0.0) - DIP
        rules.append(np.stack([np.where(own, np.nan, 0.5 * d.min(axis=0)), floor]))
    return rules


def _feet(
    plan: MotionPlan,
    s: PlanSamples,
    obstacles: Obstacles,
    rules: list[FloatArray | None],
    radius: float,
) -> tuple[FloatArray, FloatArray]:
    """Room of the swing foot to what it passes nearer than half its footholds are; and ground."""
    room, over = np.full(len(s.times), CAP), np.full(len(s.times), np.inf)
    starts = np.array([p.start for p in plan.contacts.phases])
    index = np.maximum(np.searchsorted(starts, s.times, side="right") - 1, 0)
    for k in np.unique(index):
        rule, phase = rules[k], plan.contacts.phases[k]
        if rule is None or phase.step is None:
            continue
        mine = np.flatnonzero(index == k)
        p = np.ascontiguousarray(s.feet[mine, phase.step.leg.row])
        d = _distances(p, obstacles.centre, obstacles.axes, obstacles.half) - radius
        room[mine] = np.minimum(np.where(d < rule[0], d, CAP).min(axis=1), CAP)
        over[mine] = np.where(np.isnan(rule[0]), d - rule[1], np.inf).min(axis=1)
    return room, over


def _shanks(
    robot: RobotModel, shank: ShankProfile, s: PlanSamples, obstacles: Obstacles
) -> FloatArray:
    """Room of all shanks to all boxes, at POINTS of every part."""
    R, p = rotations(s.body[:, 0]), s.body[:, None, 0, :3]
    knees = p + np.einsum("nij,nlj->nli", R, calc_knees(robot.geometry, s.q))
    a, pitch = s.q[..., 0], s.q[..., 1] + s.q[..., 2]
    axes = np.stack([np.cos(pitch), np.sin(a) * np.sin(pitch), -np.cos(a) * np.sin(pitch)], axis=-1)
    ahead = np.einsum("nij,nlj->nli", R, axes)
    boxes = ~obstacles.face
    return _shank_room(
        knees, np.ascontiguousarray(s.feet), ahead, shank.along, np.array(shank.ahead),
        np.array(shank.radii), obstacles.centre[boxes], obstacles.axes[boxes],
        obstacles.half[boxes], POINTS,
    )  # fmt: skip


def _compiled(function: F) -> F:
    return cast(F, numba.njit(cache=False)(function))


@_compiled
def _distance(p: FloatArray, centre: FloatArray, axes: FloatArray, half: FloatArray) -> float:
    out, inside = 0.0, -1e9
    for i in range(3):
        v = 0.0
        for j in range(3):
            v += axes[i, j] * (p[j] - centre[j])
        beyond = abs(v) - half[i]
        inside = max(inside, beyond)
        if beyond > 0.0:
            out += beyond * beyond
    return np.sqrt(out) if out > 0.0 else inside


@_compiled
def _distances(p: FloatArray, centre: FloatArray, axes: FloatArray, half: FloatArray) -> FloatArray:
    found = np.empty((len(p), len(centre)))
    for n in range(len(p)):
        for k in range(len(centre)):
            found[n, k] = _distance(p[n], centre[k], axes[k], half[k])
    return found


@_compiled
def _shank_room(
    knees: FloatArray,
    feet: FloatArray,
    ahead: FloatArray,
    along: FloatArray,
    lean: FloatArray,
    radii: FloatArray,
    centre: FloatArray,
    axes: FloatArray,
    half: FloatArray,
    points: int,
) -> FloatArray:
    room = np.full(len(knees), 0.1)
    p = np.empty(3)
    for n in range(len(knees)):
        for leg in range(4):
            middle = 0.5 * (knees[n, leg] + feet[n, leg])
            reach = 0.5 * np.linalg.norm(knees[n, leg] - feet[n, leg])
            reach += np.max(radii[leg]) + np.max(np.abs(lean[leg])) + 0.1
            for k in range(len(centre)):
                if _distance(middle, centre[k], axes[k], half[k]) > reach:
                    continue
                for part in range(len(along) - 1):
                    thick = max(radii[leg, part], radii[leg, part + 1])
                    for i in range(points):
                        share = i / (points - 1.0)
                        s = (1.0 - share) * along[part] + share * along[part + 1]
                        o = (1.0 - share) * lean[leg, part] + share * lean[leg, part + 1]
                        for j in range(3):
                            p[j] = (1.0 - s) * knees[n, leg, j] + s * feet[n, leg, j]
                            p[j] += o * ahead[n, leg, j]
                        d = _distance(p, centre[k], axes[k], half[k]) - thick
                        room[n] = min(room[n], d)
    return room
