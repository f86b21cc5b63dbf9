"""A plan of any length is certified in the memory of a short one: a part of its cells at a time."""

import tracemalloc

import numpy as np
import pytest
from certificate_rig import certified, paper_shank, prepared

from drake_quad.certificate import bounds as cell_bounds, obstacles
from drake_quad.certificate.bounds import TOLERANCE
from drake_quad.certificate.cells import cut_pieces
from drake_quad.certificate.certify import certify_plans
from drake_quad.certificate.clearance import find_footholds
from drake_quad.certificate.obstacles import _faces, find_box_obstacles
from drake_quad.terrain.course import build_course
from drake_quad.terrain.elements import Element


def test_parts_prove_what_the_whole_proves(monkeypatch: pytest.MonkeyPatch) -> None:
    """In parts of 100 cells the same plan is certified, with the same least values and claims."""
    whole = certified("case_study")
    monkeypatch.setattr(cell_bounds, "MOST_CELLS", 100)
    monkeypatch.setattr(obstacles, "IN_A_ROW", 7)
    p = prepared("case_study")
    parts = certify_plans(p.robot, paper_shank(), p.plan.plans, p.course.boxes)
    assert parts.failure is None and parts.record is not None
    assert np.allclose(parts.proof.best, whole.proof.best, rtol=0.0, atol=0.5 * TOLERANCE.max())
    assert np.all(np.abs(parts.proof.claims - whole.proof.claims) <= TOLERANCE + 2e-6)


def test_who_may_be_near_is_found_in_little_memory() -> None:
    """Of 40 000 points along a course: all pairs that there are, in their order, and no table."""
    flights = [Element(kind="stairs", going="up", rise=0.1, run=0.3, count=25),
               Element(kind="landing", length=1.0)] * 4  # fmt: skip
    course = build_course([Element(kind="floor", length=3.0), *flights])
    obstacles, rng = find_box_obstacles(course.boxes), np.random.default_rng(0)
    along = np.linspace(-1.0, 40.0, 40_000)
    points = np.stack([along, rng.uniform(-1.0, 1.0, 40_000), 0.3 * along], axis=-1)
    reach = rng.uniform(0.0, 0.5, 40_000)
    tracemalloc.start()
    try:
        point, which = obstacles.may_be_near(points, reach)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 4 * (point.nbytes + which.nbytes) + 20e6 and len(obstacles.top) > 100
    some = slice(12_000, 12_900)  # beyond one row of points
    flat = np.linalg.norm(points[some, None, :2] - obstacles.centre[:, :2], axis=-1)
    away = np.linalg.norm(points[some, None] - obstacles.centre, axis=-1)
    size = np.linalg.norm(obstacles.half, axis=1)
    near = (flat - obstacles.around < reach[some, None]) & (away - size < reach[some, None])
    here = (point >= 12_000) & (point < 12_900)
    assert len(np.nonzero(near)[0]) > 100
    assert np.array_equal(np.stack([point[here] - 12_000, which[here]]), np.stack(near.nonzero()))


def test_what_a_swing_owes_does_not_depend_on_what_else_is_asked() -> None:
    """Pair by pair and all at once, in any order and twice over: the same to the bit."""
    p = prepared("case_study")
    pieces, obstacles = cut_pieces(p.plan.plans), find_box_obstacles(p.course.boxes)
    footholds, rng = (
        find_footholds(pieces, obstacles, p.robot.foot_radius),
        np.random.default_rng(1),
    )
    phase = rng.integers(0, footholds.ends.shape[1], 300)
    which = rng.integers(0, len(obstacles.top), 300)
    together = footholds.owed(np.tile(phase, 2), np.tile(which, 2))
    for name in ("own", "edge", "least", "half"):
        alone = [getattr(footholds.owed(phase[k:k + 1], which[k:k + 1]), name)[0]
                 for k in range(300)]  # fmt: skip
        assert np.array_equal(getattr(together, name), np.tile(alone, 2))
    distance = [obstacles.distance(ends, which)[0] for ends in footholds.ends[:, phase]]
    nearest = np.minimum(*distance) - p.robot.foot_radius
    assert np.array_equal(together.half[:300], 0.5 * nearest)
    assert together.own.any() and together.edge.any()


def test_faces_are_those_of_all_boxes_seen_at_once() -> None:
    """A box far away covers no part of another's side: passing over it changes nothing."""
    p = prepared("case_study")
    found = find_box_obstacles(p.course.boxes)
    faces = [face for box in p.course.boxes for face in _faces(box, p.course.boxes)]
    assert len(faces) == int(found.face.sum())
    for (centre, axes, half), k in zip(faces, np.flatnonzero(found.face), strict=True):
        assert np.array_equal(centre, found.centre[k]) and np.array_equal(half, found.half[k])
        assert np.array_equal(axes, found.axes[k])
