"""What happens at edges in disparity images that are made by hand, and against plain filters."""

import numpy as np
import pytest
import scipy
from hypothesis import given, settings, strategies as st

from drake_quad.common import FloatArray
from drake_quad.perception.stereo_edges import (
    EDGE_JUMP,
    between_nodes,
    grow_near_sides,
    list_flying,
    mark_edges,
    mark_shadows,
)

SHAPE = (24, 40)


def blocks(seed: int) -> FloatArray:
    """A slanted wall with blocks before it, at random places."""
    generator = np.random.default_rng(seed)
    disparity = np.linspace(4.0, 9.0, SHAPE[0])[:, np.newaxis] * np.ones(SHAPE)
    for _ in range(4):
        v, u = generator.integers(0, SHAPE[0] - 6), generator.integers(0, SHAPE[1] - 8)
        disparity[v : v + 6, u : u + 8] += generator.uniform(0.3, 8.0)
    return disparity


def edges(disparity: FloatArray) -> np.ndarray:
    """Pixels whose disparity has a second difference, down or across."""
    edge = np.zeros(disparity.shape, dtype=bool)
    edge[1:-1] = np.abs(np.diff(disparity, 2, axis=0)) > EDGE_JUMP
    edge[:, 1:-1] |= np.abs(np.diff(disparity, 2, axis=1)) > EDGE_JUMP
    return edge


@pytest.mark.parametrize("slope", [0.0, 0.4, 3.0])
def test_a_slanted_plane_has_no_edges(slope: float) -> None:
    """However fast its disparity changes from row to row."""
    beside = np.zeros(SHAPE, dtype=np.uint8)
    mark_edges(20.0 + slope * np.arange(SHAPE[0])[:, np.newaxis] * np.ones(SHAPE), 2, beside)
    assert not beside.any()


@given(seed=st.integers(0, 10_000), reach=st.integers(1, 3))
@settings(max_examples=30, deadline=None)
def test_what_is_near_an_edge_is_what_a_maximum_filter_says(seed: int, reach: int) -> None:
    """The window is a square about each pixel of an edge."""
    disparity, beside = blocks(seed), np.zeros(SHAPE, dtype=np.uint8)
    mark_edges(disparity, reach, beside)
    wanted = scipy.ndimage.maximum_filter(edges(disparity), 2 * reach + 1, mode="constant")
    assert np.array_equal(beside.astype(bool), wanted)


def test_near_things_shade_what_is_behind_to_their_left() -> None:
    """A block before a wall hides as many columns as its disparity is greater."""
    disparity = np.full((20, 60), 4.0)
    disparity[5:15, 30:40] = 12.0
    hidden = np.zeros(disparity.shape, dtype=np.uint8)
    mark_shadows(disparity, hidden)
    assert hidden[10, 22:30].sum() >= 7 and not hidden[10, 30:].any() and not hidden[10, :21].any()
    assert not hidden[:5].any()


@given(seed=st.integers(0, 10_000), reach=st.sampled_from([0.75, 1.5, 3.0]))
@settings(max_examples=30, deadline=None)
def test_near_sides_grow_as_plain_filters_say(seed: int, reach: float) -> None:
    """Where the field allows it, a pixel near an edge takes the greatest disparity around it."""
    disparity = blocks(seed)
    field = np.random.default_rng(seed).standard_normal(SHAPE)
    lost, grown = np.ones(SHAPE, dtype=np.uint8), np.empty(SHAPE)
    grow_near_sides(disparity, reach, field, 1, grown, lost)
    window = int(np.ceil(reach))
    greatest = scipy.ndimage.grey_dilation(disparity, size=(2 * window + 1,) * 2)
    beside = scipy.ndimage.maximum_filter(edges(disparity), 2 * window + 1, mode="constant")
    share = np.clip(0.5 + 0.5 * field, 0.0, 1.0)
    grows = beside & (greatest - disparity > EDGE_JUMP) & (share < reach / window)
    assert np.array_equal(grown, np.where(grows, greatest, disparity))
    assert np.array_equal(lost == 0, grows)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_what_may_fly_lies_between_two_sides(seed: int) -> None:
    """Each pixel is told once, at an edge, with the least and the greatest disparity around it."""
    disparity = blocks(seed)
    rows = np.empty((disparity.size, 4))
    rows = rows[: list_flying(disparity, rows)]
    v, u = rows[:, 0].astype(int), rows[:, 1].astype(int)
    low = scipy.ndimage.minimum_filter(disparity, 3)
    high = scipy.ndimage.maximum_filter(disparity, 3)
    beside = scipy.ndimage.maximum_filter(edges(disparity), 3, mode="constant")
    at = np.zeros(SHAPE, dtype=bool)
    at[v, u] = True
    assert np.array_equal(at, beside & (high - low > EDGE_JUMP)) and len(rows) == at.sum()
    assert np.array_equal(rows[:, 2:], np.stack([low[v, u], high[v, u]], axis=1))


def test_a_field_is_bilinear_between_its_nodes() -> None:
    """At nodes it has their values; a plane is met everywhere."""
    i, j = np.arange(5.0)[:, np.newaxis], np.arange(7.0)[np.newaxis]
    nodes = 2.0 * i - 0.5 * j
    for v, u in ((0, 0), (3, 6), (7, 10), (11, 17)):
        assert between_nodes(nodes, 3, v, u) == pytest.approx(2.0 * v / 3.0 - 0.5 * u / 3.0)
