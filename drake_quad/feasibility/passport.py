"""A robot's passport: which stairs of common rules it climbs, how fast, and with what margin."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.feasibility.check import check_flight
from drake_quad.feasibility.check_report import LIMITS, feasibility_report, with_proof
from drake_quad.feasibility.flight import check_stairs_numbers
from drake_quad.feasibility.result import MOST_MARGIN, Feasibility
from drake_quad.feasibility.same_gait import check_same_gait
from drake_quad.feasibility.standard_stairs import BUILDS, STANDARDS, Build, Standard
from drake_quad.gait_design.preference import GaitPreference
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.load import save_scenario
from drake_quad.simulation.precompile import DESIGN, precompiling
from drake_quad.terrain.elements import Stairs
from drake_quad.util.display import one_line
from drake_quad.util.files import write_whole
from drake_quad.util.parallel import check_workers, map_in_processes

COUNT = 10  # steps of a flight


@dataclass(frozen=True)
class BuiltOtherwise:
    """What the robot makes of the same flight, built in another way.

    Attributes:
        build: The way.
        verdict: `yes`, with a plan up and down in full, or `unknown`.
        margin: Smallest static margin of the plan [m]; None without a plan.
        same_gait: Whether the plan is by the gait of closed risers; None without a plan.
        reason: What is in the way of a plan, in a sentence; empty if there is one.
        scenario: File of the designed scenario in the passport's directory; empty without a plan.
    """

    build: Build
    verdict: str
    margin: float | None = None
    same_gait: bool | None = None
    reason: str = ""
    scenario: str = ""


@dataclass(frozen=True)
class Entry:
    """One kind of stairs, and what the robot makes of them.

    Attributes:
        stairs: The stairs.
        verdict: `yes`, with a plan up and down in full; `no`, proven; or `unknown`.
        margin: Smallest static margin of the plan [m]; None without a plan.
        wanted: Static margin that the design aims at [m]; None without a plan.
        speed: Speed along the flights [m/s], the slower of up and down; None without a plan.
        time: Time that the slower flight takes [s]; None without a plan.
        limit: What is nearest to its limit, or in the way of a plan, in a few words.
        reason: What is in the way of a plan, in a sentence; empty if there is one.
        scenario: File of the designed scenario in the passport's directory; empty without a plan.
        trials: How trials in physics ended, see `sweep.passport_trials`; None without any.
        others: The same flight, built otherwise; empty without a plan. Plans treat treads as
            solid down to the ground, so that no build is easier than closed risers.
    """

    stairs: Standard
    verdict: str
    margin: float | None = None
    wanted: float | None = None
    speed: float | None = None
    time: float | None = None
    limit: str = ""
    reason: str = ""
    scenario: str = ""
    trials: dict[str, Any] | None = None
    others: list[BuiltOtherwise] = field(default_factory=list)

    @property
    def short(self) -> bool:
        """Whether there is a plan, with less margin than is wanted."""
        return self.margin is not None and self.wanted is not None and self.margin < self.wanted


@dataclass(frozen=True)
class Passport:
    """What a robot makes of common stairs.

    Attributes:
        robot: Robot name or file, as the person gave it.
        name: Name that the robot's file has.
        count: Steps of each flight.
        prefer: What the gaits are to be good at.
        mass: Robot mass [kg].
        leg: Length of a leg, thigh and shank [m].
        complete: Whether all stairs were looked at.
        assumes: What the answers assume, for the middle of a sentence.
        drawn: What the trials draw and assume, in a sentence; empty without any.
        entries: The stairs, from low to steep.
    """

    robot: str
    name: str
    count: int
    prefer: str
    mass: float
    leg: float
    complete: bool
    entries: list[Entry] = field(default_factory=list)
    assumes: str = (
        "an exact map, and trunk, legs and motors as the robot's file has them; margin, speed and "
        "proofs are of closed risers without nosings; unknown is where no plan was found"
    )
    drawn: str = ""

    def as_dict(self) -> dict[str, Any]:
        """The passport as plain values, as passport.json holds them."""
        return asdict(self)

    def __repr__(self) -> str:
        stairs = f"{len(self.entries)} kinds of stairs"
        return one_line(self, self.name, stairs, "" if self.complete else "not complete")

    def _repr_html_(self) -> str:
        """The picture, where a notebook shows it."""
        from drake_quad.feasibility.passport_picture import passport_svg

        return passport_svg(self)


@dataclass(frozen=True)
class Question:
    """What is asked of every flight.

    Attributes:
        model: Robot name or file.
        standards: The flights.
        count: Number of steps of each.
        preference: What the gaits are to be good at.
        directory: Where to save the scenarios of the plans; nowhere if None.
    """

    model: str
    standards: tuple[Standard, ...] = STANDARDS
    count: int = COUNT
    preference: GaitPreference = MOST_MARGIN
    directory: Path | None = None


def judge_standard(asked: Question, rise: float, run: float) -> Entry:
    """Plans one kind of stairs in full, and saves the scenario of a plan.

    Args:
        asked: The question.
        rise: Rise of one of its flights [m].
        run: Run of that flight [m].
    """
    standard = next(one for one in asked.standards if (one.rise, one.run) == (rise, run))
    model, count, directory = asked.model, asked.count, asked.directory
    robot = load_robot(model)
    try:
        check = check_flight(
            model, Stairs(rise, run, count), preference=asked.preference, nearest=False, robot=robot
        )
    except InputError as error:
        if error.source not in ("--rise", "--run"):
            raise
        reason = f"run {run:g} m: {error.remedy}"  # too shallow for the robot's feet
        return Entry(standard, "unknown", limit=LIMITS["plan"], reason=reason)
    flight = Stairs(rise, run, count).fields()
    told = with_proof(feasibility_report(check, robot, source=model, asked=flight), check.proof)
    if check.designed is None:
        return Entry(standard, told["verdict"], limit=LIMITS[told["limit"]], reason=check.reason)
    name = _save(check, directory)
    return Entry(
        standard, "yes", margin=told["plan"]["margin"], wanted=told["slacks"]["margin"]["wanted"],
        speed=check.speed, time=check.flight_time,
        limit="" if told["pace"] is None else told["pace"]["bound"]["words"], scenario=name,
        others=[_judge_built(asked, check, build) for build in BUILDS],
    )  # fmt: skip


def _judge_built(asked: Question, closed: Feasibility, build: Build) -> BuiltOtherwise:
    """Plans a flight that is built otherwise, by the gait of the closed one, or by its own."""
    assert closed.stairs is not None
    stairs = replace(closed.stairs, overhang=build.overhang, open=build.open)
    same = check_same_gait(closed, stairs)
    check = same or check_flight(
        asked.model, stairs, preference=asked.preference, nearest=False, robot=closed.robot
    )
    if check.designed is None:
        return BuiltOtherwise(build, "unknown", reason=check.reason)
    return BuiltOtherwise(
        build, "yes", margin=check.margin, same_gait=same is not None,
        scenario=_save(check, asked.directory),
    )  # fmt: skip


def _save(check: Feasibility, directory: Path | None) -> str:
    """Writes the scenario of a plan: the file's name; empty if there is no directory."""
    if directory is None or check.designed is None or check.stairs is None:
        return ""
    stairs, scenario = check.stairs, check.designed.scenario
    kind = "_open" if stairs.open else "_nosings" if stairs.overhang else ""
    name = f"stairs_{1e3 * stairs.rise:.0f}_{1e3 * stairs.run:.0f}{kind}.yaml"
    write_whole(directory / name, lambda to: save_scenario(scenario, to))
    return name


def plan_passport(
    asked: Question,
    *,
    workers: int = 1,
    progress: Callable[[int, int], object] = lambda _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
    ready: Callable[[], object] = lambda: None,
    tell: Callable[[str], object] = lambda _: None,
) -> Passport:
    """Looks at all flights on paper.

    Args:
        asked: The question.
        workers: Number of processes.
        progress: Receives the number of flights that are done and of all.
        stop: Whether to stop.
        ready: Called once all that was given can be used.
        tell: Told in a line if there is something to wait for first.

    Raises:
        InputError: If anything given cannot be used, before any long work.
    """
    asked.preference.check()
    check_workers(workers)
    flights = [(one.rise, one.run) for one in asked.standards]
    check_stairs_numbers(Stairs(*flights[0], asked.count))
    robot = load_robot(asked.model)
    ready()
    with precompiling(DESIGN, tell) as wait:
        wait()
    found = map_in_processes(
        partial(judge_standard, asked), flights, workers=workers, progress=progress, stop=stop
    )
    legs = robot.geometry
    return Passport(
        robot=asked.model,
        name=robot.name,
        count=asked.count,
        prefer=asked.preference.prefer,
        mass=float(robot.mass),
        leg=float((legs.thigh + legs.shank).mean()),
        complete=len(found) == len(flights),
        entries=found,
    )


def with_trials(passport: Passport, trials: dict[str, dict[str, Any]], drawn: str) -> Passport:
    """The passport with what trials in physics came to.

    Args:
        passport: The passport.
        trials: What they came to, by the scenarios' files.
        drawn: What they draw and assume, in a sentence.
    """
    entries = [
        replace(one, trials=trials.get(one.scenario, one.trials)) for one in passport.entries
    ]
    return replace(passport, entries=entries, drawn=drawn)
