"""Draws a robot in its nominal stance."""

from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from pydrake.geometry import Box, Capsule, Cylinder, Ellipsoid, Role, SceneGraph, Sphere
from pydrake.multibody.plant import MultibodyPlant
from scipy.spatial import ConvexHull, QhullError

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.robot.kinematics import calc_com, calc_feet, calc_knees, solve_legs
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.loader import AddRobot
from drake_quad.robot.model import LegGeometry, RobotModel
from drake_quad.util.files import write_whole

BENT = 0.75  # height of the hips in the stance over the legs' length, if limits allow it
ROUND = 24  # points on a circle

FRONT, REAR = "#c8641b", "#2b63a8"  # as the legs of the paper's robot
INK, SHAPE, GROUND = "#333333", "#8a8a8a", "#b8ada0"
KINDS = (".svg", ".png", ".pdf")
GRID = 220  # points along each side of the raster that shows the reach
SIDE, BEHIND = (0, 2), (1, 2)  # which coordinates are across and up


class InspectStance(NamedTuple):
    """A robot standing with its feet below its hips; places are in B.

    Attributes:
        q: Joint angles, (4, 3) [rad].
        height: Height of B above the ground [m].
        hips: Places of the hips, (4, 3) [m].
        thighs: Points where the hip pitch axes meet the legs' planes, (4, 3) [m].
        knees: Places of the knees, (4, 3) [m].
        feet: Centres of the feet's spheres, (4, 3) [m].
        com: Centre of mass of the robot, (3,) [m].
    """

    q: FloatArray
    height: float
    hips: FloatArray
    thighs: FloatArray
    knees: FloatArray
    feet: FloatArray
    com: FloatArray


def stand(robot: RobotModel) -> InspectStance:
    """The stance with the feet below the hips at three quarters of the legs' length.

    If the joints' limits do not allow that, the nearest height is taken that they do allow; if they
    allow none, they are ignored.
    """
    g = robot.geometry
    lower, upper = robot.q_lower.reshape(4, 3), robot.q_upper.reshape(4, 3)
    shares = np.linspace(0.3, 0.99, 70)
    shares = shares[np.argsort(np.abs(shares - BENT), kind="stable")]
    chosen = None
    for share in shares:
        feet = g.p_BH + g.p_HP - [0.0, 0.0, share * g.reach.min()]
        q, excess = solve_legs(g, feet)
        if chosen is None:
            chosen = q
        if excess.max() < 1e-9 and np.all((q >= lower) & (q <= upper)):
            chosen = q
            break
    assert chosen is not None
    feet = calc_feet(g, chosen)
    a = chosen[:, 0]
    across = np.stack(
        [
            0 * a,
            np.cos(a) * g.offset - np.sin(a) * g.raised,
            np.sin(a) * g.offset + np.cos(a) * g.raised,
        ],
        axis=-1,
    )
    return InspectStance(
        q=chosen,
        height=float(robot.foot_radius - feet[:, 2].min()),
        hips=g.p_BH,
        thighs=g.p_BH + across,
        knees=calc_knees(g, chosen),
        feet=feet,
        com=calc_com(robot, chosen),
    )


def collision_points(robot: RobotModel, q: FloatArray) -> list[tuple[str, FloatArray]]:
    """The collision shapes: each one's link, and points whose hull it is, (n, 3) in B [m].

    Args:
        robot: The robot.
        q: Joint angles, (4, 3) [rad].
    """
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    AddRobot(plant, robot.url)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for name, angle in zip(robot.joint_names, q.reshape(12), strict=True):
        plant.GetJointByName(name).set_angle(context, angle)
    B = plant.GetBodyByName(robot.trunk).body_frame()
    inspector = scene_graph.model_inspector()
    found = []
    for index in plant.GetBodyIndices(plant.GetBodyByName(robot.trunk).model_instance()):
        body = plant.get_body(index)
        X_BL = body.body_frame().CalcPose(context, B)
        frame = plant.GetBodyFrameIdOrThrow(index)
        for geometry in inspector.GetGeometries(frame, Role.kProximity):
            points = _surface_points(inspector.GetShape(geometry))
            X = X_BL @ inspector.GetPoseInFrame(geometry)
            found.append((str(body.name()), np.asarray((X @ points.T).T)))
    return found


def reachable(
    geometry: LegGeometry, leg: int, lower: FloatArray, upper: FloatArray, points: FloatArray
) -> FloatArray:
    """Whether one leg's foot can be at each point within its limits, (n,) of 0 and 1.

    Args:
        geometry: Geometry of the legs.
        leg: Number of the leg, 0 to 3.
        lower: Lower joint limits, (3,) [rad].
        upper: Upper joint limits, (3,) [rad].
        points: Points (n, 3) in B [m].
    """
    feet = np.repeat(points[:, None, :], 4, axis=1)
    q, excess = solve_legs(geometry, feet)
    mine = q[:, leg]
    whole = 2.0 * np.pi
    within = [(np.mod(mine[:, k] - lower[k], whole) <= upper[k] - lower[k]) for k in range(3)]
    return np.asarray((excess[:, leg] < 1e-9) & within[0] & within[1] & within[2], dtype=float)


def _surface_points(shape: object) -> FloatArray:
    """Points whose hull is the shape, or very nearly, (n, 3) in its own frame [m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    ball = np.concatenate(
        [np.cos(t) * circle + [0.0, 0.0, np.sin(t)] for t in np.linspace(-1.5, 1.5, 13)]
    )
    up = np.array([0.0, 0.0, 1.0])
    if isinstance(shape, Sphere):
        return shape.radius() * ball
    if isinstance(shape, Ellipsoid):
        return ball * [shape.a(), shape.b(), shape.c()]
    if isinstance(shape, (Capsule, Cylinder)):
        end = shape.radius() * (ball if isinstance(shape, Capsule) else circle)
        half = 0.5 * shape.length() * up
        return np.concatenate([end + half, end - half])
    if isinstance(shape, Box):
        corners = np.array(np.meshgrid(*3 * [[-0.5, 0.5]])).reshape(3, -1).T
        return np.asarray(corners * np.array(shape.size()))
    hull = shape.GetConvexHull()  # type: ignore[attr-defined]
    return np.array([hull.vertex(i) for i in range(hull.num_vertices())])


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


def check_picture_path(path: str | Path | None) -> None:
    """Checks, before any work, that a picture can have the path's format.

    Raises:
        InputError: If it cannot.
    """
    if path is not None and Path(path).suffix.lower() not in KINDS:
        remedy = f"a picture's file ends in {', '.join(KINDS)}"
        raise InputError(source="--picture", field="picture", value=str(path), remedy=remedy)


def svg_text(figure: Figure, *, salt: str) -> str:
    """A figure as SVG, to stand in a page; the same figure gives the same text.

    Args:
        figure: The figure.
        salt: Name that the ids in it are derived from.
    """
    buffer = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": salt, "svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    _, mark, rest = buffer.getvalue().partition("<svg")
    return mark + rest


def save_picture(
    figure: Figure, path: Path, *, salt: str, dpi: int = 130, option: str = "--picture"
) -> None:
    """Writes a figure, in the format of the path's ending; the same figure gives the same bytes.

    Args:
        figure: The figure.
        path: The file.
        salt: Name that the ids in an SVG are derived from.
        dpi: Resolution of a PNG.
        option: Option that asked for the file, named by an error.

    Raises:
        InputError: If the file cannot be written.
    """
    kind = path.suffix.lstrip(".").lower()
    with matplotlib.rc_context({"svg.hashsalt": salt, "svg.fonttype": "none"}):
        metadata = {"Date": None} if kind == "svg" else None
        write_whole(
            path,
            lambda to: figure.savefig(to, format=kind, dpi=dpi, metadata=metadata),
            option=option,
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
    """The legend of colours and marks."""
    handles: list[Any] = [
        Line2D([], [], color=FRONT, lw=3, label="front legs"),
        Line2D([], [], color=REAR, lw=3, label="rear legs"),
        Line2D([], [], color=SHAPE, lw=0.8, label="collision shapes"),
        Patch(color=INK, alpha=0.13, lw=0, label="where a foot can be within the joints' limits"),
        Line2D([], [], color="white", marker="o", mec=INK, ms=8, label="centre of mass"),
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=5, frameon=False)
