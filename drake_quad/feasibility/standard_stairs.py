"""Flights of stairs that common rules allow: what a robot in buildings will meet."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Standard:
    """A flight that a common rule allows.

    Attributes:
        name: Name for people.
        rise: Rise of the steps [m].
        run: Run of the treads [m].
        source: The rule.
    """

    name: str
    rise: float
    run: float
    source: str


@dataclass(frozen=True)
class Build:
    """A way to build the steps of a flight, beside treads flush with closed risers.

    Attributes:
        name: Name for people.
        overhang: Distance that each tread reaches beyond the riser under it [m].
        open: Whether the risers are open.
    """

    name: str
    overhang: float
    open: bool


# DIN 18065 asks for treads that reach out by 30 mm where risers are open or runs short; the
# International Building Code has nosings of 19 to 32 mm (1011.5.5.1).
BUILDS = (
    Build("nosings of 30 mm", 0.03, open=False),
    Build("open risers", 0.03, open=True),
)

_IBC, _OSHA = "International Building Code 1011.5.2", "OSHA 1910.25(c)"
_BEFORE = "OSHA 1910.24, table D-1 (before 2017)"
# The steepest of each rule of today, and the usual one: a chart marks these.
CHARTED = (
    Standard("DIN 18065, 0.17 × 0.29 m", 0.170, 0.290, "DIN 18065, usual"),
    Standard("IBC 7 × 11 in", 0.178, 0.279, f"{_IBC} and ADA Standards 504.2, steepest"),
    Standard("IRC 7.75 × 10 in", 0.197, 0.254, "International Residential Code R311.7.5, steepest"),
    Standard("OSHA 9.5 × 9.5 in", 0.241, 0.241, f"{_OSHA}, steepest"),
)
_OTHERS = (
    Standard("ADA 4 × 11 in", 0.102, 0.279, "ADA Standards 504.2, lowest"),
    Standard("DIN 18065, 0.20 × 0.23 m", 0.200, 0.230, "DIN 18065, in houses, steepest"),
    Standard("45°, 0.222 × 0.222 m", 0.222, 0.222, _BEFORE),
    Standard("50°, 9.5 × 8 in", 0.241, 0.203, f"{_BEFORE}, steepest"),
)
STANDARDS = tuple(sorted((*CHARTED, *_OTHERS), key=lambda one: (one.rise / one.run, one.rise)))
