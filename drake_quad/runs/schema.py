"""Every column of a run's log, once, as data.

The log and its loggers, and the tables of docs/log_format.md, are made from these. The figures of a
run's summary are in `summary_figures.py`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_quad.control.ports import Catch, GaitPhase
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.stability.margins import Margins

Columns = dict[str, np.ndarray]
AXES = ("x", "y", "z")
TURNS = ("roll", "pitch", "yaw")

# Which runs have a signal, and what the documents say of these.
EVERY = "In every log"
PHYSICS = "In a run with physics"
FRICTION = "Unless `monitor.margins` and `gait.margin` are both `hull`"
FEASIBLE = "Where `monitor.margins` or `gait.margin` is `feasible`"
KINEMATIC = "In a kinematic replay"
ESTIMATED = "Where the controller estimates its state (`estimator.kind: ekf`)"
LANDMARKS = "Where the flights ahead correct the estimate (`estimator.landmarks: stairs`)"
WHOLE_BODY = "Where `controller.kind` is `whole_body`"
FELT = "Where the joints feel which feet bear (`sensors.contacts: joints`)"


@dataclass(frozen=True)
class Source:
    """An output port that is logged.

    Attributes:
        name: Name of its log.
        system: Name of the system that has the port.
        port: Name of the port.
        where: Which runs log it.
    """

    name: str
    system: str
    port: str
    where: str = EVERY


SOURCES = (
    Source("state", "plant", "state"),
    Source("torque", "plant", "net_actuation"),
    Source("gait_phase", "controller", "gait_phase"),
    Source("standing", "controller", "contact_state_desired"),
    Source("body_desired", "controller", "body_desired"),
    Source("feet_desired", "controller", "feet_desired"),
    Source("bearing", "contact_monitor", "contact_state"),
    Source("force", "contact_monitor", "foot_force_measured"),
    Source("contact_position", "contact_monitor", "foot_contact_position"),
    Source("slip_speed", "contact_monitor", "foot_slip_speed"),
    Source("nonfoot", "contact_monitor", "nonfoot_contact"),
    Source("margin", "stability_monitor", "stability_margin"),
    Source("zmp_margin", "stability_monitor", "zmp_margin"),
    Source("least_margins", "stability_monitor", "least_margins"),
    Source("contact_totals", "stability_monitor", "contact_totals"),
    Source("com", "stability_monitor", "com_position"),
    Source("push_force", "push_source", "push_force"),
    Source("catch", "controller", "catch"),
    Source("state_estimated", "controller", "robot_state_estimated", ESTIMATED),
    Source("deviation", "controller", "estimator_deviation", ESTIMATED),
    Source("slip_estimated", "controller", "foot_slip_estimated", ESTIMATED),
    Source("healthy", "controller", "estimator_healthy", ESTIMATED),
    Source("landmark", "controller", "landmark_state", LANDMARKS),
    Source("felt", "controller", "contact_state_felt", FELT),
    Source("qp_state", "controller", "qp_state", WHOLE_BODY),
    Source("carried", "controller", "carried_estimated", WHOLE_BODY),
    Source("friction", "controller", "friction_estimated", WHOLE_BODY),
    Source("further_margins", "stability_monitor", "further_margins", FRICTION),
)


@dataclass(frozen=True)
class Signal:
    """One quantity of the log, in one column or in several.

    Attributes:
        name: Name of its column, to which `parts` are appended, and `each` prepended or appended.
        unit: Its unit, or units of unlike columns.
        text: What it means, a sentence without its stop.
        source: The log that it is taken from, one of SOURCES; or none: `log_table` computes it.
        first: Index of its first value in the source's vector.
        parts: Endings of its columns.
        each: `leg`, `joint`, `position` or `velocity`, if there are columns for each of these.
        kind: `float`, `int`, `bool` or `text`.
        frame: The frame that it is expressed in.
        where: Which runs have it.
    """

    name: str
    unit: str
    text: str
    source: str = ""
    first: int = 0
    parts: tuple[str, ...] = ()
    each: str = ""
    kind: str = "float"
    frame: str = ""
    where: str = EVERY

    def columns(self, names: Mapping[str, Sequence[str]]) -> list[str]:
        """The names of its columns, in the order of its values.

        Args:
            names: Names of the joints, positions and velocities, by the words of `each`.
        """
        if self.each == "leg":
            stems = [f"{leg}_{self.name}" for leg in SHORT_NAMES]
        elif self.each:
            stems = [f"{self.name}_{name}" for name in names[self.each]]
        else:
            stems = [self.name]
        return [f"{stem}_{part}" for stem in stems for part in self.parts] if self.parts else stems

    @property
    def pattern(self) -> str:
        """Its columns in one word, as the documents have them."""
        stem = {
            "": self.name,
            "leg": f"<leg>_{self.name}",
            "joint": f"{self.name}_<joint>",
        }.get(self.each, f"{self.name}_*")
        return f"{stem}_{'/'.join(self.parts)}" if self.parts else stem


SIGNALS = (
    Signal("t", "s", "Simulated time"),
    Signal("task", "", "Index of the mission's task under way", kind="int"),
    Signal("plan_revision", "", "How often the plan that is followed had been made anew within "
           "its task", kind="int"),
    Signal("gait_time", "s", "Gait clock since the task began, or since its plan was made anew",
           "gait_phase", GaitPhase.TIME),
    Signal("gait_rate", "", "How fast the gait clock runs, from 0 to 1: 0 while it waits (for a "
           "touchdown, a margin, or a plan), less than 1 while it slows for `margin_demanded`",
           "gait_phase", GaitPhase.RATE),
    Signal("gait_waited", "s", "How long the clock has waited in all, for the feet and for "
           "recoveries", "gait_phase", GaitPhase.WAITED),
    Signal("gait_mode", "", "What the clock does: `run` (it may wait for a foot), `catch` (a foot "
           "is put down to catch a push), `settle` (all four stand until the robot is calm), "
           "`replan` (the plan from there on is made)", kind="text"),
    Signal("segment", "", "Name of the plan's segment", kind="text"),
    Signal("segment_kind", "", "`stand`, `transition`, `wave`, `trot` or `spin`", kind="text"),
    Signal("swing_leg", "", "1 to 4, 0 while all four stand; of two legs both digits: 14 for the "
           "front left and the rear right one", "gait_phase", GaitPhase.SWING_LEG, kind="int"),
    Signal("swing_phase", "", "0 to 1 through the swing", "gait_phase", GaitPhase.SWING_PHASE),
    Signal("catch_leg", "", "1 to 4 while that leg is put down to catch a push, else 0", "catch",
           Catch.LEG, kind="int"),
    Signal("q", "m, rad", "Positions, by Drake's own names", "q", each="position"),
    Signal("v", "m/s, rad/s", "Velocities, by Drake's own names", "v", each="velocity"),
    Signal("tau", "Nm", "Torque of each joint's drive as applied, its PD and limits included",
           "tau", each="joint"),
    Signal("bearing", "", "True while the foot's normal force is above 1 % of the robot's weight, "
           "from contact results", "bearing", each="leg", kind="bool"),
    Signal("standing_planned", "", "True while the foot is to be on the ground, by the plan or, "
           "after a push, by the catch", "standing", each="leg", kind="bool"),
    Signal("slip_speed", "m/s", "Tangential speed at the contact", "slip_speed", each="leg"),
    Signal("force", "N", "Force on the foot from what it touches", "force", parts=AXES,
           each="leg", frame="W"),
    Signal("position", "m", "Where that force acts; the last such place while the foot touches "
           "nothing", "contact_position", parts=AXES, each="leg", frame="W"),
    Signal("desired", "m", "The foot sphere's centre as planned", "feet_desired", parts=AXES,
           each="leg", frame="W"),
    Signal("com", "m", "The whole robot's centre of mass", "com", parts=AXES, frame="W"),
    Signal("base_desired", "m, rad", "B's pose as the controller wants it (yaw about z, then pitch "
           "about y; roll is 0): the plan's, or aside of it for a load that the model does not "
           "know of, or up to 0.2 s ahead of the gait clock or behind it where that has stopped "
           "or gone on (then `margin` differs from `margin_planned` by as much)", "body_desired",
           parts=(*AXES, "pitch", "yaw"), frame="W"),
    Signal("margin", "m", "Static margin measured: the whole robot's centre of mass over the "
           "bearing feet's contacts; negative outside; −9 if no foot bears. In a kinematic replay "
           "with `body.path: uniform`, the paper's, legs have no mass: there it is that of the "
           "body's centre, B's origin", "margin"),
    Signal("margin_planned", "m", "Static margin of the plan that is followed, at the sample's "
           "gait time (also while the clock waits); in a kinematic replay with "
           "`body.path: uniform` that of the body's centre, as `margin`"),
    Signal("torque_ratio_planned", "", "Greatest torque of any joint over its limit, of a robot "
           "that stands still as planned then, its weight shared as the run's controller shares "
           "it: `ik` as `planning/contact_forces.py`, `whole_body` by the least forces within "
           "friction"),
    Signal("zmp_margin", "m", "Margin of the centre of pressure of the measured foot forces",
           "zmp_margin"),
    Signal("margin_least", "m", "The smallest `margin` since the sample before, over all ticks of "
           "the controller", where=PHYSICS),
    Signal("zmp_margin_least", "m", "The smallest `zmp_margin` since the sample before, over all "
           "ticks of the controller", where=PHYSICS),
    Signal("time_under_three_feet", "s", "How long fewer than three feet have borne since the run "
           "began, over all ticks of the controller", "contact_totals", 0, where=PHYSICS),
    Signal("nonfoot_contact_time", "s", "How long anything but a foot has touched since the run "
           "began, over all ticks of the controller", "contact_totals", 1, where=PHYSICS),
    Signal("nonfoot_force_most", "N", "The greatest normal force of these contacts since the run "
           "began, over all ticks of the controller", "contact_totals", 2, where=PHYSICS),
    Signal("nonfoot_contacts", "", "Contacts of anything but a foot with the course, or of the "
           "robot with itself; in a kinematic replay overlaps of the collision geometry, asked of "
           "Drake at every sample", "nonfoot", 0, kind="int"),
    Signal("nonfoot_force", "N", "The greatest normal force among these contacts; nan in a "
           "kinematic replay", "nonfoot", 1),
    Signal("push_force", "N", "Force that pushes the robot (`disturbances.pushes`)", "push_force",
           parts=AXES, frame="W"),
    Signal("nonfoot_depth", "m", "Depth of the deepest overlap of anything but a foot",
           "nonfoot_depth", where=KINEMATIC),
    Signal("foot_depth", "m", "How deep the deepest foot is in the course; with "
           "`robot.point_feet` that of the balls around the points, which tilt into it",
           where=KINEMATIC),
    Signal("margin_friction", "m", "Signed distance of the centre of mass from the border of the "
           "[region of balance](margins.md) that friction leaves; −9 of no region",
           "further_margins", Margins.FRICTION, where=FRICTION),
    Signal("margin_capture", "m", "Signed distance of the capture point from the border of where "
           "the feet's pressure can be, now and at rest", "further_margins", Margins.CAPTURE,
           where=FRICTION),
    Signal("push_budget", "m/s", "The least push, of all directions, that takes a step, by the "
           "pendulum's law", "further_margins", Margins.BUDGET, where=FRICTION),
    Signal("push_budget_direction", "rad", "Direction of that push", "further_margins",
           Margins.BUDGET_DIRECTION, frame="W", where=FRICTION),
    Signal("margin_friction_planned", "m", "`margin_friction` of the plan that is followed, on the "
           "map's ground, with the ground's real friction (`simulation.friction`); what `plan` "
           "prints is with the controller's (`controller.friction`)", where=FRICTION),
    Signal("margin_feasible", "m", "As `margin_friction`, within the joints' torque limits too",
           "further_margins", Margins.FEASIBLE, where=FEASIBLE),
    Signal("margin_dynamic", "m", "As `margin_feasible`, of the region that the measured "
           "accelerations leave", "further_margins", Margins.DYNAMIC, where=FEASIBLE),
    Signal("margin_feasible_planned", "m", "`margin_feasible` of the plan that is followed, as "
           "`margin_friction_planned`", where=FEASIBLE),
    Signal("base_estimated", "m, rad", "B's pose as estimated: its origin, and yaw about z, then "
           "pitch, then roll", "base_estimated", parts=(*AXES, *TURNS), frame="W",
           where=ESTIMATED),
    Signal("v_estimated", "m/s", "Velocity of B's origin as estimated", "v_estimated", parts=AXES,
           frame="W", where=ESTIMATED),
    Signal("deviation_turn", "rad", "Standard deviation that the filter believes its orientation "
           "to have, about W's axes", "deviation", 0, parts=AXES, frame="W", where=ESTIMATED),
    Signal("deviation_v", "m/s", "Standard deviation that the filter believes its velocity to "
           "have", "deviation", 3, parts=AXES, frame="W", where=ESTIMATED),
    Signal("deviation_base", "m", "Standard deviation that the filter believes its place to have",
           "deviation", 6, parts=AXES, frame="W", where=ESTIMATED),
    Signal("slip_estimated", "", "True where the filter takes a bearing foot for slipping",
           "slip_estimated", each="leg", kind="bool", where=ESTIMATED),
    Signal("estimator_healthy", "", "True while every sensor's reading is sound", "healthy",
           kind="bool", where=ESTIMATED),
    Signal("landmarks_seen", "", "Sightings of flights of the map so far", "landmark", 0,
           kind="int", where=LANDMARKS),
    Signal("landmark_ahead", "m", "How much too far ahead the estimate was by the last sighting, "
           "less what the camera is believed to have wrong", "landmark", 1, where=LANDMARKS),
    Signal("landmark_turn", "rad", "The same of the heading", "landmark", 2, where=LANDMARKS),
    Signal("landmark_left", "m", "How much too far to the left it was; 0 if no side of the flight "
           "was seen", "landmark", 3, where=LANDMARKS),
    Signal("felt", "", "True where the drives' torques tell the controller that the foot bears",
           "felt", each="leg", kind="bool", where=FELT),
    Signal("qp_unsolved", "", "Programs of the whole-body controller not solved so far",
           "qp_state", kind="int", where=WHOLE_BODY),
    Signal("carried_force", "N", "Upward force that an unknown load needs, as the controller "
           "learned it", "carried", 0, where=WHOLE_BODY),
    Signal("carried_moment", "Nm", "Moments that the load needs, about x (forward) and y (left) "
           "of the heading, at B's origin", "carried", 1, parts=("x", "y"), frame="heading",
           where=WHOLE_BODY),
    Signal("friction_estimated", "", "Friction coefficient that the controller keeps the foot's "
           "force within: less after a slip", "friction", each="leg", where=WHOLE_BODY),
)  # fmt: skip


def sources_of(
    *,
    estimated: bool,
    whole_body: bool,
    margins: bool,
    felt: bool = False,
    landmarks: bool = False,
) -> list[Source]:
    """The ports that a simulation logs.

    Args:
        estimated: Whether its controller estimates the robot's state.
        whole_body: Whether its controller has a whole-body program.
        margins: Whether margins beyond the hull's are measured.
        felt: Whether its controller feels by the joints which feet bear.
        landmarks: Whether what a camera sees corrects the estimate.
    """
    there = {
        EVERY: True, ESTIMATED: estimated, WHOLE_BODY: whole_body, FRICTION: margins, FELT: felt,
        LANDMARKS: landmarks,
    }  # fmt: skip
    return [source for source in SOURCES if there[source.where]]
