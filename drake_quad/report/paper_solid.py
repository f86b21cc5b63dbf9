"""Solids seen from afar: faces in W, hidden by what is nearer; for pictures of the robot."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil, cos, radians, sin

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from drake_quad.common import FloatArray
from drake_quad.report.paper_drawing import Axes

CELL = 0.25  # [m] faces are cut so small that the farther can be painted before the nearer
SIDES = 12  # of a rod
LIGHT = np.array([-0.40, 0.75, 0.53])  # from where: to the left of the picture, up, to the viewer
DARKEST = 0.55  # of its colour, on a face turned away from the light


@dataclass(frozen=True)
class View:
    """A parallel projection.

    Attributes:
        azimuth: Where it is seen from, about z from x [deg].
        elevation: How high above the horizon [deg].
    """

    azimuth: float
    elevation: float

    @property
    def axes(self) -> FloatArray:
        """Rows: to the right in the picture, up in it, and towards the viewer (3, 3)."""
        a, e = radians(self.azimuth), radians(self.elevation)
        towards = np.array([cos(e) * cos(a), cos(e) * sin(a), sin(e)])
        right = np.array([-sin(a), cos(a), 0.0])
        return np.stack([right, np.cross(towards, right), towards])

    def flat(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) in W as (..., 2) in the picture [m]."""
        return np.asarray(points @ self.axes[:2].T)


@dataclass
class Solids:
    """Faces to be painted: polygons (n, 3) in W, counterclockwise from outside, with colours."""

    faces: list[FloatArray] = field(default_factory=list)
    colours: list[str] = field(default_factory=list)

    def add_box(
        self, centre: FloatArray, size: Sequence[float] | FloatArray, R: FloatArray, colour: str
    ) -> None:
        """Adds a box with its middle and its axes, the columns of R, in W."""
        half = 0.5 * np.asarray(size)
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for sign in (-1.0, 1.0):
                n = [ceil(2.0 * half[k] / CELL) for k in (u, v)]
                us, vs = (
                    np.linspace(-half[k], half[k], m + 1) for k, m in zip((u, v), n, strict=True)
                )
                for a, b in pairwise(us):
                    for c, d in pairwise(vs):
                        corners = np.zeros((4, 3))
                        corners[:, axis] = sign * half[axis]
                        corners[:, u], corners[:, v] = [a, b, b, a], [c, c, d, d]
                        self._add(centre + corners[:: int(sign)] @ R.T, colour)

    def add_rod(self, start: FloatArray, end: FloatArray, radius: float, colour: str) -> None:
        """Adds a rod, a prism with SIDES sides, from one point to another [m]."""
        along = (end - start) / np.linalg.norm(end - start)
        across = np.cross(along, [0.0, 1.0, 0.0] if abs(along[1]) < 0.9 else [1.0, 0.0, 0.0])
        across /= np.linalg.norm(across)
        angles = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
        ring = radius * (
            np.outer(np.cos(angles), across) + np.outer(np.sin(angles), np.cross(along, across))
        )
        pieces = max(ceil(float(np.linalg.norm(end - start)) / (0.5 * CELL)), 1)
        ends = np.linspace(start, end, pieces + 1)
        for a, b in pairwise(ends):
            for k in range(SIDES):
                m = (k + 1) % SIDES
                quad = np.stack([a + ring[k], a + ring[m], b + ring[m], b + ring[k]])
                self._add(quad, colour)
        self._add(start + ring[::-1], colour)
        self._add(end + ring, colour)

    def _add(self, face: FloatArray, colour: str) -> None:
        self.faces.append(face)
        self.colours.append(colour)

    def paint(self, axes: Axes, view: View, *, zorder: float = 2.0) -> None:
        """Paints the faces that are turned to the viewer, the farthest first."""
        shown = []
        for face, colour in zip(self.faces, self.colours, strict=True):
            normal = np.cross(face[1] - face[0], face[2] - face[0])
            normal /= np.linalg.norm(normal)
            if normal @ view.axes[2] <= 1e-9:
                continue
            bright = DARKEST + (1.0 - DARKEST) * max(float(view.axes @ normal @ LIGHT), 0.0)
            rgb = tuple(bright * channel for channel in to_rgb(colour))
            shown.append((float(face.mean(axis=0) @ view.axes[2]), view.flat(face), rgb))
        shown.sort(key=lambda entry: entry[0])
        colours = [rgb for *_, rgb in shown]
        axes.add_collection(
            PolyCollection([flat for _, flat, _ in shown], facecolors=colours, edgecolors=colours,
                           linewidths=0.4, zorder=zorder)
        )  # fmt: skip
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.margins(0.01)
        axes.autoscale_view()
