"""The paper's figures, and the page that sets its statements beside ours."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from drake_quad.scenario.load import load_scenario
from paper.figures_gaits import (
    BETA_DRAWN,
    spin_configuration,
    spin_cycle,
    spin_geometry,
    spin_transition,
    wave_configuration,
    wave_transition,
)
from paper.figures_run import margins, robot_model, trajectories, traverse
from paper.figures_stairs import stair_climbing, swing_path, treads
from paper.finding import Finding, Verdict
from paper.margins import BetaRow
from paper.study import TABLE_I, CaseStudy, Samples

# ------------------------------------------------------------------------------------------------
# The paper's figures again: which there are, their captions, and how each is drawn.
# ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PaperFigure:
    """One figure.

    Attributes:
        number: Its number in the paper.
        name: Name of its file, without the number and the suffix.
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


# ------------------------------------------------------------------------------------------------
# The page that sets the paper's statements beside ours; its numbers are computed, all of them.
# ------------------------------------------------------------------------------------------------


HEIGHT = load_scenario("paper").gait.body_height
COMMAND = "python scripts/reproduce_paper.py"

_INTRODUCTION = f"""\
# The paper again

A. Zamani, M. Khorram, S. A. A. Moosavian, *Stable Stair-Climbing of a Quadruped Robot*: each of its
statements that a computation can decide, beside what we compute; its figures; its Table I.
`{COMMAND}` writes this page and the figures.

Everything here is kinematic, as in the paper: the body level and at constant speed, transitions
with the body still and by way of the workspaces' centres, β = {TABLE_I.beta}. The margin is the
paper's: the body's centre over the feet that stand, legs massless; we sign it, negative outside of
the support polygon. How many stairs, and how long a floor, the paper does not say: here six up, a
quarter turn, six down, and level ground in whole strides. Legs are 1 front left, 2 front right,
3 rear left, 4 rear right.

The case study is the shipped scenario `paper` (`drake-quad plan paper`). Its transition to the wave
gait is the paper's own, 2-3-4-1-3, in Figs. 3(a), 11 and 12 alike. The paper's text has no order of
legs towards the spinning gait (it is in its Fig. 7 alone) and towards the centres: there the orders
are ours, the fewest steps with the largest margins. With `transition.wave_order: []` ours takes the
place of the paper's, and has the better margins of Fig. 3(b). What the paper leaves open besides:
the body's height, here {HEIGHT} m, at which the shanks touch no nosing (a replay asks Drake's
geometry); and over what a spin's swing is at rest at its ends, here over the ground."""

_BETAS = """\
## The margin beyond β = 3/4

Least static margin of the wave gait at the same stride, legs massless, the body at constant
speed and without sway: by the wave's own equations, (β - 3/4)λ/2 across the feet's diagonal, and
of `drake-quad plan paper --set gait.duty_factor=β`, where the body goes (β - 3/4)λ/2 ahead, on four
feet, before the first cycle and back after the last, so that the longer strokes are centred."""


def page(findings: Sequence[Finding], betas: Sequence[BetaRow]) -> str:
    """Returns the page as Markdown."""
    parts = [
        _INTRODUCTION,
        _table_i(),
        _statements(findings),
        _beta_table(betas),
        _figures(),
    ]
    return "\n\n".join(parts) + "\n"


def _table_i() -> str:
    """Returns Table I."""
    w, t = TABLE_I.workspace, TABLE_I
    columns = {
        "R_x [m]": w.R_x, "R_y [m]": w.R_y, "P_x [m]": w.P_x, "P_y [m]": w.P_y, "β": t.beta,
        "W [m]": t.W, "H [m]": t.H, "T [s]": t.T, "t_0 [s]": t.t_0, "Δh [m]": t.delta_h,
    }  # fmt: skip
    derived = (
        f"From it: stroke R = 2Wβ = {t.stroke:.2f} m, stride λ = {t.stride:.2f} m, swing time "
        f"(1 - β)T = {t.swing_time:.1f} s, body speed λ/T = {t.stride / t.T:.3f} m/s."
    )
    rows = [_row(columns), _row("---" for _ in columns), _row(f"{v:g}" for v in columns.values())]
    return "\n".join(["## Table I. Gait parameters", "", *rows, "", derived])


def _beta_table(rows: Sequence[BetaRow]) -> str:
    """Returns the margins beyond β = 3/4."""
    head = ["β", "by the equations [m]", "as planned, up [m]", "as planned, down [m]"]
    lines = [_row(head), _row("---" for _ in head)]
    for row in rows:
        figures = (round(value, 6) + 0.0 for value in (row.equations, row.up, row.down))
        lines.append(_row([f"{row.beta:.2f}", *(f"{value:.4f}" for value in figures)]))
    return "\n".join([_BETAS, "", *lines])


def _statements(findings: Sequence[Finding]) -> str:
    """Returns the table of statements, and how many there are of each verdict."""
    counts = Counter(finding.verdict for finding in findings)
    summary = ", ".join(f"{counts[verdict]} {verdict}" for verdict in Verdict)
    rows = [
        _row(
            (
                finding.statement,
                finding.where,
                finding.found,
                ", ".join(_link(number) for number in finding.figures),
                f"**{finding.verdict}**",
            )
        )
        for finding in findings
    ]
    head = [
        _row(("The paper", "Where", "What we find", "Fig.", "Verdict")),
        "|---|---|---|---|---|",
    ]
    return "\n".join(
        ["## Statements", "", f"{len(findings)} statements: {summary}.", "", *head, *rows]
    )


def _figures() -> str:
    """Returns the figures with their captions, in the paper's manner."""
    return "\n\n".join(["## Figures", *(_figure(figure) for figure in FIGURES)])


def _figure(figure: PaperFigure) -> str:
    """Returns one figure with its anchor and caption."""
    return (
        f'<a id="fig-{figure.number}"></a>\n'
        f"![{figure.caption}]({figure.file})\n\n"
        f"Fig. {figure.number}. {figure.caption} *{figure.note}*"
    )


def _link(number: int) -> str:
    """Returns a link to a figure on the page."""
    return f"[{number}](#fig-{number})"


def _row(cells: Iterable[str]) -> str:
    """Returns one row of a Markdown table."""
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
