"""The run again: in a live Meshcat, in Meldis, and as an LCM log."""

import dataclasses
import os
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.lcm import DrakeLcm
from replay_rig import glitched, short_run

from drake_quad.errors import InputError
from drake_quad.report.lcm_replay import (
    DRAW,
    LOAD,
    Message,
    play,
    publish_in_time,
    scene_messages,
    write_scene_log,
)
from drake_quad.report.replay import AddReplay, recorded_samples
from drake_quad.report.scene import shown_samples
from drake_quad.runs.reader import RecordedRun
from drake_quad.runs.run_log import RunLog


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    return short_run(tmp_path_factory.mktemp("run"))


def test_a_moment_shorter_than_a_frame_is_not_missed(run: RecordedRun) -> None:
    """The sample of least margin has a frame, though it lies between two."""
    assert 307 not in shown_samples(run, 10.0)
    samples = recorded_samples(glitched(run, 307), 10.0)
    assert 307 in samples and samples == sorted(set(samples))


def test_a_recording_lasts_as_long_as_the_run(run: RecordedRun) -> None:
    """Frames are as many as asked a second; twice the speed takes half the time."""
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    for speed in (1.0, 2.0):
        count = AddReplay(meshcat, run, fps=20.0, speed=speed)
        recording = meshcat.get_mutable_recording()
        assert recording.frames_per_second() == 20.0 * speed
        assert count == pytest.approx(3.0 * 20.0, abs=1.5)
    for path in ("/drake/scene/paper_quadruped/trunk", "/replay/force/FL", "/replay/plumb"):
        assert meshcat.HasPath(path)


def test_a_run_without_samples_still_shows_its_course(run: RecordedRun) -> None:
    """Meshcat gets the course and the robot where it stands by default, and no recording."""
    empty = dataclasses.replace(run, log=RunLog({}), positions=run.positions[:0])
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    assert AddReplay(meshcat, empty) == 0


def test_messages_are_the_scene_then_frame_by_frame(run: RecordedRun) -> None:
    """The scene is loaded once and first; then it is drawn at every frame's time."""
    messages = list(scene_messages(run, fps=10.0))
    channels = [message.channel for message in messages]
    assert channels[0] == LOAD and channels.count(LOAD) == 1
    assert channels[1:] == [DRAW] * len(shown_samples(run, 10.0))
    times = [message.time for message in messages]
    assert times == sorted(times) and times[0] == 0.0
    assert times[-1] == pytest.approx(run.log.t[-1] - run.log.t[0])


def test_lcm_plays_the_scene_log_in_its_own_time(run: RecordedRun) -> None:
    """LCM itself reads every event, and at ten times the speed in a tenth of the run's time."""
    path = write_scene_log(run, fps=30.0)
    sent = list(scene_messages(run, fps=30.0))
    lcm = DrakeLcm(f"file://{path}?speed=10")
    heard: list[bytes] = []
    drawn: list[float] = []
    lcm.Subscribe(LOAD, heard.append)
    lcm.Subscribe(DRAW, lambda data: drawn.append(time.monotonic()))
    wanted = sum(message.channel == DRAW for message in sent)
    end = time.monotonic() + 5.0
    while len(drawn) < wanted and time.monotonic() < end:
        lcm.HandleSubscriptions(20)
    assert heard == [sent[0].data] and len(drawn) == wanted
    assert 0.2 < drawn[-1] - drawn[0] < 2.0  # 0.3 s, but for a busy machine


def test_meldis_receives_the_scene(tmp_path: Path) -> None:
    """Meldis, on a private channel, shows the robot, its centre of mass and the course."""
    script = """
import sys
from pathlib import Path
sys.path.insert(0, "tests/support")
from report_run import make_log, short_scenario, write_run
from drake_quad.runs.reader import load_run
from drake_quad.report.lcm_replay import scene_messages
from pydrake.visualization._meldis import Meldis
meldis = Meldis()
assert not meldis.meshcat.HasPath("/DRAKE_VIEWER")
run = load_run(write_run(Path(sys.argv[1]), log=make_log(short_scenario(), seconds=0.2)))
for message in scene_messages(run, fps=10.0):
    meldis._lcm.Publish(message.channel, message.data)
    meldis._lcm.HandleSubscriptions(0)
    meldis._invoke_subscriptions()
html = meldis.meshcat.StaticHtml()
assert meldis.meshcat.HasPath("/DRAKE_VIEWER")
import base64, re
parts = re.findall(r"octet-binary;base64,([A-Za-z0-9+/=]+)", html)
scene = b"".join(base64.b64decode(part) for part in parts)
for word in (b"trunk", b"FL_shank", b"centre_of_mass"):
    assert word in scene, word
assert scene.count(b"BoxGeometry") >= len(run.course.boxes) + len(run.course.nosings())
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)],
        cwd=Path(__file__).resolve().parents[2],
        env={**os.environ, "LCM_DEFAULT_URL": "memq://"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


class Clock:
    """A clock that only sleeping moves."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:  # noqa: D102
        return self.now

    def sleep(self, seconds: float) -> None:
        """Moves on."""
        assert seconds > 0.0
        self.now += seconds


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_messages_are_published_at_their_times(speed: float) -> None:
    """Each at its time over the speed, none lost, the scene again every second for latecomers."""
    clock, sent = Clock(), []
    messages = [Message(0.0, LOAD, b"scene")]
    messages += [Message(0.1 * k, DRAW, bytes([k])) for k in range(51)]
    publish_in_time(
        messages,
        lambda channel, data: sent.append((clock.now - 100.0, channel, data)),
        speed=speed,
        clock=clock,
        sleep=clock.sleep,
    )
    drawn = [(t, data) for t, channel, data in sent if channel == DRAW]
    assert [data for _, data in drawn] == [m.data for m in messages[1:]]
    assert [t for t, _ in drawn] == pytest.approx([m.time / speed for m in messages[1:]])
    loads = [t for t, channel, _ in sent if channel == LOAD]
    assert sent[0][1] == LOAD and len(loads) == 1 + int(5.0 / speed)
    assert np.all(np.diff(loads) >= 1.0 - 1e-9) and np.all(np.diff(loads) < 1.25)


def test_a_slow_viewer_is_not_waited_for_twice() -> None:
    """Publishing that takes longer than a frame is caught up with, not added to each wait."""
    clock, sent = Clock(), []

    def publish(channel: str, data: bytes) -> None:
        sent.append(clock.now - 100.0)
        clock.now += 0.35 if len(sent) == 3 else 0.0

    messages = [Message(0.1 * k, DRAW, b"") for k in range(11)]
    publish_in_time(messages, publish, clock=clock, sleep=clock.sleep)
    assert sent[-1] == pytest.approx(1.0)


def test_replay_in_meshcat_tells_where_and_ends_quietly(
    run: RecordedRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The told address answers while it plays; Ctrl-C ends it without an error."""
    told: list[str] = []
    pages: list[bytes] = []

    def interrupt(_: float) -> None:
        address = told[0].split()[2]
        pages.append(urllib.request.urlopen(address, timeout=5.0).read())
        raise KeyboardInterrupt

    monkeypatch.setattr("drake_quad.report.lcm_replay.time.sleep", interrupt)
    play(run, "meshcat", fps=5.0, tell=told.append)
    assert told[0].startswith("Replay at http://") and b"MeshCat" in pages[0]


def test_replay_in_meldis_plays_the_run_once(run: RecordedRun) -> None:
    """On a private bus it comes to its end by itself, at speed."""
    told: list[str] = []
    begun = time.monotonic()
    play(run, "meldis", speed=10.0, fps=10.0, lcm_url="memq://", tell=told.append)
    assert 0.25 < time.monotonic() - begun < 20.0 and "meldis" in told[0]


@pytest.mark.parametrize(
    ("options", "field"),
    [({"viewer": "rviz"}, "viewer"), ({"speed": 0.0}, "speed"), ({"fps": -1.0}, "fps")],
)
def test_a_replay_that_cannot_be_is_refused(
    run: RecordedRun, options: dict[str, Any], field: str
) -> None:
    """The error names the setting and what would be right."""
    with pytest.raises(InputError) as caught:
        play(run, **options)
    assert caught.value.field == field and caught.value.remedy


def test_a_run_without_samples_cannot_be_replayed(run: RecordedRun) -> None:
    """It is said, rather than an empty page served for ever."""
    with pytest.raises(InputError, match="no sample"):
        play(dataclasses.replace(run, log=RunLog({})))
