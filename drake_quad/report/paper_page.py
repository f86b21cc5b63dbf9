"""The page that sets the paper's statements beside ours; its numbers are computed, all of them."""

from collections import Counter
from collections.abc import Iterable, Sequence

from drake_quad.report.paper_betas import BetaRow
from drake_quad.report.paper_figures import FIGURES, PaperFigure
from drake_quad.report.paper_findings import Finding, Verdict
from drake_quad.report.paper_study import TABLE_I
from drake_quad.scenario.load import load_scenario

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
