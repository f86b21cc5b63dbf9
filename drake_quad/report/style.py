"""Colours and type of all figures and of the replay: each thing has one colour everywhere.

The hues are Okabe and Ito's, told apart by the colour-blind; front legs are warm and rear legs
cool, as on the shipped robot, left legs light and right legs dark. Ink, muted ink and grid are
stand-ins: `svg` replaces them by the page's own variables, so that figures follow its light or
dark theme.
"""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure

LEG_COLOURS = ("#E69F00", "#B8480A", "#3FA7E6", "#0068A8")  # FL, FR, RL, RR
LEG_NAMES = ("1 FL", "2 FR", "3 RL", "4 RR")  # the paper's number, the log's name

GOOD, WARN, BAD = "#009E73", "#C98A00", "#D55E00"
COM_COLOUR = "#CC79A7"
LESS_COLOUR = "#8C6BB1"  # a second quantity beside the measured one

KIND_COLOURS = {
    "stand": "#8A8F94",
    "transition": "#8C6BB1",
    "wave": "#009E73",
    "trot": "#009E73",
    "spin": "#C98A00",
}
OTHER_KIND = "#8A8F94"
# What the gait clock does while it stands still.
MODE_COLOURS = {"wait": "#5B6770", "catch": "#D55E00", "settle": "#E3B505", "replan": "#7A4FBF"}
PUSH_COLOUR = "#C2185B"
BAND_OPACITY = 0.13

INK, MUTED, GRID, PAPER = "#010203", "#040506", "#070809", "#0A0B0C"
THREE_COLOURS = ("#1B9AA0", "#D0569A", INK)  # joints of a leg, axes: none is a leg's
PAGE_VARIABLES = {INK: "--ink", MUTED: "--muted", GRID: "--grid", PAPER: "--paper"}

WIDTH = 11.0  # [in] of every figure; at 1100 px one inch is 100 px

RC: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "sans-serif"],
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.linewidth": 0.7,
    "lines.linewidth": 1.2,
    "lines.solid_joinstyle": "round",
    "svg.fonttype": "none",
    "path.simplify": True,
    "path.simplify_threshold": 0.1,
    "mathtext.fontset": "dejavusans",
}

HERE = Path(__file__).parent


def kind_colour(kind: str) -> str:
    """The colour of a segment's kind; grey for one that this page does not know."""
    return KIND_COLOURS.get(kind, OTHER_KIND)


def render(template: str, **values: object) -> str:
    """Fills a template; text is escaped, and a value that is missing is an error."""
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    return environment.get_template(template).render(**values)


def read_css(name: str) -> str:
    """A style sheet as it is."""
    return (HERE / name).read_text(encoding="utf-8")


@contextmanager
def report_style() -> Iterator[None]:
    """Within it, figures are made in the report's type and colours, whatever the user's own are."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(RC)
        yield


def to_svg(figure: Figure, *, name: str, label: str) -> str:
    """Returns the figure as an `<svg>` element.

    Args:
        figure: Made within `report_style`.
        name: Unlike that of the page's other figures: the ids in it are derived from it, so that
            figures do not clip one another, and the same run gives the same page.
        label: What the figure shows, for those who cannot see it.
    """
    with matplotlib.rc_context({"svg.hashsalt": name}):
        buffer = io.StringIO()
        empty = {"Date": None, "Creator": None, "Format": None, "Type": None}
        figure.savefig(buffer, format="svg", metadata=empty)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->\n?", "", text, flags=re.DOTALL)
    text = re.sub(r'<g id="[^"]*"', "<g", text)
    text = re.sub(r' (?:width|height)="[\d.]+pt"', "", text, count=2)
    for colour, variable in PAGE_VARIABLES.items():
        text = re.sub(colour, f"var({variable})", text, flags=re.IGNORECASE)
    label = label.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    label = label.replace(">", "&gt;")  # so that the first in the text ends the element's head
    return text.replace("<svg", f'<svg role="img" aria-label="{label}"', 1)


def stand_alone(svg: str) -> str:
    """What `to_svg` made, to be a file of its own: with the ink that a page would have given it."""
    own = (
        "svg { --ink: #1b1f23; --muted: #6a737d; --grid: #e1e4e8; --paper: #fff; background: #fff }"
    )
    head, mark, rest = svg.partition(">")
    return f"{head}{mark}<style>{own}</style>{rest}"
