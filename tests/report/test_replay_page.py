"""The run again in the static page: everything is drawn where the log has it."""

import dataclasses
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from replay_rig import glitched, short_run
from report_browser import ask_page
from report_run import short_scenario

from drake_quad.report import page as build_module
from drake_quad.report.derived import base_motion
from drake_quad.report.overlay import LEAST_FORCE, NEWTONS_PER_METRE
from drake_quad.report.replay import frame_numbers, make_replay_html, recorded_samples
from drake_quad.report.style import BAD, GOOD
from drake_quad.runs.reader import RecordedRun

READY = "await until(() => window.replay);"
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


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    return short_run(tmp_path_factory.mktemp("run"))


@dataclasses.dataclass
class Visit:
    """What the browser found in the static page of a run with a glitch, and its picture."""

    run: RecordedRun
    samples: list[int]
    answer: dict[str, Any]
    picture: np.ndarray


@pytest.fixture(scope="module")
def visit(run: RecordedRun, tmp_path_factory: pytest.TempPathFactory) -> Visit:
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
    run: RecordedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A segment's button in the page takes the replay inside to the segment's start."""
    monkeypatch.setattr(build_module, "FIGURES", ())
    html = build_module.write_report(run).read_text(encoding="utf-8")
    question = """
      const inside = document.querySelector("iframe").contentWindow;
      await until(() => inside.replay);
      const button = [...document.querySelectorAll("button[data-seek]")].at(-1);
      button.click();
      await until(() => !inside.viewer.animator.playing);
      return [Number(button.dataset.seek), Number(inside.document.getElementById("time").value)];"""
    asked, reached = ask_page(html, question, work=tmp_path)
    assert reached == pytest.approx(asked - run.log.t[0], abs=0.011) and reached > 0.5


def test_no_other_thread_has_to_clear_away_after_a_page(tmp_path: Path) -> None:
    """Drake ends a program in which Meshcat goes in a thread other than the one that made it."""
    script = """
import gc, sys, threading
from pathlib import Path
sys.path.insert(0, "tests/support")
from report_run import make_log, short_scenario, write_run
from drake_quad.report.replay import make_replay_html
run = write_run(Path(sys.argv[1]), log=make_log(short_scenario(), seconds=0.2))
gc.disable()  # so that nothing but what is asked for here is collected
make_replay_html(run)
other = threading.Thread(target=gc.collect)
other.start()
other.join()
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)],
        cwd=Path(__file__).resolve().parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
