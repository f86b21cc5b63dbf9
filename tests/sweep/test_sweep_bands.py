"""Bands and rates say what they are: names that differ, and no 100 % that is none."""

import json

import pytest
from hypothesis import assume, given, strategies as st

from drake_quad.sweep.findings import bin_indices, bins_of
from drake_quad.sweep.statistics import percent, rate_of
from drake_quad.sweep.study import Vary


@pytest.mark.parametrize(
    ("vary", "labels"),
    [
        (Vary(path="a", uniform=[0.5, 1.25], bands=3), ["0.5 to 0.75", "0.75 to 1", "1 to 1.25"]),
        (Vary(path="a", uniform=[1000, 1001], bands=2), ["1000 to 1000.5", "1000.5 to 1001"]),
        (Vary(path="a", uniform=[0.8, 0.9], step=1.0), ["1 to 1"]),
        (
            Vary(path="a", uniform=[-0.01, 0.02], bands=3),
            ["-0.01 to 0", "0 to 0.01", "0.01 to 0.02"],
        ),
        (Vary(path="a", log_uniform=[1e-3, 1e13], bands=2), ["0.001 to 1e+05", "1e+05 to 1e+13"]),
        (Vary(path="a", linspace=[0.1, 0.1000002, 3]), ["0.1", "0.1000001", "0.1000002"]),
        (Vary(path="a", values=[1 / 3, 7]), ["0.333333", "7"]),
        (Vary(path="a", values=["1", 1, 2]), ['"1"', "1", "2"]),
    ],
)
def test_labels_have_the_digits_that_tell_them_apart(vary: Vary, labels: list[str]) -> None:
    """A few where these do, as many as it takes where not; of 1000 to 1001 all were 1e+03."""
    assert bin_indices(vary, [])[0] == labels


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.integers(1, 50))
def test_no_two_bands_have_the_same_name(one: float, other: float, bands: int) -> None:
    """However near to each other a study's ends are; bands without width there are none."""
    low, high = sorted((one, other))
    assume(low < high)
    labels, _, ends = bin_indices(Vary(path="a", uniform=[low, high], bands=bands), [])
    assert len(set(labels)) == len(labels) and all(a < b for a, b in ends)


def test_true_is_not_one() -> None:
    """What is no list of numbers is told apart by type, too, and comes so out of a table's JSON."""
    vary = Vary(path="a", choice=[True, 1, 1.0, "x", {"y": 1}, {"y": True}])
    values = [json.loads(json.dumps(value)) for value in [1.0, True, {"y": 1}, 1.0, 1, {"y": True}]]
    bands = bins_of(vary, values, [True] * 6)
    assert [band.rate.trials for band in bands] == [1, 1, 2, 0, 1, 1]
    assert [band.label for band in bands[:4]] == ["true", "1", "1.0", '"x"']


def test_one_number_written_in_two_ways_is_one() -> None:
    """A list of numbers is a table's column of them, where 1 is 1.0."""
    bands = bins_of(Vary(path="a", choice=[2, 1, 1.0]), [1.0, 2.0, 1.0], [True, False, False])
    assert [(b.label, b.rate.good, b.rate.trials) for b in bands] == [("1", 1, 2), ("2", 0, 1)]


@pytest.mark.parametrize(
    ("part", "text"),
    [(0.0, "0.0"), (1e-9, "<0.1"), (0.00049, "<0.1"), (0.0006, "0.1"), (0.975, "97.5"),
     (0.9994, "99.9"), (0.99986, ">99.9"), (1.0 - 1e-16, ">99.9"), (1.0, "100.0")],
)  # fmt: skip
def test_only_all_is_a_hundred_percent(part: float, text: str) -> None:
    """And only nothing is 0 %, however near a rate or a bound comes."""
    assert percent(part) == text


def test_a_bound_below_one_is_not_printed_as_one() -> None:
    """The upper bound of 179 of 180 is 99.986 %, the lower one of 1 of 180 is 0.014 %."""
    assert rate_of(179, 180).text() == "99.4 % (96.9 to >99.9 %)"
    assert rate_of(1, 180).text() == "0.6 % (<0.1 to 3.1 %)"
    assert rate_of(180, 180).text() == "100.0 % (98.0 to 100.0 %)"
