"""HTML of a report: templates, inline SVG, and a page packed within a page.

Meshcat's recordings are numbers in base64, of which gzip makes little, and of the numbers much.
The report's script (`report.html`) unpacks what is made here as `unpack` does.
"""

import base64
import binascii
import gzip
import io
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib
import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure

from drake_quad.report.style import PAGE_VARIABLES, RC

# ------------------------------------------------------------------------------------------------
# The report's HTML templates, which stand beside this file.
# ------------------------------------------------------------------------------------------------


HERE = Path(__file__).parent


def render(template: str, **values: object) -> str:
    """Fills a template; text is escaped, and a value that is missing is an error."""
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    return environment.get_template(template).render(**values)


def read_css(name: str) -> str:
    """A style sheet as it is."""
    return (HERE / name).read_text(encoding="utf-8")


# ------------------------------------------------------------------------------------------------
# A matplotlib figure as SVG to stand in a page: small, with the page's own ink and no network.
# ------------------------------------------------------------------------------------------------


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


# ------------------------------------------------------------------------------------------------
# A page within a page, packed small: what is in base64 is packed as the bytes that it stands for.
# ------------------------------------------------------------------------------------------------


# Meshcat has its recording in data URLs; short ones are left as they are.
_BASE64 = re.compile(r"(?<=;base64,)[A-Za-z0-9+/]{400,}={0,2}")
# Of a recording in MessagePack: a keyframe's three or four numbers, each of 8 bytes after \xcb.
_RECORDING = b"\x83\xa4type\xadset_animation"
_KEYFRAME = re.compile(rb"(?<=\xa5value[\x93\x94])(?:\xcb.{8}){3,4}", re.DOTALL)
FINEST = 2.0**-20  # [m], and of a unit quaternion: a thousandth of a millimetre


def round_recording(page: str) -> str:
    """The page with the numbers of its recording rounded to whole FINEST.

    Nobody sees so little move; and what is rounded ends in zeros, of which packing makes nothing.
    """

    def keyframe(found: re.Match[bytes]) -> bytes:
        cells = np.frombuffer(found[0], dtype=[("mark", "S1"), ("value", ">f8")]).copy()
        cells["value"] = np.round(cells["value"] / FINEST) * FINEST
        return cells.tobytes()

    def recording(found: re.Match[str]) -> str:
        try:
            raw = base64.b64decode(found[0])
        except binascii.Error:
            return found[0]
        if not raw.startswith(_RECORDING):
            return found[0]
        return base64.b64encode(_KEYFRAME.sub(keyframe, raw)).decode()

    return _BASE64.sub(recording, page)


def pack(page: str) -> str:
    """The page in base64 of gzip: the lengths of its pieces as JSON, a line, then the pieces.

    Pieces are text and bytes in turn, text first; bytes are what base64 in the page stands for.
    """
    pieces, end = [], 0
    for found in _BASE64.finditer(page):
        try:
            raw = base64.b64decode(found[0])
        except binascii.Error:
            continue
        if base64.b64encode(raw).decode() != found[0]:  # it would not come back as it was
            continue
        pieces += [page[end : found.start()].encode(), raw]
        end = found.end()
    pieces.append(page[end:].encode())
    head = json.dumps([len(piece) for piece in pieces]).encode() + b"\n"
    packed = gzip.compress(head + b"".join(pieces), compresslevel=6, mtime=0)
    return base64.b64encode(packed).decode()


def unpack(packed: str) -> str:
    """The page that `pack` was given."""
    head, _, rest = gzip.decompress(base64.b64decode(packed)).partition(b"\n")
    text, at = [], 0
    for k, length in enumerate(json.loads(head)):
        piece = rest[at : at + length]
        text.append((base64.b64encode(piece) if k % 2 else piece).decode())
        at += length
    return "".join(text)
