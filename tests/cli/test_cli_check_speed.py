"""The options of `check` about speed reach the gait, the files and the words."""

import json
from pathlib import Path

import pytest
from command import drake_quad, refused

import drake_quad as dq

FLIGHT = ("check", "paper_quadruped", "--rise", "0.12", "--run", "0.4", "--count", "1")


@pytest.mark.long
def test_a_balanced_gait_and_its_curve_are_told_and_saved(tmp_path: Path) -> None:
    """It is what nothing asked gives; the saved gait is the one told; the curve's points load."""
    done = drake_quad(
        *FLIGHT, "--save", "quick.yaml", "--curve", "curve", "--json",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    pace = told["pace"]
    assert pace["wish"] == {
        "prefer": "balanced", "speed": None, "min_margin": None, "balance": "static",
        "fulfilled": True, "unmet": [],
    }  # fmt: skip
    assert pace["speed"] > 1.5 * pace["slow"]["speed"]
    assert told["plan"]["margin"] >= 0.8 * pace["slow"]["margin"]
    saved = dq.load_scenario(tmp_path / "quick.yaml")
    assert saved.gait.cycle_time == told["gait"]["cycle_time"]
    points = json.loads((tmp_path / "curve" / "curve.json").read_text())["points"]
    names = {path.name for path in (tmp_path / "curve").iterdir()}
    numbers = range(1, len(points) + 1)
    assert {"curve.json", "curve.png", "curve.svg", *(f"point_{k}.yaml" for k in numbers)} == names
    assert dq.load_scenario(tmp_path / "curve" / "point_1.yaml").course == saved.course


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--prefer", "fast"], "--prefer"),
        (["--speed", "0"], "--speed"),
        (["--min-margin", "nan"], "--min-margin"),
        (["--curve", "/dev/null/curve"], "--curve"),
        (["--balance", "moving"], "--balance"),
        (["--balance", "dynamic", "--margin", "friction"], "--margin"),
        (["--balance", "dynamic", "--curve", "curve"], "--curve"),
    ],
)
def test_what_cannot_be_wished_for_is_refused(
    options: list[str], named: str, tmp_path: Path
) -> None:
    """One line that names the option, and status 2, before any gait is designed."""
    assert named in refused(drake_quad(*FLIGHT, *options, cwd=tmp_path))
