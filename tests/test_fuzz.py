"""Whatever is given, there is a run or one clear line: no traceback, crash, hang or half result."""

import io
import json
import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pyarrow.parquet as pq
import pytest
import sweep_rig as rig
import yaml
from fuzz_cases import (
    FILE_KINDS,
    FILES,
    GENTLE,
    GENTLE_KIND,
    KINDS,
    Case,
    kind_of,
    make_case,
    pick,
)
from fuzz_files import fields_said
from hypothesis import given, strategies as st
from rich.console import Console
from synthetic_robot import Quadruped

from drake_quad.cli.studies import print_sweep
from drake_quad.errors import LONGEST_PATH, InputError, PlanningError
from drake_quad.feasibility.inspect_robot import describe_robot, print_robot
from drake_quad.robot.importer import pipeline as import_robot
from drake_quad.robot.importer.overrides import read_overrides
from drake_quad.robot.loader import load_robot
from drake_quad.scenario.load import parse_scenario
from drake_quad.sweep.compare import compare_sweeps
from drake_quad.sweep.executors import run_local
from drake_quad.sweep.report import write_section, write_sweep_report
from drake_quad.sweep.run import carry_out_study
from drake_quad.sweep.study import Base, Limits, Study
from drake_quad.sweep.study_loading import load_study_and_base, parse_study
from drake_quad.sweep.trials import Trial, count_trials, make_trials

LONGEST = 240.0  # [s] that a case may take before it counts as a hang; kernels compile once
# A case that could be is carried out on a course that is planned at once, for a moment.
MOMENT = ("mission=[{kind: stand, duration: 0.1}]", "simulation.log_period=0.05")
LONGEST_READ = 60.0  # [s], of a robot's file, which takes 0.1 s
SWEPT = ("trials.parquet", "sweep.json", "study.json", "journal.jsonl")
MOST_PLACES = 40.0  # [m] of a course; planning more is no hang, but takes long


def survive(case: Case, folder: Path) -> str:
    """Gives the case to the program as a person would.

    Returns:
        `refused`, `no plan`, `passed over` (long courses, designs: read and checked alone), or
        `simulate`.

    Raises:
        Exception: Whatever is no error on purpose: a finding.
    """
    try:
        return _do(case, folder)
    except InputError as error:
        line = str(error)
        begun = " ".join(error.source.split())[: LONGEST_PATH // 2]
        if "\n" in line or not error.remedy or not line.startswith(begun) or len(line) > 6000:
            raise AssertionError(f"no clear line: {line!r}") from None
        return "refused"
    except PlanningError as error:
        if not error.reason.strip() or "\n" in error.reason:
            raise AssertionError(f"no reason: {error.reason!r}") from None
        return "no plan"


def _do(case: Case, folder: Path) -> str:
    """As `survive`, of what is neither refused nor without a plan."""
    if case.kind == "result":
        _do_result(case, folder)
    elif FILES <= case.number < GENTLE:
        _read_robot(case, folder)
    elif case.kind.startswith("study"):
        path = folder / "study.yaml"
        path.write_text(case.text, encoding="utf-8")
        study, base = load_study_and_base(path)
        for trial in make_trials(study, base, first=0, last=3):
            try:
                base.load(list(trial.overrides))
            except InputError as error:
                assert "\n" not in str(error)
        _sweep(study, base, folder)
    elif case.kind.startswith("robot"):
        path = folder / "robot.urdf"
        path.write_text(case.text, encoding="utf-8")
        text = f"robot: {{model: {path}}}\ndesign: given\ncourse: [{{kind: floor, length: 6.0}}]\n"
        return _run(text, folder, MOMENT, physics=case.physics)
    else:
        return _run(case.text, folder, case.overrides, physics=case.physics)
    return "run"


def _read_robot(case: Case, folder: Path) -> None:
    """Reads a robot's file and tells all of it; what is told are numbers."""
    form = case.kind.partition(" ")[0]
    name = {"sdf": "robot.sdf", "mjcf": "robot.xml", "said": "mine.robot.yaml"}[form]
    (folder / "robot.urdf").write_text(Quadruped().text(), encoding="utf-8")
    (folder / name).write_bytes(case.text.encode("utf-8", errors="surrogateescape"))
    robot = load_robot(str(folder / name))
    told = describe_robot(robot, source=name)
    print_robot(told, Console(file=io.StringIO()))
    json.dumps(told, allow_nan=False)
    assert np.all(robot.q_lower < robot.q_upper)
    assert np.all(robot.effort > 0.0) and np.all(robot.speed > 0.0) and robot.foot_radius > 0.0


def _sweep(study: Study, base: Base, folder: Path) -> None:
    """The study's first trials, made up: its tables, its report, and what is printed of it."""
    out = folder / "swept"
    told = carry_out_study(study, base, out, rig.at_once, limit=4, work=rig.some_fell)
    write_sweep_report(study, told, out)
    write_section(folder / "page.md", told, "drake-quad sweep study.yaml", "study")
    print_sweep(told, out, Console(file=io.StringIO()))
    assert len(pq.read_table(out / "trials.parquet")) == min(4, count_trials(study))


def _run(text: str, folder: Path, overrides: tuple[str, ...], *, physics: bool) -> str:
    from drake_quad.runs.result import write_files
    from drake_quad.simulation.run import simulate

    scenario = parse_scenario(text, source="mine.yaml", base=folder, overrides=overrides)
    length = sum((e.length or 0.0) + (e.count or 0) * (e.run or 0.0) for e in scenario.course)
    if length + sum(sum(e.runs or []) for e in scenario.course) > MOST_PLACES:
        return "passed over"
    if scenario.design == "auto":
        return "passed over"  # minutes, of which other tests have some
    if physics:
        scenario = parse_scenario(
            text, source="mine.yaml", base=folder, overrides=(*overrides, *MOMENT)
        )
    else:
        scenario.simulation.mode = "kinematic"
        scenario.simulation.log_period = max(scenario.simulation.log_period, 0.5)
    scenario.simulation.realtime_rate = 0.0  # who asks for a slow pace gets it
    result = simulate(scenario, source="mine.yaml")
    fault = re.search(r"simulation failed: \w+(Error|Exception|Warning):", result.reason)
    assert not fault, result.reason
    write_files(result, result.scenario, folder / "run")
    return "run"


def _do_result(case: Case, folder: Path) -> None:
    """A sweep's files, one of them cut or spoilt: they are refused, or they are still whole."""
    rng = np.random.default_rng(case.number)
    whole = Path(str(folder) + "_whole")
    try:
        for name in ("a", "b"):
            rig.sweep_made_up(folder, whole / name, carry_out=rig.at_once)
        told = compare_sweeps(whole / "a", whole / "b")
        path = whole / "a" / pick(rng, SWEPT)
        kept = path.read_bytes()
        path.write_bytes(kept[: int(rng.integers(0, len(kept)))])
        if path.name == "journal.jsonl":
            again = rig.sweep_made_up(folder, whole / "a", carry_out=rig.at_once, resume=True)
            assert again["complete"]
        elif path.name == "trials.parquet" or _loads(path) is None:
            with pytest.raises(InputError):
                compare_sweeps(whole / "a", whole / "b")
        else:
            assert compare_sweeps(whole / "a", whole / "b") == told
    finally:
        shutil.rmtree(whole, ignore_errors=True)


def _loads(path: Path) -> Any:
    try:
        return yaml.safe_load(path.read_text()) if path.read_text().rstrip().endswith("}") else None
    except yaml.YAMLError:
        return None


def fuzz(trial: Trial) -> dict[str, Any]:
    """A case in a process of its own; its number is the trial's index."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz"))
    try:
        # Robots alone: kernels in a cache of its own would be compiled anew by every case.
        with patch.object(import_robot, "robots_directory", lambda: folder / "cache"):
            came = survive(make_case(trial.index), folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return {**rig.result(trial), "reason": came}


def fuzz_all(numbers: Sequence[int], workers: int = 2) -> Counter[tuple[str, str]]:
    """Carries out the cases of these numbers; by kind what came of them.

    Raises:
        AssertionError: With every finding, if there is one.
    """
    trials = [
        Trial(k, 0, (), Base("flat_walk"), (), (), (), wall_time=longest(k), memory=4.0)
        for k in numbers
    ]
    limits = Limits(recycle=400, retries=0)
    found = dict(run_local(trials, workers=workers, limits=limits, work=fuzz))
    bad = {
        k: f"{one['outcome']}: {one['reason']}" for k, one in found.items() if not one["success"]
    }
    listed = "\n".join(f"{k} ({kind_of(k)}): {bad[k]}" for k in sorted(bad))
    assert not bad, f"{len(bad)} of {len(found)} cases:\n{listed}"
    return Counter((kind_of(k), one["reason"]) for k, one in found.items())


def longest(number: int) -> float:
    """How long the case of that number may take [s]."""
    return LONGEST_READ if FILES <= number < GENTLE else LONGEST


def check_counts(counts: Counter[tuple[str, str]]) -> None:
    """The cases are worth something: every kind is there, some are refused, and some can be."""
    assert {kind for kind, _ in counts} == {*KINDS, *FILE_KINDS, GENTLE_KIND}
    assert {"refused", "run"} <= {came for _, came in counts}
    passed = sum(count for (_, came), count in counts.items() if came == "passed over")
    assert passed < 0.2 * counts.total()
    for form in ("sdf", "mjcf", "said"):
        assert {"refused", "run"} <= {came for kind, came in counts if kind.startswith(form)}
    gentle = {came: count for (kind, came), count in counts.items() if kind == GENTLE_KIND}
    assert gentle["run"] >= 0.5 * sum(gentle.values())


@pytest.mark.long
def test_some_cases() -> None:
    """A few of each kind."""
    numbers = [*range(32), *range(FILES, FILES + 33), *range(GENTLE, GENTLE + 10)]
    check_counts(fuzz_all(numbers, workers=1))  # beside other tests


@pytest.mark.slow
def test_thousands_of_cases() -> None:
    """The same, of more."""
    check_counts(
        fuzz_all(
            [*range(32, 2200), *range(FILES + 33, FILES + 2200), *range(GENTLE + 10, GENTLE + 300)]
        )
    )


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner),
    max_leaves=8,
)
WORDS = st.sampled_from(
    ["course", "vary", "scenario", "trials", "set", "gait", "success", "limits"]
)


@pytest.mark.parametrize("parse", [parse_scenario, parse_study])
@given(data=st.dictionaries(WORDS | st.text(max_size=6), PLAIN, max_size=5) | PLAIN)
def test_data_of_any_shape_is_read_or_refused(parse: Callable[..., Any], data: Any) -> None:
    """Nested lists and mappings of anything, at any place, as YAML: an error is one line."""
    text = yaml.safe_dump(data)
    try:
        parse(text, source="mine.yaml")
    except InputError as error:
        assert "\n" not in str(error) and error.remedy


@given(data=st.dictionaries(st.sampled_from([*fields_said(), "feet", 1]), PLAIN, max_size=6))
def test_robot_yaml_of_any_shape_is_read_or_refused(data: Any) -> None:
    """Anything as any of its fields, beside a model: an error is one line that names the file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mine.robot.yaml"
        path.write_text(yaml.safe_dump({"model": "robot.urdf", **data}))
        try:
            read = read_overrides(path)
        except InputError as error:
            assert "\n" not in str(error) and error.remedy and error.source == path.name
        else:
            assert np.isfinite([*(read.effort or ()), *(read.knee or ())]).all()
