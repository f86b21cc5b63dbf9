"""Robots that are called alike and are not are told apart by their files."""

from pathlib import Path

from drake_quad.robot.digest import MOST_READ, robot_digest

MODEL = '<mujoco><include file="legs.xml"/><asset><mesh file="trunk.obj"/></asset></mujoco>'


def robot(folder: Path, *, legs: str = "<mujoco/>", mesh: bytes = b"v 0 0 0\n") -> str:
    folder.mkdir()
    (folder / "robot.xml").write_text(MODEL)
    (folder / "legs.xml").write_text(legs)
    (folder / "trunk.obj").write_bytes(mesh)
    return robot_digest(str(folder / "robot.xml"))


def test_what_a_file_includes_and_names_counts_and_where_it_lies_does_not(tmp_path: Path) -> None:
    """One digit of a mass in an included file, or a point of a mesh, makes another robot."""
    light = '<mujoco><body><inertial mass="5"/></body></mujoco>'
    one = robot(tmp_path / "one", legs=light)
    assert robot(tmp_path / "elsewhere", legs=light) == one
    assert robot(tmp_path / "heavy", legs=light.replace("5", "9")) != one
    assert robot(tmp_path / "other", legs=light, mesh=b"v 0 0 1\n") != one


def test_great_meshes_are_known_by_name_and_size(tmp_path: Path) -> None:
    """A trial is not to read tens of megabytes: their contents do not count, their size does."""
    great = b"v 0 0 0\n" * (MOST_READ // 8 + 1)
    one = robot(tmp_path / "one", mesh=great)
    assert robot(tmp_path / "two", mesh=great.replace(b"0", b"1")) == one
    assert robot(tmp_path / "three", mesh=great + b"\n") != one


def test_overrides_that_say_nothing_make_no_other_robot(tmp_path: Path) -> None:
    """So a run's digest stays, when later versions know of more that could be said."""
    one = robot(tmp_path / "one")
    said = tmp_path / "one" / "my.robot.yaml"
    said.write_text("model: robot.xml\n")
    assert robot_digest(str(said)) == one
    said.write_text("model: robot.xml\nfoot_radius: 0.02\n")
    assert robot_digest(str(said)) != one
