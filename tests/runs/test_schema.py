"""What the schema says of a run's files is what runs leave, and what the documents say."""

from functools import cache
from pathlib import Path
from typing import Any

import pytest

from drake_quad.robot.loader import MakeModelPlant
from drake_quad.runs.result import RunResult
from drake_quad.runs.schema import (
    ESTIMATED,
    EVERY,
    FEASIBLE,
    FRICTION,
    KINEMATIC,
    PHYSICS,
    SIGNALS,
    WHOLE_BODY,
)
from drake_quad.runs.summary_figures import SUMMARY
from drake_quad.runs.summary_lines import summary_lines
from drake_quad.scenario.build import robot_of
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.run import simulate

DOCS = Path(__file__).resolve().parents[2] / "docs"
STAND = (
    "design: given\ncourse: [{kind: floor, length: 4.0}]\nmission: [{kind: stand, duration: 0.3}]\n"
)
EVERYTHING = (
    "controller.kind=whole_body",
    "controller.period=0.002",
    "estimator.kind=ekf",
    "monitor.margins=feasible",
    "disturbances.pushes=[{time: 0.1, speed: 0.05}]",
)
# Overrides of a short run, and the signals that its log is to have.
RUNS: dict[tuple[str, ...], set[str]] = {
    (): {EVERY, PHYSICS, FRICTION},
    ("monitor.margins=hull",): {EVERY, PHYSICS},
    ("simulation.mode=kinematic",): {EVERY, KINEMATIC},
    EVERYTHING: {EVERY, PHYSICS, FRICTION, FEASIBLE, ESTIMATED, WHOLE_BODY},
}


@cache
def result(overrides: tuple[str, ...]) -> RunResult:
    return simulate(parse_scenario(STAND, source="test", overrides=overrides))


def leaves(summary: dict[str, Any], path: str = "") -> dict[str, Any]:
    """What is no mapping in it, by dotted keys; the tables of a list by those of the first."""
    found: dict[str, Any] = {}
    for name, value in summary.items():
        own = f"{path}.{name}".lstrip(".")
        if isinstance(value, dict) and own != "versions":
            found |= leaves(value, own)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            found |= {own: value, **leaves(value[0], f"{own}[]")}
        else:
            found[own] = value
    return found


@pytest.mark.parametrize("overrides", RUNS)
def test_a_runs_log_has_just_the_columns_of_the_schema(overrides: tuple[str, ...]) -> None:
    """None is unknown to the schema, and none of those that such a run has is missing."""
    made = result(overrides)
    robot = robot_of(made.scenario)
    plant = MakeModelPlant(robot.url)
    names = {
        "joint": robot.joint_names,
        "position": plant.GetPositionNames(),
        "velocity": plant.GetVelocityNames(),
    }
    where = RUNS[overrides]
    expected = [c for signal in SIGNALS if signal.where in where for c in signal.columns(names)]
    assert made.table.column_names == expected and made.table.num_rows > 10


@pytest.mark.parametrize("overrides", RUNS)
def test_a_runs_summary_has_just_the_keys_of_the_schema(overrides: tuple[str, ...]) -> None:
    """Each is in the schema as the kind that it is; each of the schema's is there or null."""
    found = leaves(result(overrides).summary)
    known = {key: figure for figure in SUMMARY for key in figure.keys}
    types = {
        "number": int | float,
        "spread": int | float,
        "verdict": bool,
        "text": str,
        "list": list,
        "tables": list,
        "words": dict,
    }
    for key, value in found.items():
        if value is None:
            assert key in known or any(k.startswith(f"{key}.") for k in known), key
        else:
            assert isinstance(value, types[known[key].kind]), key
    empty = {key for key, value in found.items() if value is None or value == []}
    missing = [
        key
        for key in known
        if key not in found and not any(key.startswith((f"{e}.", f"{e}[]")) for e in empty)
    ]
    absent = () if "simulation.mode=kinematic" in overrides else ("overlaps",)
    assert [key for key in missing if not key.startswith(absent)] == []


def test_figures_that_only_one_kind_of_run_has_are_there() -> None:
    """The two tests above see estimates, pushes, margins within torques, and printed lines."""
    found = leaves(result(EVERYTHING).summary)
    assert {"estimate.drift", "pushes[].speed", "margin_feasible.minimum"} <= set(found)
    assert ("contacts of anything but feet", "0") in summary_lines(result(()).summary)


def test_figures_in_another_unit_than_their_own_are_converted() -> None:
    """A time of 0.032 s is 32 ms in the report, not 0 ms."""
    factors = {("m", "mm"): 1e3, ("s", "ms"): 1e3, ("", "%"): 100.0, ("of the limit", "%"): 100.0}
    seen = set()
    for figure in SUMMARY:
        if figure.shown is not None and figure.shown.unit not in ("", "°", figure.unit):
            pair = figure.unit, figure.shown.unit
            assert figure.scale == factors[pair], figure.key
            seen.add(pair[1])
    assert seen == {"mm", "ms", "%"}
