"""Works out the answer to a question of `check`: reads it, designs, proves, looks on, and saves."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.feasibility.answers import remember
from drake_quad.feasibility.check import check_flight, check_preference, design_for_course
from drake_quad.feasibility.check_report import (
    feasibility_report,
    with_changes,
    with_nearest,
    with_proof,
)
from drake_quad.feasibility.check_request import COUNT, RISE, RUN, CheckRequest, save_answer
from drake_quad.feasibility.check_words import stairs_in_words
from drake_quad.feasibility.flight import Around, check_stairs_numbers
from drake_quad.infeasibility.proof import proof_record
from drake_quad.robot.digest import robot_digest
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.load import load_scenario, scenario_text
from drake_quad.simulation.precompile import DESIGN, precompiling
from drake_quad.stability.margin_kinds import HULL
from drake_quad.terrain.elements import Stairs
from drake_quad.util.files import write_whole
from drake_quad.util.parallel import check_workers
from drake_quad.util.stopping import Stopping, never


def work_out(
    asked: CheckRequest,
    *,
    save: Path | None = None,
    proof: Path | None = None,
    picture: Path | None = None,
    curve: Path | None = None,
    nearest: bool = True,
    changes: bool = False,
    workers: int | None = None,
    key: str = "",
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
        key: By what the answer is remembered, if it is a flight that is climbed; it is not if this
            is empty.
        first: Receives the answer, with the reason of a no, before the search for the nearest
            stairs and before any file is written.
        note: Receives a line about what is being done.
        stopping: See `check_flight`.

    Raises:
        InputError: If anything given cannot be used, before any long work; or a file cannot be
            written, after `first` had the answer.
    """
    if picture is not None:  # drawing takes matplotlib, which an answer alone does without
        from drake_quad.feasibility.robot_picture import check_picture_path

        check_picture_path(picture)
    check_preference(asked.preference, asked.margin)
    if curve is not None and asked.preference.dynamic:
        remedy = "leave it out: the curve is of gaits with --balance static"
        raise InputError(source="--curve", field="curve", value=str(curve), remedy=remedy)
    own = {name: getattr(asked, name) for name in ("width", "landing", "turn")}
    flight = {name: getattr(asked, name) for name in ("rise", "run", "count", "overhang", "open")}
    given = {**flight, **own}
    robot = load_robot(asked.robot)
    usual_flight = {"rise": RISE, "run": RUN, "count": COUNT}
    stairs = Stairs(**usual_flight | {k: v for k, v in flight.items() if v is not None})
    known = {name: value for name, value in own.items() if value is not None}
    if workers is not None:
        check_workers(workers)
    if asked.scenario is None:
        check_stairs_numbers(stairs, Around(**known))
    else:
        if changes:
            remedy = "leave it out: changes are sought for a flight, not for a scenario's course"
            raise InputError(source="--changes", field="changes", value=True, remedy=remedy)
        for name, value in given.items():
            if value is not None:
                remedy = "leave it out: with --scenario the stairs are the scenario's"
                raise InputError(source=f"--{name}", field=name, value=value, remedy=remedy)
        load_scenario(asked.scenario)
    with precompiling(DESIGN, note) as wait:
        wait()
    if asked.scenario is not None:
        question: dict[str, Any] = {"scenario": asked.scenario}
        check = design_for_course(
            asked.robot,
            asked.scenario,
            margin=asked.margin,
            preference=asked.preference,
            nearest=nearest,
            note=note,
            stopping=stopping,
        )
    else:
        question = {**stairs.fields(), **known}
        check = check_flight(
            asked.robot,
            stairs,
            around=Around(**known),
            margin=asked.margin,
            preference=asked.preference,
            nearest=False,
            robot=robot,
            note=note,
            stopping=stopping,
        )
    if asked.margin != HULL:
        question["margin"] = asked.margin
    usual = CheckRequest(asked.robot)
    liked = ("prefer", "speed", "min_margin", "balance")
    question |= {k: getattr(asked, k) for k in liked if getattr(asked, k) != getattr(usual, k)}
    report = feasibility_report(check, robot, source=asked.robot, asked=question)
    report = with_proof(report, check.proof) | {"remembered": None}
    if check.designed is not None and key and not check.stopped:
        remember(key, report, scenario_text(check.designed.scenario))
    first(report)
    if check.proof is not None and proof is not None:
        record = proof_record(check.proof, robot, file_digest=robot_digest(asked.robot))
        text = json.dumps(record) + "\n"
        write_whole(proof, lambda to: to.write_text(text, encoding="utf-8"), option="--proof")
        report["proof"] = str(proof)
    if not check.feasible and changes:

        def told(done: int, total: int) -> None:
            note(f"not these; looking for the least change that helps: {done} of {total} kinds")

        found = check.changes(workers=workers or os.cpu_count() or 1, progress=told)
        report = with_changes(report, found)
    elif not check.feasible and asked.scenario is None and nearest:
        report = with_nearest(report, check.nearest(note))
    if check.designed is not None:
        report |= save_answer(scenario_text(check.designed.scenario), save)
    if check.designed is not None and picture is not None:
        from drake_quad.feasibility.check_picture import draw_check
        from drake_quad.feasibility.robot_picture import save_picture

        note("drawing")
        save_picture(draw_check(check.designed, robot), picture, salt=robot.name, dpi=110)
        report["picture"] = str(picture)
    traced = check.curve(note) if curve is not None else None
    if traced is not None and curve is not None:
        from drake_quad.feasibility.curve_picture import save_speed_curve

        save_speed_curve(traced, curve, f"{robot.name} on {stairs_in_words(question)}")
        report["curve"] = traced.as_dict() | {"directory": str(curve)}
    return report
