"""Every measured column of a log's row is of that row's time."""

import numpy as np
import pytest

from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.run import simulate
from drake_quad.stability.support_polygon import stability_margin

LONG = pytest.mark.long


@pytest.mark.parametrize(
    "log_period", [pytest.param(0.004, marks=LONG), 0.005, pytest.param(0.003, marks=LONG)]
)
def test_a_reader_recomputes_the_margin_of_every_row(log_period: float) -> None:
    """From that row's own feet and centre of mass, whether or not the monitor ticks with the log.

    In logs of before 23 246 of 33 558 rows had a margin of another time, by up to 0.18 m.
    """
    overrides = [f"simulation.log_period={log_period}", "mission=[{kind: walk, distance: 1.0}]"]
    chunks = iter(range(100))
    result = simulate(load_scenario("case_study", overrides), stop=lambda: next(chunks) >= 11)
    column = {name: result.table[name].to_numpy() for name in result.table.column_names}
    assert len(column["t"]) > 2.9 / log_period
    com = np.stack([column["com_x"], column["com_y"]], axis=1)
    bearing = np.stack([column[f"{leg}_bearing"] for leg in SHORT_NAMES], axis=1).astype(bool)
    place = np.stack(
        [np.stack([column[f"{leg}_position_{a}"] for a in "xy"], axis=1) for leg in SHORT_NAMES],
        axis=1,
    )
    expected = [stability_margin(c, p[b]) for c, p, b in zip(com, place, bearing, strict=True)]
    np.testing.assert_allclose(column["margin"], expected, rtol=0.0, atol=1e-9)
    assert np.all(column["margin_least"] <= column["margin"])
    lifted = np.flatnonzero(~bearing.all(axis=1))
    assert len(lifted) > 0 and lifted[-1] < len(bearing) - 1  # a foot lifted, and came down again
