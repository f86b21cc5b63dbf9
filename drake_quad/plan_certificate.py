"""The certificate of a scenario's plan: what `drake-quad plan` prints of it, and its file."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from drake_quad.certificate.certify import Certificate, certify
from drake_quad.certificate.chain import shank_of
from drake_quad.certificate.record import CLAIMS
from drake_quad.preparation import Preparation
from drake_quad.whole_files import Write, write_together

FILE, PLAN = "certificate.json", "plan.json"


def certify_plan(p: Preparation) -> tuple[dict[str, Any], Certificate | None]:
    """Certifies a prepared scenario's plan.

    Returns:
        The result as plain values, for `plan --json`: `certified`, `reason`, `time` [s] of the
        mission and `segment` of the first failure, `proven` (the least of each figure over the
        plan), `jumps` (the greatest of body and feet where tasks meet, of value, rate and
        acceleration), `intervals` of time that it took, `certifying_time` [s]; and the certificate,
        None of a plan that is not looked at, for it has swings along arcs.
    """
    begun = time.perf_counter()
    arc = _first_arc(p)
    if arc is not None:
        at, segment = arc
        reason = "swings along arcs are no polynomials of time, of which proofs are made"
        none = {"proven": {}, "jumps": {}, "intervals": 0, "certifying_time": 0.0}
        return {
            "certified": False, "reason": reason, "time": at, "segment": segment, **none
        }, None  # fmt: skip
    asked = p.scenario.certify
    certificate = certify(
        p.robot,
        shank_of(p.robot),
        p.plan.plans,
        p.course.boxes,
        margin=asked.margin,
        clearance=asked.clearance,
    )
    taken = time.perf_counter() - begun
    failure = certificate.failure
    segments = [s.name for plan in p.plan.plans for s in plan.segments]
    told = {
        "certified": failure is None,
        "reason": failure.reason if failure else "",
        "time": p.plan.starts[failure.task] + failure.time if failure else None,
        "segment": segments[failure.segment] if failure else None,
        "proven": dict(zip(CLAIMS, certificate.proof.claims.min(axis=0).tolist(), strict=True)),
        "jumps": np.maximum(
            certificate.joins.body.max(axis=1), [certificate.joins.feet, 0.0, 0.0]
        ).tolist(),
        "intervals": len(certificate.proof.cells.half),
        "certifying_time": taken,
    }
    return told, certificate


def _first_arc(p: Preparation) -> tuple[float, str] | None:
    """When and in which segment a plan has its first swing along an arc, if it has one."""
    for plan, start in zip(p.plan.plans, p.plan.starts, strict=True):
        for step in plan.contacts.steps:
            if step.swing.pivot is not None:
                segment = plan.segments[plan.segment_index(step.lift_off)]
                return start + step.lift_off, segment.name
    return None


def write_plan(told: dict[str, Any], certificate: Certificate | None, directory: Path) -> None:
    """Writes plan.json, and certificate.json; without a certificate no old one stays, either.

    Args:
        told: What plan.json holds.
        certificate: Of the plan, if there is a plan.
        directory: Where to.

    Raises:
        InputError: If they cannot be written; what was there before stays.
    """
    files: dict[Path, Write] = {}
    if certificate is not None and certificate.record is not None:
        record = json.dumps(certificate.record, allow_nan=False) + "\n"
        files[directory / FILE] = lambda path: path.write_text(record, encoding="utf-8")
    plan = json.dumps(told, indent=2) + "\n"
    files[directory / PLAN] = lambda path: path.write_text(plan, encoding="utf-8")
    write_together(files, gone=[directory / FILE])


def certificate_lines(told: dict[str, Any]) -> list[str]:
    """What is proven, or the first time at which it fails and why, for people."""
    proven = told["proven"]
    where = f"from {told['time']:.3f} s on, in '{told['segment']}'" if told["segment"] else ""
    if not told["certified"]:
        return [f"not certified: {told['reason']}, {where}"]
    figures = [
        ("static margin at least", f"{proven['margin']:.4f} m"),
        ("swing feet from risers and nosings at least", f"{proven['foot_clearance']:.4f} m"),
        ("knees and shanks from the course at least", f"{proven['shank_clearance']:.4f} m"),
        ("joints inside their limits by at least", f"{proven['joint_room']:.3f} rad"),
        ("torques to stand still at most", f"{1.0 - proven['torque_room']:.1%} of their limits"),
    ]
    head = (
        f"certified for every time, in {told['intervals']} intervals, "
        f"{told['certifying_time']:.2f} s:"
    )
    lines = [f"  {name} {value}" for name, value in figures]
    return [head, *lines, "  body and feet continuous to the acceleration, also between tasks"]


def print_certificate(told: dict[str, Any], console: Console) -> None:
    """Prints `certificate_lines`."""
    for line in certificate_lines(told):
        console.print(Text(line), soft_wrap=True)
