"""What a run comes to: the verdict in a sentence."""

import math
from dataclasses import dataclass

import numpy as np

from drake_quad.report.axes import signed
from drake_quad.report.derived import margins
from drake_quad.report.tables import entries_of, look_up
from drake_quad.runs.reader import RecordedRun
from drake_quad.stability.safety import Safety, judge_safety, safe_margin


@dataclass(frozen=True)
class RunVerdict:
    """The head of the page.

    Attributes:
        grade: `good`, `warn` or `bad`: the colour.
        word: In a word or two.
        sentence: With the figures that matter.
        least_time: When the margin was least [s], if it is known.
    """

    grade: str
    word: str
    sentence: str
    least_time: float | None


def grade_run(run: RecordedRun) -> RunVerdict:
    """The verdict on a run, from its summary and its log."""
    outcome = str(run.summary.get("outcome", ""))
    grade, word = {
        "goal_reached": ("good", "Reached the goal"),
        "fell": ("bad", "Fell"),
        "stopped": ("bad", "Stopped"),
    }.get(outcome, ("bad", outcome.replace("_", " ").capitalize() or "Unfinished"))
    log = run.log
    lasted = float(log.t[-1]) if len(log) else look_up(run.summary, "simulated_time")
    sentence = ""
    if math.isfinite(lasted):
        sentence = f"{'Done after' if outcome == 'goal_reached' else 'After'} {lasted:.1f} s"
        bands = log.bands()
        if outcome != "goal_reached" and bands:
            sentence += f" ({bands[-1].name or bands[-1].kind})"
        reason = str(run.summary.get("reason") or "").strip()
        if reason and outcome != "goal_reached":
            sentence += f": {reason.removeprefix(outcome).lstrip(': ')}"
        sentence = sentence.rstrip(": ") + ". "
    text, time, least = _least(run)
    safety = judge_safety(run.summary, safe_margin(run.robot))
    if grade == "good" and (safety.safe is not True or least < 0.0):
        grade = "warn"
    if run.kinematic:
        word = f"{word}: kinematic replay, no physics"
    sentence += text + _pushed(run) + _told(safety)
    return RunVerdict(grade, word, signed(sentence.strip()), time)


def _told(safety: Safety) -> str:
    """The verdict of safety, as a sentence; none of a replay without physics."""
    return f" {safety.words[0].upper()}{safety.words[1:]}." if safety.safe is not None else ""


def _pushed(run: RecordedRun) -> str:
    """How often the robot was pushed, and in what time it recovered, in words; maybe none."""
    # Of a push that the run did not come to the summary says nothing.
    told = [e for e in entries_of(run.summary, "pushes") if e.get("recovered") is not None]
    if not told:
        return ""
    times = [f"{look_up(e, 'recovery_time'):.1f} s" for e in told if e["recovered"]]
    lost = len(told) - len(times)
    parts = [f"recovered in {', '.join(times)}"] if times else []
    if lost:
        parts.append("not recovered" if not times else f"not recovered from {lost}")
    often = "once" if len(told) == 1 else f"{len(told)} times"
    return f" Pushed {often}, {'; '.join(parts)}."


def _least(run: RecordedRun) -> tuple[str, float | None, float]:
    """The least margin: in words, when [s], and how much [m]."""
    margin, noun = margins(run), "planned" if run.kinematic else "measured"
    if not np.any(np.isfinite(margin)):
        least = look_up(run.summary, "margin.minimum")
        known = math.isfinite(least)
        return f"Smallest {noun} margin {least:.3f} m." if known else "", None, least
    k = int(np.nanargmin(margin))
    time = float(run.log.t[k])
    where = run.log.text("segment")[k]
    where = f" ({where})" if where else ""
    text = f"The smallest {noun} static margin was {margin[k]:.3f} m, at {time:.1f} s{where}."
    return text, time, float(margin[k])
