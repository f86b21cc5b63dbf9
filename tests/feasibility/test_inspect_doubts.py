"""Robots' files that can be read and are hardly meant so: each is told of in one clear line."""

import io
import re
from pathlib import Path

import pytest
from import_rig import write
from rich.console import Console
from rig import paper_robot
from synthetic_robot import Quadruped

from drake_quad.cli.check_answer import print_check
from drake_quad.errors import InputError
from drake_quad.feasibility.inspect_robot import all_doubts, describe_robot, print_robot
from drake_quad.robot.loader import load_robot

INERTIAL = r'(<link name="{}"><inertial>.*?)<inertia [^>]*/>'
ZERO = '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>'


def without_inertial(text: str, link: str) -> str:
    return re.sub(rf'(<link name="{link}">)<inertial>.*?</inertial>', r"\1", text)


def with_inertia(text: str, link: str, inertia: str) -> str:
    return re.sub(INERTIAL.format(link), rf"\1{inertia}", text)


def reversed_axis(text: str, joint: str) -> str:
    """Its axis the other way round, its limits as they were."""

    def turn(found: re.Match[str]) -> str:
        turned = " ".join(str(-float(x)) for x in found[2].split())
        return f'{found[1]}<axis xyz="{turned}"'

    return re.sub(rf'(<joint name="{joint}".*?)<axis xyz="([^"]*)"', turn, text)


def in_millimetres(text: str) -> str:
    """All places of joints and centres of mass, axes apart."""

    def larger(found: re.Match[str]) -> str:
        return f'<origin xyz="{" ".join(str(1e3 * float(x)) for x in found[1].split())}"'

    return re.sub(r'<origin xyz="([^"]*)"', larger, text)


TEXT = Quadruped().text()
SHIPPED = Path(__file__).resolve().parents[2] / "models" / "paper_quadruped.urdf"  # in normal form
SYMMETRIC = Quadruped(limits=((-0.7, 0.7), (-1.4, 1.4), (-2.5, -0.3))).text()
DOUBTFUL = {
    "no inertia": (with_inertia(TEXT, "FL_shank", ""), ("FL_shank", "0.433 kg", "no inertia")),
    "zero inertia": (with_inertia(TEXT, "FL_shank", ZERO), ("FL_shank", "no inertia", "ixx")),
    "no inertial": (without_inertial(TEXT, "RR_thigh"), ("RR's thigh", "<inertial>")),
    "a light shank": (without_inertial(TEXT, "FL_shank"), ("FL's shank", "0.1 kg", "alike")),
    "a knee": (reversed_axis(TEXT, "FL_kfe"), ("FL_kfe and FR_kfe", "wrong way round")),
    "a leg": (
        reversed_axis(reversed_axis(reversed_axis(TEXT, "RL_haa"), "RL_hfe"), "RL_kfe"),
        ("RL_haa and RR_haa", "RL_hfe and RR_hfe", "RL_kfe and RR_kfe", "wrong way round"),
    ),
    "an axis": (reversed_axis(SYMMETRIC, "FR_hfe"), ("FR_hfe", "three other legs")),
}


@pytest.mark.parametrize("case", DOUBTFUL)
def test_what_is_hardly_meant_is_told_in_one_line(tmp_path: Path, case: str) -> None:
    """By `inspect` and by `check`, with what is doubtful and what may be wrong."""
    text, words = DOUBTFUL[case]
    robot = load_robot(write(tmp_path, text))
    told = describe_robot(robot, source="mine.urdf")
    (line,) = told["doubts"]
    assert all(word in line for word in words), line
    console = Console(width=300, record=True, file=io.StringIO())
    print_robot(told, console)
    answer = {"answer": "Unknown: no plan", "verdict": "unknown", "feasible": False, "slacks": {}}
    print_check({**answer, "doubts": all_doubts(robot)}, console)
    assert console.export_text().count(f"doubtful: {line}") == 2


@pytest.mark.parametrize("rear", [1, -1])
@pytest.mark.parametrize("signs", [(1, 1, 1), (-1, -1, 1)])
def test_what_is_meant_is_not_doubted(
    tmp_path: Path, rear: int, signs: tuple[int, int, int]
) -> None:
    """Rear legs that are mirrored, and axes that are the other way round at all legs."""
    text = Quadruped(rear=rear, signs=signs).text()
    assert all_doubts(load_robot(write(tmp_path, text))) == []
    assert all_doubts(paper_robot()) == []


def test_lengths_in_millimetres_are_refused(tmp_path: Path) -> None:
    """A leg of 620 m is none: the line names lengths and unit; so in a file in normal form."""
    for text in (in_millimetres(TEXT), in_millimetres(SHIPPED.read_text())):
        with pytest.raises(InputError, match=r"up to .* m.*in metres.*mm\?"):
            load_robot(write(tmp_path, text))
