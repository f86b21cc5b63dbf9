"""How the paper's figures are drawn: one look, the same colour for a leg everywhere.

As in the paper a solid circle is a foothold during the support phase, an open circle where a
swing leg will be put down.
"""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from drake_quad.common import BoolArray, FloatArray
from drake_quad.gait.workspace import Workspace
from drake_quad.report.style import LEG_COLOURS
from drake_quad.robot.legs import LEGS, Leg
from drake_quad.stability.support_polygon import support_polygon

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
