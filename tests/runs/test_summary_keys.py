"""The figures that a study may name are those that runs have."""

from typing import Any

import pytest

from drake_quad.runs.schema import FIGURES, WALL_CLOCK
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.run import simulate

STAND = (
    "design: given\ncourse: [{kind: floor, length: 4.0}]\nmission: [{kind: stand, duration: 0.3}]\n"
)
EVERYTHING = (
    "controller.kind=whole_body",
    "controller.period=0.002",
    "estimator.kind=ekf",
)


def leaves(summary: dict[str, Any], path: str = "") -> dict[str, Any]:
    """What is no mapping in it, by dotted paths."""
    found: dict[str, Any] = {}
    for name, value in summary.items():
        own = f"{path}.{name}".lstrip(".")
        found |= leaves(value, own) if isinstance(value, dict) else {own: value}
    return found


@pytest.mark.parametrize("overrides", [(), EVERYTHING, ("simulation.mode=kinematic",)])
def test_every_number_of_a_summary_can_be_named(overrides: tuple[str, ...]) -> None:
    """None is missing from the list, and the list has none that a run could not have."""
    summary = leaves(simulate(parse_scenario(STAND, source="test", overrides=overrides)).summary)
    numbers = {k for k, v in summary.items() if isinstance(v, int | float)}
    assert numbers <= {*FIGURES, *WALL_CLOCK}
    nothing = {k for k, v in summary.items() if v is None}
    gone = {k for k in FIGURES if k not in summary and k.split(".")[0] not in nothing}
    assert not gone
    if overrides == EVERYTHING:
        assert any(name.startswith("estimate.") for name in numbers)
