"""Certifies a plan for every time, and writes what was proved to certificate.json.

The file is one JSON object: what is claimed, of which robot, plan and course, and the partition of
time with a witness of the forces. docs/certificates.md has each field. Its hash is the SHA-256 of
the object without it, as JSON with sorted keys and without spaces.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from drake_quad.certificate.bounds import Proof, make_demand, pose_problem, prove
from drake_quad.certificate.cells import Pieces, cut_pieces
from drake_quad.certificate.failure import Failure, Joins, check_joins, first_failure
from drake_quad.certificate.obstacles import find_box_obstacles
from drake_quad.common import FloatArray
from drake_quad.planning.contact_plan import FootRoll
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import RobotModel, ShankProfile
from drake_quad.terrain.boxes import Box
from drake_quad.util.display import html_table, one_line

FORMAT = "drake_quad certificate"
VERSION = 3
CLAIMS = ("margin", "foot_clearance", "shank_clearance", "joint_room", "torque_room")


def make_record(
    robot: RobotModel,
    shank: ShankProfile,
    plans: Sequence[MotionPlan],
    boxes: Sequence[Box],
    pieces: Pieces,
    proof: Proof,
) -> dict[str, Any]:
    """The certificate of a proven plan, as plain values.

    Args:
        robot: The robot.
        shank: Its shanks.
        plans: The mission's tasks.
        boxes: The course.
        pieces: The plan as it was proven.
        proof: The proof.
    """
    record = {
        "format": FORMAT,
        "version": VERSION,
        "demanded": dict(zip(CLAIMS, proof.demand.tolist(), strict=False)),
        "claimed": dict(zip(CLAIMS, proof.claims.min(axis=0).tolist(), strict=True)),
        "robot": _robot(robot, shank),
        "course": [_box(box) for box in boxes],
        "tasks": _tasks(plans, pieces, proof),
    }
    return {**record, "sha256": digest(record)}


def digest(record: dict[str, Any]) -> str:
    """The hash of a certificate's content; its own hash, if it has one, is left out."""
    content = {k: v for k, v in record.items() if k != "sha256"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _robot(robot: RobotModel, shank: ShankProfile) -> dict[str, Any]:
    """The robot's numbers that the claims depend on, in the legs' order FL, FR, RL, RR."""
    g = robot.geometry
    return {
        "name": robot.name,
        "trunk": robot.trunk,
        "joints": list(robot.joint_names),
        "hips": _plain(g.p_BH),
        "offsets": _plain(g.offset),
        "raised": _plain(g.raised),
        "thighs": _plain(g.thigh),
        "shanks": _plain(g.shank),
        "knee_signs": _plain(g.knee_sign),
        "q_lower": _plain(robot.q_lower),
        "q_upper": _plain(robot.q_upper),
        "efforts": _plain(robot.effort),
        "trunk_mass": float(robot.trunk_mass),
        "trunk_com": _plain(robot.trunk_com),
        "link_masses": _plain(robot.link_mass),
        "link_coms": _plain(robot.link_com),
        "foot_radius": float(robot.foot_radius),
        "shank_places": _plain(shank.along),
        "shank_ahead": _plain(shank.ahead),
        "shank_radii": _plain(shank.radii),
    }


def _box(box: Box) -> dict[str, Any]:
    return {
        "name": box.name,
        "centre": _plain(box.centre),
        "size": _plain(box.size),
        "yaw": float(box.yaw),
        "pitch": float(box.pitch),
    }


def _tasks(plans: Sequence[MotionPlan], pieces: Pieces, proof: Proof) -> list[dict[str, Any]]:
    """Every task: its motion, its segments with what is claimed of each, its partition of time."""
    cells = proof.cells
    owner, tasks, segment = pieces.task[cells.piece], [], 0
    ends = cells.middle + cells.half
    for index, plan in enumerate(plans):
        mine = owner == index
        segments = []
        for s in plan.segments:
            claims = dict(zip(CLAIMS, proof.claims[segment].tolist(), strict=True))
            segments.append(
                {"name": s.name, "kind": s.kind, "start": s.start, "end": s.end, **claims}
            )
            segment += 1
        tasks.append(
            {
                "duration": float(plan.duration),
                "knot": float(plan.body.knot),
                "control": _plain(plan.body.control),
                "feet": _plain(plan.contacts.feet),
                "roll": _roll(plan),
                "steps": [
                    {
                        "leg": int(step.leg),
                        "lift_off": float(step.lift_off),
                        "touchdown": float(step.touchdown),
                        "from": _plain(step.swing.p_start),
                        "to": _plain(step.swing.p_end),
                        "lasts": float(step.swing.duration),
                        "back": float(step.back),
                        "apex_time": float(step.swing.apex_time),
                        "apex_z": float(step.swing.apex_z),
                    }
                    for step in plan.contacts.steps
                ],
                "segments": segments,
                "partition": [0.0, *ends[mine][:-1].tolist(), float(plan.duration)],
                "shares": _plain(proof.bounds.witness[mine]),
            }
        )
    return tasks


def _roll(plan: MotionPlan) -> dict[str, Any]:
    """How far standing feet have rolled from where they were set down, linear between its times."""
    roll = plan.contacts.roll or FootRoll(np.array([0.0, plan.duration]), np.zeros((2, 4, 2)))
    return {"times": _plain(roll.times), "offset": _plain(roll.offset)}


def _plain(values: FloatArray) -> Any:
    """Nested lists of floats, -0 as 0."""
    return (np.asarray(values, dtype=float) + 0.0).tolist()


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is proven of a plan.

    Attributes:
        proof: The bounds.
        failure: The first time at which the plan does not meet the demand; None if it always does.
        record: What certificate.json holds; None where there is a failure.
        joins: Where its tasks meet, and how continuous it is there.
    """

    proof: Proof
    failure: Failure | None
    record: dict[str, Any] | None
    joins: Joins

    @property
    def least(self) -> dict[str, float | None]:
        """The least of each figure over the plan, by CLAIMS; None where nothing is known of it."""
        least = self.proof.claims.min(axis=0).tolist()
        return {n: v if isfinite(v) else None for n, v in zip(CLAIMS, least, strict=True)}

    def __repr__(self) -> str:
        if self.failure is not None:
            return one_line(self, "not certified", self.failure.reason)
        margin = self.least["margin"]
        told = "" if margin is None else f"static margin at least {margin:.4f} m"
        return one_line(self, "certified for every time", told)

    def _repr_html_(self) -> str:
        """What is proven, or where the proof fails, where a notebook shows it."""
        if self.failure is not None:
            where = f"task {self.failure.task + 1}, {self.failure.time:.3f} s after its start"
            return html_table([("not certified", self.failure.reason), ("from", where)])
        figures = dict(zip(CLAIMS, self.proof.claims.min(axis=0).tolist(), strict=True))
        return html_table(
            [
                ("certified", "for every time"),
                ("static margin at least", f"{figures['margin']:.4f} m"),
                ("swing feet to risers and nosings at least", f"{figures['foot_clearance']:.4f} m"),
                ("knees and shanks to the course at least", f"{figures['shank_clearance']:.4f} m"),
                ("joints inside their limits by at least", f"{figures['joint_room']:.3f} rad"),
                ("torques at most", f"{1.0 - figures['torque_room']:.1%} of their limits"),
            ]
        )


def certify_plans(
    robot: RobotModel,
    shank: ShankProfile,
    plans: Sequence[MotionPlan],
    boxes: Sequence[Box],
    *,
    margin: float = 0.0,
    clearance: float = 0.0,
) -> Certificate:
    """Proves what holds of a plan at every time.

    Args:
        robot: The robot.
        shank: How thick its shanks are.
        plans: The mission's tasks, each beginning where the one before ends.
        boxes: The course.
        margin: Static margin demanded [m].
        clearance: Clearance of feet and shanks demanded [m].
    """
    pieces = cut_pieces(plans)
    problem = pose_problem(robot, shank, pieces, find_box_obstacles(boxes))
    proof = prove(problem, make_demand(margin=margin, foot=clearance, shank=clearance))
    joins = check_joins(plans)
    found = [f for f in (joins.failure, first_failure(problem, proof)) if f is not None]
    failure = min(found, key=lambda f: (f.task, f.time), default=None)
    record = None if failure else make_record(robot, shank, plans, boxes, pieces, proof)
    return Certificate(proof, failure, record, joins)
