"""The profile of shanks: chains of rods that hold the shapes that they were read from."""

import numpy as np
from hypothesis import given, strategies as st
from rig import paper_robot

from drake_quad.common import FloatArray
from drake_quad.robot.model import SHANK_POINTS, ShankProfile
from drake_quad.robot.shank_profile import (
    ALONG,
    EASED,
    PLACES,
    box_edges,
    join_places,
    profile_of_rods,
)

LENGTH = 0.3  # [m] of the shank


def beyond(profile: ShankProfile, points: FloatArray) -> FloatArray:
    """How far points (n, 2), along and ahead, are from the chain of the first leg (n,) [m]."""
    nodes = np.stack([LENGTH * profile.along, profile.ahead[0]], axis=1)
    thick = np.maximum(profile.radii[0, :-1], profile.radii[0, 1:])
    way = np.diff(nodes, axis=0)
    from_start = points[:, None] - nodes[:-1]
    share = np.clip((from_start * way).sum(-1) / (way**2).sum(-1), 0.0, 1.0)
    off = np.linalg.norm(from_start - share[..., None] * way, axis=-1) - thick
    return np.asarray(off.min(axis=1))


def rods_of(rng: np.random.Generator, count: int) -> list[tuple[FloatArray, float]]:
    """Rods at random places of a shank."""
    ends = rng.uniform([-0.04, -0.03, -0.9 * LENGTH], [0.06, 0.03, 0.05], (count, 2, 3))
    shares = np.linspace(0.0, 1.0, ALONG)[:, None]
    return [
        (a + shares * (b - a), float(rng.uniform(0.005, 0.08)))
        for a, b in zip(ends[:, 0], ends[:, 1], strict=True)
    ]


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 4))
def test_a_profile_holds_all_rods_that_it_was_read_from(seed: int, count: int) -> None:
    """Seen from the side, no point of one is outside of the chain, as far down as that goes."""
    rng = np.random.default_rng(seed)
    rods = rods_of(rng, count)
    back, ahead = profile_of_rods(rods, LENGTH, 0.02)
    profile = join_places(PLACES, np.tile(back, (4, 1)), np.tile(ahead, (4, 1)))
    for line, radius in rods:
        angle = rng.uniform(0.0, 2.0 * np.pi, (len(line), 8))
        points = np.stack(
            [-line[:, 2, None] + radius * np.cos(angle), line[:, 0, None] + radius * np.sin(angle)],
            axis=-1,
        ).reshape(-1, 2)
        points = points[points[:, 0] <= PLACES[-1] * LENGTH]
        assert np.all(beyond(profile, points) <= 1e-9)
    assert np.all(beyond(profile, np.array([[0.0, 0.02], [-0.02, 0.0]])) <= 1e-9)  # the knee's ball


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 4))
def test_a_profile_holds_boxes_however_they_are_turned(seed: int, count: int) -> None:
    """By points on their faces; a rod as thick as a box would leave its corners out."""
    rng = np.random.default_rng(seed)
    rods: list[tuple[FloatArray, float]] = []
    points = []
    for _ in range(count):
        half = rng.uniform(0.005, 0.06, 3)
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        place = rng.uniform([-0.04, -0.03, -0.9 * LENGTH], [0.06, 0.03, 0.05])
        rods += [(edge @ turn.T + place, 0.0) for edge in box_edges(half)]
        faces = rng.uniform(-1.0, 1.0, (200, 3))
        faces[np.arange(200), rng.integers(3, size=200)] = rng.choice([-1.0, 1.0], 200)
        points.append((faces * half) @ turn.T + place)
    back, ahead = profile_of_rods(rods, LENGTH, 0.0)
    profile = join_places(PLACES, np.tile(back, (4, 1)), np.tile(ahead, (4, 1)))
    at = np.concatenate(points)
    beside = np.stack([-at[:, 2], at[:, 0]], axis=1)
    beside = beside[beside[:, 0] <= PLACES[-1] * LENGTH]
    assert np.all(beyond(profile, beside) <= 1e-9)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 4))
def test_fewer_places_make_a_shank_hardly_thicker(seed: int, count: int) -> None:
    """At each place it reaches no farther than twice what may be given away, but by a jump."""
    rods = rods_of(np.random.default_rng(seed), count)
    back, ahead = profile_of_rods(rods, LENGTH, 0.0)
    profile = join_places(PLACES, np.tile(back, (4, 1)), np.tile(ahead, (4, 1)))
    assert profile.along[0] == 0.0 and profile.along[-1] == PLACES[-1]
    own = 0.5 * (ahead - back)
    part = np.clip(np.searchsorted(profile.along, PLACES, side="right") - 1, 0, None)
    part = np.minimum(part, len(profile.along) - 2)
    thick = np.maximum(profile.radii[0, part], profile.radii[0, part + 1])
    inside = ~np.isin(PLACES, profile.along)
    assert np.all(thick[inside] <= own[inside] + 3.0 * EASED + 1e-12)


def test_a_ball_at_the_knee_does_not_make_the_whole_shank_thick() -> None:
    """The shipped robot's knees are balls of 50 mm over shanks of 18 mm: so its profile says."""
    robot = paper_robot()
    profile = robot.shank_profile
    assert profile is not None and profile.along[-1] == SHANK_POINTS[-1]
    assert np.all(np.abs(profile.ahead) <= 1e-9)
    np.testing.assert_allclose(profile.radii[:, 0], 0.050, atol=1e-9)
    np.testing.assert_allclose(profile.radii[:, 1:], 0.018, atol=1e-9)
    assert profile.along[1] <= 0.031
