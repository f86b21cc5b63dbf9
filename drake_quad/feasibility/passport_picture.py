"""Draws a passport: the flights to scale, each with its answer."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_quad.feasibility.passport import Entry, Passport
from drake_quad.feasibility.passport_page import ANSWERS
from drake_quad.feasibility.robot_picture import INK, save_picture, svg_text

STEPS = 3  # of each flight that are drawn
COLOURS = {"yes": "#2e7d32", "no": "#8a8a8a", "unknown": "#c8c8c8"}
SHORT = "#c98a00"  # of a yes below the margin that is wanted
ACROSS = 4  # flights in a row


def passport_svg(passport: Passport) -> str:
    """The figure as SVG, to stand in a page; the same passport gives the same text."""
    return svg_text(draw_passport(passport), salt="passport")


def save_passport_picture(passport: Passport, directory: Path) -> None:
    """Writes passport.svg and passport.png.

    Raises:
        InputError: If they cannot be written.
    """
    figure = draw_passport(passport)
    for kind in ("svg", "png"):
        save_picture(figure, directory / f"passport.{kind}", salt="passport", option="--out")


def draw_passport(passport: Passport) -> Figure:
    """The figure: three steps of every flight to one scale, and the robot's leg beside them."""
    entries = passport.entries
    rows = max(-(-len(entries) // ACROSS), 1)
    with matplotlib.rc_context({"font.size": 9}):
        figure = Figure(figsize=(10.5, 0.5 + 2.5 * rows), layout="constrained")
        axes = np.atleast_2d(figure.subplots(rows, ACROSS))
        wide = (STEPS + 0.6) * max((one.stairs.run for one in entries), default=0.3)
        high = max(STEPS * max((one.stairs.rise for one in entries), default=0.2), passport.leg)
        for k, ax in enumerate(axes.flat):
            ax.set_axis_off()
            if k < len(entries):
                _draw_entry(ax, entries[k], passport.leg)
            ax.set_xlim(-0.25, wide)
            ax.set_ylim(-0.05, high + 0.05)
            ax.set_aspect("equal")
        figure.suptitle(
            f"{passport.name}: flights of {passport.count} steps, up and down; the bar is as long "
            f"as its leg, {passport.leg:.2f} m",
            parse_math=False,
        )
    return figure


def _draw_entry(ax: Axes, entry: Entry, leg: float) -> None:
    """Some steps of the flight in the colour of the answer."""
    stairs = entry.stairs
    colour = SHORT if entry.short else COLOURS[entry.verdict]
    x, y = [0.0], [0.0]
    for k in range(STEPS):
        x += [x[-1], x[-1] + stairs.run]
        y += [(k + 1) * stairs.rise] * 2
    x.append(x[-1])
    y.append(0.0)
    ax.fill(x, y, color=colour, lw=0)
    ax.plot([-0.12, -0.12], [0.0, leg], color=INK, lw=2.5, solid_capstyle="butt")
    told = ANSWERS[entry.verdict]
    if entry.margin is not None:
        speed = "" if entry.speed is None else f", {entry.speed:.3f} m/s"
        told += f": {1e3 * entry.margin:.0f} mm{speed}"
    words = f"{stairs.name}\n{told}\n{entry.limit}"
    ax.set_title(words, fontsize=8.5, color=INK, parse_math=False)
