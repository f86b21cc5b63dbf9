"""report.html: what it says and shows, of every kind of run, and that it needs no network."""

import base64
import dataclasses
import json
import re
import struct
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_run import (
    add_estimate,
    add_margins,
    add_recovery,
    make_log,
    make_summary,
    short_scenario,
    wave_begins,
    write_run,
)

from drake_quad.report.figures_gait import find_cycle, find_losses
from drake_quad.report.page import FIGURES as ALL_FIGURES, grade_run, write_report
from drake_quad.report.replay import (
    FINEST,
    make_replay_html,
    pack,
    round_recording,
    unpack,
)
from drake_quad.report.style import KIND_COLOURS, PAGE_VARIABLES
from drake_quad.report.tables import bounds, segment_rows, summary_rows
from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.runs.run_log import RunLog

# Attributes that make a browser fetch something.
PACKED = re.compile(r'<script type="text/plain" id="replay-packed">([^<]*)</script>')
FETCHING = {"src", "href", "srcset", "data", "poster", "action", "xlink:href", "background"}

# Those of a run that was told its map.
FIGURES = [kind for kind in ALL_FIGURES if kind.name not in ("seen", "revisions")]


def replay_in(html: str) -> str:
    """The replay's own page, which the report holds packed."""
    (packed,) = PACKED.findall(html)
    return unpack(packed)


class Page(HTMLParser):
    """A page taken apart: its elements' attributes, its text, the figures of its sections."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.drawn: dict[str, int] = {}
        self.text = ""
        self._section = ""
        self._mute = False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:  # noqa: D102
        found = {name: value or "" for name, value in attrs}
        self.tags.append((tag, found))
        self._mute = tag in ("style", "script")
        if tag == "section":
            self._section = found.get("id", "")
        elif tag == "path":
            self.drawn[self._section] = self.drawn.get(self._section, 0) + 1

    def handle_endtag(self, tag: str) -> None:  # noqa: D102
        self._mute = False

    def handle_data(self, data: str) -> None:  # noqa: D102
        if not self._mute:
            self.text += data + " "


# Of a session: workers that take tests from one another come back to this module, and would make a
# module's page again.
@pytest.fixture(scope="session")
def log() -> dict[str, Any]:
    """Of a run that has something to show in every figure."""
    made = make_log(short_scenario(), start=wave_begins() - 1.5)
    recovered = add_recovery(add_margins(made), wave_begins() - 1.0)
    return add_estimate(recovered, ahead=0.01, yaw=0.01)


@pytest.fixture(scope="session")
def run(log: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    return load_run(write_run(tmp_path_factory.mktemp("run"), log=log))


@pytest.fixture(scope="session")
def html(run: RecordedRun) -> str:
    return write_report(run).read_text(encoding="utf-8")


def changed(run: RecordedRun, **columns: Any) -> RecordedRun:
    """The run with some columns of its log changed."""
    return dataclasses.replace(run, log=RunLog({**run.log.columns, **columns}))


def told(run: RecordedRun, **summary: Any) -> RecordedRun:
    """The run with some of its summary's keys changed."""
    return dataclasses.replace(run, summary={**run.summary, **summary})


def without_samples(run: RecordedRun) -> RecordedRun:
    """The run with an empty log: its page is made at once."""
    return dataclasses.replace(run, log=RunLog({}))


def test_every_figure_is_in_the_page_and_drawn(html: str) -> None:
    """Each figure has its section, with an SVG in it that holds more lines than empty axes."""
    page = Page(html)
    for kind in FIGURES:
        assert page.drawn[kind.name] > 15, kind.name
    labels = [tag["aria-label"] for name, tag in page.tags if name == "svg"]
    assert labels == [kind.title for kind in FIGURES]


def test_the_page_fetches_nothing(html: str) -> None:
    """Neither the page nor the replay in it has an element or a style that loads from elsewhere."""
    replay = replay_in(html)
    for part in (html, replay):
        for name, tag in Page(part).tags:
            for attribute in FETCHING & tag.keys():
                local = tag[attribute].startswith(("#", "data:"))
                assert local or not tag[attribute], (name, attribute, tag[attribute][:80])
            assert name not in ("link", "object", "embed", "base")
        styles = re.findall(r"<style>(.*?)</style>", part, re.DOTALL)
        assert styles and not any("@import" in s or "url(" in s for s in styles)


def test_the_key_of_segments_has_those_of_the_run(run: RecordedRun, html: str) -> None:
    """Every kind that the run has, and no other: it has no trot."""
    key = html[html.index("Segments in the figures over time:") :]
    key = key[: key.index("</p>")]
    kinds = {band.kind for band in run.log.bands()}
    assert kinds == {kind for kind in KIND_COLOURS if f">{kind}</span>" in key}
    assert "wave" in kinds and "trot" not in kinds


def test_a_figure_says_its_units(html: str) -> None:
    """Time is in s, lengths in m, forces in N, angles in deg: named on the axes."""
    text = Page(html).text
    for label in ("simulated time [s]", "margin [m]", "vertical force [N]", "attitude [deg]"):
        assert label in text


def test_no_two_elements_share_an_id(html: str) -> None:
    """Else one figure would clip another."""
    ids = [tag["id"] for _, tag in Page(html).tags if "id" in tag]
    assert len(ids) == len(set(ids)) > len(FIGURES)


def test_figures_take_their_ink_from_the_page(html: str) -> None:
    """No stand-in for a colour of the theme is left, so both themes are readable."""
    for stand_in, variable in PAGE_VARIABLES.items():
        assert stand_in.lower() not in html.lower() and f"var({variable})" in html


def test_the_same_run_gives_the_same_page(run: RecordedRun, html: str) -> None:
    """To the byte but for Meshcat's own random names, so that pages can be compared."""
    again = write_report(run, replay=False).read_text(encoding="utf-8")
    for kind in FIGURES:
        start = again.index(f'<section id="{kind.name}">')
        assert again[start : again.index("</section>", start)] in html


def test_the_page_stays_small(html: str) -> None:
    """Meshcat's own page is 2.3 MB, and packed less than half; figures and 3 s of replay little."""
    replay = replay_in(html)
    assert len(replay) > 2e6 and len(html) < 1.6e6


def test_a_recording_is_rounded_to_what_nobody_sees(run: RecordedRun) -> None:
    """Every number of a keyframe to half of FINEST, and not a byte of anything else."""
    page = make_replay_html(run)
    rounded = round_recording(page)
    sizes = len(pack(rounded)), len(pack(page))
    assert len(rounded) == len(page) and sizes[0] < sizes[1]
    keyframe = re.compile(rb"(?<=\xa5value[\x93\x94])(?:\xcb.{8}){3,4}", re.DOTALL)

    def parts(text: str) -> tuple[list[bytes], list[float]]:
        data = [base64.b64decode(m) for m in re.findall(r";base64,([A-Za-z0-9+/]{400,}=*)", text)]
        (raw,) = [one for one in data if one.startswith(b"\x83\xa4type\xadset_animation")]
        cells = [m[k : k + 9] for m in keyframe.findall(raw) for k in range(0, len(m), 9)]
        return keyframe.split(raw), [struct.unpack(">d", cell[1:])[0] for cell in cells]

    rest, values = parts(page)
    rounded_rest, rounded_values = parts(rounded)
    assert rest == rounded_rest and len(values) > 1000
    np.testing.assert_allclose(rounded_values, values, rtol=0.0, atol=0.5 * FINEST)
    assert np.all(np.array(rounded_values) % FINEST == 0.0)


def test_a_page_is_unpacked_as_it_was() -> None:
    """To the letter: data in base64 of any length, and what only looks like it."""
    raw = bytes(range(256)) * 9
    data = [base64.b64encode(raw[: 900 + k]).decode() for k in range(3)]
    odd = "A" * 401  # of no whole number of bytes
    loose = data[0][:-1] + "/"  # another last letter, which stands for the same bytes
    for page in ("", "é\n", f"<a>;base64,{data[0]}</a>ü;base64,{data[1]}", f";base64,{odd}=",
                 f"x;base64,{data[2]}", f";base64,{loose};base64,{data[1]}\r\n"):  # fmt: skip
        assert unpack(pack(page)) == page
        assert pack(page) == pack(page)


@pytest.mark.parametrize(
    ("outcome", "reason", "grade", "word"),
    [
        ("goal_reached", "the mission was carried out", "good", "Reached the goal"),
        ("fell", "the trunk is tilted by 41°", "bad", "Fell"),
        ("stopped", "the gait clock waited 2 s", "bad", "Stopped"),
        ("", "", "bad", "Unfinished"),
    ],
)
def test_the_verdict_is_the_outcome(
    run: RecordedRun, outcome: str, reason: str, grade: str, word: str
) -> None:
    """Colour and word follow the outcome; of a run that failed the sentence says when and why."""
    verdict = grade_run(told(run, outcome=outcome, reason=reason))
    assert (verdict.grade, verdict.word) == (grade, word)
    assert (reason in verdict.sentence) == (grade == "bad")
    assert f"{run.log.t[-1]:.1f} s" in verdict.sentence


def test_a_run_that_ends_as_it_waits_for_a_plan_is_told_by_its_last_segment(
    run: RecordedRun,
) -> None:
    """Its last samples are of no segment."""
    columns = {name: np.array(values) for name, values in run.log.columns.items()}
    last = [band.name for band in run.log.bands() if band.name][-1]
    for name in ("segment", "segment_kind"):
        columns[name] = columns[name].astype(object)
        columns[name][-3:] = ""
    waits = dataclasses.replace(run, log=RunLog(columns))
    sentence = grade_run(told(waits, outcome="stopped", reason="no way on")).sentence
    assert f"s ({last}): no way on" in sentence


def test_a_figure_beyond_its_bound_is_missed(run: RecordedRun) -> None:
    """Each bound is kept by a good run, and missed by one that breaks it; the others stay kept."""
    kept = {bound.name: bound.kept for bound in bounds(run) if bound.kept is not None}
    assert len(kept) == 11 and all(kept.values())
    broken = {
        "time_under_three_feet": 0.005,
        "nonfoot_contact_samples": 1,
        "torque_ratio_max": 1.01,
        "speed_ratio_max": 1.2,
        "position_ratio_max": 1.001,
        "margin": {"minimum": 0.0299},
        "margin_planned": {"minimum": -0.01},
        "slip_max": 0.0101,
        "base_error_max": 0.031,
        "base_tilt_error_max_deg": 2.01,
        "margin_within_20mm": 0.949,
    }
    for key, value in broken.items():
        missed = [bound.name for bound in bounds(told(run, **{key: value})) if bound.kept is False]
        assert len(missed) == 1, key


@pytest.mark.parametrize("value", [None, float("nan"), "soon", True, [1.0]])
def test_a_figure_that_is_no_number_is_left_out(run: RecordedRun, value: object) -> None:
    """The table of bounds shows what is there, and the page is built."""
    lacking = told(run, torque_ratio_max=value, margin=value, segments=value, versions=value)
    names = [bound.name for bound in bounds(lacking)]
    assert not any("torque" in name for name in names) and len(names) == len(bounds(run)) - 2
    assert [row.name for row in segment_rows(lacking)] == [b.name for b in run.log.bands()]
    assert write_report(without_samples(lacking)).is_file()


def test_the_summary_is_shown_in_full_with_units(run: RecordedRun, html: str) -> None:
    """Every key of the summary is in the page, nested ones by their paths."""
    rows = {key: (value, unit) for key, value, unit in summary_rows(run.summary)}
    assert rows["margin.minimum"][1] == "m" and rows["simulated_time"][1] == "s"
    assert rows["base_tilt_error_max_deg"] == ("0.57", "deg") and rows["seed"] == ("0", "")
    for key in rows:
        assert f"<code>{key}</code>" in html


def test_words_of_the_run_are_no_html(run: RecordedRun) -> None:
    """A description with tags in it is shown as it was written."""
    scenario = dataclasses.replace(run.scenario, description="<script>alert(1)</script>")
    page = write_report(without_samples(dataclasses.replace(run, scenario=scenario)))
    text = page.read_text(encoding="utf-8")
    assert "<script>alert" not in text and "&lt;script&gt;alert" in text


@pytest.mark.parametrize("rows", [0, 1])
def test_a_run_cut_short_still_has_its_report(
    log: dict[str, Any], tmp_path: Path, rows: int
) -> None:
    """With hardly a sample in the log, or none, the page is there with its verdict."""
    cut = {name: values[:rows] for name, values in log.items()}
    write_run(tmp_path, log=cut) if rows else write_run(tmp_path, log=log)
    if not rows:
        (tmp_path / "log.parquet").unlink()
    text = {"outcome": "stopped", "reason": "interrupted", "margin": {"minimum": None}}
    (tmp_path / "summary.json").write_text(json.dumps(text), encoding="utf-8")
    page = Page(write_report(tmp_path).read_text(encoding="utf-8"))
    assert "Stopped" in page.text and "interrupted" in page.text
    assert sum(name == "iframe" for name, _ in page.tags) == (rows > 0)
    # A single sample tells of no waiting.
    assert sum(name == "svg" for name, _ in page.tags) == (len(FIGURES) - 1 if rows else 0)


@pytest.mark.parametrize("how", ["nan", "missing"])
def test_a_log_without_figures_still_has_its_report(run: RecordedRun, how: str) -> None:
    """With nothing but the time known, the page is built, and claims no margin."""
    words = ("segment", "segment_kind")
    columns: dict[str, Any] = {"t": run.log.t}
    if how == "nan":
        nothing = np.full(len(run.log), np.nan)
        columns = {n: c if n in words else nothing for n, c in run.log.columns.items()} | columns
    empty = dataclasses.replace(
        run,
        log=RunLog(columns),
        summary={},
        positions=np.full_like(run.positions, np.nan),
        velocities=np.full_like(run.velocities, np.nan),
    )
    text = write_report(empty).read_text(encoding="utf-8")
    assert "margin was" not in text


def test_a_kinematic_replay_says_so(tmp_path: Path) -> None:
    """The verdict, the replay and every figure say that there was no physics; forces are absent."""
    log = make_log(short_scenario(), seconds=1.0, kinematic=True)
    html = write_report(write_run(tmp_path, log=log, simulation="kinematic")).read_text("utf-8")
    page = Page(html)
    assert page.text.count("inematic replay, no physics") >= 2 + len(page.drawn)
    replay = replay_in(html)
    assert 'id="kinematic"' in replay
    assert {"torques", "forces", "error"} & page.drawn.keys() == set()
    assert "margin was" in page.text and "measured static margin" not in page.text


def test_a_physical_run_does_not(html: str) -> None:
    """And the page of a simulated run has nothing of it."""
    assert "inematic replay" not in Page(html).text


def test_the_cycle_to_look_at_is_one_cycle() -> None:
    """In a wave, it spans leg 1's lift-off to its next: the gait's own cycle time, all legs."""
    scenario = short_scenario()
    run_log = RunLog(make_log(scenario, seconds=32.0, kinematic=True))
    start, end = find_cycle(run_log)
    assert end - start == pytest.approx(scenario.gait.cycle_time, abs=0.02)
    inside = (run_log.t >= start) & (run_log.t < end - 0.02)
    lifts = np.diff(run_log.flags("standing_planned")[inside].astype(int), axis=0) == -1
    assert lifts.sum(axis=0).tolist() == [0, 1, 1, 1]  # leg 1's own is at the very start


def test_a_loss_of_ground_is_told_from_a_late_touchdown() -> None:
    """A gap within a stance is a loss, a short delay at its ends is none, a long one is."""
    t = np.linspace(0.0, 1.995, 400)
    planned = (t > 0.3) & (t < 1.7)
    sensed = (t > 0.38) & (t < 1.65)
    assert not find_losses(t, planned, sensed).any()
    gap = (t > 1.0) & (t < 1.012)
    np.testing.assert_array_equal(find_losses(t, planned, sensed & ~gap), gap)
    # As a light foot's contact comes and goes before its lift-off, and after its touchdown.
    lift, down = t[planned][-1], t[planned][0]
    flicker = (np.abs(t - lift + 0.07) < 0.008) | (np.abs(t - lift + 0.03) < 0.008)
    flicker |= np.abs(t - down - 0.06) < 0.008
    assert np.any(flicker & sensed) and not find_losses(t, planned, sensed & ~flicker).any()
    late = t > 0.6
    np.testing.assert_array_equal(find_losses(t, planned, late & sensed), planned & ~late)


def test_the_summary_of_these_tests_is_as_a_run_writes_it(run: RecordedRun) -> None:
    """The made-up summary says of its log what the log says."""
    assert make_summary(dict(run.log.columns))["margin"]["minimum"] == pytest.approx(
        run.log.number("margin").min()
    )
