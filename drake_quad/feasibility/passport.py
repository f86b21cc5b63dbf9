"""A robot's passport: which stairs of common rules it climbs, how fast, and with what margin."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.feasibility.check import MOST_MARGIN, check_flight, check_stairs_numbers
from drake_quad.feasibility.check_report import LIMITS, feasibility_report, with_proof
from drake_quad.feasibility.standard_stairs import STANDARDS, Standard
from drake_quad.gait_design.tempo_search import Wish
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.load import save_scenario
from drake_quad.simulation.precompile import DESIGN, precompiling
from drake_quad.terrain.elements import Stairs
from drake_quad.util.files import write_whole
from drake_quad.util.parallel import check_workers, map_in_processes

COUNT = 10  # steps of a flight
ANSWERS = {"yes": "yes", "no": "no, proven", "unknown": "unknown"}


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
        "closed risers without nosings, an exact map, and trunk, legs and motors as the robot's "
        "file has them; unknown is where no plan was found"
    )
    drawn: str = ""

    def as_dict(self) -> dict[str, Any]:
        """The passport as plain values, as passport.json holds them."""
        return asdict(self)

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
        wish: What the gaits are to be good at.
        directory: Where to save the scenarios of the plans; nowhere if None.
    """

    model: str
    standards: tuple[Standard, ...] = STANDARDS
    count: int = COUNT
    wish: Wish = MOST_MARGIN
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
            model, Stairs(rise, run, count), wish=asked.wish, nearest=False, robot=robot
        )
    except InputError as error:
        if error.source not in ("--rise", "--run"):
            raise
        reason = f"run {run:g} m: {error.remedy}"  # too shallow for the robot's feet
        return Entry(standard, "unknown", limit=LIMITS["plan"], reason=reason)
    flight = asdict(Stairs(rise, run, count))
    told = with_proof(feasibility_report(check, robot, source=model, asked=flight), check.proof)
    if check.designed is None:
        return Entry(standard, told["verdict"], limit=LIMITS[told["limit"]], reason=check.reason)
    name = ""
    if directory is not None:
        name = f"stairs_{1e3 * rise:.0f}_{1e3 * run:.0f}.yaml"
        scenario = check.designed.scenario
        write_whole(directory / name, lambda to: save_scenario(scenario, to))
    return Entry(
        standard, "yes", margin=told["plan"]["margin"], wanted=told["slacks"]["margin"]["wanted"],
        speed=check.speed, time=check.flight_time,
        limit="" if told["pace"] is None else told["pace"]["bound"]["words"], scenario=name,
    )  # fmt: skip


def plan_passport(
    asked: Question,
    *,
    workers: int = 1,
    progress: Callable[[int, int], object] = lambda _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
    ready: Callable[[], object] = lambda: None,
) -> Passport:
    """Looks at all flights on paper.

    Args:
        asked: The question.
        workers: Number of processes.
        progress: Receives the number of flights that are done and of all.
        stop: Whether to stop.
        ready: Called once all that was given can be used.

    Raises:
        InputError: If anything given cannot be used, before any long work.
    """
    asked.wish.check()
    check_workers(workers)
    flights = [(one.rise, one.run) for one in asked.standards]
    check_stairs_numbers(Stairs(*flights[0], asked.count))
    robot = load_robot(asked.model)
    ready()
    with precompiling(DESIGN) as wait:
        wait()
    found = map_in_processes(
        partial(judge_standard, asked), flights, workers=workers, progress=progress, stop=stop
    )
    legs = robot.geometry
    return Passport(
        robot=asked.model,
        name=robot.name,
        count=asked.count,
        prefer=asked.wish.prefer,
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


def write_passport(passport: Passport, directory: Path) -> None:
    """Writes passport.json, passport.md and the picture, passport.svg and passport.png.

    Raises:
        InputError: If they cannot be written.
    """
    from drake_quad.feasibility.passport_picture import save_passport_picture

    text = json.dumps(passport.as_dict(), indent=2) + "\n"
    write_whole(directory / "passport.json", lambda to: to.write_text(text, encoding="utf-8"))
    page = passport_page(passport)
    write_whole(directory / "passport.md", lambda to: to.write_text(page, encoding="utf-8"))
    save_passport_picture(passport, directory)


def passport_page(passport: Passport, picture: str = "passport.svg") -> str:
    """The passport as a page of Markdown.

    Args:
        passport: The passport.
        picture: Path of its picture from the page.
    """
    yes = [one for one in passport.entries if one.verdict == "yes"]
    tried = any(one.trials for one in passport.entries)
    lines = [
        f"# {passport.name}: stairs that it climbs",
        "",
        f"{len(yes)} of {len(passport.entries)} kinds of stairs by common rules, flights of "
        f"{passport.count} steps, up and, after a turn, down. Robot mass {passport.mass:.1f} kg, "
        f"legs {passport.leg:.2f} m. The answers assume {passport.assumes}."
        + (f" {passport.drawn}" if passport.drawn else ""),
        "",
        f"![Flights to scale, with answers]({picture})",
        "",
        "| " + " | ".join(passport_columns(tried=tried)) + " |",
        "|---|---|---|---:|---:|---|" + ("---|" if tried else ""),
    ]
    lines += [
        "| " + " | ".join(passport_cells(one, tried=tried)) + " |" for one in passport.entries
    ]
    lines += ["", "Rules: " + "; ".join(f"{one.stairs.name}: {one.stairs.source}"
                                         for one in passport.entries) + "."]  # fmt: skip
    return "\n".join(lines) + "\n"


def passport_columns(*, tried: bool) -> list[str]:
    """Heads of the table."""
    heads = ["stairs", "rise × run [m]", "answer", "margin [mm]", "speed [m/s]", "nearest limit"]
    return [*heads, "reached the goal"] if tried else heads


def passport_cells(entry: Entry, *, tried: bool) -> list[str]:
    """A row of the table, for people."""
    answer = ANSWERS[entry.verdict]
    if entry.short and entry.wanted is not None:
        answer = f"yes, below the {1e3 * entry.wanted:.0f} mm wanted"
    row = [
        entry.stairs.name,
        f"{entry.stairs.rise:g} × {entry.stairs.run:g}",
        answer,
        "-" if entry.margin is None else f"{1e3 * entry.margin:.0f}",
        "-" if entry.speed is None else f"{entry.speed:.3f}",
        entry.limit or "-",
    ]
    return [*row, "-" if entry.trials is None else entry.trials["text"]] if tried else row
