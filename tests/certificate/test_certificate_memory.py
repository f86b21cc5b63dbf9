"""A plan of any length is certified in the memory of a short one: a part of its cells at a time."""

import tracemalloc

import numpy as np
import pytest
from certificate_rig import certified, paper_shank, prepared

from drake_quad.certificate import bounds as cell_bounds, clearance as feet_room
from drake_quad.certificate.bounds import TOLERANCE
from drake_quad.certificate.certify import certify_plans
from drake_quad.certificate.clearance import _faces, find_box_obstacles
from drake_quad.terrain.course import build_course
from drake_quad.terrain.elements import Element


def test_parts_prove_what_the_whole_proves(monkeypatch: pytest.MonkeyPatch) -> None:
    """In parts of 100 cells the same plan is certified, with the same least values and claims."""
    whole = certified("case_study")
    monkeypatch.setattr(cell_bounds, "MOST_CELLS", 100)
    monkeypatch.setattr(feet_room, "MOST_PAIRS", 1000)
    p = prepared("case_study")
    parts = certify_plans(p.robot, paper_shank(), p.plan.plans, p.course.boxes)
    assert parts.failure is None and parts.record is not None
    assert np.allclose(parts.proof.best, whole.proof.best, rtol=0.0, atol=0.5 * TOLERANCE.max())
    assert np.all(np.abs(parts.proof.claims - whole.proof.claims) <= TOLERANCE + 2e-6)


def test_the_distances_from_all_obstacles_are_found_in_parts() -> None:
    """Of 40 000 points and some hundred obstacles: memory for the result and one part."""
    flights = [Element(kind="stairs", going="up", rise=0.1, run=0.3, count=25),
               Element(kind="landing", length=1.0)] * 4  # fmt: skip
    course = build_course([Element(kind="floor", length=3.0), *flights])
    obstacles = find_box_obstacles(course.boxes)
    points = np.random.default_rng(0).uniform(-1.0, 30.0, (40_000, 3))
    tracemalloc.start()
    try:
        found = feet_room._distances(points, obstacles)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < found.nbytes + 600e6 and len(obstacles.top) > 100
    which = np.full(50, 7)
    assert np.array_equal(found[:50, 7], obstacles.distance(points[:50], which)[0])


def test_faces_are_those_of_all_boxes_seen_at_once() -> None:
    """A box far away covers no part of another's side: passing over it changes nothing."""
    p = prepared("case_study")
    found = find_box_obstacles(p.course.boxes)
    faces = [face for box in p.course.boxes for face in _faces(box, p.course.boxes)]
    assert len(faces) == int(found.face.sum())
    for (centre, axes, half), k in zip(faces, np.flatnonzero(found.face), strict=True):
        assert np.array_equal(centre, found.centre[k]) and np.array_equal(half, found.half[k])
        assert np.array_equal(axes, found.axes[k])
