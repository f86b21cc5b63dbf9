"""A record's robot against a URDF: what is another robot is refused, whatever the record names."""

import copy
import importlib
import re
import sys
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from infeasibility_rig import SCRIPTS, checker, record

ARM = """<link name="arm"><inertial><origin xyz="3 0 1"/><mass value="300"/>
<inertia ixx="9" iyy="9" izz="9" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="arm" type="revolute"><parent link="trunk"/><child link="arm"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="100" velocity="1"/></joint></robot>"""


def comparer() -> ModuleType:
    """scripts/certificate_robot.py as a module."""
    checker()  # which it shares its errors with
    sys.path.insert(0, str(SCRIPTS))
    try:
        return importlib.import_module("certificate_robot")
    finally:
        sys.path.remove(str(SCRIPTS))


def urdf() -> str:
    """The shipped robot's file."""
    return resources.files("drake_quad_models").joinpath("paper_quadruped.urdf").read_text()


def refusal_of(changed: dict[str, Any], text: str, folder: Path) -> str | None:
    """Why a record is not of the robot in a file of that text; None if it is."""
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    try:
        comparer().compare_robot(changed, path)
    except checker().RefusedError as error:
        return str(error)
    return None


def test_an_honest_record_is_of_its_robot(tmp_path: Path) -> None:
    """Every number of it, to rounding."""
    assert refusal_of(record(), urdf(), tmp_path) is None


def _turned(text: str) -> str:
    joint = '<joint name="FL_abduction" type="revolute">'
    before, found, after = text.partition(joint)
    assert found
    return before + found + after.replace("/>", ' rpy="0 1.5 0"/>', 1)


def _other_axes(text: str) -> str:
    changed, count = re.subn(
        r'(<joint name="\w+_hip_pitch" type=.*?<axis xyz=")[^"]*(")',
        r"\g<1>0 0 1\2",
        text,
        flags=re.S,
    )
    assert count == 4
    return changed


def _endless_knees(text: str) -> str:
    def endless(found: re.Match[str]) -> str:
        joint = re.sub(r'\s(lower|upper)="[^"]*"', "", found.group(0))
        return joint.replace('type="revolute"', 'type="continuous"')

    return re.sub(r'<joint name="\w+_knee".*?</joint>', endless, text, flags=re.S)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda text: text.replace("</robot>", ARM), "neither the trunk nor the legs"),
        (_turned, "frames turned"),
        (_other_axes, "axes"),
        (_endless_knees, "without an end"),
    ],
    ids=["an arm of 300 kg", "a turned leg", "other axes", "knees without limits"],
)
def test_another_robot_is_refused(
    change: Callable[[str], str], reason: str, tmp_path: Path
) -> None:
    """Though every number that the record has is in its file, too, or can be made to look so."""
    text = change(urdf())
    assert text != urdf()
    told = refusal_of(record(), text, tmp_path)
    assert told is not None and reason in told


@pytest.mark.parametrize("kind", ["another trunk", "one leg four times", "a joint twice"])
def test_a_record_cannot_choose_what_it_is_compared_with(kind: str, tmp_path: Path) -> None:
    """The trunk is what floats in the file, and its legs are four."""
    changed = copy.deepcopy(record())
    joints = changed["robot"]["joints"]
    if kind == "another trunk":
        changed["robot"]["trunk"] = "RR_hip"
    elif kind == "one leg four times":
        changed["robot"]["joints"] = joints[:3] * 4
    else:
        changed["robot"]["joints"] = [*joints[:11], joints[10]]
    told = refusal_of(changed, urdf(), tmp_path)
    assert told is not None and any(word in told for word in ("floats", "twelve joints", "chains"))
