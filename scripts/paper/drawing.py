"""How the paper's figures are drawn: one look, and solids seen from afar.

As in the paper a solid circle is a foothold during the support phase, an open circle where a
swing leg will be put down.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil, cos, radians, sin
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from drake_quad.common import BoolArray, FloatArray
from drake_quad.gait.workspace import Workspace
from drake_quad.report.style import LEG_COLOURS
from drake_quad.robot.legs import LEGS, Leg
from drake_quad.stability.support_polygon import support_polygon

# ------------------------------------------------------------------------------------------------
# How the paper's figures are drawn: one look, the same colour for a leg everywhere.
# ------------------------------------------------------------------------------------------------


COLOURS = dict(zip(LEGS, LEG_COLOURS, strict=True))
BODY, SUPPORT, GROUND, FAINT = "#222222", "#DCDCDC", "#C9C2B8", "#8A8A8A"
BODY_HALF = (0.40, 0.20)  # [m] of the body as drawn from above; the paper doesn't give it
_STYLE: dict[str, Any] = {"fontsize": 8}

Axes = Any


def new_figure(width: float, height: float) -> Figure:
    """Returns an empty figure of the given size [in]; its parts make room for each other."""
    return Figure(figsize=(width, height), layout="constrained", dpi=120)


def style_axes(axes: Axes, x: str, y: str, *, title: str = "") -> None:
    """Labels axes, with small type."""
    axes.set_xlabel(x, **_STYLE)
    axes.set_ylabel(y, **_STYLE)
    axes.tick_params(labelsize=7)
    if title:
        axes.set_title(title, fontsize=9)


def top_view(axes: Axes, *, room: float = 0.1, labels: bool = True) -> None:
    """Makes axes a view from above in the body frame: +x, forward, to the right, +y up.

    Args:
        axes: The axes.
        room: Around Table I's boxes [m].
        labels: Whether to show scales.
    """
    x, y = 0.78 + room, 0.52 + room
    axes.set_aspect("equal")
    axes.set(xlim=(-x, x), ylim=(-y, y))
    style_axes(axes, "x [m]" if labels else "", "y [m]" if labels else "")
    if not labels:
        axes.set(xticks=[], yticks=[])


def draw_body(axes: Axes) -> None:
    """Draws the body, its centre and which way it faces."""
    length, width = BODY_HALF
    outline = [(-length, -width), (length, -width), (length + 0.07, 0), (length, width),
               (-length, width)]  # fmt: skip
    axes.add_patch(Polygon(outline, facecolor="#EDEDED", edgecolor=FAINT, lw=0.8, zorder=0))


def draw_centre(axes: Axes, at: FloatArray | tuple[float, float] = (0.0, 0.0)) -> None:
    """Draws the projected centre of mass."""
    axes.plot(*at, marker="o", ms=6, mfc="white", mec=BODY, zorder=6)
    axes.plot(*at, marker="+", ms=6, mec=BODY, zorder=7)


def draw_boxes(
    axes: Axes, workspace: Workspace, *, body: FloatArray | tuple[float, float] = (0.0, 0.0)
) -> None:
    """Draws the legs' workspaces and their centres, the body being at `body` (2,)."""
    for centre, leg in zip(workspace.centres + np.asarray(body), LEGS, strict=True):
        corner = centre - workspace.half_size
        axes.add_patch(
            Rectangle(tuple(corner), workspace.R_x, workspace.R_y, fill=False, lw=0.9, ls="--",
                      edgecolor=COLOURS[leg], zorder=1)
        )  # fmt: skip
        axes.plot(*centre, marker="+", ms=5, color=COLOURS[leg], zorder=2)


def draw_support(axes: Axes, feet: FloatArray, standing: BoolArray) -> None:
    """Draws the support polygon of the standing feet, (4, 2)."""
    corners = support_polygon(feet[standing])
    axes.add_patch(
        Polygon(corners, facecolor=SUPPORT, edgecolor="#777777", alpha=0.75, lw=1.0, zorder=2)
    )


def draw_foot(axes: Axes, leg: Leg, at: FloatArray, *, solid: bool = True, size: float = 8) -> None:
    """Draws a foot at `at` (2,): solid where it stands, open where it is to be put down."""
    colour = COLOURS[leg]
    axes.plot(*at, marker="o", ms=size, color=colour, mfc=colour if solid else "white",
              mew=1.4, ls="none", zorder=5)  # fmt: skip


def name_leg(axes: Axes, leg: Leg, at: FloatArray, *, offset: tuple[float, float]) -> None:
    """Writes a leg's number beside its foot."""
    axes.annotate(str(int(leg)), at, xytext=offset, textcoords="offset points", fontsize=9,
                  ha="center", va="center", color=COLOURS[leg], fontweight="bold",
                  zorder=8)  # fmt: skip


def arrow(
    axes: Axes, start: FloatArray, end: FloatArray, *, colour: str = BODY, both: bool = False
) -> None:
    """Draws an arrow from `start` to `end` (2,), or a dimension line with two heads."""
    axes.annotate("", xy=tuple(end), xytext=tuple(start), zorder=6, annotation_clip=False,
                  arrowprops={"arrowstyle": "<|-|>" if both else "-|>", "color": colour, "lw": 1.1,
                              "mutation_scale": 9, "shrinkA": 0 if both else 3,
                              "shrinkB": 0 if both else 4})  # fmt: skip


def dimension(axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str) -> None:
    """Draws a dimension line with its text in the middle, or behind a short one."""
    arrow(axes, np.array(start), np.array(end), colour=FAINT, both=True)
    short = 0.0 < end[0] - start[0] < 0.3
    x = end[0] + 0.02 if short else (start[0] + end[0]) / 2
    axes.text(x, (start[1] + end[1]) / 2, text, fontsize=8, ha="left" if short else "center",
              va="center", zorder=9,
              bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8})  # fmt: skip


# ------------------------------------------------------------------------------------------------
# Solids seen from afar: faces in W, hidden by what is nearer; for pictures of the robot.
# ------------------------------------------------------------------------------------------------


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
