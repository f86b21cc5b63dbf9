"""What is compiled beforehand is what a run calls: the same kernels, with the same types."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drake_quad import jit as kernel_cache
from drake_quad.simulation import precompile

COURSE = """
course: [{kind: floor, length: 3.0}]
mission: [{kind: stand, duration: 0.1}]
"""
EVERYTHING = [
    "controller.kind=whole_body", "controller.period=0.002", "estimator.kind=ekf",
]  # fmt: skip
FELT = [*EVERYTHING, "sensors.contacts=joints"]
# After it the robot takes a step, and then many more, of which none calls another kernel.
PUSHED = [
    *EVERYTHING, "disturbances.pushes=[{time: 0.05, speed: 1.3, direction_deg: 90}]",
]  # fmt: skip


SCRIPT = """
import sys
from importlib import import_module
from itertools import count
from drake_quad.simulation import precompile
from drake_quad.feasibility.check_request import CheckRequest, run_check
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.run import simulate

felt, pushed = (
    parse_scenario({course!r}, source="test", overrides=overrides)
    for overrides in ({felt!r}, {pushed!r})
)
assert simulate(felt).outcome == "goal_reached"
chunks = count()
assert simulate(pushed, stop=lambda: next(chunks) >= 3).outcome == "stopped"
assert run_check(CheckRequest("paper_quadruped", rise=0.15, run=0.35, count=3))["feasible"]
for group in precompile._kernels().values():
    for path, types in group.items():
        module, name = path.rsplit(".", 1)
        kernel = getattr(import_module("drake_quad." + module), name)
        called = [tuple(signature) for signature in kernel.signatures]
        assert called == [types], (path, called)
"""


def test_every_kernel_that_is_called_is_in_the_table() -> None:
    """A run on estimates and a check, in a process of their own, call all, with its types alone."""
    script = SCRIPT.format(course=COURSE, felt=FELT, pushed=PUSHED)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


def test_every_group_is_compiled_by_some_command() -> None:
    """No group of the table is forgotten, and none is asked for that is not there."""
    parts = {*precompile.kernels_for("whole_body", "ekf", "joints"), *precompile.DESIGN}
    assert {group for part in parts for group in part.split("+")} == set(precompile._kernels())
    assert "forces" not in "+".join(precompile.kernels_for("ik", "truth", "feet"))


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cache that has no kernel."""
    monkeypatch.setenv("DRAKE_QUAD_CACHE", str(tmp_path / "cache"))
    own = kernel_cache.kernel_directory.__wrapped__
    monkeypatch.setattr(kernel_cache, "kernel_directory", own)
    monkeypatch.setattr(precompile, "kernel_directory", own)


@pytest.mark.long
@pytest.mark.usefixtures("empty_cache")
def test_processes_compile_what_is_missing_and_say_so() -> None:
    """Two at once on one cache do not break each other; the second time there is nothing to do."""
    command = [sys.executable, "-P", "-m", "drake_quad.simulation.precompile", "loop"]
    said: list[str] = []
    assert precompile._missing(["loop"])
    with subprocess.Popen(command) as other, precompile.precompiling(["loop"], said.append) as wait:
        wait()
        assert precompile._missing(["loop"]) == []
        assert other.wait() == 0
    assert len(said) == 2 and "that this needs" in said[0] and "compiled" in said[1]
    with precompile.precompiling(["loop"], said.append) as wait:
        wait()
    assert len(said) == 2


@pytest.mark.usefixtures("empty_cache")
def test_an_error_while_kernels_compile_ends_the_processes() -> None:
    """Nothing goes on in the background that nobody waits for."""
    with pytest.raises(KeyboardInterrupt), precompile.precompiling(["loop"]):
        raise KeyboardInterrupt
    assert precompile._missing(["loop"])


def test_with_one_processor_nothing_is_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another process would only take its time from this one."""
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    assert precompile._begin(precompile.DESIGN) == []
