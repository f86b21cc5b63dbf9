"""The run again: in the static page, in a live Meshcat, in Meldis, and as an LCM log."""

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
from PIL import Image
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.lcm import DrakeLcm
from report_browser import ask_page
from report_run import make_log, short_scenario, wave_begins, write_run

from drake_quad.errors import InputError
from drake_quad.report import build as build_module
from drake_quad.report.columns import RunLog
from drake_quad.report.motion import base_motion
from drake_quad.report.overlay import LEAST_FORCE, NEWTONS_PER_METRE
from drake_quad.report.play import play, publish_in_time
from drake_quad.report.replay import (
    AddReplay,
    frame_numbers,
    make_replay_html,
    recorded_samples,
)
from drake_quad.report.run_files import Run, read_run
from drake_quad.report.scene import shown_samples
from drake_quad.report.scene_log import write_scene_log
from drake_quad.report.scene_messages import DRAW, LOAD, Message, scene_messages
from drake_quad.report.style import BAD, GOOD

READY = "await until(() => window.replay);"


@pytest.fixture(scope="module")
def log() -> dict[str, Any]:
    return make_log(short_scenario(), seconds=3.0, start=wave_begins() - 1.5)


@pytest.fixture(scope="module")
def run(log: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Run:
    return read_run(write_run(tmp_path_factory.mktemp("run"), log=log))


def glitched(run: Run, sample: int) -> Run:
    """The run, but in one sample the margin is negative."""
    margin = np.array(run.log.number("margin"))
    margin[sample] = -0.05
    return dataclasses.replace(run, log=RunLog({**run.log.columns, "margin": margin}))


FPS = 10.0
GLITCH = 303  # a sample between two frames

# One visit to the page asks all: which meshes there are; then, frame by frame, where the trunk is
# and which support polygons are visible, in what colour; then what the bar says of the least.
VISIT = f"""{READY}
  const count = {{}}, places = [], supports = [], arrows = [], plumbs = [];
  const find = path => viewer.scene_tree.find(path.split("/")).object;
  const where = node => node.getWorldPosition(new MeshCat.THREE.Vector3()).toArray();
  viewer.scene.traverse(node => {{
    if (!node.isMesh) return;
    const path = new Set();
    for (let top = node; top; top = top.parent) path.add(top.name);
    for (const name of path) count[name] = (count[name] || 0) + 1;
  }});
  for (const frame of FRAMES) {{
    replay.seek(frame / {FPS});
    viewer.scene.updateMatrixWorld(true);
    places.push(where(find("drake/scene/paper_quadruped/trunk")));
    arrows.push(["FL", "FR", "RL", "RR"].map(leg => find(`replay/force/${{leg}}`).visible
      ? where(find(`replay/force/${{leg}}/head`)) : [NaN, NaN, NaN]));
    plumbs.push([...where(find("replay/plumb")), find("replay/plumb/line").scale.z]);
    const shown = find("replay/support").children.filter(child => child.visible);
    supports.push(shown.map(child => {{
      let colour = null;
      child.traverse(node => {{ if (node.isMesh) colour = node.material.color.getHexString(); }});
      return colour;
    }}));
  }}
  document.getElementById("least").click();
  await new Promise(done => setTimeout(done, 300));
  const note = document.getElementById("note").textContent;
  return {{ count, places, supports, arrows, plumbs, note }};"""


@dataclasses.dataclass
class Visit:
    """What the browser found in the static page of a run with a glitch, and its picture."""

    run: Run
    samples: list[int]
    answer: dict[str, Any]
    picture: np.ndarray


@pytest.fixture(scope="module")
def visit(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Visit:
    work = tmp_path_factory.mktemp("visit")
    bad = glitched(run, GLITCH)
    samples = recorded_samples(bad, FPS)
    question = VISIT.replace("FRAMES", str(frame_numbers(bad, samples, FPS)))
    picture = work / "page.png"
    answer = ask_page(make_replay_html(bad, fps=FPS), question, work=work, picture=picture)
    return Visit(bad, samples, answer, np.asarray(Image.open(picture).convert("RGB")))


def test_the_static_page_holds_robot_and_stairs(visit: Visit) -> None:
    """In a browser without a network: each tread, nosing and link, and what is drawn over them."""
    count, course = visit.answer["count"], short_scenario().course
    treads = [name for name in count if name.startswith("stairs_1_tread_")]
    nosings = [name for name in count if name.startswith("nosing_")]
    assert len(treads) == len(nosings) == course[1].count
    assert count["paper_quadruped"] >= 1 + 4 * 3  # a trunk, and three links a leg
    assert count["support"] >= 1 and count["centre_of_mass"] == 1
    assert count["force"] == 4 * 2  # a shaft and a head a foot


def test_the_static_page_is_no_blank_picture(visit: Visit) -> None:
    """There are many colours in it, and those of front and rear legs among them."""
    height = len(visit.picture)
    view = visit.picture[: int(0.85 * height), :-40].reshape(-1, 3)
    assert len(np.unique(view, axis=0)) > 500  # the bare background has some 230
    red, green, blue = view.astype(int).T
    assert np.sum((red > 150) & (green > 60) & (green < 130) & (blue < 60)) > 200  # front legs
    assert np.sum((red < 40) & (blue > 90) & (blue - green > 40)) > 200  # rear legs


def test_the_robot_is_where_the_log_has_it(visit: Visit) -> None:
    """At each moment that the bar seeks, the trunk in the browser is at the logged place."""
    logged = base_motion(visit.run).p_WB[visit.samples]
    np.testing.assert_allclose(from_three(visit.answer["places"]), logged, atol=1e-4)
    assert np.ptp(logged[:, 0]) > 0.05


def from_three(points: Any) -> np.ndarray:
    """Points (..., 3) of three.js, which has y up, in W; its null is nan."""
    x, y, z = np.moveaxis(np.array(points, dtype=float), -1, 0)
    return np.stack([x, -z, y], axis=-1)


def test_an_arrow_is_the_force_on_its_foot(visit: Visit) -> None:
    """From where the force acts its tip is as far as the force over the scale; none in the air."""
    log = visit.run.log
    force = log.feet("force")[visit.samples]
    tips = log.feet("position")[visit.samples] + force / NEWTONS_PER_METRE
    tips[np.linalg.norm(force, axis=-1) < LEAST_FORCE] = np.nan
    assert np.isnan(tips).any() and np.isfinite(tips).any()
    np.testing.assert_allclose(from_three(visit.answer["arrows"]), tips, atol=2e-3)


def test_the_plumb_line_hangs_from_the_centre_of_mass(visit: Visit) -> None:
    """Its foot is on the ground under the centre of mass, and its length is the height."""
    com = visit.run.log.vector("com")[visit.samples]
    ground = visit.run.course.height(com[:, 0], com[:, 1])
    found = np.array(visit.answer["plumbs"])
    foot = from_three(found[:, :3])
    np.testing.assert_allclose(foot[:, :2], com[:, :2], atol=1e-4)
    np.testing.assert_allclose(foot[:, 2], ground, atol=0.02)
    np.testing.assert_allclose(found[:, 3], com[:, 2] - ground, atol=1e-4)


def test_one_support_polygon_shows_at_a_time_in_the_margin_s_colour(visit: Visit) -> None:
    """In the frame of negative margin it is red, in all others green; never two at once."""
    colours = visit.answer["supports"]
    assert all(len(shown) == 1 for shown in colours)
    bad = visit.samples.index(GLITCH)
    expected = [GOOD] * len(colours)
    expected[bad] = BAD
    assert [f"#{shown[0]}".upper() for shown in colours] == expected


def test_the_bar_goes_to_the_least_margin(visit: Visit) -> None:
    """One click, and it tells the time, the segment and the margin of the worst moment."""
    time, band = visit.run.log.t[GLITCH], visit.run.log.text("segment")[GLITCH]
    for words in (f"t = {time:.1f} s", band, "-0.050 m"):
        assert words in visit.answer["note"]


def test_the_report_s_buttons_move_its_replay(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A segment's button in the page takes the replay inside to the segment's start."""
    monkeypatch.setattr(build_module, "FIGURES", ())
    html = build_module.build_report(run).read_text(encoding="utf-8")
    question = """
      const inside = document.querySelector("iframe").contentWindow;
      await until(() => inside.replay);
      const button = [...document.querySelectorAll("button[data-seek]")].at(-1);
      button.click();
      await until(() => !inside.viewer.animator.playing);
      return [Number(button.dataset.seek), Number(inside.document.getElementById("time").value)];"""
    asked, reached = ask_page(html, question, work=tmp_path)
    assert reached == pytest.approx(asked - run.log.t[0], abs=0.011) and reached > 0.5


def test_a_moment_shorter_than_a_frame_is_not_missed(run: Run) -> None:
    """The sample of least margin has a frame, though it lies between two."""
    assert 307 not in shown_samples(run, 10.0)
    samples = recorded_samples(glitched(run, 307), 10.0)
    assert 307 in samples and samples == sorted(set(samples))


def test_a_recording_lasts_as_long_as_the_run(run: Run) -> None:
    """Frames are as many as asked a second; twice the speed takes half the time."""
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    for speed in (1.0, 2.0):
        count = AddReplay(meshcat, run, fps=20.0, speed=speed)
        recording = meshcat.get_mutable_recording()
        assert recording.frames_per_second() == 20.0 * speed
        assert count == pytest.approx(3.0 * 20.0, abs=1.5)
    for path in ("/drake/scene/paper_quadruped/trunk", "/replay/force/FL", "/replay/plumb"):
        assert meshcat.HasPath(path)


def test_a_run_without_samples_still_shows_its_course(run: Run) -> None:
    """Meshcat gets the course and the robot where it stands by default, and no recording."""
    empty = dataclasses.replace(run, log=RunLog({}), positions=run.positions[:0])
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    assert AddReplay(meshcat, empty) == 0


def test_messages_are_the_scene_then_frame_by_frame(run: Run) -> None:
    """The scene is loaded once and first; then it is drawn at every frame's time."""
    messages = list(scene_messages(run, fps=10.0))
    channels = [message.channel for message in messages]
    assert channels[0] == LOAD and channels.count(LOAD) == 1
    assert channels[1:] == [DRAW] * len(shown_samples(run, 10.0))
    times = [message.time for message in messages]
    assert times == sorted(times) and times[0] == 0.0
    assert times[-1] == pytest.approx(run.log.t[-1] - run.log.t[0])


def test_lcm_plays_the_scene_log_in_its_own_time(run: Run) -> None:
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
sys.path.insert(0, "tests")
from report_run import make_log, short_scenario, write_run
from drake_quad.report.run_files import read_run
from drake_quad.report.scene_messages import scene_messages
from pydrake.visualization._meldis import Meldis
meldis = Meldis()
assert not meldis.meshcat.HasPath("/DRAKE_VIEWER")
run = read_run(write_run(Path(sys.argv[1]), log=make_log(short_scenario(), seconds=0.2)))
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
        cwd=Path(__file__).resolve().parents[1],
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
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The told address answers while it plays; Ctrl-C ends it without an error."""
    told: list[str] = []
    pages: list[bytes] = []

    def interrupt(_: float) -> None:
        address = told[0].split()[2]
        pages.append(urllib.request.urlopen(address, timeout=5.0).read())
        raise KeyboardInterrupt

    monkeypatch.setattr("drake_quad.report.play.time.sleep", interrupt)
    play(run, "meshcat", fps=5.0, tell=told.append)
    assert told[0].startswith("Replay at http://") and b"MeshCat" in pages[0]


def test_replay_in_meldis_plays_the_run_once(run: Run) -> None:
    """On a private bus it comes to its end by itself, at speed."""
    told: list[str] = []
    begun = time.monotonic()
    play(run, "meldis", speed=10.0, fps=10.0, lcm_url="memq://", tell=told.append)
    assert 0.25 < time.monotonic() - begun < 20.0 and "meldis" in told[0]


@pytest.mark.parametrize(
    ("options", "field"),
    [({"viewer": "rviz"}, "viewer"), ({"speed": 0.0}, "speed"), ({"fps": -1.0}, "fps")],
)
def test_a_replay_that_cannot_be_is_refused(run: Run, options: dict[str, Any], field: str) -> None:
    """The error names the setting and what would be right."""
    with pytest.raises(InputError) as caught:
        play(run, **options)
    assert caught.value.field == field and caught.value.remedy


def test_a_run_without_samples_cannot_be_replayed(run: Run) -> None:
    """It is said, rather than an empty page served for ever."""
    with pytest.raises(InputError, match="no sample"):
        play(dataclasses.replace(run, log=RunLog({})))
