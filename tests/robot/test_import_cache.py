"""Imported robots are kept, found again, made anew when their files change, and never half."""

import os
from pathlib import Path

import pytest
from import_rig import write
from synthetic_robot import Quadruped

from drake_quad.errors import InputError
from drake_quad.robot.importer import pipeline as module
from drake_quad.robot.loader import MakeModelPlant, load_robot

TEXT = Quadruped().text()


@pytest.fixture(autouse=True)
def cache(own_cache: Path) -> Path:
    return own_cache / "robots"


def test_robot_is_imported_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second time nothing is made: the file of the first is read."""
    first = load_robot(write(tmp_path, TEXT)).url
    monkeypatch.setattr(module, "_make", lambda *_: pytest.fail("made again"))
    assert load_robot(str(tmp_path / "robot.urdf")).url == first
    assert load_robot(first).url == first
    MakeModelPlant(first)


def test_change_of_the_file_or_of_what_is_said_makes_another(tmp_path: Path) -> None:
    """Each content has its own normal form, and the old one stays for who uses it."""
    path = write(tmp_path, TEXT)
    first = load_robot(path)
    write(tmp_path, TEXT.replace('<mass value="12.0"/>', '<mass value="13.0"/>'))
    second = load_robot(path)
    said = load_robot(write(tmp_path, "model: robot.urdf\nspeed: [3, 3, 3]", "a.robot.yaml"))
    assert len({first.url, second.url, said.url}) == 3
    assert second.mass == pytest.approx(first.mass + 1.0)
    assert load_robot(first.url).mass == first.mass


def test_change_of_a_mesh_makes_another(tmp_path: Path) -> None:
    """The files that a robot's file names count as it does."""
    mesh = '<visual><geometry><mesh filename="part.obj"/></geometry></visual>'
    path = write(tmp_path, TEXT.replace('<link name="body">', f'<link name="body">{mesh}'))
    before = load_robot(path).url
    (tmp_path / "part.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    after = load_robot(path).url
    os.utime(tmp_path / "part.obj", (1, 1))
    assert len({before, after, load_robot(path).url}) == 3


def test_import_that_fails_leaves_nothing(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever stops it, the cache holds no half of a robot."""

    def stop(*_: object, **__: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "make_urdf", stop)
    with pytest.raises(KeyboardInterrupt):
        load_robot(write(tmp_path, TEXT))
    assert list(cache.iterdir()) == []


def test_half_a_robot_is_made_whole(tmp_path: Path, cache: Path) -> None:
    """A folder without its URDF, as a full disk may leave it, is replaced."""
    url = Path(load_robot(write(tmp_path, TEXT)).url)
    text = url.read_text()
    url.unlink()
    assert load_robot(str(tmp_path / "robot.urdf")).url == str(url)
    assert url.read_text() == text


def test_place_that_cannot_be_written_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The line names the variable that gives another place."""
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("DRAKE_QUAD_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(InputError, match="set DRAKE_QUAD_CACHE to another directory"):
        load_robot(write(tmp_path, TEXT))


def test_normal_form_that_is_none_is_not_kept(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The line names the file that was given, and the next try starts anew."""
    monkeypatch.setattr(module, "make_urdf", lambda *_, **__: '<robot name="r"/>')
    path = write(tmp_path, TEXT)
    for _ in range(2):
        with pytest.raises(InputError) as caught:
            load_robot(path)
        assert caught.value.source == path
    assert list(cache.iterdir()) == []


def test_normal_form_whose_inertia_drake_would_replace_is_none(tmp_path: Path) -> None:
    """A mass below zero in a file of this form is refused as in any other."""
    shipped = Path(load_robot("paper_quadruped").url).read_text()
    light = shipped.replace('<mass value="', '<mass value="-', 1)
    with pytest.raises(InputError, match="mass"):
        load_robot(write(tmp_path, light))


@pytest.mark.parametrize("links", [("trunk",), ("FL_shank",), ("trunk", "RR_shank", "RR_thigh")])
def test_normal_form_without_the_mass_of_a_trunk_or_shank_is_none(
    tmp_path: Path, links: tuple[str, ...]
) -> None:
    """A file of this form that lacks `inertial` is refused as any other, with the link's name."""
    text = Path(load_robot("paper_quadruped").url).read_text()
    for link in links:
        start = text.index(f'<link name="{link}">')
        first, last = text.index("<inertial>", start), text.index("</inertial>", start)
        text = text[:first] + text[last + len("</inertial>") :]
    with pytest.raises(InputError, match=f"{links[0]}: mass.*has no mass"):
        load_robot(write(tmp_path, text))
