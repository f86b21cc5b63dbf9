"""What is no regular file of a fair size is refused in a line, at once, by every reader."""

import io
import os
import shutil
import signal
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import sweep_rig as rig
from command import drake_quad, refused
from report_run import make_log, short_scenario, write_run
from synthetic_robot import Quadruped

from drake_quad.errors import InputError
from drake_quad.robot.importer.meshes import load_parts
from drake_quad.robot.loader import load_robot
from drake_quad.runs.read_summary import read_summary
from drake_quad.scenario.load import load_scenario
from drake_quad.sweep.compare import compare_sweeps
from drake_quad.sweep.journal import NAME, read_journal
from drake_quad.sweep.rebuild_report import rebuild_report
from drake_quad.sweep.report import check_page, write_sweep_report
from drake_quad.sweep.study_loading import load_study_and_base
from drake_quad.util import files as given_tables
from drake_quad.util.files import (
    MOST_MESH,
    MOST_TABLE,
    read_given,
    read_given_table,
    read_given_text,
)

LONGEST = 20  # [s] that a refusal may take


@pytest.fixture(autouse=True)
def _no_hang() -> Iterator[None]:
    """What waits for a pipe, or reads a device without end, is interrupted."""

    def fail(*_: object) -> None:
        raise TimeoutError("hangs")

    before = signal.signal(signal.SIGALRM, fail)
    signal.alarm(LONGEST)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def pipe(path: Path) -> None:
    """A FIFO that nobody writes to."""
    os.mkfifo(path)


def device(path: Path) -> None:
    """A device that never ends."""
    path.symlink_to("/dev/zero")


def large(path: Path) -> None:
    """A file of more bytes than any may have, that takes none of the disk."""
    with path.open("wb") as file:
        file.truncate(max(MOST_TABLE, MOST_MESH) + 1)


KINDS: dict[str, tuple[Callable[[Path], None], str]] = {
    "pipe": (pipe, "is a pipe"),
    "device": (device, "is a device"),
    "large": (large, "may have at most"),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a sweep, a run, a study and robots, each with all its files."""
    directory = tmp_path_factory.mktemp("given")
    told = rig.sweep_made_up(directory, directory / "sweep", command="drake-quad sweep study.yaml")
    write_sweep_report(rig.made(directory)[0], told, directory / "sweep")
    log = make_log(short_scenario(), seconds=0.1)
    write_run(directory / "run", log=log, versions={"drake": "1"})
    (directory / "study.yaml").write_text("scenario: mine.yaml\n")
    (directory / "mine.yaml").write_text("course: [{kind: floor, length: 3.0}]\n")
    text = Quadruped().text()
    (directory / "robot.urdf").write_text(text)
    visual = '<visual><geometry><mesh filename="mesh.obj"/></geometry></visual>'
    (directory / "meshed.urdf").write_text(text.replace("<inertial", f"{visual}<inertial", 1))
    (directory / "mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (directory / "own.robot.yaml").write_text("model: robot.urdf\n")
    (directory / "page.md").write_text("# Page\n")
    return directory


READERS: dict[str, Callable[[Path], Any]] = {
    "mine.yaml": lambda d: load_scenario(d / "mine.yaml"),
    "study.yaml": lambda d: load_study_and_base(d / "study.yaml"),
    "page.md": lambda d: check_page(d / "page.md", "study"),
    "robot.urdf": lambda d: load_robot(str(d / "robot.urdf")),
    "mesh.obj": lambda d: load_robot(str(d / "meshed.urdf")),
    "own.robot.yaml": lambda d: load_robot(str(d / "own.robot.yaml")),
    "run/summary.json": lambda d: read_summary(d / "run"),
    "run/log.parquet": lambda d: read_summary(d / "run"),
    "sweep/study.json": lambda d: rebuild_report(d / "sweep"),
    "sweep/sweep.json": lambda d: rebuild_report(d / "sweep"),
    "sweep/trials.parquet": lambda d: rebuild_report(d / "sweep"),
    "sweep/clock.parquet": lambda d: rebuild_report(d / "sweep"),
    f"sweep/{NAME}": lambda d: read_journal(d / "sweep"),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", READERS)
def test_each_reader_refuses_what_is_no_plain_file(
    whole: Path, tmp_path: Path, name: str, kind: str
) -> None:
    """In one line that names the file and says what it is; the file itself is read well."""
    place = tmp_path / "given"
    shutil.copytree(whole, place)
    if kind == "pipe":
        READERS[name](place)
    (place / name).unlink()
    make, said = KINDS[kind]
    make(place / name)
    with pytest.raises(InputError) as caught:
        READERS[name](place)
    line = str(caught.value)
    assert "\n" not in line and (Path(name).name in line or "'/dev/zero'" in line), line
    assert said in line or "no file that could be written anew" in line, line


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["mine.yaml", "robot.urdf"])
def test_what_a_file_names_is_refused_as_well(
    whole: Path, tmp_path: Path, name: str, kind: str
) -> None:
    """A study's scenario, and the robot's file that a .robot.yaml names."""
    place = tmp_path / "given"
    shutil.copytree(whole, place)
    (place / name).unlink()
    make, said = KINDS[kind]
    make(place / name)
    with pytest.raises(InputError, match=said):
        if name == "mine.yaml":
            load_study_and_base(place / "study.yaml")
        else:
            load_robot(str(place / "own.robot.yaml"))


OBJ = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\n"
GLTF = """{"asset": {"version": "2.0"}, "buffers": [{"uri": "\\u0061.bin", "byteLength": 36}],
"images": [{"uri": "a%2Epng"}]}"""
MESHES = {  # a mesh, what else it needs, and a file that is named in it or in that
    "mesh.obj": (OBJ, {}, "a.mtl"),
    "MESH.OBJ": (OBJ, {"a.mtl": "newmtl m\r\nmap_Kd -s 1 1 1 a.png\r\n"}, "a.png"),
    "mesh.gltf": (GLTF, {}, "a.bin"),
    "other.gltf": (GLTF, {"a.bin": ""}, "a.png"),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("element", ["visual", "collision"])
@pytest.mark.parametrize("name", MESHES)
def test_what_a_mesh_names_is_refused_as_well(
    tmp_path: Path, name: str, element: str, kind: str
) -> None:
    """Materials, pictures and buffers, before Drake's viewers or other readers wait for them."""
    text, others, named = MESHES[name]
    robot = Quadruped().text()
    mesh = f'<{element}><geometry><mesh filename="{name}"/></geometry></{element}>'
    (tmp_path / "robot.urdf").write_text(robot.replace("<inertial", f"{mesh}<inertial", 1))
    for file, content in {name: text, **others}.items():
        (tmp_path / file).write_text(content)
    make, said = KINDS[kind]
    make(tmp_path / named)
    with pytest.raises(InputError, match=said):
        load_robot(str(tmp_path / "robot.urdf"))


@pytest.mark.parametrize("kind", KINDS)
def test_a_mesh_that_trimesh_reads_opens_no_device(tmp_path: Path, kind: str) -> None:
    """Nor a pipe, nor too large a file: a binary glTF whose buffer is one has no surface."""
    json_part = b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "a.bin", "byteLength": 36}]}  '
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(json_part), len(json_part), 0x4E4F534A)
    (tmp_path / "mesh.glb").write_bytes(head + json_part)
    KINDS[kind][0](tmp_path / "a.bin")
    assert load_parts(tmp_path / "mesh.glb") == []


@pytest.mark.parametrize("name", ["study.json", "sweep.json"])
def test_a_comparison_waits_for_no_pipe(whole: Path, tmp_path: Path, name: str) -> None:
    """Whichever file of a sweep it is."""
    shutil.copytree(whole / "sweep", tmp_path / "sweep")
    (tmp_path / "sweep" / name).unlink()
    pipe(tmp_path / "sweep" / name)
    with pytest.raises(InputError, match=f"{name}.*is a pipe"):
        compare_sweeps(whole / "sweep", tmp_path / "sweep")


def test_the_commands_end_with_status_2(whole: Path, tmp_path: Path) -> None:
    """`report` of a run and of a sweep, and `sweep`, in one line each."""
    shutil.copytree(whole, tmp_path / "given")
    for name in ("run/summary.json", "sweep/sweep.json", "study.yaml"):
        (tmp_path / "given" / name).unlink()
        pipe(tmp_path / "given" / name)
    for words in (("report", "run"), ("report", "sweep"), ("sweep", "study.yaml")):
        assert "is a pipe" in refused(drake_quad(*words, cwd=tmp_path / "given"))


@pytest.mark.parametrize("name", [NAME, f".{NAME}.lock"])
def test_a_sweep_does_not_begin_in_a_pipe(tmp_path: Path, name: str) -> None:
    """Neither its journal nor its lock; what is there stays."""
    (tmp_path / "out").mkdir()
    pipe(tmp_path / "out" / name)
    with pytest.raises(InputError, match="--out"):
        rig.sweep_made_up(tmp_path, tmp_path / "out")
    assert (tmp_path / "out" / name).is_fifo()


def test_a_link_beside_a_result_is_not_followed(whole: Path, tmp_path: Path) -> None:
    """A file is filled beside its place: what somebody put there is not what is filled."""
    (tmp_path / "precious").write_text("as it was")
    out = tmp_path / "sweep"
    shutil.copytree(whole / "sweep", out)
    (out / ".report.html.part").symlink_to(tmp_path / "precious")
    rebuild_report(out)
    assert (tmp_path / "precious").read_text() == "as it was"
    assert "html" in (out / "report.html").read_text()


def test_a_file_is_read_to_the_byte(tmp_path: Path) -> None:
    """Up to the bound, and no further; its text has line ends as `read_text` makes them."""
    path = tmp_path / "some"
    path.write_bytes(b"a\r\nb\rc\n")
    assert read_given(path, most=7) == b"a\r\nb\rc\n"
    assert read_given_text(path, most=7) == path.read_text() == "a\nb\nc\n"
    with pytest.raises(OSError, match="at most"):
        read_given(path, most=6)
    with pytest.raises(IsADirectoryError):
        read_given(tmp_path, most=7)
    with pytest.raises(FileNotFoundError):
        read_given(tmp_path / "none", most=7)


def test_a_file_that_does_not_tell_its_size_is_bounded() -> None:
    """As those of /proc, which seem empty."""
    path = Path("/proc/self/status")
    assert path.stat().st_size == 0 and b"Name" in read_given(path, most=1 << 20)
    with pytest.raises(OSError, match="at most"):
        read_given(path, most=10)


def test_a_file_that_has_nothing_to_read_yet_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the kernel's log in /proc, a regular file by its kind that waits like a pipe."""
    path = tmp_path / "some"
    path.write_bytes(b"")

    class Waiting(io.FileIO):
        def read(self, _size: int | None = -1, /) -> Any:
            return None

    monkeypatch.setattr(os, "fdopen", lambda handle, _: Waiting(handle))
    with pytest.raises(OSError, match="nothing to read yet"):
        read_given(path, most=7)


def test_a_table_is_read_as_parquet_reads_it(tmp_path: Path) -> None:
    """With its kinds and notes, of all columns or of some; a table of no row, too."""
    for rows in (0, 10_000):
        table = pa.table(
            {"a": list(range(rows)), "b": ["x"] * rows, "c": [["y"]] * rows},
            schema=pa.schema(
                {"a": pa.int64(), "b": pa.string(), "c": pa.list_(pa.string())}, {"k": "v"}
            ),
        )
        pq.write_table(table, tmp_path / "t.parquet")
        found = read_given_table(tmp_path / "t.parquet", most_rows=10_000)
        assert found.equals(table) and found.schema.metadata == table.schema.metadata
        assert read_given_table(tmp_path / "t.parquet", ["b", "none"], most_rows=10_000).equals(
            table.select(["b"])
        )


def test_a_small_table_of_endless_rows_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By its rows before it is read; by what its text takes while it is."""
    path = tmp_path / "t.parquet"
    pq.write_table(pa.table({"a": np.full(3_000_000, 0.5)}), path)
    assert path.stat().st_size < 20_000
    monkeypatch.setattr(given_tables, "MOST_VALUES", 2_000_000)
    with pytest.raises(OSError, match="3000000 rows, and may hold 2999999"):
        read_given_table(path, most_rows=2_999_999)
    with pytest.raises(OSError, match="3000000 rows of 1 columns"):
        read_given_table(path, most_rows=3_000_000)
    monkeypatch.setattr(given_tables, "MOST_MEMORY", 50 * 1024 * 1024)
    pq.write_table(pa.table({"a": ["x" * 10_000] * 4096 * 3}), path)
    with pytest.raises(OSError, match="more than 50 MiB"):
        read_given_table(path, most_rows=3_000_000)


def test_no_log_or_table_is_read_that_holds_more_rows_than_any(whole: Path, tmp_path: Path) -> None:
    """A few kilobytes can be millions of rows, of each of which reports make a hundred numbers."""
    shutil.copytree(whole, tmp_path / "given")
    rows = pa.array([0.5] * 1_500_001)
    pq.write_table(pa.table({"t": rows, "margin": rows}), tmp_path / "given/run/log.parquet")
    with pytest.raises(InputError, match="1500001 rows, and may hold 1500000"):
        read_summary(tmp_path / "given" / "run")
    for name in ("trials", "clock"):
        pq.write_table(pa.table({"index": rows}), tmp_path / f"given/sweep/{name}.parquet")
        with pytest.raises(InputError, match="1500001 rows, and may hold 1000000"):
            rebuild_report(tmp_path / "given" / "sweep")
        shutil.copy(whole / f"sweep/{name}.parquet", tmp_path / f"given/sweep/{name}.parquet")
