"""The independent checker: accepts what is true, refuses what was changed, and shares no code."""

import ast
import copy
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from certificate_rig import SCRIPTS, record_of, refusal
from hypothesis import given, settings, strategies as st

SPARE = {"numpy", *(path.stem for path in SCRIPTS.glob("certificate_*.py"))}


@pytest.mark.parametrize("name", ["case_study", "flat_walk", "spin_both_ways", "descend"])
def test_certificates_are_accepted(name: str) -> None:
    """By bounds of another kind than those that they were found with."""
    assert refusal(record_of(name)) is None


def test_checker_shares_no_code_with_the_planner() -> None:
    """The script and its modules import numpy, each other, and the standard library."""
    for path in (SCRIPTS / "check_certificate.py", *SCRIPTS.glob("certificate_*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            for name in names:
                library = name.split(".")[0]
                assert library in SPARE or library in sys.stdlib_module_names | {"pydrake"}, path
                assert library != "pydrake" or path.name == "certificate_robot.py"


def numbers_of(record: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The paths to all numbers of a record."""
    if isinstance(record, dict):
        return [p for k, v in record.items() for p in numbers_of(v, (*path, k))]
    if isinstance(record, list):
        return [p for k, v in enumerate(record) for p in numbers_of(v, (*path, k))]
    return [path] if isinstance(record, int | float) else []


def change(record: Any, path: tuple[Any, ...], by: float) -> None:
    """Adds to one number of a record, in place."""
    for key in path[:-1]:
        record = record[key]
    record[path[-1]] = record[path[-1]] + by


@given(place=st.floats(0.0, 1.0, exclude_max=True), by=st.sampled_from([1e-9, -1e-3, 0.1]))
@settings(max_examples=30, deadline=None)
def test_any_number_changed_is_noticed(place: float, by: float) -> None:
    """By the hash, whatever it is and however little."""
    record = record_of("spin_both_ways")
    paths = numbers_of(record)
    path = paths[int(place * len(paths))]
    before = json.dumps(record)
    change(record, path, by)
    if json.dumps(record) != before:
        assert refusal(record) is not None


def untrue(record: dict[str, Any], kind: str) -> str:
    """Makes a record untrue or no motion, in place; returns a word of why it has to be refused."""
    task = record["tasks"][1]
    segment = task["segments"][0]
    if kind == "margin":
        segment["margin"] += 5e-4
        return "margin"
    if kind == "foot":
        for t in record["tasks"]:
            for s in t["segments"]:
                s["foot_clearance"] += 1e-3
        return "swing foot"
    if kind == "shank":
        for s in task["segments"]:
            s["shank_clearance"] += 1e-3
        return "shank"
    if kind == "joints":
        segment["joint_room"] += 5e-3
        return "joint"
    if kind == "torque":
        segment["torque_room"] += 5e-3
        return "torque"
    if kind == "body":
        task["control"][30][1] += 0.3
        return "not as claimed"
    if kind == "mass":
        record["robot"]["link_masses"][0][2] += 20.0
        return "not as claimed"
    if kind == "foothold":
        task["steps"][2]["to"][2] += 0.01
        return "ground"
    if kind == "jump":
        record["tasks"][2]["feet"][0][0] += 0.01
        return "jumps"
    if kind == "body jump":
        for p in record["tasks"][2]["control"]:
            p[0] += 0.01
        return "jumps"
    if kind == "small jump":  # of the height, by a hundredth of a millimetre
        for p in record["tasks"][2]["control"]:
            p[2] += 1e-5
        return "the body jumps"
    if kind == "speed":
        record["tasks"][1]["control"][0][3] += 1e-4
        record["tasks"][1]["control"][2][3] -= 1e-4  # the pitch itself stays
        return "speed jumps"
    if kind == "acceleration":
        record["tasks"][1]["control"][-1][2] += 1e-5
        record["tasks"][1]["control"][-2][2] -= 0.5e-5
        record["tasks"][1]["control"][-3][2] += 1e-5
        return "acceleration jumps"
    if kind == "moving at first":
        for p, by in zip(record["tasks"][0]["control"], (-1e-4, 0.0, 1e-4), strict=False):
            p[0] += by
        return "at rest"
    if kind == "hole":
        del task["partition"][5], task["shares"][5]
        task["partition"][5] += 0.1
        return "not as claimed"
    if kind == "short":
        task["duration"] += 10.0
        return "short"
    if kind == "segment":
        task["segments"][1]["start"] += 1.0
        return "gap"
    if kind == "overlap":
        task["steps"][1]["lift_off"] = task["steps"][0]["touchdown"] - 0.5
        return "overlap"
    if kind == "less":
        record["claimed"]["margin"] += 0.01
        return "less than the whole"
    if kind == "asked":
        record["demanded"]["margin"] = record["claimed"]["margin"] + 0.01
        return "asked"
    if kind == "flying":
        step = task["steps"][3]
        middle = 0.5 * (step["lift_off"] + step["touchdown"])
        cell = next(k for k, t in enumerate(task["partition"]) if t > middle) - 1
        task["shares"][cell] = [0.25, 0.25, 0.25, 0.25]
        return "bears"
    if kind == "rolled":  # 1 mm as it is set down
        step, roll = task["steps"][3], task["roll"]
        at = min(range(len(roll["times"])), key=lambda k: abs(roll["times"][k] - step["touchdown"]))
        roll["offset"][at][step["leg"] - 1][0] += 1e-3
        return "set down"
    if (
        kind == "ice"
    ):  # nothing is claimed but that feet stand on balls, which roll four fifths as far
        segments = [s for t in record["tasks"] for s in t["segments"]]
        for claims in (record["demanded"], record["claimed"], *segments):
            claims.update(dict.fromkeys(record["claimed"], 0.0))
        for t in record["tasks"]:
            t["roll"]["offset"] = [
                [[0.8 * x for x in foot] for foot in at] for at in t["roll"]["offset"]
            ]
        return "roll"
    if kind == "slide":  # from one side to the other of where it is set down, in an instant
        roll, step = task["roll"], task["steps"][1]
        near = [abs(t - step["touchdown"]) for t in roll["times"]]
        at, row = near.index(min(near)), step["leg"] - 1
        first, second = copy.deepcopy(roll["offset"][at]), copy.deepcopy(roll["offset"][at])
        first[row][0], second[row][0] = -5e-3, 5e-3
        roll["offset"][at : at + 1] = [first, second]
        roll["times"][at : at + 1] = [step["touchdown"] - 1e-4, step["touchdown"] + 1e-4]
        return "no knot"
    if kind == "back":  # later than the swing is over
        task["steps"][1]["back"] = 1.1 * task["steps"][1]["lasts"]
        return "back on its way"
    raise ValueError(kind)


KINDS = (
    "margin", "foot", "shank", "joints", "torque", "body", "mass", "foothold", "jump", "body jump",
    "small jump", "speed", "acceleration", "moving at first",
    "short", "segment", "overlap", "less", "asked", "flying",
    "rolled", "ice", "slide", "back",
)  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_an_untrue_record_is_refused_even_with_its_hash_made_right(kind: str) -> None:
    """By what it says, not by the hash, and for the right reason."""
    record = record_of("descend")
    why = untrue(record, kind)
    told = refusal(record, rehash=True)
    assert told is not None and why in told, told


def test_a_clearance_that_nobody_looked_for_is_refused() -> None:
    """On level ground no riser is near, and yet no more is claimed than what is looked at."""
    record = record_of("flat_walk")
    record["claimed"]["foot_clearance"] = 1000.0
    for task in record["tasks"]:
        for segment in task["segments"]:
            segment["foot_clearance"] = 1000.0
    told = refusal(record, rehash=True)
    assert told is not None and "clearances above 0.1 m" in told


def test_command_says_what_it_found(tmp_path: Path) -> None:
    """Exit status 0 for a true certificate, 1 for a changed one, 2 for no file."""
    script = str(SCRIPTS / "check_certificate.py")

    def run(path: Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, script, str(path)], capture_output=True, text=True, check=False
        )

    record, path = record_of("spin_both_ways"), tmp_path / "certificate.json"
    path.write_text(json.dumps(record))
    good = run(path)
    assert good.returncode == 0 and "accepted" in good.stdout
    record["robot"]["trunk_mass"] += 1.0
    path.write_text(json.dumps(record))
    assert run(path).returncode == 1
    path.write_text("{}")
    bad = run(path)
    assert bad.returncode == 1 and "refused" in bad.stdout and "Traceback" not in bad.stderr
    assert run(tmp_path / "nowhere.json").returncode == 2


def test_record_survives_being_read_again() -> None:
    """Numbers come back to the bit from JSON."""
    record = record_of("flat_walk")
    assert json.loads(json.dumps(record)) == record
    assert np.all(np.isfinite(record["claimed"]["margin"]))


@pytest.mark.parametrize("script", ["check_certificate.py", "check_no.py"])
@pytest.mark.parametrize("kind", ["pipe", "device", "large", "deep", "directory"])
def test_what_is_no_plain_file_cannot_be_read(tmp_path: Path, script: str, kind: str) -> None:
    """In a line with status 2, at once: a pipe is not waited for, a device not read."""
    path = tmp_path / "given.json"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "large":
        with path.open("wb") as file:
            file.truncate(1 << 36)
    elif kind == "deep":
        path.write_text("[" * 200_000)
    else:
        path.mkdir()
    command = [sys.executable, str(SCRIPTS / script), str(path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "cannot be read" in done.stderr
