"""How long certificates take, whether any is false, and whether a changed one is ever accepted.

    python -m benchmarks.certificates --plans 1000 --tamper 1000

Asked: the case study certified in 2 s at most, checked again in 5 s at most; none of 1000 random
plans, each sampled at 10 kHz, with a value below its certificate's; none of 1000 changed
certificates accepted; the paper's transitions in four steps certified with 0.10 m and 0.045 m.
"""

import argparse
import copy
import importlib
import json
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from paper.gaits import find_alternatives, spin_goal, wave_goal

from benchmarks.certificate_plans import (
    massless_legs,
    random_plan,
    read_record,
    transition_plan,
)
from benchmarks.certificate_samples import sampled_minima
from benchmarks.common import markdown_table, provenance
from drake_quad.certificate.certify import CLAIMS, certify_plans, digest
from drake_quad.certificate.kinematics import shank_of
from drake_quad.certificate.obstacles import find_box_obstacles
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.config import RobotConfig
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.plan_report import certify_plan
from drake_quad.simulation.prepare import prepare
from drake_quad.terrain.boxes import Box
from drake_quad.terrain.course import build_course
from drake_quad.terrain.elements import Element

RATE = 10000.0  # [Hz]
SCENARIOS = ("case_study", "descend", "flat_walk", "spin_both_ways", "paper_physics")
SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"


def load_checker() -> ModuleType:
    """scripts/check_certificate.py as a module."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        return importlib.import_module("check_certificate")
    finally:
        sys.path.remove(str(SCRIPTS))


def refusal(record: dict[str, Any]) -> str | None:
    """Why the checker refuses a record; None if it accepts it."""
    checker = load_checker()
    try:
        checker.check(record)
    except checker.RefusedError as error:
        return str(error)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        return f"{type(error).__name__} {error}"
    return None


def measure_times(scenarios: tuple[str, ...] = SCENARIOS, repeats: int = 3) -> list[dict[str, Any]]:
    """Certifies scenarios' plans and checks the certificates, the best of some repeats [s]."""
    rows = []
    for name in scenarios:
        p = prepare(load_scenario(name), source=name)
        proving, checking = [], []
        for _ in range(repeats):
            told, certificate = certify_plan(p)
            proving.append(told["certifying_time"])
            if certificate is not None and certificate.record is not None:
                begun = time.perf_counter()
                why = refusal(certificate.record)
                checking.append(time.perf_counter() - begun)
                assert why is None, why
        rows.append(
            {
                "scenario": name,
                "duration": p.plan.duration,
                "certified": told["certified"],
                "reason": told["reason"],
                "proven": told["proven"],
                "intervals": told["intervals"],
                "certify": min(proving),
                "check": min(checking, default=None),
            }
        )
    return rows


def certify_transitions() -> list[dict[str, Any]]:
    """The paper's two transitions in four steps, the body shifting by at most 0.1 m."""
    robot = load_robot(RobotConfig().model)
    shank = shank_of(robot)
    course = build_course([Element("floor", length=8.0, width=8.0)], foot_radius=robot.foot_radius)
    floor = [replace(b, centre=b.centre - [4.0, 0.0, 0.0]) for b in course.boxes]
    rows = []
    for name, goal in (("wave", wave_goal()), ("spin", spin_goal())):
        transition = find_alternatives(goal).shifting
        for masses, model in (("none in the legs", massless_legs(robot)), ("all", robot)):
            plan = transition_plan(model, transition, height=0.85, swing=1.2, shift=1.3)
            certificate = certify_plans(model, shank, [plan], floor)
            record = certificate.record
            rows.append(
                {
                    "transition": name,
                    "steps": len(transition.steps),
                    "masses": masses,
                    "margin": float(certificate.proof.claims[0, 0]),
                    "checked": refusal(record) is None if record else None,
                    "reason": certificate.failure.reason if certificate.failure else "",
                }
            )
    return rows


def study_falsehood(
    count: int, seed: int, *, rate: float = RATE, seconds: float = np.inf
) -> dict[str, Any]:
    """Certifies random plans, samples each, and counts values below what was certified.

    A refusal is counted as mistaken if no sample is as bad as what it says.

    Args:
        count: How many plans.
        seed: Seed of everything random.
        rate: Rate of the samples [Hz].
        seconds: Time after which no further plan is begun [s]; the result says how many there were.
    """
    begun = time.perf_counter()
    rng = np.random.default_rng(seed)
    robot = load_robot(RobotConfig().model)
    shank = shank_of(robot)
    told: Counter[str] = Counter()
    sampled, closest = 0.0, np.full(5, np.inf)
    while told["plans"] < count and time.perf_counter() - begun < seconds:
        found = random_plan(robot, rng)
        if found is None:
            told["without a plan"] += 1
            continue
        model, course, plans = found
        told["plans"] += 1
        if told["plans"] % 10 == 0:
            print(dict(told), f"{time.perf_counter() - begun:.0f} s", file=sys.stderr, flush=True)
        certificate = certify_plans(model, shank, plans, course.boxes)
        obstacles = find_box_obstacles(course.boxes)
        least = np.concatenate([sampled_minima(model, shank, p, obstacles, rate) for p in plans])
        sampled += sum(p.duration for p in plans)
        above = least[:, :5] - certificate.proof.claims
        if np.any(above < 0.0) or (certificate.record is not None and least[:, 5].min() < 0.0):
            told["false"] += 1
        if certificate.record is None:
            told["refused"] += 1
            if least.min() > 1e-4:
                told["refused, no sample at fault"] += 1
            continue
        told["certified"] += 1
        closest = np.minimum(closest, above.min(axis=0))
        if refusal(certificate.record) is not None:
            told["certified, but not accepted by the checker"] += 1
    return {
        **told,
        "false": told["false"],
        "seed": seed,
        "rate": rate,
        "sampled_seconds": sampled,
        "least_above_claim": dict(zip(CLAIMS, closest.tolist(), strict=True)),
    }


def study_tampering(
    count: int, seed: int, scenario: str = "descend", *, seconds: float = np.inf
) -> dict[str, Any]:
    """Changes numbers of a certificate at random: as they are, and with the hash made right.

    With the right hash a record is another claim, which may well be true. So what the checker then
    accepts is sampled, and counted if a value is below what it claims.
    """
    rng = np.random.default_rng(seed)
    _, certificate = certify_plan(prepare(load_scenario(scenario), source=scenario))
    assert certificate is not None and certificate.record is not None
    whole = certificate.record
    told: Counter[str] = Counter()
    begun = time.perf_counter()
    while told["changed"] < count and time.perf_counter() - begun < seconds:
        record = copy.deepcopy(whole)
        _change(record, rng)
        told["changed"] += 1
        if refusal(record) is None:
            told["accepted"] += 1
        record["sha256"] = digest(record)
        if refusal(record) is None:
            told["accepted with its hash made right"] += 1
            if _untrue(record):
                told["accepted with its hash made right, and untrue"] += 1
    zero = {"accepted": 0, "accepted with its hash made right, and untrue": 0}
    return {**zero, **told, "seed": seed, "scenario": scenario}


def _change(record: dict[str, Any], rng: np.random.Generator) -> None:
    """Changes one number: any field is as likely as any other, however long its list."""
    while True:
        holder: Any = record
        key: Any = None
        value: Any = record
        while isinstance(value, dict | list) and len(value):
            holder = value
            key = rng.choice(list(value)) if isinstance(value, dict) else rng.integers(len(value))
            key = str(key) if isinstance(value, dict) else int(key)
            value = value[key]
        if isinstance(value, int | float) and not isinstance(value, bool):
            break
    size = 10.0 ** rng.uniform(-7.0, 0.5)
    by = float(rng.choice([-1.0, 1.0]) * size * (abs(value) if rng.random() < 0.5 else 1.0))
    holder[key] = value + (by if by else size)


def _untrue(record: dict[str, Any], rate: float = 500.0) -> bool:
    """Whether a sample of a record's plan is below what it claims."""
    robot, shank, plans = read_record(record)
    boxes = [
        Box(b["name"], np.array(b["centre"]), np.array(b["size"]), b["yaw"], 0, b["pitch"])
        for b in record["course"]
    ]
    obstacles = find_box_obstacles(boxes)
    for plan, task in zip(plans, record["tasks"], strict=True):
        claims = np.array([[s[c] for c in CLAIMS] for s in task["segments"]])
        least = sampled_minima(robot, shank, plan, obstacles, rate)
        if np.any(least[:, :5] < claims - 1e-9) or least[:, 5].min() < 0.0:
            return True
    return False


def report(result: dict[str, Any]) -> str:
    """The figures as Markdown."""
    lines = [provenance(), ""]
    if "times" in result:
        rows = [
            [
                r["scenario"], f"{r['duration']:.0f}", "yes" if r["certified"] else r["reason"],
                str(r["intervals"]), f"{r['certify']:.2f}",
                "-" if r["check"] is None else f"{r['check']:.2f}",
                *(f"{r['proven'][c]:.4f}" for c in CLAIMS),
            ]
            for r in result["times"]
        ]  # fmt: skip
        header = ["scenario", "lasts [s]", "certified", "intervals", "certify [s]", "check [s]",
                  *CLAIMS]  # fmt: skip
        lines += [markdown_table(header, rows), ""]
    if "transitions" in result:
        rows = [
            [r["transition"], str(r["steps"]), r["masses"], f"{r['margin']:.4f}", str(r["checked"])]
            for r in result["transitions"]
        ]
        header = ["transition", "steps", "leg masses", "margin proven [m]", "checked"]
        lines += [markdown_table(header, rows), ""]
    for name in ("falsehood", "tampering"):
        if name in result:
            lines += [f"{name}: {json.dumps(result[name])}", ""]
    return "\n".join(lines)


def main() -> None:
    """Parses what to do, does it and prints it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--plans", type=int, default=0, help="random plans to certify and sample")
    parser.add_argument("--tamper", type=int, default=0, help="certificates to change")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=np.inf, help="most time for each study")
    parser.add_argument("--no-times", action="store_true", help="leave out times and transitions")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    result: dict[str, Any] = {}
    if not asked.no_times:
        result["times"] = measure_times()
        result["transitions"] = certify_transitions()
    if asked.plans:
        result["falsehood"] = study_falsehood(asked.plans, asked.seed, seconds=asked.seconds)
    if asked.tamper:
        result["tampering"] = study_tampering(asked.tamper, asked.seed, seconds=asked.seconds)
    print(json.dumps(result) if asked.json else report(result))


if __name__ == "__main__":
    main()
