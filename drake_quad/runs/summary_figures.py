"""Every figure of a run's summary, once, as data.

The keys that a study may name, the report's table of figures and bounds, the lines that
`drake-quad run` prints, and the tables of docs/log_format.md are made from these. The columns of a
run's log are in `schema.py`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drake_quad.runs.schema import EVERY, SIGNALS
from drake_quad.stability.safety import MOST_SLIP


@dataclass(frozen=True)
class Shown:
    """How the report's table shows a figure.

    Attributes:
        label: Its words.
        digits: Digits after the point.
        unit: Unit that it is converted to (mm, %); its own if none.
    """

    label: str
    digits: int
    unit: str = ""


@dataclass(frozen=True)
class Figure:
    """One figure of a run's summary, or a word, or a list of tables.

    Attributes:
        key: Its dotted key; `name[].key` is a field of each table of a list.
        unit: Its unit.
        text: What it means, a sentence without its stop.
        kind: `number`, `verdict` (true or false), `text`, `tables`, `list` or `words`; or `spread`,
            a number that stands for itself in three: those of SPREAD.
        shown: How the report shows it beside its bound; a spread's minimum.
        at_least: What the report wants it to be at least, in SI units.
        at_most: What the report wants it to be at most, in SI units.
        safe: Whether it is to be at least the robot's safe margin.
        physics: Whether a kinematic replay says nothing of it.
        wall_clock: Whether two runs of one scenario differ in it.
    """

    key: str
    unit: str
    text: str
    kind: str = "number"
    shown: Shown | None = None
    at_least: float | None = None
    at_most: float | None = None
    safe: bool = False
    physics: bool = False
    wall_clock: bool = False

    @property
    def keys(self) -> list[str]:
        """The keys under which its numbers stand."""
        return [f"{self.key}.{part}" for part in SPREAD] if self.kind == "spread" else [self.key]

    @property
    def scale(self) -> float:
        """What its value is multiplied by where the report shows it."""
        return {"mm": 1e3, "ms": 1e3, "%": 100.0}.get(self.shown.unit, 1.0) if self.shown else 1.0


SPREAD = ("minimum", "percentile_1", "median")
BY_FEET = ("margin", "zmp_margin")  # figures that there are none of where no foot bears
SUMMARY = (
    Figure("description", "", "The scenario's description", "text"),
    Figure("outcome", "", "`goal_reached`; `fell`: for longer than 0.1 s the trunk was tilted by "
           "more than 40°, or down at its feet; `stopped`: the clock waited in vain, for longer "
           "than `controller.patience`, or what `reason` says. A margin below 0 or a shank that "
           "touches is in the figures below, and ends no run", "text"),
    Figure("reason", "", "What ended the run", "text"),
    Figure("safety.safe", "", "Whether the run was safe, which is more than to have reached the "
           "goal: it was reached, `margin.minimum` is at least `safety.margin_wanted`, three feet "
           "carried load throughout, nothing but feet touched, `swing_hit_samples` is 0, no foot "
           "slipped by more than 0.01 m, and every push that the run came to was recovered from; "
           "null of a kinematic replay",
           "verdict"),
    Figure("safety.margin_wanted", "m", "Least static margin of a safe run: 2.5 % of a leg, "
           "0.030 m of the shipped robot"),
    Figure("safety.lacks", "", "What was not as `safety.safe` wants it, a few words each", "list"),
    Figure("simulation", "", "`physics` or `kinematic`", "text"),
    Figure("assumes", "", "What all figures take for granted, in a line: whether the map is "
           "exact, how the controller knows which feet bear, and whose state it has", "text"),
    Figure("simulated_time", "s", "Time simulated"),
    Figure("wall_time", "s", "Time that the simulation took", wall_clock=True),
    Figure("real_time_factor", "", "`simulated_time` over `wall_time`, planning inside the run "
           "included", wall_clock=True),
    Figure("planning_time", "s", "Time to plan the whole mission on paper, before the run",
           wall_clock=True),
    Figure("margin_kind", "", "Region in which the plan's margin is measured, `gait.margin`",
           "text"),
    Figure("margin", "m", "The column `margin`; the minimum is over all ticks of the monitor, not "
           "over samples", "spread", Shown("Smallest static margin", 3), safe=True),
    Figure("margin_minimum_at", "s", "When the margin was smallest, to a sample"),
    Figure("zmp_margin", "m", "The column `zmp_margin`, its minimum over all ticks too", "spread",
           Shown("Smallest margin of the zero-moment point", 3), physics=True),
    Figure("margin_planned", "m", "The column `margin_planned`", "spread",
           Shown("Smallest static margin of the plan", 3), safe=True),
    Figure("margin_friction", "m", "This column; null if it was not measured", "spread"),
    Figure("margin_friction_planned", "m", "This column; null if it was not measured", "spread"),
    Figure("margin_capture", "m", "This column; null if it was not measured", "spread"),
    Figure("push_budget", "m/s", "This column; null if it was not measured", "spread"),
    Figure("margin_feasible", "m", "This column; null if it was not measured", "spread"),
    Figure("margin_feasible_planned", "m", "This column; null if it was not measured", "spread"),
    Figure("margin_dynamic", "m", "This column; null if it was not measured", "spread"),
    Figure("zmp_inside", "", "Share of the samples that have a `zmp_margin` in which it is at "
           "least 0", shown=Shown("Samples with the zero-moment point inside", 1, "%"),
           physics=True),
    Figure("samples", "samples", "Samples in the log"),
    Figure("samples_under_three_feet", "samples", "Samples with fewer than three feet bearing"),
    Figure("time_under_three_feet", "s", "Time with fewer than three feet bearing, over all ticks "
           "of the controller",
           shown=Shown("Time with fewer than three feet bearing", 3), at_most=0.0),
    Figure("nonfoot_contact_samples", "samples", "Samples with a contact of anything but feet",
           shown=Shown("Contacts of anything but a foot", 0), at_most=0.0),
    Figure("nonfoot_contact_time", "s", "Time with a contact of anything but feet, over all ticks "
           "of the controller; in a kinematic replay over the samples",
           shown=Shown("Time with a contact of anything but a foot", 3), at_most=0.0),
    Figure("nonfoot_force_max", "N", "The greatest normal force of these, over all ticks of the "
           "controller"),
    Figure("nonfoot_depth_max", "m", "The greatest `nonfoot_depth`; null in physics",
           shown=Shown("The deepest of these, by geometry", 1, "mm"), at_most=0.0),
    Figure("foot_depth_max", "m", "The greatest `foot_depth`; null in physics",
           shown=Shown("Foot deepest in the ground, by geometry", 1, "mm")),
    Figure("overlaps", "", "In a kinematic replay alone: the ten deepest pairs of shapes",
           "tables"),
    Figure("overlaps[].part", "", "Part of the robot", "text"),
    Figure("overlaps[].inside", "", "What that part is in", "text"),
    Figure("overlaps[].depth", "m", "How deep it is in there"),
    Figure("overlaps[].time", "s", "When"),
    Figure("swing_contact_samples", "samples", "Samples in which a swing foot, from 0.1 to 0.8 of "
           "its swing, touches anything, such as a riser, or ground that is higher than the "
           "map's"),
    Figure("swing_hit_samples", "samples", "Those of them with more than 1 % of the robot's "
           "weight: a run with any does not count as safe",
           shown=Shown("Samples in which a swing foot hit something", 0), at_most=0.0),
    Figure("swing_force_max", "N", "The greatest force in these contacts"),
    Figure("torque_ratio_max", "of the limit", "The greatest torque of any joint",
           shown=Shown("Greatest joint torque, of its limit", 0, "%"), at_most=1.0),
    Figure("torque_ratio_rms", "of the limit", "The root mean square of a joint's torque over the "
           "run, of the joint that has the greatest: it heats the drive, so compare it with what "
           "the drive's maker rates as continuous"),
    Figure("torque_ratio_planned_max", "of the limit", "The greatest `torque_ratio_planned`",
           shown=Shown("The same of the plan, standing still", 0, "%")),
    Figure("speed_ratio_max", "of the limit", "The greatest speed of any joint",
           shown=Shown("Greatest joint speed, of its limit", 0, "%"), at_most=1.0),
    Figure("position_ratio_max", "of the limit", "The position of the joint nearest its limit, "
           "from the middle of its range", at_most=1.0,
           shown=Shown("Joint nearest its end, of its range", 0, "%")),
    Figure("slip_max", "m", "Farthest that a standing foot slid in one stance: tangential contact "
           "speed, summed", shown=Shown("Farthest slip of a standing foot", 1, "mm"),
           at_most=MOST_SLIP, physics=True),
    Figure("foot_roll_max", "m", "Farthest that a standing foot's contact moved in one stance, by "
           "rolling and sliding together"),
    Figure("base_error_max", "m", "Farthest that the base was from where it is wanted "
           "(`base_desired_*`)", shown=Shown("Body farthest from its plan", 1, "mm"),
           at_most=0.03, physics=True),
    Figure("base_tilt_error_max_deg", "deg", "Farthest that the base was turned from where it is "
           "wanted", shown=Shown("Body most tilted off its plan", 2, "°"), at_most=2.0,
           physics=True),
    Figure("tracking.body_max", "m", "Farthest that the body was from its plan along an axis of W; "
           "in all of `tracking` in the log's samples, and without what lifts the feet that are to "
           "stand and the body alike", shown=Shown("Body farthest from its plan, along an axis", 1,
                                                    "mm")),
    Figure("tracking.tilt_max_deg", "deg", "Greatest roll, or error of pitch"),
    Figure("tracking.turn_max_deg", "deg", "Greatest error of yaw"),
    Figure("tracking.foot_max", "m", "Farthest that a foot was, along the ground, from where it is "
           "planned to stand", shown=Shown("Standing foot farthest from its place", 1, "mm")),
    Figure("tracking.foot_height_max", "m", "The same in height"),
    Figure("tracking.swing_max", "m", "Farthest that a swing foot was from where it is planned",
           shown=Shown("Swing foot farthest from its plan", 1, "mm")),
    Figure("tracking.late_max", "s", "Longest time, by the gait clock, for which a foot that is "
           "planned to stand did not bear", shown=Shown("A foot bore late by at most", 0, "ms")),
    Figure("tracking.share", "", "The least share of the tolerances of the plan's certificate "
           "(`certify.tolerances`) that the run kept within; if `drake-quad plan` proves as "
           "much or more, the run is one of the motions that the proof is about; null if the run "
           "left `support` or `plan`",
           shown=Shown("Share of the certificate's tolerances that was used", 2), at_most=1.0),
    Figure("tracking.left", "", "Tolerances of the plan's certificate (`certify.tolerances`) that "
           "the run left: `body`, `tilt`, `turn`, `foot`, `rise` (a standing foot's height), "
           "`swing`, `late`; and `support`, if fewer than three of the feet that are to stand "
           "bore; and `plan`, if the plan was made anew on the way, which is not proven; empty if "
           "it kept within all of them", "list"),
    Figure("tracking.left_at", "s", "When it first left one; null if it did not"),
    Figure("margin_within_20mm", "", "Share of samples in which measured and planned margin are "
           "within 0.02 m", shown=Shown("Samples with the margin within 20 mm of its plan", 1, "%"),
           at_least=0.95, physics=True),
    Figure("cost_of_transport", "", "Joints' mechanical work over weight times way: the "
           "weight of all that moves, payload included, and the way along the course, as "
           "`estimate.way`, without swaying; null of a way below 0.1 m"),
    Figure("clock_waited", "s", "How long the gait clock waited, in all",
           shown=Shown("Time that the gait clock waited", 2), physics=True),
    Figure("clock_waited_for.touchdown", "s", "How long the clock waited for a foot to land"),
    Figure("clock_waited_for.lift_off", "s", "How long the clock waited before a lift-off, for the "
           "other feet or for their margin"),
    Figure("clock_waited_for.recovery", "s", "How long the clock waited in recoveries"),
    Figure("recoveries", "", "The times that the plan was left, in order", "tables"),
    Figure("recoveries[].time", "s", "When the plan was left"),
    Figure("recoveries[].legs", "", "Legs put down to catch the robot, in order (none: it stood)",
           "list"),
    Figure("recoveries[].duration", "s", "Time until the clock ran again; null if the run ended "
           "before"),
    Figure("estimate.drift", "m", "Error of the base's estimated place at the end; `estimate` is "
           "null where nothing is estimated"),
    Figure("estimate.way", "m", "How far the base went, each task from its beginning straight to "
           "its end, which leaves its swaying out"),
    Figure("estimate.drift_ratio", "", "Drift over way; null of a way below 0.1 m",
           shown=Shown("Drift of the estimate at the end, of the way", 2, "%")),
    Figure("estimate.position_error_max", "m", "Greatest error of the estimated place",
           shown=Shown("Estimated place farthest from the truth", 1, "mm")),
    Figure("estimate.yaw_error_max_deg", "deg", "Greatest error of the estimated heading from "
           "0.1 s on", shown=Shown("Estimated heading farthest from the truth", 2, "°")),
    Figure("estimate.attitude_error_max_deg", "deg", "Greatest error of the whole estimated "
           "orientation from 0.1 s on"),
    Figure("estimate.place_error_sigmas", "", "Errors of the estimated place along the ground over "
           "their stated deviations, root mean square from 0.1 s on; some 1 where these are right"),
    Figure("estimate.yaw_error_sigmas", "", "The same of the estimated heading"),
    Figure("estimate.landmarks_seen", "", "How many sightings of flights of the map corrected it; "
           "null where no camera looks for them",
           shown=Shown("Sightings of the map's flights that corrected the estimate", 0)),
    Figure("estimate.slips_flagged", "", "How often a foot came to be taken for slipping"),
    Figure("estimate.samples_unhealthy", "samples", "Samples in which a sensor's reading was not "
           "sound"),
    Figure("felt.touchdowns", "", "How often a foot began to bear that had not borne for 0.15 s; "
           "`felt` is null where the feet have sensors"),
    Figure("felt.missed", "", "Touchdowns that the joints did not feel within 0.15 s",
           shown=Shown("Touchdowns that the joints did not feel", 0)),
    Figure("felt.false", "", "Touchdowns that they felt where there was none",
           shown=Shown("Touchdowns felt that were none", 0)),
    Figure("felt.delay_median", "s", "How much later than it was a touchdown was felt, median; "
           "null of none", shown=Shown("A touchdown was felt later by, median", 1, "ms")),
    Figure("felt.delay_percentile_95", "s", "The same, 95th percentile"),
    Figure("qp_unsolved", "", "Programs of the whole-body controller not solved; null of another "
           "controller", shown=Shown("Programs of the controller that were not solved", 0)),
    Figure("contact_friction", "", "Friction coefficient between feet and ground: "
           "`simulation.friction`, unless the robot's file states one for its feet "
           "([robots](robots.md)); then what Drake makes of the two, of the foot with the least; "
           "null of a replay", shown=Shown("Contact friction", 3)),
    Figure("friction_estimated_min", "", "The least of the `<leg>_friction_estimated`; null of "
           "another controller",
           shown=Shown("Least friction that a foot was trusted with after slips", 2)),
    Figure("carried.mass", "kg", "Mass of the unknown load as learned by the end; `carried` is "
           "null where nothing learns of it", shown=Shown("Unknown load as learned by the end", 2)),
    Figure("carried.ahead", "m", "How far ahead of B's origin, along the heading, the load acts; "
           "null of less than 5 N"),
    Figure("carried.left", "m", "How far to the left the load acts; null of less than 5 N"),
    Figure("carried.moment_x", "Nm", "The load's moment about the heading's x"),
    Figure("carried.moment_y", "Nm", "The load's moment about the heading's y"),
    Figure("segments", "", "The segments as they were run", "tables"),
    Figure("segments[].name", "", "Name of the segment", "text"),
    Figure("segments[].kind", "", "`stand`, `transition`, `wave` or `spin`", "text"),
    Figure("segments[].start", "s", "When the segment began"),
    Figure("segments[].end", "s", "When the segment ended"),
    Figure("segments[].margin_min", "m", "The smallest margin measured in the segment"),
    Figure("segments[].margin_planned_min", "m", "The smallest margin planned in the segment"),
    Figure("seen.stairs", "", "Whether stairs were seen; `seen` is null where the map was told",
           "verdict"),
    Figure("seen.climbed", "", "Whether the robot climbs what it saw; `reason` says why not",
           "verdict"),
    Figure("seen.images", "", "How many images were looked at; the last one counts"),
    Figure("seen.count_least", "", "How many steps there are at least, as seen"),
    Figure("seen.count_most", "", "How many there are at most; null if that was not seen"),
    Figure("seen.count_true", "", "How many there are on the way ahead"),
    Figure("seen.level_seen", "m", "How far the ground was seen to be level beyond the last "
           "nosing; null where no flight up was seen"),
    Figure("seen.place_error_max", "m", "Greatest error of a nosing's place, along the climb as it "
           "was believed to head", shown=Shown("Seen nosing farthest from its place", 1, "mm")),
    Figure("seen.place_error_told", "m", "What the plan allowed for: the greatest half of a 95 % "
           "interval, with the yaw's over half a stance's width"),
    Figure("seen.places_inside", "", "Share of the nosings whose place lies in its 95 % interval",
           shown=Shown("Nosings' places in their 95 % intervals", 0, "%")),
    Figure("seen.height_error_max", "m", "Greatest error of a nosing's height",
           shown=Shown("Seen nosing farthest from its height", 1, "mm")),
    Figure("seen.height_error_told", "m", "What the plan allowed for: the greatest half of a 95 % "
           "interval"),
    Figure("seen.heights_inside", "", "Share of the nosings whose height lies in its 95 % "
           "interval", shown=Shown("Nosings' heights in their 95 % intervals", 0, "%")),
    Figure("seen.rise_error", "m", "Error of the mean rise"),
    Figure("seen.rise_inside", "", "Whether the mean rise lies in its 95 % interval", "verdict"),
    Figure("seen.run_error", "m", "Error of the mean run"),
    Figure("seen.run_inside", "", "Whether the mean run lies in its 95 % interval", "verdict"),
    Figure("seen.yaw_error_deg", "deg", "Error of the climb's heading"),
    Figure("seen.yaw_inside", "", "Whether the heading lies in its 95 % interval", "verdict"),
    Figure("seen.looks", "", "From how many places it looked: 1, or more where the map grew on the "
           "way; the other figures are of the first look"),
    Figure("seen.map_steps", "", "How many steps the map had in the end; this and the next ones "
           "are null where the robot neither looked again nor came back"),
    Figure("seen.map_complete", "", "Whether the flight's end was seen in the end", "verdict"),
    Figure("seen.map_place_error_max", "m", "Greatest error of a nosing's place in the map as it "
           "was in the end, along its lane"),
    Figure("seen.map_places_inside", "", "Share of its nosings whose place lies in its 95 % "
           "interval"),
    Figure("seen.map_height_error_max", "m", "Greatest error of a nosing's height in it"),
    Figure("seen.map_treads_touched", "", "Number of its treads whose height feet have told"),
    Figure("seen.map_heights_inside", "", "Share of its nosings whose height lies in its 95 % "
           "interval"),
    Figure("seen.box_inside", "", "Whether the true stairs are in the box of stairs that each map "
           "takes for possible: its widest 95 % intervals of place and height; this and the next "
           "ones are null where nothing was planned", "verdict"),
    Figure("seen.box_proven", "", "Whether the plans are proven for all stairs in these boxes",
           "verdict"),
    Figure("seen.box_share", "", "Share of the tolerances of tracking within which they are, too; "
           "null where they are not"),
    Figure("seen.box_margin", "m", "The static margin that is proven for all of that",
           shown=Shown("Margin proven for all stairs that were believed possible", 1, "mm")),
    Figure("seen.box_covered", "", "Number of stretches, each planned on one map, in which the run "
           "did what the proof is about: the stairs were in the box, from where the robot "
           "stood, and the run was no farther off its plan than was proven"),
    Figure("seen.box_kept", "", "Whether it had the proven margin in all of these; null if there "
           "are none", "verdict"),
    Figure("pushes", "", "The pushes in physics, in order of time; of a push that the run did not "
           "reach the last three are null", "tables"),
    Figure("pushes[].time", "s", "When the push began"),
    Figure("pushes[].duration", "s", "How long it lasted"),
    Figure("pushes[].speed", "m/s", "What it was worth to the whole robot as its file has it: "
           "impulse over the file's mass, without payload or `disturbances.mass_factor`"),
    Figure("pushes[].force", "N", "Size of its force"),
    Figure("pushes[].base_error_max", "m", "Farthest that the base was from where it is wanted, "
           "until a later push began"),
    Figure("pushes[].recovered", "", "Whether the robot recovered from it", "verdict"),
    Figure("pushes[].recovery_time", "s", "Time from the push's end until the base was back"),
    Figure("seed", "", "The scenario's `simulation.seed`"),
    Figure("robot.name", "", "The robot's name", "text"),
    Figure("robot.digest", "", "Digest of the robot's file, and of the files that it names",
           "text"),
    Figure("versions", "", "Versions of this program, Drake, numpy and Python", "words"),
)  # fmt: skip

# The spreads of margins that only some runs measure.
_WHERE = {signal.name: signal.where for signal in SIGNALS}
FURTHER = tuple(f.key for f in SUMMARY if f.kind == "spread" and _WHERE[f.key] != EVERY)
NUMBERS = {
    key: figure
    for figure in SUMMARY
    if figure.kind in ("number", "spread", "verdict") and "[]" not in figure.key
    for key in figure.keys
}
UNITS = {key: figure.unit for key, figure in NUMBERS.items()}
# What a study can keep, and be judged by; verdicts count as 1 and 0.
FIGURES = tuple(key for key, figure in NUMBERS.items() if not figure.wall_clock)
VERDICTS = tuple(key for key, figure in NUMBERS.items() if figure.kind == "verdict")
WALL_CLOCK = tuple(key for key, figure in NUMBERS.items() if figure.wall_clock)
WORDS = tuple(f.key for f in SUMMARY if f.kind == "text" and "[]" not in f.key)


def look_up(summary: Mapping[str, Any], key: str) -> float:
    """The number at a dotted key of the summary; nan where there is none."""
    value: Any = summary
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    return float(value)
