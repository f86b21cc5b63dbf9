"""What the replay shows over the scene: support region, plumb line, forces, footprints."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from matplotlib.colors import to_rgb
from pydrake.geometry import Cylinder, Meshcat, MeshcatCone, Rgba
from pydrake.math import RigidTransform, RotationMatrix

from drake_quad.common import FloatArray
from drake_quad.report.derived import BaseMotion, base_motion, has_massless_legs, touchdowns
from drake_quad.report.style import BAD, COM_COLOUR, GOOD, LEG_COLOURS, LESS_COLOUR, WARN
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.runs.reader import RecordedRun
from drake_quad.stability.equilibrium_region import Region, find_region, joint_limits, static_region
from drake_quad.stability.margin_kinds import FEASIBLE, FRICTION, HULL, stricter
from drake_quad.stability.margins import MarginEstimator, Posture
from drake_quad.stability.safety import safe_margin
from drake_quad.stability.support_polygon import support_polygon
from drake_quad.terrain.boxes import Box
from drake_quad.terrain.course import Course

LIFT = 0.006  # [m] above the ground: level with it, the two would flicker
EDGE_WIDTH = 0.02  # [m] of what two feet give: a line, which would not be seen

MEASURED = {HULL: "margin", FRICTION: "margin_friction", FEASIBLE: "margin_feasible"}

NAMES = {
    HULL: "support polygon",
    FRICTION: "region of balance within friction",
    FEASIBLE: "region of balance within friction and torque limits",
}
MARGIN_NAMES = {
    HULL: "static margin",
    FRICTION: "margin within friction",
    FEASIBLE: "margin within friction and torque",
}

OVERLAY = "/replay"
NEWTONS_PER_METRE = 600.0  # of a force arrow
LEAST_FORCE = 1.0  # [N] below this there is no arrow
REDRAWN = 0.5  # [s] after which a region that moves is drawn anew
ARROW = 0.012  # [m] radius of a shaft


def drape_polygon(course: Course, feet: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The convex hull of feet, cut along the course's boxes and put on top of each.

    Args:
        course: Course in W.
        feet: (n, 2) horizontal places of the bearing feet in W [m]. One foot gives nothing.

    Returns:
        (vertices (k, 3) in W [m], triangles (m, 3) of their indices).
    """
    hull = np.array(support_polygon(feet))
    if len(hull) == 2:
        hull = _widen(hull)
    vertices: list[FloatArray] = []
    triangles: list[list[int]] = []
    count = 0
    for box in course.boxes if len(hull) > 2 else ():
        piece = clip_polygon(hull, box)
        if len(piece) < 3:
            continue
        z = box.top + box.gradient * ((piece - box.middle) @ box.axes[0])
        vertices.append(np.column_stack([piece, z + LIFT]))
        triangles += [[count, count + i, count + i + 1] for i in range(1, len(piece) - 1)]
        count += len(piece)
    if not vertices:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.float64)
    return np.concatenate(vertices), np.array(triangles, dtype=np.float64)


def clip_polygon(polygon: FloatArray, box: Box) -> FloatArray:
    """The part of a convex polygon (n, 2) within a box's footprint (Sutherland and Hodgman)."""
    for axis, half in zip(box.axes, 0.5 * box.extent, strict=True):
        for normal in (axis, -axis):
            if not len(polygon):
                return polygon
            inside = half - (polygon - box.middle) @ normal  # [m] positive within
            polygon = _cut(polygon, inside)
    return polygon


def _cut(polygon: FloatArray, inside: FloatArray) -> FloatArray:
    """The part of a polygon (n, 2) on the side where `inside` (n,), linear over it, is positive."""
    kept = []
    for a, b, da, db in zip(
        polygon, np.roll(polygon, -1, axis=0), inside, np.roll(inside, -1), strict=True
    ):
        if da >= 0.0:
            kept.append(a)
        if (da > 0.0) != (db > 0.0) and da != db:
            kept.append(a + da / (da - db) * (b - a))
    return np.array(kept).reshape(-1, 2)


def _widen(ends: FloatArray) -> FloatArray:
    """A strip about the line between two points (2, 2)."""
    along = ends[1] - ends[0]
    across = np.array([-along[1], along[0]]) * (0.5 * EDGE_WIDTH / np.linalg.norm(along))
    return np.array([ends[0] - across, ends[1] - across, ends[1] + across, ends[0] + across])


class Regions:
    """Regions by sample.

    Args:
        run: The run. What it did not measure is not shown: then it is the hull of the feet.
    """

    def __init__(self, run: RecordedRun) -> None:
        self._run = run
        asked = stricter(run.scenario.monitor.margins, run.scenario.gait.margin)
        wanted = HULL if run.kinematic else asked
        self.kind = wanted if MEASURED[wanted] in run.log.columns else HULL
        self._bearing = run.log.flags("bearing")
        self._places = run.log.feet("position")

    @property
    def name(self) -> str:
        """What they are called."""
        return NAMES[self.kind]

    @property
    def margin_name(self) -> str:
        """What the margin that goes with them is called."""
        without = ", legs without mass" if has_massless_legs(self._run) else ""
        return MARGIN_NAMES[self.kind] + without

    @property
    def margin(self) -> FloatArray:
        """The margin that goes with them, and that they are coloured by (N,) [m]."""
        return self._run.log.number(MEASURED[self.kind])

    def corners(self, sample: int) -> FloatArray:
        """The region's corners (k, 2) in W [m]; of the hull, its feet."""
        feet = self._places[sample, self._bearing[sample], :2]
        if self.kind == HULL or not len(feet):
            return np.asarray(feet)
        return self._region(sample).corners

    def _region(self, sample: int) -> Region:
        robot, base = self._run.robot, self._base
        posture = Posture(
            bearing=self._bearing[sample].astype(np.float64),
            places=self._places[sample],
            com=np.zeros(3),
            com_velocity=np.zeros(3),
            p_WB=base.p_WB[sample],
            R_WB=base.R_WB[sample],
            q=self._run.positions[sample, self._run.layout.q_joints].reshape(4, 3),
        )
        friction = self._run.scenario.simulation.friction
        gauge = MarginEstimator(robot, self.kind, friction, robot.mass, robot.effort)
        contacts = gauge.contacts(posture)
        if self.kind == FRICTION:
            return static_region(contacts)
        limits = joint_limits(robot, posture.R_WB, posture.q, self._bearing[sample])
        return find_region(contacts, limits=limits)

    @cached_property
    def _base(self) -> BaseMotion:
        return base_motion(self._run)


def margin_colour(margin: float, safe: float) -> str:
    """Green, amber or red: whether a margin [m] is safe, less than that, or none."""
    return GOOD if margin >= safe else WARN if margin >= 0.0 else BAD


class Overlay:
    """Objects in Meshcat that go with a run's samples.

    Meshcat writes what `show` does into its recording, if one is under way.

    Args:
        meshcat: Where to draw.
        run: The run.
        samples: Those that will be shown, in order.
    """

    def __init__(self, meshcat: Meshcat, run: RecordedRun, samples: Sequence[int]) -> None:
        self._meshcat, self._run = meshcat, run
        log = run.log
        self._force, self._place = log.feet("force"), log.feet("position")
        self._com = log.vector("com")
        self._ground = run.world.height(self._com[:, 0], self._com[:, 1])
        self._support = self._lay_support(samples)
        self._shown = ""  # path of the support polygon that is visible
        self._add_arrows()
        self._add_plumb_line()
        self._add_prints()
        self._add_map()

    def show(self, sample: int, *, time: float) -> None:
        """Moves everything to a sample of the log; `time` [s] is where a recording keeps it."""
        self._show_support(self._support.get(sample, ""), time)
        for row, leg in enumerate(SHORT_NAMES):
            path, force = f"{OVERLAY}/force/{leg}", self._force[sample, row]
            size = float(np.linalg.norm(force))
            there = bool(np.isfinite(size) and size > LEAST_FORCE)
            self._meshcat.SetProperty(path, "visible", there, time)
            if there:
                X_WA = RigidTransform(_z_along(force / size), self._place[sample, row])
                self._place_arrow(path, X_WA, size / NEWTONS_PER_METRE, time)
        p, ground = self._com[sample], self._ground[sample]
        if np.isfinite(ground) and np.all(np.isfinite(p)):
            self._place_stick(p, float(ground), time)

    def _lay_support(self, samples: Sequence[int]) -> dict[int, str]:
        """Makes one polygon for each stretch of samples with the same feet and colour.

        Standing feet do not move, so within a stretch the region that friction leaves does not
        either. That within the joints' torque limits does: it is drawn anew now and then.

        Returns:
            The path of each sample's polygon.
        """
        regions = Regions(self._run)
        bearing, margin, t = self._run.log.flags("bearing"), regions.margin, self._run.log.t
        moves, safe = regions.kind == FEASIBLE, safe_margin(self._run.robot)
        paths: dict[int, str] = {}
        last, path = (), ""  # type: tuple[object, ...], str
        for k in samples:
            colour = margin_colour(float(margin[k]), safe)
            state = (*bearing[k].tolist(), colour, t[k] // REDRAWN if moves else 0.0)
            if state != last:
                last = state
                vertices, triangles = drape_polygon(self._run.world, regions.corners(k))
                path = f"{OVERLAY}/support/{k}" if len(triangles) else ""
                if path:
                    self._meshcat.SetTriangleMesh(
                        path,
                        np.asfortranarray(vertices.T),
                        np.asfortranarray(triangles.T.astype(np.int32)),
                        _rgba(colour, 0.65),
                    )
                    self._meshcat.SetProperty(path, "visible", False)
            paths[k] = path
        return paths

    def _show_support(self, path: str, time: float) -> None:
        if path == self._shown:
            return
        if self._shown:
            self._meshcat.SetProperty(self._shown, "visible", False, time)
        if path:
            # A recording knows nothing of what was before its first keyframe.
            self._meshcat.SetProperty(path, "visible", False, 0.0)
            self._meshcat.SetProperty(path, "visible", True, time)
        self._shown = path

    def _add_arrows(self) -> None:
        """An arrow per foot, of length 1 m along its own z until it is scaled."""
        for leg, colour in zip(SHORT_NAMES, LEG_COLOURS, strict=True):
            path = f"{OVERLAY}/force/{leg}"
            self._meshcat.SetObject(f"{path}/shaft/rod", Cylinder(ARROW, 1.0), _rgba(colour))
            self._meshcat.SetTransform(f"{path}/shaft/rod", RigidTransform([0.0, 0.0, 0.5]))
            # Meshcat's cone has its point at its origin and opens along +z.
            self._meshcat.SetObject(
                f"{path}/head/cone",
                MeshcatCone(6.0 * ARROW, 2.5 * ARROW, 2.5 * ARROW),
                _rgba(colour),
            )
            X_HC = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.0, 0.0, 6.0 * ARROW])
            self._meshcat.SetTransform(f"{path}/head/cone", X_HC)

    def _place_arrow(self, path: str, X_WA: RigidTransform, length: float, time: float) -> None:
        self._meshcat.SetTransform(path, X_WA, time)
        self._meshcat.SetProperty(f"{path}/shaft", "scale", [1.0, 1.0, max(length, 1e-3)], time)
        self._meshcat.SetTransform(f"{path}/head", RigidTransform([0.0, 0.0, length]), time)

    def _add_plumb_line(self) -> None:
        """From the centre of mass down to the ground, and a disc where it meets it."""
        path, colour = f"{OVERLAY}/plumb", _rgba(COM_COLOUR)
        self._meshcat.SetObject(f"{path}/line/rod", Cylinder(0.004, 1.0), colour)
        self._meshcat.SetTransform(f"{path}/line/rod", RigidTransform([0.0, 0.0, 0.5]))
        self._meshcat.SetObject(f"{path}/disc", Cylinder(0.03, 0.004), colour)

    def _place_stick(self, p_WScm: FloatArray, ground: float, time: float) -> None:
        path = f"{OVERLAY}/plumb"
        X_WP = RigidTransform([p_WScm[0], p_WScm[1], ground + 2.0 * LIFT])
        self._meshcat.SetTransform(path, X_WP, time)
        length = max(float(p_WScm[2]) - ground, 1e-3)
        self._meshcat.SetProperty(f"{path}/line", "scale", [1.0, 1.0, length], time)

    def _add_prints(self) -> None:
        """A disc where each foot stood, in its leg's colour."""
        for k, step in enumerate(touchdowns(self._run)):
            path = f"{OVERLAY}/prints/{k}"
            colour = _rgba(LEG_COLOURS[step.row], 0.8)
            self._meshcat.SetObject(path, Cylinder(0.025, 0.002), colour)
            self._meshcat.SetTransform(path, RigidTransform(np.add(step.p_WF, [0.0, 0.0, 0.001])))

    def _add_map(self) -> None:
        """Thin lines where the map has the nosings, if it has them elsewhere."""
        if self._run.world is not self._run.course:
            ends = np.array(self._run.course.nosings())
            # Over the ground as it is, where that is higher: inside it they would not be seen.
            along = ends.mean(axis=1, keepdims=True) + np.multiply.outer(
                [-0.5, -0.25, 0.0, 0.25, 0.5], ends[:, 1] - ends[:, 0]
            ).swapaxes(0, 1)
            ground = self._run.world.height(along[..., 0], along[..., 1])
            ends[..., 2] = np.fmax(ends[..., 2], np.fmax.reduce(ground, axis=1)[:, None]) + LIFT
            right, left = np.swapaxes(ends, 0, 1)
            self._meshcat.SetLineSegments(
                f"{OVERLAY}/map", right.T, left.T, line_width=2.0, rgba=_rgba(LESS_COLOUR)
            )


def _rgba(colour: str, opacity: float = 1.0) -> Rgba:
    return Rgba(*to_rgb(colour), opacity)


def _z_along(unit: FloatArray) -> RotationMatrix:
    """A rotation that takes z to `unit` (3,)."""
    return RotationMatrix.MakeFromOneVector(unit, 2)
