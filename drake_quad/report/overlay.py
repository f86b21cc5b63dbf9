"""What the replay draws over the scene: region of balance, plumb line, forces, prints."""

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_rgb
from pydrake.geometry import Cylinder, Meshcat, MeshcatCone, Rgba
from pydrake.math import RigidTransform, RotationMatrix

from drake_quad.gait.legs import SHORT_NAMES, FloatArray
from drake_quad.report.drape import LIFT, drape
from drake_quad.report.motion import touchdowns
from drake_quad.report.regions import Regions
from drake_quad.report.run_files import Run
from drake_quad.report.style import BAD, COM_COLOUR, GOOD, LEG_COLOURS, LESS_COLOUR, WARN
from drake_quad.stability.kinds import FEASIBLE
from drake_quad.stability.safety import safe_margin

OVERLAY = "/replay"
NEWTONS_PER_METRE = 600.0  # of a force arrow
LEAST_FORCE = 1.0  # [N] below this there is no arrow
REDRAWN = 0.5  # [s] after which a region that moves is drawn anew
ARROW = 0.012  # [m] radius of a shaft


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

    def __init__(self, meshcat: Meshcat, run: Run, samples: Sequence[int]) -> None:
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
                vertices, triangles = drape(self._run.world, regions.corners(k))
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
