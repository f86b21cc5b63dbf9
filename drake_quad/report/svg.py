"""A matplotlib figure as SVG to stand in a page: small, with the page's own ink and no network."""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib
from matplotlib.figure import Figure

from drake_quad.report.style import PAGE_VARIABLES, RC


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
