"""The planning problem: settings, tasks, and the mission that a course implies."""

from dataclasses import dataclass, field

from drake_quad.gait.workspace import Workspace
from drake_quad.planning.foothold_pattern import FootholdPattern
from drake_quad.robot.legs import Leg
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.course import Course

EDGE_CLEARANCE = 0.01  # [m] between a standing foot's sphere and a nosing or riser
KNOT = 0.2  # [s] between knots of a body's spline, for swings that are not quick


@dataclass(frozen=True, kw_only=True)
class PlanSettings:
    """The gait's and the body's parameters.

    Attributes:
        duty_factor: β of the wave gait, in [3/4, 1).
        cycle_time: T of the wave gait [s].
        switch_wait: Time on four feet, the body moving, before each lift-off of the leg diagonal to
            the one that landed last [s]; twice a cycle, which lasts so much longer than T.
        stride: The longest stride on level ground [m]; on stairs it is the pattern's treads.
        pattern: How many treads a cycle takes, and how many lie between front and rear feet.
        deep_tread: Depth of treads from which a flight is walked as floors with curbs between
            them are [m].
        body_ahead: How far the body goes ahead of its places on the lattice [places].
        tread_phase_up: How far ahead of the treads' middles the feet stand going up [treads].
        tread_phase_down: How far ahead of the treads' middles they stand going down [treads].
        places_together: How much nearer to its tread's middle feet stand than their place, of that
            distance, where treads have several places.
        body_shift_up: How far ahead of its places the body goes besides, going up [m].
        body_shift_down: How far ahead of its places the body goes besides, going down [m].
        lift_down: How much higher the body goes, going down, than on level ground [m].
        shank_room: Clearance between shanks and stairs that the body's path keeps where it can
            [m]; 0: it does not look.
        max_ahead: How far the body may go ahead of or behind its nominal place as it walks [m].
        workspace: The legs' boxes: R_x, R_y, P_x, P_y of Table I [m].
        stance_stagger: Rear feet's |y| minus front feet's |y| [m]. The wave puts a rear foot down
            beside the front foot of its side; the stagger keeps the two apart.
        on_centre: Whether footprints on stairs are on the treads' centres, or keep the gait's own
            offset from them (the paper's ±0.025 m).
        swing_speed: Speed of a foot that the wave gait's swings do not exceed, along the ground, up
            or down [m/s]: those that would last longer than the others. 0: all last as long.
        swing_speeds: The same of swings that end higher, and that end lower, than they begin, leg
            by leg (2, 4) [m/s]; 0: as `swing_speed` has it.
        swing_clearance: Δh: by how much the foot's sphere clears what it passes [m].
        map_error_place: Position error of the map's risers that swings allow for [m].
        map_error_height: Height error of the map's treads that swings allow for [m].
        riser_setback: Distance of footprints from a riser ahead, beyond EDGE_CLEARANCE [m]: feet
            roll towards it. It is at least what they mostly do.
        body_height: Height of B above the mean ground under the feet [m].
        pitch_along_slope: How much of the stairs' slope the body tilts with: 0 level, 1 all of it.
        spin_workspace: The boxes of the spinning gait; the same ones if None.
        spin_arcs: Whether swings of the spinning gait go round the body, as the paper's, or
            straight to the next footprint.
        spin_duty_factor: β of the spinning gait.
        spin_cycle_time: T of the spinning gait [s].
        body_still: Transitions with the body still (the paper's), or shifting before each lift.
        max_shift: How far the body may go from its nominal place [m]: in x and y where that
            stands still, sideways where it walks.
        swing_time: Duration of a transition's step [s].
        shift_time: Time on four feet before each step of a transition [s].
        via_centres: Whether transitions between gaits pass through the workspaces' centres.
        wave_order: Order in which the legs are lifted in the transition to the wave gait, the
            paper's is 2-3-4-1-3; empty: the one with the best margins.
        spin_order: Order in which they are lifted in the transition to the spinning gait.
        uniform_body: The paper's body path (constant speed, no sway), or one optimised for margin.
        dynamic: Whether the zero-moment point alone is kept over the feet, with the legs' masses
            moving; else the centre of mass too.
        margin_desired: Static margin beyond which more is worth nothing to the body's path [m].
        zmp_margin: Margin of the zero-moment point beyond which more is worth nothing [m].
        guard: Time before lift-off and after touchdown in which three feet have to do already [s].
        margin: Region that the static margin is measured in, one of
            `stability.margin_kinds.KINDS`.
        friction: Coulomb's coefficient that a margin beyond the hull's counts on.
        searches: How many searches there are at most for a body path within the legs' limits.
    """

    duty_factor: float = 0.85
    cycle_time: float = 8.0
    switch_wait: float = 0.0
    stride: float = 1.0
    pattern: FootholdPattern = field(default_factory=FootholdPattern)
    deep_tread: float = 100.0
    body_ahead: float = 0.0
    tread_phase_up: float = 0.0
    tread_phase_down: float = 0.0
    places_together: float = 0.0
    body_shift_up: float = 0.0
    body_shift_down: float = 0.0
    lift_down: float = 0.0
    shank_room: float = 0.0
    max_ahead: float = 10.0
    workspace: Workspace = field(
        default_factory=lambda: Workspace(R_x=0.80, R_y=0.5, P_x=0.75, P_y=0.54)
    )
    stance_stagger: float = 0.12
    on_centre: bool = True
    swing_speed: float = 0.0
    swing_speeds: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0,) * 4, (0.0,) * 4)
    swing_clearance: float = 0.02
    map_error_place: float = 0.0
    map_error_height: float = 0.0
    riser_setback: float = 0.0
    body_height: float = 0.85
    pitch_along_slope: float = 0.0
    spin_workspace: Workspace | None = None
    spin_arcs: bool = False
    spin_duty_factor: float = 0.85
    spin_cycle_time: float = 8.0
    body_still: bool = False
    max_shift: float = 0.3
    swing_time: float = 1.2
    shift_time: float = 1.3
    via_centres: bool = False
    wave_order: tuple[Leg, ...] = ()
    spin_order: tuple[Leg, ...] = ()
    uniform_body: bool = False
    dynamic: bool = False
    margin_desired: float = 0.10
    zmp_margin: float = 0.08
    guard: float = 0.15
    margin: str = HULL
    friction: float = 0.5
    searches: int = 1


END_CLEARANCE = 0.25  # [m] between the foremost foot and the end of the course


@dataclass(frozen=True, kw_only=True)
class Task:
    """One thing to do.

    Attributes:
        kind: `stand`, `walk` or `spin`.
        name: Name that people read.
        lane: Index of the course's lane that it happens on.
        goal: Place along the lane where a walk's body is to end [m].
        angle: Angle of a spin, counterclockwise positive [rad].
        duration: Duration of a stand [s].
    """

    kind: str
    name: str
    lane: int
    goal: float = 0.0
    angle: float = 0.0
    duration: float = 0.0


def derive_mission(course: Course, settings: PlanSettings) -> tuple[Task, ...]:
    """Walks every lane of the course to its end, and turns where the course turns."""
    tasks = [Task(kind="stand", name="stand at the start", lane=0, duration=1.0)]
    for index, lane in enumerate(course.lanes):
        last = index == len(course.lanes) - 1
        ahead = 0.5 * settings.workspace.P_x + 0.25 * settings.stride + END_CLEARANCE
        goal = lane.length - ahead if last else lane.length
        tasks.append(Task(kind="walk", name=f"walk {index + 1}", lane=index, goal=goal))
        if not last:
            turn = course.turns[index]
            tasks.append(Task(kind="spin", name=f"spin {index + 1}", lane=index, angle=turn))
    tasks.append(
        Task(kind="stand", name="stand at the goal", lane=len(course.lanes) - 1, duration=1.0)
    )
    return tuple(tasks)
