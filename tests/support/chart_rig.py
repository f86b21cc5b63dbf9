"""Made-up cells for the tests of charts: functions of a module, so that any process finds them."""

import time

from drake_quad.feasibility.chart import Cell


def made_up(rise: float, run: float) -> Cell:
    """Climbs what is not steeper than 1 in 2."""
    if rise / run > 0.5:
        limit = "reach" if rise < 0.2 else "joints"
        return Cell(rise, run, None, None, None, limit, "too steep")
    return Cell(rise, run, 0.1 - 0.15 * rise / run, 1.0, 2, "", "")


def made_up_slowly(rise: float, run: float) -> Cell:
    """Leaves time to stop in."""
    time.sleep(0.05)
    return made_up(rise, run)
