"""Figs. 1 and 10: the robot, and the robot on its way over the stairs."""

import numpy as np
from matplotlib.figure import Figure

from drake_quad.common import FloatArray
from drake_quad.math.rotations import rotations
from drake_quad.planning.motion_plan import pose_robot
from drake_quad.report.paper_drawing import BODY, COLOURS, new_figure
from drake_quad.report.paper_samples import Samples
from drake_quad.report.paper_solid import Solids, View
from drake_quad.report.paper_study import TABLE_I, CaseStudy
from drake_quad.robot.kinematics import calc_knees
from drake_quad.robot.legs import LEGS
from drake_quad.robot.model import RobotModel
from drake_quad.terrain.course import Course

FROM_AHEAD = View(azimuth=-38.0, elevation=20.0)
FROM_CORNER = View(azimuth=128.0, elevation=30.0)  # inside of the turn: both flights' risers show
TRUNK, FLOOR, TREAD, OTHER_TREAD = "#D9D9D9", "#CFCBC4", "#E2DCD0", "#CDC4B3"
THIGH, SHANK, HIP = 0.028, 0.018, 0.045  # [m] radii as drawn


def robot_model(study: CaseStudy, samples: Samples) -> Figure:
    """Returns Fig. 1: the robot in its initial configuration, its frame and its legs' numbers."""
    figure = new_figure(7.5, 5.6)
    axes = figure.subplots()
    body, feet = samples.body[0], samples.feet[0]
    solids, view = Solids(), FROM_AHEAD
    ground = Solids()
    ground.add_box(np.array([body[0], 0.0, -0.02]), (2.4, 1.7, 0.04), np.eye(3), FLOOR)
    ground.paint(axes, view, zorder=1.0)
    w = TABLE_I.workspace
    for centre, leg in zip(w.centres, LEGS, strict=True):
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * w.half_size + centre
        box = np.column_stack([corners + body[:2], np.zeros(4)])
        axes.fill(*view.flat(box).T, facecolor="none", edgecolor=COLOURS[leg], ls="--", lw=1.0,
                  zorder=1.5)  # fmt: skip
    _add_robot(solids, study.robot, body, feet)
    solids.paint(axes, view)
    peak = view.flat(body[:3] + np.array([0.0, 0.0, 0.55]))[1]
    axes.set_ylim(axes.get_ylim()[0], peak)
    for leg in LEGS:
        at = view.flat(feet[leg.row] + np.array([0.0, 0.12 * (1 if leg.row % 2 == 0 else -1), 0.0]))
        axes.text(*at, str(int(leg)), color=COLOURS[leg], fontsize=12, fontweight="bold",
                  ha="center", va="center", zorder=5)  # fmt: skip
    top = body[:3] + np.array([0.0, 0.0, 0.10])
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        tip = top + 0.34 * axis
        axes.annotate("", xy=view.flat(tip), xytext=view.flat(top), zorder=6,
                      arrowprops={"arrowstyle": "-|>", "color": BODY, "lw": 1.3})  # fmt: skip
        axes.text(*view.flat(top + 0.40 * axis), f"${name}$", fontsize=11, ha="center",
                  va="center", zorder=6)  # fmt: skip
    return figure


def traverse(study: CaseStudy, samples: Samples) -> Figure:
    """Returns Fig. 10: the robot on the whole course, at five moments of the case study."""
    figure = new_figure(12.0, 5.6)
    axes = figure.subplots()
    solids = Solids()
    _add_course(solids, study.course)
    spin = next(s for s in study.segments if s.kind == "spin")
    walks = [s for s in study.segments if s.kind == "wave"]
    moments = [
        walks[0].start - 2.0,
        walks[0].start + 4.6 * TABLE_I.T,
        0.5 * (spin.start + spin.end),
        walks[1].start + 3.6 * TABLE_I.T,
        walks[1].end,
    ]
    for k, t in enumerate(moments):
        n = int(np.argmin(np.abs(samples.times - t)))
        _add_robot(solids, study.robot, samples.body[n], samples.feet[n])
        at = FROM_CORNER.flat(samples.body[n, :3] + np.array([0.0, 0.0, 0.55]))
        axes.text(*at, f"({'abcde'[k]}) {samples.times[n]:.0f} s", fontsize=9, ha="center",
                  va="center", zorder=9)  # fmt: skip
    solids.paint(axes, FROM_CORNER)
    return figure


def _add_course(solids: Solids, course: Course) -> None:
    """Adds the course's boxes, neighbouring treads in other shades."""
    treads = 0
    for box in course.boxes:
        colour = FLOOR
        if "tread" in box.name:
            treads += 1
            colour = (TREAD, OTHER_TREAD)[treads % 2]
        c, s = np.cos(box.yaw), np.sin(box.yaw)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        solids.add_box(np.asarray(box.centre), box.size, R, colour)


def _add_robot(solids: Solids, robot: RobotModel, body: FloatArray, feet: FloatArray) -> None:
    """Adds the robot with its body at a pose (5,) and its feet (4, 3) in W."""
    q = pose_robot(robot, body[None], feet[None])[0][0]
    R, g = rotations(body), robot.geometry
    for low, high in robot.trunk_boxes:
        centre = body[:3] + R @ (0.5 * (low + high))
        solids.add_box(centre, high - low, R, TRUNK)
    abduction = q[:, 0]
    aside = np.stack([np.zeros(4), np.cos(abduction), np.sin(abduction)], axis=-1)
    hips_B = g.p_BH + g.offset[:, None] * aside
    knees_B = calc_knees(g, q)
    for leg in LEGS:
        row, colour = leg.row, COLOURS[leg]
        joint, hip, knee = (body[:3] + R @ p[row] for p in (g.p_BH, hips_B, knees_B))
        if np.linalg.norm(hip - joint) > 1e-6:
            solids.add_rod(joint, hip, HIP, TRUNK)
        solids.add_rod(hip, knee, THIGH, colour)
        solids.add_rod(knee, feet[row], SHANK, colour)
