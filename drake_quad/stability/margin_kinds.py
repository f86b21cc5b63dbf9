"""The regions that a static margin may be measured in.

They are the convex hull of the feet; the region of balance within friction, which also counts
slopes; and the same within torque limits.
"""

HULL, FRICTION, FEASIBLE = KINDS = ("hull", "friction", "feasible")


def stricter(one: str, other: str) -> str:
    """The stricter of two kinds of margin; measuring it yields the other as well."""
    return max(one, other, key=KINDS.index)
