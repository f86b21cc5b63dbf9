"""The question of `check` as a person puts it, and its answer: remembered, or worked out."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.feasibility.answers import answer_key, recall
from drake_quad.gait_design.preference import BALANCE, GaitPreference
from drake_quad.stability.margin_kinds import HULL
from drake_quad.util.files import user_path, write_whole
from drake_quad.util.stopping import Stopping, never

RISE, RUN, COUNT = 0.178, 0.28, 10  # a common indoor flight


@dataclass(frozen=True)
class CheckRequest:
    """The question, as a person put it.

    Attributes:
        robot: Robot name or file.
        rise: Rise of the steps [m]; RISE if None.
        run: Run of the treads [m]; RUN if None.
        count: Number of steps of the flight; COUNT if None.
        overhang: Distance that each tread reaches beyond the riser under it [m]; 0 if None.
        open: Whether the risers are open; they are not if None.
        scenario: Scenario whose course to walk instead of a flight.
        margin: Region that the plan's margin is measured in, one of
            `stability.margin_kinds.KINDS`.
        width: Width of the flights [m]; as the robot needs if None.
        landing: Length of the landing between the flights [m]; as the robot needs if None.
        turn: Turn on the landing [deg], left positive; 90 if None.
        prefer: What the gait is to be good at, see `GaitPreference.asked`.
        speed: Speed on the flights that is enough [m/s], see `GaitPreference`.
        min_margin: Margin that the plan is to keep [m], see `GaitPreference`.
        balance: How the gait is balanced, one of `BALANCE`.
    """

    robot: str
    rise: float | None = None
    run: float | None = None
    count: int | None = None
    overhang: float | None = None
    open: bool | None = None
    scenario: str | None = None
    margin: str = HULL
    width: float | None = None
    landing: float | None = None
    turn: float | None = None
    prefer: str | None = None
    speed: float | None = None
    min_margin: float | None = None
    balance: str = BALANCE[0]

    @property
    def preference(self) -> GaitPreference:
        """What the gait is to be good at."""
        return GaitPreference.asked(self.prefer, self.speed, self.min_margin, self.balance)


def run_check(
    asked: CheckRequest,
    *,
    save: str | Path | None = None,
    proof: str | Path | None = None,
    picture: str | Path | None = None,
    curve: str | Path | None = None,
    nearest: bool = True,
    changes: bool = False,
    workers: int | None = None,
    remembered: bool = False,
    first: Callable[[dict[str, Any]], object] = lambda _: None,
    note: Callable[[str], object] = lambda _: None,
    stopping: Stopping = never,
) -> dict[str, Any]:
    """Answers the question, as `feasibility_report` has it.

    Args:
        asked: The question.
        save: Where to write the designed scenario, if there is one.
        proof: Where to write the proof that there is no climb, if one is found.
        picture: Where to draw the climb, if there is one.
        curve: Directory to write the curve of speed against margin into, if there is a gait.
        nearest: Whether to look for the nearest stairs that it climbs, if not these; it takes a
            minute or two.
        changes: Whether to look, instead, for the least change of the robot or of the stairs that
            makes it a yes; it takes some minutes.
        workers: Number of processes that look for changes; one for each processor if None.
        remembered: Whether an answer that was found before will do, unless a picture, a curve or
            workers are asked for; and whether this one is remembered, if a flight is climbed. Its
            `remembered` then says when it was found.
        first: Receives the answer, with the reason of a no, before the search for the nearest
            stairs and before any file is written.
        note: Receives a line about what is being done.
        stopping: Entered while a quicker gait is looked for. What it yields says whether the best
            so far will do; such an answer has `stopped` and is not remembered.

    Raises:
        InputError: If anything given cannot be used, before any long work; or a file cannot be
            written, after `first` had the answer.
    """
    save, proof, picture, curve = (
        None if path is None else user_path(path) for path in (save, proof, picture, curve)
    )
    key = ""
    if remembered and asked.scenario is None:
        # What cannot be used is remembered by no key: it is told of below.
        with suppress(InputError, OSError, TypeError, ValueError):
            key = answer_key(asdict(asked), asked.robot)
    before = recall(key) if key and picture is None and curve is None and workers is None else None
    if before is not None:
        report = before.report | {"remembered": before.when}
        first(report)
        return report | save_answer(before.scenario, save)
    # To work an answer out takes Drake and much else, which one that is remembered does without.
    from drake_quad.feasibility.work_out import work_out

    return work_out(
        asked, save=save, proof=proof, picture=picture, curve=curve, nearest=nearest,
        changes=changes, workers=workers, key=key, first=first, note=note, stopping=stopping,
    )  # fmt: skip


def save_answer(scenario: str, path: Path | None) -> dict[str, Any]:
    """Writes a scenario's text into a file, if one is asked for; what the report says of it.

    Args:
        scenario: The scenario's YAML.
        path: The file, or None.

    Raises:
        InputError: If it cannot be written.
    """
    if path is None:
        return {}
    write_whole(path, lambda to: to.write_text(scenario, encoding="utf-8"), option="--save")
    return {"saved": str(path)}
