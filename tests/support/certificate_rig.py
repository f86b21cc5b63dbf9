"""What the tests of certificates share: certified plans, and the checker."""

import copy
import importlib
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from rig import paper_robot

from drake_quad.certificate.certify import Certificate, certify_plans
from drake_quad.certificate.kinematics import shank_of
from drake_quad.common import FloatArray
from drake_quad.math.curves import BodySpline
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.robot.model import ShankProfile
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import PreparedScenario, prepare

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"


@cache
def checker() -> ModuleType:
    """scripts/check_certificate.py as a module."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        return importlib.import_module("check_certificate")
    finally:
        sys.path.remove(str(SCRIPTS))


@cache
def prepared(name: str) -> PreparedScenario:
    """A shipped scenario, planned."""
    return prepare(load_scenario(name), source=name)


@cache
def paper_shank() -> ShankProfile:
    """The shipped robot's shanks."""
    return shank_of(paper_robot())


@cache
def certified(name: str) -> Certificate:
    """The certificate of a shipped scenario's plan."""
    p = prepared(name)
    return certify_plans(p.robot, paper_shank(), p.plan.plans, p.course.boxes)


def record_of(name: str) -> dict[str, Any]:
    """A copy of a shipped scenario's certificate.json."""
    record = certified(name).record
    assert record is not None
    return copy.deepcopy(record)


def with_body(plan: MotionPlan, control: FloatArray) -> MotionPlan:
    """The plan with other control points of the body."""
    return replace(plan, body=BodySpline(plan.body.knot, control))


def refusal(record: dict[str, Any], *, rehash: bool = False) -> str | None:
    """Why the checker refuses a record; None if it accepts it.

    Args:
        record: The record.
        rehash: Whether to give it the hash of its content first.
    """
    check = checker()
    if rehash:
        from drake_quad.certificate.certify import digest

        record = {**record, "sha256": digest(record)}
    try:
        check.check(record)
    except check.RefusedError as error:
        return str(error)
    return None
