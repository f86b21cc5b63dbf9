"""What a sweep takes with one worker and with two, and what it adds to the time of its trials.

The same small study is carried out by the command, into a directory that is thrown away, with each
number of workers in turn. Run it from the repository's top, on a machine that does nothing else:

    python -m benchmarks.sweep_throughput --trials 16

Processor time hardly depends on what else the machine does: what a sweep with two workers uses more
of it than one with one is what it would lose of the factor two on a machine of its own.

Trials compile the loop's kernels if the sources were changed, other kernels in other cells of the
study's grid: one of each is carried out first, and does not count.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from benchmarks.common import markdown_table, provenance
from benchmarks.page import commit
from drake_quad.sweep.sampling import Draws
from drake_quad.sweep.study_loading import load_study_and_base

ROOT = Path(__file__).resolve().parents[1]
HEADER = (
    "workers",
    "wall time [s]",
    "processor time [s]",
    "simulating, all trials [s]",
    "overhead",
    "of it: in the trials",
    "processes begin and end, wait for the last",
    "faster than the first",
)


@dataclass(frozen=True)
class Taken:
    """What a sweep took.

    Attributes:
        workers: Processes.
        wall: Wall time of the command, from its start to its end [s].
        processor: Processor time of the command and its processes [s].
        simulating: Wall time in the simulations of all trials together [s].
        trials: Wall time of all trials together, with reading, planning and figures [s].
        good: Trials that succeeded.
    """

    workers: int
    wall: float
    processor: float
    simulating: float
    trials: float
    good: int

    @property
    def overhead(self) -> float:
        """Of the workers' time that is no simulation, to that which is."""
        return (self.wall * self.workers - self.simulating) / self.simulating

    @property
    def in_trials(self) -> float:
        """The part of it within the trials."""
        return (self.trials - self.simulating) / self.simulating


def shrink(path: Path, trials: int, to: Path) -> Path:
    """Writes the study with so many trials to a cell of its grid, without a gate."""
    study = yaml.safe_load(path.read_text(encoding="utf-8"))
    study["trials"] = trials
    study.pop("gate", None)
    if (beside := path.parent / study["scenario"]).is_file():
        study["scenario"] = str(beside.resolve())
    to.write_text(yaml.safe_dump(study, sort_keys=False), encoding="utf-8")
    return to


def sweep(study: Path, workers: int, out: Path, *, limit: int | None = None) -> Taken:
    """Carries out the study by the command.

    Raises:
        RuntimeError: If it did not end well.
    """
    words = [sys.executable, "-m", "drake_quad", "sweep", str(study), "--json"]
    words += ["--out", str(out), "--workers", str(workers)]
    words += [] if limit is None else ["--limit", str(limit)]
    begun, used = time.perf_counter(), processor_time()
    done = subprocess.run(words, stdout=subprocess.PIPE, check=False, cwd=ROOT)
    wall = time.perf_counter() - begun
    if done.returncode:
        raise RuntimeError(f"the sweep ended with status {done.returncode}")
    told: dict[str, Any] = json.loads(done.stdout)
    clock = told["clock"]
    used = processor_time() - used
    return Taken(workers, wall, used, clock["simulating"], clock["wall"], told["rate"]["good"])


def processor_time() -> float:
    """Of all processes that were begun from here and have ended, and of theirs [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def row(taken: Taken, first: Taken) -> list[str]:
    """The table's row."""
    return [
        str(taken.workers),
        f"{taken.wall:.1f}",
        f"{taken.processor:.1f}",
        f"{taken.simulating:.1f}",
        f"{100.0 * taken.overhead:.1f} %",
        f"{100.0 * taken.in_trials:.1f} %",
        f"{100.0 * (taken.overhead - taken.in_trials):.1f} %",
        f"{first.wall / taken.wall:.2f}",
    ]


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--study", type=Path, default=ROOT / "studies" / "gate.yaml")
    parser.add_argument("--trials", type=int, default=8, help="to a cell of the study's grid")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], help="one after another")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    options = parser.parse_args(arguments)
    if min(options.trials, *options.workers) < 1:
        parser.error("--trials and --workers must be 1 or more")
    return options


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures, and prints the table."""
    options = parse(arguments)
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        study = shrink(options.study, options.trials, directory / "study.yaml")
        cells = Draws(load_study_and_base(study)[0]).cells
        sweep(study, 1, directory / "warm", limit=cells)
        taken = [
            sweep(study, workers, directory / f"sweep{k}")
            for k, workers in enumerate(options.workers)
        ]
    if options.json:
        print(json.dumps({"load": load, "sweeps": [vars(one) for one in taken]}))
        return
    print(f"{options.study.name}, {options.trials} trials to a cell; {commit()}; {provenance()};")
    print(f"load before it began: {load:.1f}\n")
    print(markdown_table(HEADER, [row(one, taken[0]) for one in taken]))


if __name__ == "__main__":
    main()
