"""The page of a controller's process on a bus: what control.json holds, to look at."""

import re
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from drake_quad.bus.real_time import NS, LoopTimes
from drake_quad.bus.safety import SafetyMode
from drake_quad.report.bus_page import SAFETY_MODE_COLOURS, write_bus_page

PERIOD = 0.002


def result(ticks: int, **changed: Any) -> dict[str, Any]:
    """A controller's result after so many ticks, every hundredth of which took 30 ms."""
    times = LoopTimes(PERIOD)
    for k in range(ticks):
        begun = round(k * PERIOD * NS)
        work = 0.03 if k % 100 == 99 else 0.0008
        times.note(begun, begun + round(work * NS), round(0.0015 * NS))
    events = [
        {"time": 0.5, "mode": "standing_up", "reason": ""},
        {"time": 1.5, "mode": "damping", "reason": "a NaN <b>"},
    ]
    found = {
        "outcome": "damped: a NaN <b>",
        "events": events,
        "bus": {"bus": "lcm", "interface": "lo", "domain": 3, "rate": 1.0},
        "contacts": "joints",
        "remarks": ["states have no clock"],
        "states_lost": 17,
        "ticks_held": 5,
        "largest_step": 0.0123,
        "real_time": {"fifo": True, "time_given_up": 0.0, **times.figures()},
    }
    return found | changed


def words_of(page: Path) -> str:
    """The page's text, without its tags."""
    return unescape(re.sub(r"<[^>]*>", " ", page.read_text(encoding="utf-8")))


def test_the_page_has_what_the_file_has(tmp_path: Path) -> None:
    """Outcome, remarks, modes with their times and reasons, and the figures of the loop's time."""
    page = write_bus_page(result(1000), tmp_path / "control.html", name="my walk")
    words = " ".join(words_of(page).split())
    for text in (
        "my walk", "damped: a NaN <b>", "states have no clock", "0.500 standing up",
        "1.500 damping a NaN <b>", "LCM, domain 3", "0.0123 rad a tick", "0.80, 30.00, 30.0 ms",
        "states lost since the robot was armed 17", "ticks held for want of a new state 5",
    ):  # fmt: skip
        assert text in words, text
    assert "<b>" not in page.read_text(encoding="utf-8")  # text is no markup


def test_each_mode_has_a_colour_of_its_own() -> None:
    """Of the safety machine's modes none is drawn in the colour of the unknown."""
    assert set(SAFETY_MODE_COLOURS) == {mode.name.lower() for mode in SafetyMode}
    assert len(set(SAFETY_MODE_COLOURS.values())) == len(SAFETY_MODE_COLOURS)


def test_histograms_hold_every_tick(tmp_path: Path) -> None:
    """Beside the bars stand their counts: of work 990 short ticks and 10 long ones."""
    page = write_bus_page(result(1000), tmp_path / "control.html", name="walk")
    text = page.read_text(encoding="utf-8")
    work = text[text.index("Work: how long") : text.index("Age of the state: how long")]
    counts = re.findall(r">(\d+)</text>", work)
    assert "990" in counts and "10" in counts
    assert text.count("<svg") == 4


def test_a_mission_that_was_carried_out_is_told_as_in_a_runs_report(tmp_path: Path) -> None:
    """In words, and in green."""
    found = result(1000, outcome="goal_reached")
    page = write_bus_page(found, tmp_path / "control.html", name="walk")
    assert "Reached the goal" in words_of(page)
    assert '<header class="good">' in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("ticks", [0, 1])
def test_a_loop_that_ended_at_once_has_a_page(tmp_path: Path, ticks: int) -> None:
    """No figure of time is known then, and no mode but damping."""
    found = result(ticks, events=[], outcome="stopped: interrupted")
    page = write_bus_page(found, tmp_path / "control.html", name="walk")
    words = words_of(page)
    assert "stopped: interrupted" in words and "late by half" not in words


def test_the_longest_ticks_are_where_they_were_in_a_long_run() -> None:
    """Only the last ticks are kept, but their times count from the first."""
    times = LoopTimes(PERIOD, capacity=100)
    for k in range(250):
        begun = 5 * NS + round(k * PERIOD * NS)
        times.note(begun, begun + round((0.02 if k == 240 else 0.001) * NS), -1)
    longest = times.figures()["longest_ticks"][0]
    assert longest["at"] == pytest.approx(240 * PERIOD)
    assert longest["work_ms"] == pytest.approx(20.0)
