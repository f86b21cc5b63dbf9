"""The figures of a run's page, in their order, with what is said of each."""

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

from drake_quad.report.figure_clock import draw_clock, stood_still
from drake_quad.report.figure_course import draw_footprints, draw_side
from drake_quad.report.figure_estimate import draw_estimate, was_estimated
from drake_quad.report.figure_gait import draw_gait
from drake_quad.report.figure_joints import draw_forces, draw_speeds, draw_torques
from drake_quad.report.figure_margin import draw_margin
from drake_quad.report.figure_motion import draw_base_error, draw_trajectories
from drake_quad.report.figure_regions import draw_regions, was_measured
from drake_quad.report.run_files import Run


@dataclass(frozen=True)
class FigureKind:
    """A figure of the page.

    Attributes:
        name: Of its place in the page.
        title: Over it.
        caption: Under it.
        draw: Makes it.
        physics: Whether it shows what a kinematic replay has not.
        wanted: Whether a run has anything to show in it.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[Run], Figure]
    physics: bool = False
    wanted: Callable[[Run], bool] = lambda _: True


FIGURES = (
    FigureKind(
        "margin",
        "Stability margin",
        "Distance from the projected centre of mass of the whole robot to the nearest side of the "
        "support polygon: positive inside. Measured over the feet that bear, planned over those "
        "that were to. The zero-moment point's margin counts the accelerations too.",
        draw_margin,
    ),
    FigureKind(
        "regions",
        "Margins within friction and torque, and pushes",
        "Signed distance of the centre of mass from the border of where the feet's forces can "
        "balance it: within their friction cones; within the joints' torque limits too; and with "
        "what its acceleration asks for besides the weight. Dashed as planned. Bands: red outside, "
        "amber under a margin that is safe. Below, the capture point's distance from where the "
        "feet's pressure can hold it, and the least push of all directions that would take a step.",
        draw_regions,
        physics=True,
        wanted=was_measured,
    ),
    FigureKind(
        "footprints",
        "Footprints from above",
        "Where each foot stood (left round, right square), the paths of body and centre of mass, "
        "and the support polygon at the moment of the least margin. The higher the ground, the "
        "stronger its tint; lines across are nosings.",
        draw_footprints,
    ),
    FigureKind(
        "side",
        "The course from the side",
        "The lanes of the course laid out straight, with the lowest points of the feet and the "
        "centre of mass.",
        draw_side,
    ),
    FigureKind(
        "trajectories",
        "Trajectories of the body, leg 1 and leg 2",
        "Body centre and foot centres in the world frame.",
        draw_trajectories,
    ),
    FigureKind(
        "gait",
        "Gait diagram",
        "A bar while a foot stands: pale or outlined as planned, full as sensed (more than 1 % of "
        "the robot's weight on it). Red: it was to stand and lost "
        "the ground, beyond 0.1 s of delay at touchdown or lift-off.",
        draw_gait,
    ),
    FigureKind(
        "torques",
        "Joint torques against their limits",
        "Ratio to the limit, dashed at ±1; the ring marks the greatest of all.",
        draw_torques,
        physics=True,
    ),
    FigureKind(
        "speeds",
        "Joint speeds against their limits",
        "Ratio to the limit, dashed at ±1; the ring marks the greatest of all.",
        draw_speeds,
    ),
    FigureKind(
        "forces",
        "Foot forces",
        "Vertical force on each foot; dashed, a quarter of the robot's weight.",
        draw_forces,
        physics=True,
    ),
    FigureKind(
        "error",
        "The body against its plan",
        "Measured less what the controller wants: the plan, or aside of it for an unknown load.",
        draw_base_error,
        physics=True,
    ),
    FigureKind(
        "clock",
        "The gait clock's waiting",
        "Where the clock stood still and what for, and how long in all.",
        draw_clock,
        physics=True,
        wanted=stood_still,
    ),
    FigureKind(
        "estimate",
        "The estimated state against the truth",
        "Errors of the base's place, heading and tilt (sizes, but for the heading), and what the "
        "filter believes them to be. Nothing that the robot feels shows its place or its heading: "
        "they drift. Marks along the bottom: feet taken for slipping, in their legs' colours.",
        draw_estimate,
        physics=True,
        wanted=was_estimated,
    ),
)
