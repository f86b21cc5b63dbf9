"""The paper's figures again: which there are, their captions, and how each is drawn."""

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

from drake_quad.report.paper_figures_robot import robot_model, traverse
from drake_quad.report.paper_figures_run import margins, trajectories
from drake_quad.report.paper_figures_spin import BETA_DRAWN, spin_cycle, spin_geometry
from drake_quad.report.paper_figures_stairs import stair_climbing, swing_path
from drake_quad.report.paper_figures_top import (
    spin_configuration,
    spin_transition,
    wave_configuration,
    wave_transition,
)
from drake_quad.report.paper_figures_treads import treads
from drake_quad.report.paper_samples import Samples
from drake_quad.report.paper_study import CaseStudy


@dataclass(frozen=True)
class PaperFigure:
    """One figure.

    Attributes:
        number: Its number in the paper.
        name: Of its file, without the number and the suffix.
        caption: The paper's caption.
        note: What there is to see in ours.
        draw: Draws it from the case study and its samples.
    """

    number: int
    name: str
    caption: str
    note: str
    draw: Callable[[CaseStudy, Samples], Figure]

    @property
    def file(self) -> str:
        """The name of its file."""
        return f"fig_{self.number:02d}_{self.name}.png"


FIGURES: tuple[PaperFigure, ...] = (
    PaperFigure(
        1,
        "robot",
        "Model of the quadruped robot.",
        "The shipped robot, not the authors', whose model is in other papers: with Table I's "
        "workspaces (dashed, on the ground), in the initial configuration; the legs' numbers and "
        "the body's axes are the paper's.",
        robot_model,
    ),
    PaperFigure(
        2,
        "wave_configuration",
        "The desired foot positions with respect to the body at the beginning of wave gait.",
        "Crosses are the workspaces' centres, the initial configuration; offsets are from there.",
        lambda study, samples: wave_configuration(),
    ),
    PaperFigure(
        3,
        "wave_transition",
        "Transition from the initial to desired configuration for the wave gait.",
        "Solid circles stand, an open circle is where the swing leg goes; shaded the support "
        "polygon, above each panel its margin. (a) is the paper's order; (b) and (c) are ours. The "
        "workspaces move with the body.",
        lambda study, samples: wave_transition(),
    ),
    PaperFigure(
        4,
        "stair_climbing",
        "The quadruped robot climbing up stairs.",
        "One cycle from the robot's right side, each panel in the middle of a swing; dotted the "
        "body at its beginning and end.",
        lambda study, samples: stair_climbing(study),
    ),
    PaperFigure(
        5,
        "swing_trajectory",
        "The trajectory of the swing leg for stair climbing.",
        "A point foot, up and down two treads. Dotted red: the same equations with the other of "
        "the two risers.",
        lambda study, samples: swing_path(),
    ),
    PaperFigure(
        6,
        "spin_configuration",
        "The desired foot positions with respect to the body at the beginning of spinning gait.",
        "Thin the longest arc in each workspace, thick the part that a quarter turn uses.",
        lambda study, samples: spin_configuration(),
    ),
    PaperFigure(
        7,
        "spin_transition",
        "Transition from the initial to desired configuration for the spinning gait.",
        "As in Fig. 3. The paper's order is in its own figure alone; these are ours.",
        lambda study, samples: spin_transition(),
    ),
    PaperFigure(
        8,
        "spin_geometry",
        "Geometric configuration used for the spinning gait.",
        "Leg 1's workspace, and the circle through its centre. Equations (4)-(6) hold in (a); in "
        "(b), Table I, the circle never reaches the outer length.",
        lambda study, samples: spin_geometry(),
    ),
    PaperFigure(
        9,
        "spin_cycle",
        "Relative foot positioning in a counterclockwise spinning gait.",
        f"Each foot goes from its solid to its open circle. (a) is drawn for β = {BETA_DRAWN:.2f}: "
        "with Table I's 0.75 the intervals t1-t2 and t4-t5 have no length.",
        lambda study, samples: spin_cycle(),
    ),
    PaperFigure(
        10,
        "traverse",
        "The model of the quadruped robot during simulation.",
        "On the level, up, in the spin on the landing, down, and at the end; seen from inside the "
        "turn, so that the robot comes from the right.",
        traverse,
    ),
    PaperFigure(
        11,
        "trajectories",
        "Trajectories of the body, leg 1, and leg 2 with respect to the ground.",
        "Floor, six stairs up, a quarter turn on the landing, six stairs down, floor. Transitions "
        "to the wave gait in the paper's order, 2-3-4-1-3; the others are ours.",
        trajectories,
    ),
    PaperFigure(
        12,
        "static_margin",
        "Static stability margin versus time.",
        "Blue as in the paper, the body's centre over the feet. Grey the whole robot's centre of "
        "mass in the same motion. Transitions to the wave gait in the paper's order, 2-3-4-1-3; "
        "the others are ours. At β = 0.75 the wave's own switches are zeros too.",
        margins,
    ),
    PaperFigure(
        13,
        "one_tread",
        "One tread a cycle against two; not in the paper, whose introduction has it in words.",
        "Support polygons seen from above with the body in the middle of each swing, the line is "
        "its way meanwhile, the open circle where the swing leg goes. Legs massless, no sway.",
        treads,
    ),
)
