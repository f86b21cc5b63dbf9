"""Makes docs/images/case_study.png: one moment of a run, as its replay shows it, by Chromium.

drake-quad run case_study
python scripts/case_study_picture.py runs/case_study docs/images/case_study.png
"""

import argparse
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import drake_quad as dq
from drake_quad.report.replay import make_replay_html
from drake_quad.runs.reader import RecordedRun

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--hide-scrollbars")  # fmt: skip
SIZE = (1200, 600)
FROM = (-1.4, -2.1, 0.75)  # [m] of the camera from the centre of mass, in W
AT = (0.12, 0.0, -0.22)  # [m] where it looks, from the centre of mass
BUDGET = 20_000  # [ms] of the page's own time

# The page hides its bar, seeks the moment, and puts the camera there; three.js has y up.
POSE = """<style>#bar, .dg, .lil-gui {{ display: none !important; }}</style><script>
  const pose = () => {{
    if (!window.replay) return setTimeout(pose, 50);
    replay.seek({time});
    document.querySelectorAll("body > *").forEach(node => {{
      if (!node.querySelector("canvas") && node.tagName !== "CANVAS") node.style.display = "none";
    }});
    viewer.camera.position.set({camera});
    viewer.controls.target.set({target});
    viewer.controls.update();
    viewer.set_dirty();
  }};
  pose();
</script>"""


def most_telling(run: RecordedRun) -> int:
    """The sample in the middle of the climb at which all four feet stand on different heights."""
    bearing = run.log.flags("bearing").all(axis=1)
    spread = np.ptp(np.round(run.log.feet("position")[:, :, 2], 2), axis=1)
    return int(np.argmax(np.where(bearing, spread, -1.0)))


def page_of(run: RecordedRun, sample: int) -> str:
    """The replay's page, at the moment of a sample."""
    com = run.log.vector("com")[sample]

    def three(offset: tuple[float, float, float]) -> str:
        x, y, z = com + np.array(offset)
        return f"{x}, {z}, {-y}"

    pose = POSE.format(time=run.log.t[sample] - run.log.t[0], camera=three(FROM), target=three(AT))
    head, end, tail = make_replay_html(run).rpartition("</body>")
    return f"{head}{pose}{end}{tail}"


def take_picture(page: str, out: Path) -> None:
    """Opens a page in Chromium, and writes what it shows as PNG."""
    browser = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if browser is None:
        raise SystemExit(f"no Chromium on this machine (looked for {', '.join(BROWSERS)})")
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory) / "page.html"
        file.write_text(page, encoding="utf-8")
        subprocess.run(
            [browser, *FLAGS, f"--user-data-dir={directory}/browser",
             f"--window-size={SIZE[0]},{SIZE[1]}", f"--virtual-time-budget={BUDGET}",
             f"--screenshot={out.resolve()}", file.as_uri()],
            check=True, capture_output=True,
        )  # fmt: skip


def main() -> None:
    """Takes the picture of the moment that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("run", type=Path, help="directory of the run")
    parser.add_argument("out", type=Path, help="the PNG")
    parser.add_argument("--time", type=float, help="moment [s]; by default it is chosen")
    given = parser.parse_args()
    run = dq.load_run(given.run)
    asked = given.time
    sample = most_telling(run) if asked is None else int(np.argmin(np.abs(run.log.t - asked)))
    take_picture(page_of(run, sample), given.out)
    print(f"{given.out}: t = {run.log.t[sample]:.1f} s, {run.log.text('segment')[sample]}")


if __name__ == "__main__":
    main()
