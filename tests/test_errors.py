"""What errors on purpose say: one line, whole where values are ordinary, bounded where not."""

import time
from typing import Any

import pytest

from drake_quad.errors import LONGEST, InputError, brief


@pytest.mark.parametrize(
    "value",
    [
        "/home/somebody/a folder of robots" * 6,
        {"b": 1, "a": [1, {"c": [2.5, None]}]},
        [f"{leg}_{joint}_joint" for leg in ("FL", "FR", "RL") for joint in "ahk"],
        10**30,
        float("nan"),
    ],
)
def test_ordinary_values_are_told_whole(value: Any) -> None:
    """As Python writes them: paths of 200 letters, mappings in their order, large numbers."""
    assert len(repr(value)) < LONGEST
    assert brief(value) == repr(value)


def test_endless_values_are_told_briefly_and_at_once() -> None:
    """Lists of lists of lists, whether by aliases or of themselves, long text, long numbers."""
    many: list[Any] = ["x"] * 9
    for _ in range(20):
        many = [many] * 9
    own: list[Any] = []
    own.append(own)
    begun = time.perf_counter()
    for value in (many, own, {"a": many}, "x" * 20000, 10**300, 10**5000, -(10**5000)):
        assert len(brief(value)) <= LONGEST + 40
    assert time.perf_counter() - begun < 2.0


def test_line_is_bounded_whatever_is_in_it() -> None:
    """Each part of it; its attributes are as given."""
    long = "x" * 20000
    error = InputError(source=long, field=long, value=long, remedy=long)
    assert len(str(error)) < 6000
    assert (error.source, error.field, error.value, error.remedy) == (long, long, long, long)
