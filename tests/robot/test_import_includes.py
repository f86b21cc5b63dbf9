"""Robots in several files, and files that are nested, encoded or named in any way."""

from pathlib import Path

import numpy as np
import pytest
from import_rig import write
from robot_formats import figures, mjcf, sdf, urdf
from test_import_repairs import CUBE

from drake_quad.errors import InputError
from drake_quad.robot.importer.pipeline import MAPPING
from drake_quad.robot.loader import load_robot

MASS = "<mass>2</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia>"
PAYLOAD = f'<model name="p"><link name="box"><inertial>{MASS}</inertial></link>{{}}</model>'


pytestmark = pytest.mark.usefixtures("own_cache")


def refusal(model: str) -> InputError:
    with pytest.raises(InputError) as caught:
        load_robot(model)
    assert "\n" not in str(caught.value)
    return caught.value


def included(uri: str, more: str = "") -> str:
    """The sample SDF, which includes another and carries it."""
    weld = '<joint name="w" type="fixed"><parent>body</parent><child>p::box</child></joint>'
    return sdf().replace("</model>", f"<include><uri>{uri}</uri>{more}</include>{weld}</model>")


def payload(folder: Path, inner: str = "", name: str = "pay.sdf") -> None:
    write(folder, f'<sdf version="1.9">{PAYLOAD.format(inner)}</sdf>', name)


def test_sdf_includes_what_is_beside_it_from_wherever_one_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file of the same name where one works is another; a change of the right one counts."""
    (tmp_path / "elsewhere").mkdir()
    write(tmp_path / "elsewhere", '<sdf version="1.9"><model name="p"/></sdf>', "pay.sdf")
    payload(tmp_path)
    path = write(tmp_path, included("pay.sdf"), "r.sdf")
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert load_robot(path).mass == pytest.approx(18.6 + 2.0)
    pay = tmp_path / "pay.sdf"
    pay.write_text(pay.read_text().replace("<mass>2", "<mass>33"))
    assert load_robot(path).mass == pytest.approx(18.6 + 33.0)


def test_included_sdf_is_cleaned_as_the_robot_is(tmp_path: Path) -> None:
    """Its meshes are found beside it, and what is wrong in it names it."""
    (tmp_path / "sub").mkdir()
    path = write(tmp_path, included("sub/pay.sdf"), "r.sdf")
    payload(tmp_path / "sub")
    pay = tmp_path / "sub" / "pay.sdf"
    shape = "<geometry><mesh><uri>cube.obj</uri></mesh></geometry>"
    mesh = f'<collision name="cube">{shape}</collision></link>'
    pay.write_text(pay.read_text().replace("</link>", mesh))
    write(tmp_path / "sub", CUBE, "cube.obj")
    notes = (Path(load_robot(path).url).parent / MAPPING).read_text()
    assert "collision mesh cube as its box" in notes
    payload(tmp_path / "sub", '<link name="l"><inertial><mass>-1</mass></inertial></link>')
    error = refusal(path)
    assert error.source == str(tmp_path / "sub" / "pay.sdf")
    assert (error.field, error.value) == ("l: mass", "-1")


def test_drives_are_those_of_the_robots_own_model(tmp_path: Path) -> None:
    """Of two models in a world whose joints are called alike, each has its own torque limits."""
    other = (
        sdf()
        .replace('<model name="r">', '<model name="weak">')
        .replace("<effort>50<", "<effort>5<")
    )
    bodies = [text[text.index("<model") : text.index("</sdf>")] for text in (sdf(), other)]
    for order in (bodies, bodies[::-1]):
        world = f'<sdf version="1.9"><world name="w">{"".join(order)}</world></sdf>'
        effort = load_robot(write(tmp_path, world, "w.sdf")).effort[0]
        assert effort == (50.0 if order is bodies else 5.0)


@pytest.mark.parametrize("inner", ["r.sdf", "file://{}/r.sdf", "a.sdf"])
def test_sdf_that_includes_itself_is_refused(inner: str, tmp_path: Path) -> None:
    """The parser would run out of its stack, and Python with it."""
    uri = inner.format(tmp_path)
    back = f"<include><uri>{uri if inner != 'a.sdf' else 'b.sdf'}</uri></include>"
    payload(tmp_path, back, "a.sdf")
    payload(tmp_path, "<include><uri>a.sdf</uri></include>", "b.sdf")
    error = refusal(write(tmp_path, included("a.sdf"), "r.sdf"))
    way = "a.sdf includes itself by way of b.sdf" if inner == "a.sdf" else "by way of a.sdf"
    assert way in error.remedy and error.field == "include"


def test_sdf_that_grows_without_end_is_refused(tmp_path: Path) -> None:
    """Each file twice in the one before: thirty of them would be a thousand million."""
    for k in range(30):
        twice = "".join(f"<include><uri>a{k + 1}.sdf</uri><name>{n}</name></include>" for n in "xy")
        payload(tmp_path, twice if k < 29 else "", f"a{k}.sdf")
    assert "more than 200" in refusal(write(tmp_path, included("a0.sdf"), "r.sdf")).remedy


ME = "r.xml"
MJCF = {  # text of b.xml, which r.xml includes, and words of the refusal
    "itself": ('<mujoco><include file="b.xml"/></mujoco>', "b.xml includes itself"),
    "the robot": (f'<mujoco><include file="{ME}"/></mujoco>', "itself by way of b.xml"),
    "twice": (
        '<mujoco><include file="c.xml"/><worldbody><include file="c.xml"/></worldbody></mujoco>',
        "takes each file once",
    ),
    "a page": ("<html/>", "begins with <html>"),
    "text": ("nothing", "no XML"),
    "nothing": ("", "empty"),
    "nan": ('<mujoco><worldbody><geom size="nan"/></worldbody></mujoco>', "must be a number"),
    "what is gone": ('<mujoco><include file="gone.xml"/></mujoco>', "no such file"),
    "no name": ("<mujoco><include/></mujoco>", "names no file"),
    "a folder": ('<mujoco><include file="."/></mujoco>', "no such file"),
}


@pytest.mark.parametrize("case", MJCF)
def test_mjcf_include_that_mujoco_refuses_is_refused(case: str, tmp_path: Path) -> None:
    """And the line names the file that is wrong, not only the robot's."""
    text, words = MJCF[case]
    write(tmp_path, text, "b.xml")
    write(tmp_path, "<mujoco/>", "c.xml")
    robot = mjcf().replace("<worldbody>", '<include file="b.xml"/><worldbody>')
    error = refusal(write(tmp_path, robot, ME))
    assert words in error.remedy
    assert (error.source if case != "a page" else error.remedy).count("b.xml")


def test_mjcf_included_by_what_is_included_counts(tmp_path: Path) -> None:
    """However deep a file is included, in whatever quotes: its change makes another robot."""
    write(tmp_path, mjcf(), "inner.xml")
    write(tmp_path, "<mujoco><include file='inner.xml'/></mujoco>", "middle.xml")
    path = write(tmp_path, "<mujoco><include file='middle.xml'/></mujoco>", "r.xml")
    assert load_robot(path).mass == pytest.approx(18.6)
    write(tmp_path, mjcf().replace('mass="9.0"', 'mass="19.0"'), "inner.xml")
    assert load_robot(path).mass == pytest.approx(28.6)


JUNK = "<a>" * 100_000 + "</a>" * 100_000
BODY = '<body name="n{}"><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>'
BODIES = "".join(BODY.format(k) for k in range(1200))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("r.urdf", urdf().replace("</robot>", f"{JUNK}</robot>")),
        ("r.sdf", sdf().replace("</model>", f"{JUNK}</model>")),
        ("r.xml", mjcf().replace("</worldbody>", f"{BODIES}{'</body>' * 1200}</worldbody>")),
        ("r.xml", mjcf().replace("</worldbody>", f"<body>{'<joint/>' * 1200}</body></worldbody>")),
    ],
    ids=["URDF", "SDF", "MJCF", "MJCF of many joints"],
)
def test_deep_tree_is_refused(name: str, text: str, tmp_path: Path) -> None:
    """No robot is nested so deep, and no stack is as deep as a file may be."""
    assert "nested too deep" in refusal(write(tmp_path, text, name)).remedy


def test_long_chain_of_fixed_links_is_one_link(tmp_path: Path) -> None:
    """However many links hang one on the other."""
    links = "".join(
        f'<link name="n{k}"/><joint name="j{k}" type="fixed"><parent link="'
        f'{f"n{k - 1}" if k else "body"}"/><child link="n{k}"/></joint>'
        for k in range(1200)
    )
    robot = load_robot(write(tmp_path, urdf().replace("</robot>", f"{links}</robot>")))
    assert robot.mass == pytest.approx(18.6)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1"])
def test_encoding_that_is_declared_is_read(encoding: str, tmp_path: Path) -> None:
    """Names keep their letters."""
    head = f'<?xml version="1.0" encoding="{encoding.removesuffix("-sig")}"?>'
    text = head + sdf().replace("FL_hip", "Fé_hip")
    (tmp_path / "r.sdf").write_bytes(text.encode(encoding))
    robot = load_robot(str(tmp_path / "r.sdf"))
    assert robot.joint_names[0] == "Fé_hip_joint"
    np.testing.assert_array_equal(
        figures(robot), figures(load_robot(write(tmp_path, sdf(), "p.sdf")))
    )


@pytest.mark.parametrize("encoding", ["klingon", "utf-32"])
def test_encoding_that_is_not_the_files_is_refused(encoding: str, tmp_path: Path) -> None:
    """Whether nobody knows it or it is another one."""
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    assert "encoding" in refusal(write(tmp_path, head + sdf(), "r.sdf")).remedy


def test_file_that_is_hidden_has_a_name(tmp_path: Path, own_cache: Path) -> None:
    """A file may be called .urdf: its robot is called something."""
    assert load_robot(write(tmp_path, urdf(), ".urdf")).name == "robot"
    assert next((own_cache / "robots").iterdir()).name.startswith("robot-")
