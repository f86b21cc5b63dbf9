"""A run's margins: the smallest, the usual, and how near to the plan's."""

import numpy as np
import pytest
from summary_rig import PERIOD, changed, log, summary, values, with_columns


def test_margins_are_told_by_minimum_percentile_and_median() -> None:
    """And when the smallest was, however many samples are not numbers."""
    margin = np.linspace(0.3, 0.1, log().num_rows)
    margin[7], margin[11] = 0.01, np.nan
    found = summary(changed(margin=margin))["margin"]
    rest = margin[np.isfinite(margin)]
    assert found == {
        "minimum": 0.01,
        "percentile_1": pytest.approx(np.percentile(rest, 1)),
        "median": pytest.approx(np.median(rest)),
    }
    at = summary(changed(margin=margin))["margin_minimum_at"]
    assert at == pytest.approx(7 * PERIOD)


def test_share_of_samples_with_the_pressure_inside() -> None:
    """Of the samples that have a margin; the edge counts as inside; without any there is none."""
    zmp = np.full(log().num_rows, 0.01)
    zmp[:10], zmp[10:15], zmp[15:20] = -0.01, 0.0, np.nan
    share = 1.0 - 10 / (log().num_rows - 5)
    assert summary(changed(zmp_margin=zmp))["zmp_inside"] == pytest.approx(share)
    assert summary(changed(zmp_margin=np.full(len(zmp), np.nan)))["zmp_inside"] is None


def test_share_of_samples_near_the_plan() -> None:
    """Half a log that is 2.1 cm off counts as half, one that is 1.9 cm off as whole."""
    half = np.arange(log().num_rows) % 2 == 0
    for off, share in ((0.021, 1 - half.mean()), (-0.021, 1 - half.mean()), (0.019, 1.0)):
        margin = values("margin") + off * half
        assert summary(changed(margin=margin))["margin_within_20mm"] == pytest.approx(share)


def test_the_smallest_margin_counts_what_is_between_samples() -> None:
    """And of a segment, too; the rest is of the samples, and so is all of a log without it."""
    margin = np.full(log().num_rows, 0.2)
    least = margin.copy()
    least[40] = 0.05
    plain = summary(changed(margin=margin))
    found = summary(
        with_columns(changed(margin=margin), margin_least=least, zmp_margin_least=least)
    )
    assert plain["margin"]["minimum"] == 0.2
    assert found["margin"] == {"minimum": 0.05, "percentile_1": 0.2, "median": 0.2}
    assert found["zmp_margin"]["minimum"] == 0.05
    assert found["margin_minimum_at"] == pytest.approx(40 * PERIOD)
    assert min(s["margin_min"] for s in found["segments"]) == 0.05
