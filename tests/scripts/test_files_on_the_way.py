"""The drawing of the way from `rise` to a joint command is as the code is."""

import subprocess
import sys
from pathlib import Path

import files_on_the_way

DOCS = Path(files_on_the_way.__file__).resolve().parents[1] / "docs"


def test_the_drawn_files_are_entered_and_counted() -> None:
    """design.md has today's counts and the drawing today's files; monitors are not on the way.

    In a process of its own, in which nothing is remembered from another test.
    """
    command = [sys.executable, files_on_the_way.__file__]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr  # each file that is drawn is entered
    *files, sentence = done.stdout.splitlines()
    assert {"terrain/lane.py", "planning/body_qp.py", "control/foot_targets.py"} <= set(files)
    assert "systems/stability_monitor.py" not in files
    assert sentence in (DOCS / "design.md").read_text(encoding="utf-8")
    drawn = (DOCS / "images" / "files_on_the_way.svg").read_text(encoding="utf-8")
    assert drawn == files_on_the_way.drawing()
