"""Draws where the region of balance on stairs differs from the hull of the feet, and by how much.

    python -m benchmarks.region_picture docs/images/regions.svg

The shipped robot on stairs of 18 / 28 cm, friction 0.6: on level treads; with a front foot on a
nosing, its ground tilted by 45°; with a part of its drives' torque; and braking. Each on four feet
and on three. Prints the table of areas and of distances.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.common import markdown_table
from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.report.style import COM_COLOUR, GOOD, LEG_COLOURS
from drake_quad.robot.loader import load_robot
from drake_quad.stability.capture_point import directions
from drake_quad.stability.equilibrium_region import (
    Region,
    WrenchDemand,
    find_region,
    joint_limits,
    make_contacts,
)
from drake_quad.stability.support_polygon import support_polygon

ROBOT = "package://drake_quad_models/paper_quadruped.urdf"
RISE, RUN, FRICTION = 0.18, 0.28, 0.6
STRENGTH = 0.45  # of the drives, in the third column
BRAKING = -1.0  # [m/s²] in the fourth
TREADS = np.array([3, 2, 0, 1])  # that FL, FR, RL, RR stand on
SIDES = np.array([0.27, -0.27, 0.33, -0.33])  # [m]
COLUMNS = ("level treads", "FL on a nosing", f"{STRENGTH:.0%} of the torque", "braking by 1 m/s²")
ROWS = ((True, True, True, True), (True, True, True, False))


def regions() -> list[list[tuple[FloatArray, Region, FloatArray]]]:
    """Of each row and column the hull, the region, and the centre of mass (2,)."""
    robot = load_robot(ROBOT)
    x = RUN * (TREADS + 0.5)
    feet = np.column_stack([x, SIDES, RISE * TREADS + robot.foot_radius])
    pitch = -np.arctan2(RISE, RUN)
    body = np.array([x.mean() + 0.02, 0.0, feet[:, 2].mean() + 0.72, 0.6 * pitch, 0.0])
    q, excess, com = (part[0] for part in pose_robot(robot, body[None], feet[None]))
    assert excess.max() == 0.0
    places, R = feet - [0.0, 0.0, robot.foot_radius], rotations(body)
    nosing = np.tile([0.0, 0.0, 1.0], (4, 1))
    nosing[0] = [-1.0, 0.0, 1.0]
    braking = WrenchDemand((BRAKING / 9.81, 0.0, 1.0), height=float(com[2]))
    found = []
    for row in ROWS:
        who = np.array(row)
        level = make_contacts(places[who], friction=FRICTION)
        tilted = make_contacts(places[who], nosing[who], FRICTION)
        limits = joint_limits(robot, R, q, who, effort=STRENGTH * robot.effort)
        hull = support_polygon(places[who, :2])
        found.append(
            [
                (hull, region, com[:2])
                for region in (
                    find_region(level),
                    find_region(tilted),
                    find_region(level, limits=limits),
                    find_region(level, demand=braking),
                )
            ]
        )
    return found


def area(corners: FloatArray) -> float:
    """Of a polygon (k, 2) [m²]."""
    x, y = corners.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def farthest_apart(hull: FloatArray, region: Region) -> float:
    """The greatest distance between the two borders in any direction (of their reaches) [m]."""
    if not len(region.corners):
        return float("nan")
    ways = directions(360)
    return float(np.abs((ways @ hull.T).max(axis=1) - (ways @ region.corners.T).max(axis=1)).max())


def draw(axes: Axes, hull: FloatArray, region: Region, com: FloatArray) -> None:
    """One stance from above."""
    for k in range(-1, 5):
        axes.axvline(RUN * (k + 1), color="#8A8F94", lw=0.6)
    axes.fill(*hull.T, facecolor="none", edgecolor="#5B6770", lw=1.0, ls=(0, (4, 2)))
    if len(region.corners) > 2:
        axes.fill(*region.corners.T, facecolor=GOOD, alpha=0.35, edgecolor=GOOD, lw=1.2)
    for leg, (x, y) in enumerate(np.column_stack([RUN * (TREADS + 0.5), SIDES])):
        stands = np.any(np.all(np.isclose(hull, [x, y]), axis=1))
        axes.plot(x, y, "o", ms=6, mec=LEG_COLOURS[leg], mfc=LEG_COLOURS[leg] if stands else "none")
    axes.plot(*com, "+", ms=9, mew=1.6, color=COM_COLOUR)
    axes.set_aspect("equal")
    axes.set_xlim(-0.1, 1.25)
    axes.set_ylim(-0.45, 0.45)


def main(arguments: Sequence[str] | None = None) -> None:
    """Draws and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("file", type=Path, help="the picture, .svg or .png")
    options = parser.parse_args(arguments)
    found = regions()
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    grid = figure.subplots(len(ROWS), len(COLUMNS), sharex=True, sharey=True)
    lines = []
    for axes_row, cells, who in zip(grid, found, ROWS, strict=True):
        for axes, (hull, region, com), name in zip(axes_row, cells, COLUMNS, strict=True):
            draw(axes, hull, region, com)
            margin, of_hull = region.margin(*com), Region(hull).margin(*com)
            axes.set_title(f"{name}\nmargin {of_hull:.3f} → {margin:.3f} m", fontsize=9)
            lines.append(
                [
                    f"{sum(who)} feet, {name}",
                    f"{of_hull:.3f} m",
                    f"{margin:.3f} m",
                    f"{area(region.corners) / area(hull):.0%}" if len(region.corners) > 2 else "0%",
                    f"{1e3 * farthest_apart(hull, region):.0f} mm",
                ]
            )
    figure.supxlabel("along the stairs [m]; up to the right", fontsize=9)
    figure.savefig(options.file, metadata={"Date": None} if options.file.suffix == ".svg" else None)
    header = ("stance", "hull's margin", "region's", "area of the hull's", "farthest apart")
    print(markdown_table(header, lines))


if __name__ == "__main__":
    main()
