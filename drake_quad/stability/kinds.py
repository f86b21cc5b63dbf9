"""Over what a margin of the centre of mass is measured: the three answers, from cheap to true."""

# The convex hull of the feet; the region of balance within friction; within torque limits, too.
HULL, FRICTION, FEASIBLE = KINDS = ("hull", "friction", "feasible")


def stricter(one: str, other: str) -> str:
    """Of two kinds the one that the other is measured with anyway."""
    return max(one, other, key=KINDS.index)
