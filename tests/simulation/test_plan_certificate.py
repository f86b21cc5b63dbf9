"""`drake-quad plan` and certificates: what it prints, what it leaves, and what may be asked for."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from certificate_rig import SCRIPTS
from command import drake_quad, refused

from drake_quad.api.runs import certify, plan
from drake_quad.errors import InputError

CHECKER = str(SCRIPTS / "check_certificate.py")
URDF = str(SCRIPTS.parent / "models" / "paper_quadruped.urdf")


def test_plan_leaves_a_certificate_that_is_accepted(tmp_path: Path) -> None:
    """With the robot that is shipped; and not with another one."""
    done = drake_quad("plan", "flat_walk", "--out", "plan", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "certified for every time" in done.stdout and "static margin at least" in done.stdout
    told = json.loads((tmp_path / "plan" / "plan.json").read_text())["certificate"]
    assert told["certified"] and told["proven"]["margin"] > 0.09

    def check(robot: str) -> subprocess.CompletedProcess[str]:
        path = str(tmp_path / "plan" / "certificate.json")
        return subprocess.run(
            [sys.executable, CHECKER, path, "--robot", robot],
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    assert check(URDF).returncode == 0
    other = tmp_path / "other.urdf"
    other.write_text(Path(URDF).read_text().replace('mass value="38.0"', 'mass value="39.0"'))
    wrong = check(str(other))
    assert wrong.returncode == 1 and "trunk_mass" in wrong.stdout


def test_plan_without_a_certificate_says_when_and_why(tmp_path: Path) -> None:
    """More margin than there is: the time is told, an old certificate goes, the plan counts."""
    (tmp_path / "certificate.json").write_text("{}")
    done = drake_quad(
        "plan", "flat_walk", "--set", "certify.margin=0.11", "--out", ".", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "not certified: the static margin" in done.stdout and " s on, in '" in done.stdout
    assert not (tmp_path / "certificate.json").exists()
    told = json.loads((tmp_path / "plan.json").read_text())["certificate"]
    assert not told["certified"] and told["time"] > 1.0 and told["segment"]


def test_no_plan_leaves_no_certificate_of_another(tmp_path: Path) -> None:
    """plan.json says that there is none, and nothing beside it says otherwise."""
    (tmp_path / "certificate.json").write_text("{}")
    done = drake_quad(
        "plan", "flat_walk", "--set", "gait.duty_factor=0.75", "--out", ".", cwd=tmp_path
    )
    assert done.returncode == 1, done.stderr
    assert json.loads((tmp_path / "plan.json").read_text())["feasible"] is False
    assert [path.name for path in tmp_path.iterdir()] == ["plan.json"]


@pytest.mark.parametrize("field", ["controller.lift_off_margin", "controller.margin_demanded"])
def test_a_plan_below_its_own_lift_off_margin_is_not_feasible(tmp_path: Path, field: str) -> None:
    """The clock would stop at the first lift-off: exit status 1, and both margins are told."""
    done = drake_quad("plan", "flat_walk", "--set", f"{field}=0.12", "--out", ".", cwd=tmp_path)
    assert done.returncode == 1 and f"{field} = 0.120 m" in done.stderr
    assert json.loads((tmp_path / "plan.json").read_text())["feasible"] is False


SLOPE = """
description: Up a slope of 0.3
course:
  - {kind: floor, length: 2.0}
  - {kind: slope, going: up, height: 0.45, length: 1.5}
  - {kind: floor, length: 2.5}
controller: {kind: whole_body, period: 0.002}
mission:
  - {kind: walk, distance: 3.5}
"""


def test_a_plan_on_more_slope_than_friction_holds_is_not_feasible(tmp_path: Path) -> None:
    """It was called feasible and certified, and the robot slid down."""
    (tmp_path / "slope.yaml").write_text(SLOPE)
    for friction, status in ((0.3, 1), (0.4, 0)):
        override = f"controller.friction={friction}"
        done = drake_quad("plan", "slope.yaml", "--set", override, cwd=tmp_path)
        assert done.returncode == status, done.stderr
        assert ("slope of 0.30" in done.stderr) == (status == 1)


def test_a_negative_demand_is_refused(tmp_path: Path) -> None:
    """In one line, by its field."""
    line = refused(drake_quad("plan", "flat_walk", "--set", "certify.clearance=-1", cwd=tmp_path))
    assert "certify.clearance" in line


def test_a_plan_on_two_feet_has_no_certificate_and_says_why(tmp_path: Path) -> None:
    """`plan` has the first time on two feet, and how far off their line; `certify` refuses."""
    walk = [
        "course=[{kind: floor, length: 4.0}]",
        "mission=[{kind: walk, distance: 0.5}]",
        "gait.lag=2",
    ]
    sets = [word for field in walk for word in ("--set", field)]
    done = drake_quad("plan", "trot", *sets, "--out", ".", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert "not certified: two legs swing at once" in words
    assert "m beside two feet's line" in words
    told = json.loads((tmp_path / "plan.json").read_text())
    assert not told["certificate"]["certified"] and told["certificate"]["time"] > 1.0
    assert 0.0 < told["planned_zmp_line_distance_max"] < 0.02
    with pytest.raises(InputError, match=r"gait\.pattern.*take wave"):
        certify(plan("trot", walk))
