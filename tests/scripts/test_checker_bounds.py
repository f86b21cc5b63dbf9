"""The checker's bounds over a stretch of time hold what it finds at any time within."""

import sys
from functools import cache
from types import SimpleNamespace as Bag
from typing import Any

import numpy as np
import pytest
from certificate_rig import checker, record_of

from drake_quad.common import FloatArray

AT = np.linspace(0.0, 1.0, 9)  # places in a stretch
CLAIMS = {"margin": 0, "angles": 3, "torques": 4}  # words of what is wrong, and columns
LOAD = 250.0  # [N] under a foot


@cache
def read() -> tuple[Bag, Bag]:
    """A plan down stairs, whose shanks bulge, and a random eighth of each smooth stretch of it."""
    check = checker()
    work = check.read(record_of("descend"))
    rng = np.random.default_rng(0)
    work.robot.shank_ahead = rng.uniform(-0.05, 0.05, work.robot.shank_ahead.shape)
    items = check.cut(work)
    eighth = (items.b - items.a) / 8.0
    items.a = items.a + rng.integers(0, 8, len(eighth)) * eighth
    items.b = items.a + eighth
    return work, items


def at(items: Bag, place: float) -> Bag:
    """The same items at one time."""
    t = items.a + place * (items.b - items.a)
    return Bag(**{**vars(items), "a": t, "b": t})


def legs(items: Bag, *, load: float = LOAD, load_off: float = 0.0) -> Bag:
    """Of the items' legs, one each, body, joints and points, and torques that hold a load."""
    bounds, claims = (sys.modules[f"certificate_{name}"] for name in ("bounds", "claims"))
    robot, leg = read()[0].robot, np.arange(len(items.a)) % 4
    body, body_off, state = claims.legs_of(read()[0], items, leg)
    loads, loads_off = np.full(len(leg), load), np.full(len(leg), load_off)
    state.body, state.body_off, state.q_off = body, body_off, state.off
    state.torque, state.torque_off = bounds.torques(
        robot, leg, state, bounds.masses(robot, leg, state), (body, body_off), (loads, loads_off)
    )
    return state


def used(values: FloatArray, middle: FloatArray, off: FloatArray) -> float:
    """Of bounds, numbers' or balls', the most that is used; they are known nearly everywhere."""
    far = np.abs(values - middle) if off.ndim == 2 else np.linalg.norm(values - middle, axis=1)
    known = np.isfinite(off)
    assert known.mean() > 0.9
    return float(np.max((far[known] - 1e-9) / np.maximum(off[known], 1e-9)))


@pytest.mark.parametrize("name", ["body", "foot", "knee", "ahead", "q", "torque"])
def test_legs_are_where_their_bounds_say(name: str) -> None:
    """At any time; and somewhere they are so far off that a sixth of the bound would not do."""
    items = read()[1]
    middle = legs(items)
    value, off = getattr(middle, name), getattr(middle, f"{name}_off")
    found = [used(getattr(legs(at(items, place)), name), value, off) for place in AT]
    assert 1.0 / 6.0 < max(found) <= 1.0


@pytest.mark.parametrize("change", [-40.0, 40.0])
def test_torques_of_another_load_are_within_their_bounds(change: float) -> None:
    """At the same time, to the full: where nothing moves the load is all that does."""
    now = at(read()[1], 0.5)
    middle, other = legs(now, load_off=abs(change)), legs(now, load=LOAD + change)
    assert 0.8 < used(other.torque, middle.torque, middle.torque_off) <= 1.0


@pytest.mark.parametrize("claim", CLAIMS)
def test_statics_are_no_less_than_is_said(claim: str) -> None:
    """Margin, joints and torques at any time, each claimed so high that it is what lacks most."""
    work, items = read()
    claims: Any = sys.modules["certificate_claims"]
    raised = np.array(work.segments.claims)
    raised[:, CLAIMS[claim]] += 10.0
    work = Bag(**{**vars(work), "segments": Bag(**{**vars(work.segments), "claims": raised})})
    low, _, _, _ = claims.statics(work, items)
    known = np.isfinite(low)
    assert known.mean() > 0.9
    for place in AT:
        _, now, what, _ = claims.statics(work, at(items, place))
        assert {name.split()[-2] for name in what} == {claim}
        assert np.all(low[known] <= now[known] + 1e-12)


def test_shanks_are_no_nearer_than_is_said() -> None:
    """Whole parts of them, at any time, to the boxes of the stairs."""
    work, items = read()
    check, claims = checker(), sys.modules["certificate_claims"]
    parts = check.shank_items(work, items)
    assert len(parts.a) > 100
    low, _, _, _ = claims.shanks(work, parts)
    known = np.isfinite(low)
    assert known.mean() > 0.9
    for place in AT:
        for along in AT[::2]:
            now = at(parts, place)
            now.s0 = now.s1 = parts.s0 + along * (parts.s1 - parts.s0)
            assert np.all(low[known] <= claims.shanks(work, now)[1][known] + 1e-12)
