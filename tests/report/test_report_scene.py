"""The scene of a replay: the course as drawn, the support polygon on it, and the camera."""

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from pydrake.geometry import Role, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from shapely import MultiPoint, Polygon, union_all

from drake_quad.common import FloatArray
from drake_quad.report.overlay import EDGE_WIDTH, LIFT, drape_polygon
from drake_quad.report.scene import ASPECT, FIELD_OF_VIEW, TALL, camera_pose, frame_samples
from drake_quad.terrain.course import Course, build_course
from drake_quad.terrain.drake_geometry import LEVEL, NOSING, NOSING_SIZE, TREADS, AddCourse
from drake_quad.terrain.elements import Element

FLOOR = Element("floor", length=2.0)
STRAIGHT = build_course(
    [FLOOR, Element("stairs", going="up", rise=0.15, run=0.3, count=5), FLOOR, FLOOR]
)


def turned(angle: float) -> Course:
    """Up, around a turn [deg], and down."""
    return build_course(
        [
            FLOOR,
            Element("stairs", going="up", rise=0.15, run=0.3, count=4),
            Element("landing", length=2.5, turn_deg=angle),
            Element("stairs", going="down", rise=0.15, run=0.3, count=4),
            FLOOR,
        ]
    )


COURSES = (STRAIGHT, turned(90.0), turned(-90.0), turned(40.0), turned(-60.0))
POINTS = st.lists(
    st.tuples(st.floats(0.2, 5.0), st.floats(-0.9, 0.9)), min_size=3, max_size=4, unique=True
)


@given(POINTS)
def test_the_carpet_seen_from_above_is_the_support_polygon(
    points: list[tuple[float, float]],
) -> None:
    """Pieces cover the hull without overlap, and each lies just above its own tread."""
    hull = MultiPoint(points).convex_hull
    assume(isinstance(hull, Polygon) and hull.area > 1e-3)
    vertices, triangles = drape_polygon(STRAIGHT, np.array(points))
    pieces = [Polygon(vertices[t.astype(int), :2]) for t in triangles]
    assert sum(piece.area for piece in pieces) == pytest.approx(hull.area, rel=1e-6)
    assert union_all([p.buffer(1e-9) for p in pieces]).area == pytest.approx(hull.area, rel=1e-3)
    for t in triangles.astype(int):
        x, y = vertices[t, :2].mean(axis=0)
        assert vertices[t, 2] == pytest.approx(float(STRAIGHT.height(x, y)) + LIFT)


def test_what_two_feet_support_is_a_line_that_can_be_seen() -> None:
    """Two feet give a strip as wide as promised; one foot and none give nothing."""
    feet = np.array([[0.5, 0.2], [1.3, -0.1]])
    vertices, triangles = drape_polygon(STRAIGHT, feet)
    area = sum(Polygon(vertices[t.astype(int), :2]).area for t in triangles)
    assert area == pytest.approx(EDGE_WIDTH * np.linalg.norm(feet[1] - feet[0]))
    assert not len(drape_polygon(STRAIGHT, feet[:1])[1]) and not len(
        drape_polygon(STRAIGHT, feet[:0])[1]
    )


def project(points: FloatArray, camera: FloatArray, target: FloatArray) -> FloatArray:
    """Where points (n, 3) appear, (n, 2): within ±1 is in the window."""
    ahead = (target - camera) / np.linalg.norm(target - camera)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    depth = (points - camera) @ ahead
    assert np.all(depth > 0.0)
    half = np.tan(0.5 * FIELD_OF_VIEW)
    seen = np.column_stack(
        [points @ right - camera @ right, (points - camera) @ np.cross(right, ahead)]
    )
    return np.asarray(seen / depth[:, None] / [half * ASPECT, half])


@pytest.mark.parametrize("course", COURSES)
def test_the_whole_course_shows_and_fills_the_window(course: Course) -> None:
    """Every corner with a robot on it is in the picture, which is not much larger."""
    camera, target = camera_pose(course)
    corners = np.concatenate(
        [
            np.column_stack([b.corners(), np.full(4, b.top + z)])
            for b in course.boxes
            for z in (0.0, TALL)
        ]
    )
    seen = np.abs(project(corners, camera, target))
    assert np.max(seen) < 1.0 and np.max(seen) > 0.85


@pytest.mark.parametrize("angle", [90.0, -90.0])
def test_a_turned_course_is_seen_from_the_inside_of_its_turn(angle: float) -> None:
    """The camera stands on the side to which the course turns."""
    camera, _ = camera_pose(turned(angle))
    assert np.sign(camera[1]) == np.sign(angle)


def add_course(course: Course) -> SceneGraph:
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddCourse(plant, course, friction=0.7)
    plant.Finalize()
    return scene_graph


@pytest.mark.parametrize("course", COURSES)
def test_nosings_are_drawn_and_not_touched(course: Course) -> None:
    """Feet meet the course's boxes alone; each nosing is one strip more to see."""
    inspector = add_course(course).model_inspector()
    assert inspector.NumGeometriesWithRole(Role.kProximity) == len(course.boxes)
    seen = inspector.NumGeometriesWithRole(Role.kIllustration)
    assert seen == len(course.boxes) + len(course.nosings())


@pytest.mark.parametrize("course", COURSES)
def test_a_nosing_is_let_into_the_edge_of_its_tread(course: Course) -> None:
    """Its strip lies along the nosing, 1 mm proud of the tread and never more."""
    inspector = add_course(course).model_inspector()
    by_name = {
        inspector.GetName(g).rpartition("::")[2]: g
        for g in inspector.GetAllGeometryIds(Role.kIllustration)
    }
    for k, ends in enumerate(course.nosings()):
        X_WN = inspector.GetPoseInFrame(by_name[f"nosing_{k}"])
        length = inspector.GetShape(by_name[f"nosing_{k}"]).depth()
        for sign, end in zip((-1.0, 1.0), ends, strict=True):
            tip = X_WN @ np.array([0.0, 0.5 * sign * length, 0.5 * NOSING_SIZE])
            np.testing.assert_allclose(tip, np.add(end, [0.0, 0.0, 0.001]), atol=1e-9)


def test_neighbouring_treads_can_be_told_apart() -> None:
    """Treads alternate between two colours, and differ from floors and from nosings."""
    inspector = add_course(STRAIGHT).model_inspector()
    colours = {}
    for g in inspector.GetAllGeometryIds(Role.kIllustration):
        name = inspector.GetName(g).rpartition("::")[2]
        rgba = inspector.GetIllustrationProperties(g).GetProperty("phong", "diffuse")
        colours[name] = (rgba.r(), rgba.g(), rgba.b(), rgba.a())
    treads = [colours[f"stairs_1_tread_{k}"] for k in range(1, 6)]
    assert treads == [TREADS[k % 2] for k in range(1, 6)]
    assert colours["floor_0"] == LEVEL and colours["nosing_0"] == NOSING
    assert len({*TREADS, LEVEL, NOSING}) == 4


@given(st.floats(1.0, 60.0), st.integers(1, 500))
def test_frames_are_even_and_end_at_the_end(fps: float, count: int) -> None:
    """Each frame shows the last sample not after its time; the run's last sample is there."""
    t = np.array([0.015 + 0.005 * k for k in range(count)])
    samples = frame_samples(t, fps)
    assert samples[0] == 0 and samples[-1] == count - 1 and samples == sorted(set(samples))
    gaps = np.diff(t[samples])
    assert np.all(gaps <= 1.0 / fps + 0.005 + 1e-9)
    assert np.all(gaps[:-1] >= 1.0 / fps - 0.005 - 1e-9)


def test_without_samples_there_is_no_frame() -> None:
    """An empty log has nothing to show."""
    assert frame_samples(np.zeros(0), 10.0) == []
