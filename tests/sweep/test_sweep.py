"""Sweeps from end to end: nothing lost, nothing twice, the same to the bit, and honest rates."""

import json
import os
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import sweep_rig as rig
from command import COMMAND, drake_quad, refused
from scipy.stats import binom, fisher_exact

from drake_quad.errors import InputError
from drake_quad.sweep.compare import compare_sweeps
from drake_quad.sweep.findings import bins_of
from drake_quad.sweep.statistics import causes_of, rate_of
from drake_quad.sweep.study import Vary

KILLS = 2
LONG = rig.PLUMBING.replace("trials: 4", "trials: 30")


def rows(out: Path) -> list[dict[str, Any]]:
    return list(pq.read_table(out / "trials.parquet").to_pylist())


def test_one_worker_and_two_give_the_same_to_the_bit(tmp_path: Path) -> None:
    """By the command, of real runs: tables, and what is found; a row a trial, in order."""
    rig.study_file(tmp_path, rig.PLUMBING.replace("trials: 4", "trials: 2"))
    for workers in ("1", "2"):
        done = drake_quad(
            "sweep", "study.yaml", "--out", workers, "--workers", workers, "--json", cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
        told = json.loads(done.stdout)
        assert told["complete"] and told["rate"]["good"] == 4 and told["kinematic"]
    tables = [(tmp_path / name / "trials.parquet").read_bytes() for name in "12"]
    assert tables[0] == tables[1]
    found = rows(tmp_path / "1")
    assert [row["index"] for row in found] == list(range(4))
    assert all(row["outcome"] == "goal_reached" and row["scenario"] for row in found)
    clock = pq.read_table(tmp_path / "2" / "clock.parquet").to_pylist()
    assert len({row["process"] for row in clock}) == 2
    again = refused(drake_quad("sweep", "study.yaml", "--out", "1", cwd=tmp_path))
    assert "--resume" in again


def test_a_sweep_can_be_done_in_parts(tmp_path: Path) -> None:
    """The first five, then all: what there is then is what one sweep gives; none is done twice."""
    seen: list[int] = []
    part = rig.sweep_made_up(tmp_path, tmp_path / "a", limit=5)
    assert part["trials"] == 5 and part["asked"] == 8 and not part["complete"]
    schema = pq.read_schema(tmp_path / "a" / "trials.parquet")
    assert schema.metadata[b"complete"] == b"false"
    whole = rig.sweep_made_up(
        tmp_path, tmp_path / "a", resume=True, note=lambda index, *_: seen.append(index)
    )
    assert seen == [5, 6, 7] and whole["complete"]
    rig.sweep_made_up(tmp_path, tmp_path / "b")
    assert rows(tmp_path / "a") == rows(tmp_path / "b")


@pytest.mark.parametrize("change", [("4", "5"), ("0.5", "0.6"), ("flat_walk", "descend")])
def test_a_changed_study_is_not_gone_on_with(tmp_path: Path, change: tuple[str, str]) -> None:
    """Nor one of other sources; what is there stays as it is."""
    rig.sweep_made_up(tmp_path, tmp_path / "a", limit=2)
    journal = tmp_path / "a" / "journal.jsonl"
    kept = journal.read_bytes()
    with pytest.raises(InputError, match="another study"):
        rig.sweep_made_up(tmp_path, tmp_path / "a", rig.PLUMBING.replace(*change), resume=True)
    assert journal.read_bytes() == kept
    head, _, rest = kept.partition(b"\n")
    other = {**json.loads(head), "sources": "0"}
    journal.write_bytes(json.dumps(other).encode() + b"\n" + rest)
    with pytest.raises(InputError, match="other sources"):
        rig.sweep_made_up(tmp_path, tmp_path / "a", resume=True)


def test_half_a_line_is_done_again(tmp_path: Path) -> None:
    """A journal cut anywhere gives the whole table in the end, without a trial twice."""
    rig.sweep_made_up(tmp_path, tmp_path / "whole")
    kept = (tmp_path / "whole" / "journal.jsonl").read_bytes()
    first = kept.index(b"\n") + 1
    for cut in np.random.default_rng(1).integers(first, len(kept), size=4):
        out = tmp_path / f"cut{cut}"
        out.mkdir()
        (out / "journal.jsonl").write_bytes(kept[:cut])
        seen: list[int] = []
        rig.sweep_made_up(tmp_path, out, resume=True, note=lambda k, *_, s=seen: s.append(k))
        assert rows(out) == rows(tmp_path / "whole")
        assert len(seen) == 8 - (kept[:cut].count(b"\n") - 1)
    lines = (out / "journal.jsonl").read_bytes().splitlines()[1:]
    assert len({json.loads(line)["index"] for line in lines}) == len(lines) == 8


def test_something_else_is_no_journal(tmp_path: Path) -> None:
    """A file that no sweep wrote is refused, and left alone."""
    for text in ("{}\n", "hello\n", '{"study": 1}\n', "[]\n"):
        (tmp_path / "a").mkdir(exist_ok=True)
        (tmp_path / "a" / "journal.jsonl").write_text(text)
        with pytest.raises(InputError, match="journal"):
            rig.sweep_made_up(tmp_path, tmp_path / "a", resume=True)
        assert (tmp_path / "a" / "journal.jsonl").read_text() == text


SWEEPER = """
import sys
from pathlib import Path
sys.path[:0] = [{tests!r}]
import sweep_rig as rig
if __name__ == "__main__":
    more = dict(resume=True, work=rig.slow, carry_out=rig.here())
    rig.sweep_made_up(Path({home!r}), Path({home!r}) / "a", {text!r}, **more)
"""


@pytest.mark.long
def test_a_killed_sweep_loses_nothing_and_repeats_nothing(tmp_path: Path) -> None:
    """SIGKILL at random moments: what was done is there, and nothing that reads as a whole sweep.

    The journal that remains is that of a sweep that was left alone, each line once.
    """
    script = tmp_path / "sweeper.py"
    tests = str(Path(__file__).parents[1] / "support")
    script.write_text(SWEEPER.format(tests=tests, home=str(tmp_path), text=LONG))
    done: list[dict[str, Any]] = []
    for moment in np.random.default_rng(3).uniform(0.05, 0.3, size=KILLS):
        process = subprocess.Popen([sys.executable, script], start_new_session=True)
        began, journal = time.monotonic(), tmp_path / "a" / "journal.jsonl"
        before = len(done)
        while not journal.exists() or len(journal.read_bytes().splitlines()) < before + 3:
            assert time.monotonic() < began + 60.0 and process.poll() is None
            time.sleep(0.02)
        time.sleep(moment)
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert not (tmp_path / "a" / "trials.parquet").exists()
        lines = [line for line in journal.read_text().split("\n")[:-1]]
        now = [json.loads(line) for line in lines[1:]]
        assert now[: len(done)] == done and len(now) > len(done)
        done = now
    assert subprocess.run([sys.executable, script], check=False).returncode == 0
    rig.sweep_made_up(tmp_path, tmp_path / "b", LONG)
    assert rows(tmp_path / "a") == rows(tmp_path / "b")


def test_two_sweeps_at_once_are_refused(tmp_path: Path) -> None:
    """The second one into a directory says so, and the first goes on."""

    def meddle(_index: int, *_: Any) -> None:
        with pytest.raises(InputError, match="at work"):
            rig.sweep_made_up(tmp_path, tmp_path / "a", resume=True)

    assert rig.sweep_made_up(tmp_path, tmp_path / "a", note=meddle)["complete"]


@pytest.mark.long
def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    """Status 1, the tables of what is done, how to go on; and going on completes it."""
    rig.study_file(tmp_path, rig.PLUMBING.replace("trials: 4", "trials: 8"))
    page = tmp_path / "page.md"
    page.write_text("whole")
    process = subprocess.Popen(
        [*COMMAND, "sweep", "study.yaml", "--out", "a", "--workers", "1", "--page", "page.md"],
        cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    journal = tmp_path / "a" / "journal.jsonl"
    while not journal.exists() or len(journal.read_bytes().splitlines()) < 3:
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 1, stderr
    assert "--resume" in stdout and "Traceback" not in stderr
    # What was there of a whole study is not given up for a part of one.
    assert page.read_text() == "whole" and "drake-quad report a --page page.md" in stderr
    found = rows(tmp_path / "a")
    assert 2 <= len(found) < 16
    words = ["sweep", "study.yaml", "--out", "a", "--workers", "1", "--resume", "--json"]
    done = drake_quad(*words, cwd=tmp_path)
    assert done.returncode == 0 and json.loads(done.stdout)["trials"] == 16
    whole = {row["index"]: row for row in rows(tmp_path / "a")}
    assert all(whole[row["index"]] == row for row in found)


@pytest.mark.parametrize(("good", "trials"), [(0, 7), (3, 10), (97, 100), (320, 320)])
def test_bounds_are_exact(good: int, trials: int) -> None:
    """At each bound the binomial tail beyond what was seen is 2.5 %, or the bound is 0 or 1."""
    rate = rate_of(good, trials)
    assert 0.0 <= rate.low <= rate.rate <= rate.high <= 1.0
    if good:
        assert binom.sf(good - 1, trials, rate.low) == pytest.approx(0.025, rel=1e-6)
    if good < trials:
        assert binom.cdf(good, trials, rate.high) == pytest.approx(0.025, rel=1e-6)


def test_every_trial_is_in_one_band() -> None:
    """Of drawn numbers, of a grid, and of what is no number; ends belong somewhere."""
    success = [True, False, True, True]
    for vary, values in (
        (Vary(path="a", uniform=[0.0, 1.0]), [0.0, 0.2, 0.2, 1.0]),
        (Vary(path="a", normal=[0.0, 1.0], bands=3), [-9.0, 0.0, 0.1, 9.0]),
        (Vary(path="a", uniform=[0.0, 0.01], step=0.005, bands=7), [0.0, 0.005, 0.01, 0.01]),
        (Vary(path="a", values=[1, 2]), [1, 2, 2, 1]),
        (Vary(path="a", choice=["x", {"y": 1}]), ["x", {"y": 1}, "x", "x"]),
    ):
        bands = bins_of(vary, values, success)
        assert sum(b.rate.trials for b in bands) == 4 and sum(b.rate.good for b in bands) == 3
        assert all(x.high == y.low for x, y in pairwise(bands)
                   if vary.values is None and vary.choice is None)  # fmt: skip


def test_causes_that_differ_in_numbers_are_one() -> None:
    """Most frequent first, successes not among them."""
    outcomes = ["fell", "goal_reached", "fell", "stopped", "fell"]
    reasons = ["tilted by 41°", "", "tilted by 4.5e-1°", "late", "tilted by 1.234e+04°"]
    assert causes_of(outcomes, reasons) == [("fell: tilted by #°", 3), ("stopped: late", 1)]


def test_the_gate_decides_the_status(tmp_path: Path) -> None:
    """1 with fewer successes than asked for, 0 with as many."""
    for status in (0, 1):
        text = rig.PLUMBING + "gate: {rate: 1.0}\n"
        if status:
            text += "success: [{figure: margin.minimum, least: 9.0}]\n"
        rig.study_file(tmp_path, text)
        out = f"gate{status}"
        words = ["sweep", "study.yaml", "--out", out, "--limit", "2", "--workers", "1"]
        done = drake_quad(*words, cwd=tmp_path)
        assert done.returncode == status, done.stderr
        outcomes = {row["outcome"] for row in rows(tmp_path / out)}
        assert outcomes == {"bound_missed" if status else "goal_reached"}


def test_a_comparison_tells_worse_from_chance(tmp_path: Path) -> None:
    """The same trials are paired; of others Fisher's test decides, in either order."""
    rig.sweep_made_up(tmp_path, tmp_path / "a", LONG)
    rig.sweep_made_up(tmp_path, tmp_path / "b", LONG, work=rig.result)
    other = LONG.replace("30", "32") + "seed: 1\n"
    rig.sweep_made_up(tmp_path, tmp_path / "c", other)
    paired = compare_sweeps(tmp_path / "b", tmp_path / "a")
    fell = [row["index"] for row in rows(tmp_path / "a") if not row["success"]]
    assert paired.verdict == "worse" and paired.paired is not None and paired.paired["lost"] == fell
    assert paired.p == pytest.approx(min(1.0, 2.0 * 0.5 ** len(fell)))
    assert compare_sweeps(tmp_path / "a", tmp_path / "b").verdict == "better"
    apart = compare_sweeps(tmp_path / "a", tmp_path / "c")
    good = [sum(row["success"] for row in rows(tmp_path / name)) for name in "ac"]
    p = fisher_exact([[good[0], 60 - good[0]], [good[1], 64 - good[1]]]).pvalue
    assert apart.paired is None and apart.p == pytest.approx(p)
    assert apart.verdict == "no different"
    apart = compare_sweeps(tmp_path / "b", tmp_path / "c")
    p = fisher_exact([[60, 0], [good[1], 64 - good[1]]]).pvalue
    assert apart.verdict == "worse" and apart.p == pytest.approx(p) and p < 0.05
    done = drake_quad("compare", "b", "a", cwd=tmp_path)
    assert done.returncode == 1 and "worse" in done.stdout
    assert "trials.parquet" in refused(drake_quad("compare", "a", ".", cwd=tmp_path))
