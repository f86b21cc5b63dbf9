"""A sweep that is killed again and again: is anything lost, done twice, or another in the end?

A study of short walks in physics is begun by the command, killed by SIGKILL at a random moment,
gone on with by --resume, killed again, and so on, and at last left to end. Its table must then be,
byte by byte, that of the same study left alone. Every second time the command alone is killed and
not its processes: they have to end by themselves. A moment is so many seconds, drawn, after the
beginning or, so that the sweep gets on, after its first new trial, which is drawn too. Run it from
the repository's top:

    python -m benchmarks.sweep_kills --kills 20
    python -m benchmarks.sweep_kills --memory 200

The second measures instead how much memory the processes of a sweep of so many trials take.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from benchmarks.common import provenance
from benchmarks.page import commit

ROOT = Path(__file__).resolve().parents[1]
STUDY = """\
description: Short walks in physics
scenario: flat_walk
set: ["mission=[{{kind: {task}}}]"]
trials: {trials}
vary:
  - {{path: simulation.friction, uniform: [0.5, 1.25]}}
  - {{path: disturbances.mass_factor, uniform: [0.9, 1.1]}}
"""
WALK, STAND = "walk, distance: 0.3", "stand, duration: 0.5"
BY_ITSELF = 5.0  # [s] in which processes have to end whose sweep was killed


def words(directory: Path, out: str, *more: str) -> list[str]:
    """The command."""
    study, to = str(directory / "study.yaml"), str(directory / out)
    return [sys.executable, "-m", "drake_quad", "sweep", study, "--out", to, *more]


def complete(directory: Path, out: str, *more: str) -> float:
    """Carries the study out, or on, to its end; the wall time [s]."""
    begun = time.perf_counter()
    subprocess.run(
        words(directory, out, *more), check=True, stdout=subprocess.DEVNULL, cwd=ROOT, stderr=None
    )
    return time.perf_counter() - begun


def trials_done(out: Path) -> list[dict[str, Any]]:
    """The whole lines of the journal, its head apart; what is half a line does not count."""
    with suppress(FileNotFoundError):
        lines = (out / "journal.jsonl").read_text(encoding="utf-8").split("\n")[:-1]
        return [json.loads(line) for line in lines[1:]]
    return []


def kill_once(directory: Path, *, new: int, after: float, group: bool) -> None:
    """Goes on with the sweep, and kills it so many seconds [s] after so many new trials.

    Raises:
        RuntimeError: It was done before, or processes of it live on.
    """
    out = directory / "killed"
    known = len(trials_done(out))
    process = subprocess.Popen(
        words(directory, "killed", "--workers", "2", "--resume"),
        start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=ROOT,
    )  # fmt: skip
    while process.poll() is None and len(trials_done(out)) < known + new:
        time.sleep(0.05)
    with suppress(subprocess.TimeoutExpired):
        status = process.wait(after)
        raise RuntimeError(f"the sweep ended (status {status}) before all kills: take more trials")
    if group:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()
    until = time.monotonic() + BY_ITSELF
    with suppress(ProcessLookupError):  # there is none left
        while time.monotonic() < until:
            os.killpg(process.pid, 0)
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
        raise RuntimeError("processes of a killed sweep live on")


def kill_often(directory: Path, kills: int, longest: float, seed: int) -> dict[str, Any]:
    """Kills the sweep so often, lets it end, and compares it with one that was left alone.

    Args:
        directory: Holds the study.
        kills: How often.
        longest: Longest time from its beginning, or its first new trial, to its kill [s].
        seed: Seed of the moments.
    """
    rng, out = np.random.default_rng(seed), directory / "killed"
    lost = twice = amid = 0
    done: list[dict[str, Any]] = []
    for kill in range(kills):
        new, after = int(rng.integers(2)), float(rng.uniform(0.0, longest))
        kill_once(directory, new=new, after=after, group=kill % 2 == 0)
        now = trials_done(out)
        known = {one["index"]: one for one in now}
        lost += sum(known.get(one["index"]) != one for one in done)
        twice += len(now) - len(known)
        amid += len(now) == len(done)
        done = now
        tables = [path.name for path in out.glob("*.parquet")]
        if tables:
            raise RuntimeError(f"a sweep that was killed left {', '.join(tables)}")
        told = f"kill {kill + 1} of {kills}: {len(done)} trials done, {lost} lost"
        print(told, file=sys.stderr, flush=True)
    complete(directory, "killed", "--workers", "2", "--resume")
    complete(directory, "alone", "--workers", "1")
    now = trials_done(out)
    known = {one["index"]: one for one in now}
    lost += sum(known.get(one["index"]) != one for one in done)
    twice += len(now) - len(known)
    files = [directory / name / "trials.parquet" for name in ("killed", "alone")]
    whole = [file.read_bytes() for file in files]
    return {
        "kills": kills,
        "kills_without_a_new_trial": amid,
        "done_at_last_kill": len(done),
        "trials": len(known),
        "lost": lost,
        "twice": twice,
        "equal": whole[0] == whole[1],
    }


def measure_memory(directory: Path) -> dict[str, Any]:
    """Memory of the processes of a sweep with one worker at a time [MiB]."""
    complete(directory, "memory", "--workers", "1")
    rows = pq.read_table(directory / "memory" / "clock.parquet").to_pylist()
    processes: dict[int, list[float]] = {}
    for row in rows:
        processes.setdefault(row["process"], []).append(1024.0 * row["memory"])
    return {
        "trials": len(rows),
        "processes": len(processes),
        "after_first_trial": max(taken[0] for taken in processes.values()),
        "greatest": max(max(taken) for taken in processes.values()),
        "greatest_of_each": [round(max(taken)) for taken in processes.values()],
    }


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--trials", type=int, default=40, help="of the study that is killed")
    parser.add_argument("--longest", type=float, default=6.0, help="until a kill [s]")
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    parser.add_argument("--memory", type=int, metavar="TRIALS", help="measure memory instead")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Kills, or measures memory, and prints what came of it; status 1 if it is not as it was."""
    options = parse(arguments)
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        task, trials = (STAND, options.memory) if options.memory else (WALK, options.trials)
        (directory / "study.yaml").write_text(STUDY.format(task=task, trials=trials))
        if options.memory:
            found = measure_memory(directory)
        else:
            found = kill_often(directory, options.kills, options.longest, options.seed)
    if options.json:
        print(json.dumps(found))
    else:
        print(f"{task}; {commit()}; {provenance()}")
        print("\n".join(f"{name.replace('_', ' ')}: {value}" for name, value in found.items()))
    if not options.memory and (found["lost"] or found["twice"] or not found["equal"]):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
