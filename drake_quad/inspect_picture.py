"""A picture of a robot in its nominal stance: links, collision shapes and reach."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.spatial import ConvexHull, QhullError

from drake_quad.errors import InputError
from drake_quad.gait.legs import SHORT_NAMES, FloatArray
from drake_quad.inspect_stance import InspectStance, collision_points, reachable, stand
from drake_quad.robot.robot_model import RobotModel
from drake_quad.whole_files import write_whole

FRONT, REAR = "#c8641b", "#2b63a8"  # as the legs of the paper's robot
INK, SHAPE, GROUND = "#333333", "#8a8a8a", "#b8ada0"
KINDS = (".svg", ".png", ".pdf")
GRID = 220  # points along each side of the raster that shows the reach
SIDE, BEHIND = (0, 2), (1, 2)  # which coordinates are across and up


def draw_robot(robot: RobotModel) -> Figure:
    """The figure: the robot from its right, and from behind."""
    stance = stand(robot)
    shapes = collision_points(robot, stance.q)
    with matplotlib.rc_context({"font.size": 9, "axes.spines.top": False}):
        figure = Figure(figsize=(11.0, 5.2), layout="constrained")
        side, behind = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
    _draw(side, robot, stance, shapes, SIDE, (0, 2, 1, 3))
    _draw(behind, robot, stance, shapes, BEHIND, (0, 1, 2, 3))
    behind.set_title("from behind: y to its left", loc="left")
    behind.invert_xaxis()
    _measure(side, robot, stance)
    name = f"{robot.name}: {robot.mass:.1f} kg, hips {stance.height:.2f} m up"
    # A name is no mathematics, dollars or not.
    side.set_title(f"{name}\nfrom its right: x forward", loc="left", parse_math=False)
    _legend(figure)
    return figure


def check_picture(path: Path | None) -> None:
    """Makes sure before any work that a picture can be of the path's kind.

    Raises:
        InputError: If not.
    """
    if path is not None and path.suffix.lower() not in KINDS:
        remedy = f"a picture's file ends in {', '.join(KINDS)}"
        raise InputError(source="--picture", field="picture", value=str(path), remedy=remedy)


def save_picture(robot: RobotModel, path: Path) -> None:
    """Writes the picture, in the format of the path's ending.

    Raises:
        InputError: If it cannot be written.
    """
    figure = draw_robot(robot)
    kind = path.suffix.lstrip(".").lower()
    with matplotlib.rc_context({"svg.hashsalt": robot.name, "svg.fonttype": "none"}):
        metadata = {"Date": None} if kind == "svg" else None
        write_whole(
            path,
            lambda to: figure.savefig(to, format=kind, dpi=130, metadata=metadata),
            option="--picture",
        )


def _draw(
    ax: Axes,
    robot: RobotModel,
    stance: InspectStance,
    shapes: list[tuple[str, FloatArray]],
    view: tuple[int, int],
    legs: tuple[int, ...],
) -> None:
    """One view: reach behind, collision shapes, then links and joints of some legs."""
    up = np.array([0.0, 0.0, stance.height])
    lower, upper = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    for leg in legs[-2:]:
        _shade(ax, robot, stance, view, leg, lower[leg], upper[leg])
    polygons = [hull for _, points in shapes if (hull := _outline(points + up, view)) is not None]
    ax.add_collection(
        PolyCollection(polygons, facecolors="none", edgecolors=SHAPE, linewidths=0.7, zorder=2)
    )
    for leg in legs:
        chain = [stance.hips[leg], stance.thighs[leg], stance.knees[leg], stance.feet[leg]]
        across, high = (np.array(chain) + up)[:, view].T
        colour, near = FRONT if leg < 2 else REAR, leg in legs[-2:]
        strong = {"lw": 3.0, "alpha": 1.0} if near else {"lw": 1.2, "alpha": 0.5}
        ax.plot(across, high, "-", color=colour, solid_capstyle="round", zorder=4, **strong)
        ax.plot(across[:3], high[:3], "o", color="white", mec=colour, ms=5 if near else 3, zorder=5)
        if near:
            ax.annotate(SHORT_NAMES[leg], (across[0], high[0]), (4, 7), color=colour,
                        textcoords="offset points", zorder=6)  # fmt: skip
    trunk = (stance.hips[[0, 1, 3, 2, 0]] + up)[:, view]
    ax.plot(*trunk.T, "-", color=INK, lw=1.5, zorder=3)
    com = (stance.com + up)[list(view)]
    ax.plot(*com, "o", color="white", mec=INK, ms=8, zorder=6)
    ax.plot(*com, "+", color=INK, ms=8, zorder=7)
    ax.axhline(0.0, color=GROUND, lw=2.0, zorder=1)
    ax.set_aspect("equal")
    wide = float(robot.geometry.reach.max())
    ends = np.concatenate([*polygons, stance.hips[:, view] + [wide, 0.0],
                           stance.hips[:, view] - [wide, 0.0]])  # fmt: skip
    ax.set_xlim(ends[:, 0].min() - 0.05 * wide, ends[:, 0].max() + 0.05 * wide)
    ax.set_ylim(-0.3 * wide, max([stance.height, *(p[:, 1].max() for p in polygons)]) + 0.15 * wide)
    ax.set_xlabel("m")
    ax.grid(alpha=0.25, lw=0.5)


def _shade(
    ax: Axes,
    robot: RobotModel,
    stance: InspectStance,
    view: tuple[int, int],
    leg: int,
    lower: FloatArray,
    upper: FloatArray,
) -> None:
    """Shades where one foot can be, in the plane of the view through where it stands."""
    reach = float(robot.geometry.reach[leg] + np.linalg.norm(robot.geometry.p_HP[leg]))
    centre = stance.hips[leg]
    across = centre[view[0]] + np.linspace(-1.05, 1.05, GRID) * reach
    high = centre[view[1]] + np.linspace(-1.05, 1.05, GRID) * reach
    points = np.empty((GRID * GRID, 3))
    points[:] = stance.feet[leg]
    points[:, view[0]] = np.tile(across, GRID)
    points[:, view[1]] = np.repeat(high, GRID)
    inside = reachable(robot.geometry, leg, lower, upper, points).reshape(GRID, GRID)
    colour = FRONT if leg < 2 else REAR
    ax.contourf(
        across, high + stance.height, inside, levels=[0.5, 1.5], colors=[colour], alpha=0.13
    )


def _outline(points: FloatArray, view: tuple[int, int]) -> FloatArray | None:
    """The hull of points in a view, (n, 2); None if it has no area."""
    flat = points[:, list(view)]
    try:
        return np.asarray(flat[ConvexHull(flat).vertices])
    except QhullError:
        return None


def _measure(ax: Axes, robot: RobotModel, stance: InspectStance) -> None:
    """Writes the lengths of the right front leg beside it."""
    g, up = robot.geometry, np.array([0.0, 0.0, stance.height])
    places: list[tuple[str, Any, Any]] = [
        (f"thigh {1e3 * g.thigh[1]:.0f} mm", stance.thighs[1], stance.knees[1]),
        (f"shank {1e3 * g.shank[1]:.0f} mm", stance.knees[1], stance.feet[1]),
    ]
    for text, start, end in places:
        x, _, z = 0.5 * (start + end) + up
        ax.annotate(
            text, (x, z), (10, 0), textcoords="offset points", color=INK, va="center", zorder=8
        )


def _legend(figure: Figure) -> None:
    """What is what."""
    handles: list[Any] = [
        Line2D([], [], color=FRONT, lw=3, label="front legs"),
        Line2D([], [], color=REAR, lw=3, label="rear legs"),
        Line2D([], [], color=SHAPE, lw=0.8, label="collision shapes"),
        Patch(color=INK, alpha=0.13, lw=0, label="where a foot can be within the joints' limits"),
        Line2D([], [], color="white", marker="o", mec=INK, ms=8, label="centre of mass"),
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=5, frameon=False)
