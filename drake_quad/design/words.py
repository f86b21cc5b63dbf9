"""What a design lacks, in words."""

from drake_quad.design.choose import Design

_WORDS = {
    "reach": "the legs are {0:.3f} m too short",
    "joints": "a joint would be {0:.2f} rad beyond its limit",
    "torque": "a joint needs {1:.0f} % of its torque",
    "margin": "the static margin would be {0:.3f} m short of the feet's support",
    "legs": "a knee or shank would be {0:.3f} m inside the stairs",
    "apart": "legs would be {0:.3f} m inside each other or the trunk",
    "trunk": "the trunk would be {0:.3f} m inside the stairs",
}


def what_is_short(design: Design) -> str:
    """The limit that is missed by most, for the best gait that was found, and that gait."""
    lack = -design.slacks[design.limit]
    short = _WORDS[design.limit].format(lack, 100.0 * (1.0 + lack))
    return f"{short} {describe_gait(design)}"


def describe_gait(design: Design) -> str:
    """The gait in a few words."""
    c = design.gait
    per_tread = c.pattern.per_tread
    one, more = ("tread", "") if per_tread == 1 else ("place", f", {per_tread} to a tread")
    treads = f"1 {one}" if c.pattern.treads == 1 else f"{c.pattern.treads} {one}s"
    tilt = f"tilted by {100 * c.share[0]:.0f} % of the slope"
    return (
        f"({treads} a cycle{more}, rear feet {c.pattern.lag} behind, "
        f"body {c.height[0]:.2f} m up and {tilt})"
    )
