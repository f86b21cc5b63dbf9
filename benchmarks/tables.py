"""Carries out studies behind tables of the documents, one after the other, at one commit.

    python -m benchmarks.tables --list
    python -m benchmarks.tables kicks_03 blind_stairs
    python -m benchmarks.tables

Each leaves a folder under --out: its log, its files, and `done.json` once it is done. What the
same sources have done is passed over, so that a later call goes on. The long studies `nominal` and
`robots` (600 trials), the contact solvers and the state estimator have their own commands. Pages
are not written: whoever reads a result puts it where it belongs, by the commands' own --page or
--out, or by hand.
"""

import argparse
import json
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.page import ROOT, commit
from drake_quad.sweep.provenance import own_sources

DONE, LOG = "done.json", "log.txt"
ERROR = re.compile(r"benchmarks\.\w+: ")  # how a study's error begins, which ends its log


@dataclass(frozen=True)
class TableStudy:
    """A study, and where its table is.

    Attributes:
        name: Short name.
        page: The page with its table, from the repository's top.
        minutes: About how long one core takes; `--workers` shares it out.
        command: The command as the page has it.
        files: Options by which it writes into its folder, `{}`, and goes on there.
    """

    name: str
    page: str
    minutes: int
    command: str
    files: str = ""


_LINES = "--lines {}/lines.jsonl --out {}/page.md"
_SWEPT = "--out {}/sweep"
TABLES = (
    TableStudy("contact", "docs/contact.md", 15,
               "drake-quad sweep studies/contact.yaml --workers 1", _SWEPT),
    TableStudy("kicks_03", "docs/robustness.md", 55,
               "python -m benchmarks.pushes --scenario case_study --speed 0.3 --moments 40 "
               "--directions 8 --tail 8 --to-goal 80 --workers 1", _LINES),
    TableStudy("kicks_06", "docs/robustness.md", 55,
               "python -m benchmarks.pushes --scenario case_study --speed 0.6 --moments 40 "
               "--directions 8 --tail 8 --to-goal 80 --workers 1", _LINES),
    TableStudy("kicks_10", "docs/robustness.md", 25,
               "python -m benchmarks.pushes --scenario case_study --speed 0.8 1.0 --moments 8 "
               "--directions 8 --tail 8 --to-goal 1000 --workers 1", _LINES),
    TableStudy("blind_stairs", "docs/robustness.md", 40,
               "python -m benchmarks.blind_stairs --seeds 24 --workers 1", _LINES),
    TableStudy("disturbed", "docs/robustness.md", 60,
               "python -m benchmarks.disturbed --controller whole_body --workers 1", _LINES),
    TableStudy("engines_slippery", "docs/success_maps.md", 50,
               "python -m benchmarks.cross_check --trials 40 --study studies/engines_slippery.yaml "
               "--engines lagged MuJoCo", "--lines {}/lines.jsonl --page {}/page.md"),
    TableStudy("engines_rough", "docs/success_maps.md", 60,
               "python -m benchmarks.cross_check --trials 40 --study studies/engines_rough.yaml "
               "--engines lagged MuJoCo", "--lines {}/lines.jsonl --page {}/page.md"),
    TableStudy("cross_check", "docs/success_maps.md", 40,
               "python -m benchmarks.cross_check --trials 10",
               "--lines {}/lines.jsonl --page {}/page.md"),
    TableStudy("gate", "docs/success_maps.md", 5, "drake-quad sweep studies/gate.yaml", _SWEPT),
    TableStudy("friction", "docs/success_maps.md", 40,
               "drake-quad sweep studies/friction.yaml", _SWEPT),
    TableStudy("kicks", "docs/success_maps.md", 120,
               "drake-quad sweep studies/kicks.yaml", _SWEPT),
    TableStudy("robots", "docs/robots.md", 90,
               "python scripts/robots_table.py --no-physics", "--lines {}/lines.jsonl"),
    TableStudy("ten_steps", "docs/robots.md", 20,
               "drake-quad sweep studies/ten_steps.yaml", _SWEPT),
    TableStudy("any_stairs", "docs/robots.md", 30,
               "drake-quad sweep studies/any_stairs.yaml", _SWEPT),
    TableStudy("limits", "docs/robots.md", 15, "drake-quad sweep studies/limits.yaml", _SWEPT),
    TableStudy("paper_grid", "docs/robots.md", 90,
               "drake-quad sweep studies/paper_grid.yaml", _SWEPT),
    TableStudy("push_budget", "docs/margins.md", 60,
               "python -m benchmarks.push_budget --trials 202 --seed 5 --sought 40"),
    TableStudy("region_walks", "docs/margins.md", 3, "python -m benchmarks.region_walks"),
    TableStudy("margin_demanded", "docs/margins.md", 20,
               "drake-quad sweep studies/margin_demanded.yaml", _SWEPT),
)  # fmt: skip


def words_of(study: TableStudy, directory: Path, workers: int | None) -> list[str]:
    """The command to run: this interpreter's, into the study's folder, going on if it was begun.

    Args:
        study: The study.
        directory: Its folder.
        workers: Number of processes; as the page has it if None.
    """
    folder = shlex.quote(str(directory))
    words = shlex.split(study.command) + shlex.split(study.files.replace("{}", folder))
    if workers is not None and "--workers" in words:
        words[words.index("--workers") + 1] = str(workers)
    elif workers is not None and words[0] == "drake-quad":
        words += ["--workers", str(workers)]
    begun = (directory / "lines.jsonl").exists() or (directory / "sweep" / "journal.jsonl").exists()
    if begun:
        words.append("--resume")
    python = [sys.executable, "-m", "drake_quad"] if words[0] == "drake-quad" else [sys.executable]
    return python + words[1:]


def is_done(directory: Path) -> bool:
    """Whether these sources have done the study of that folder."""
    try:
        told = json.loads((directory / DONE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(told, dict) and told.get("sources") == own_sources()


def carry_out(study: TableStudy, directory: Path, workers: int | None) -> int:
    """Runs a study: 0 if it came to its end, also with a finding (status 1); else its status."""
    directory.mkdir(parents=True, exist_ok=True)
    with (directory / LOG).open("a", encoding="utf-8") as log:
        words = words_of(study, directory, workers)
        log.write(f"{shlex.join(words)}\n")
        log.flush()
        status = subprocess.run(words, cwd=ROOT, stdout=log, stderr=log, check=False).returncode
    last = (directory / LOG).read_text(encoding="utf-8").rstrip().rpartition("\n")[2]
    if status == 0 or (status == 1 and not ERROR.search(last)):
        told = {"sources": own_sources(), "commit": commit(), "status": status}
        (directory / DONE).write_text(json.dumps(told) + "\n", encoding="utf-8")
        return 0
    return status


def main(arguments: Sequence[str] | None = None) -> None:
    """Carries out the studies that are asked for and not done yet."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", help="which; all unless told")
    parser.add_argument("--list", action="store_true", help="tell names, pages and times, and end")
    parser.add_argument("--out", type=Path, default=Path("runs/tables"), help="folder")
    parser.add_argument("--workers", type=int, help="number of processes of each")
    asked = parser.parse_args(arguments)
    known = {study.name: study for study in TABLES}
    unknown = [name for name in asked.names if name not in known]
    if unknown:
        parser.error(f"there is no table {unknown[0]}; there are {', '.join(known)}")
    out, failed = asked.out.resolve(), []
    for study in [known[name] for name in asked.names] or TABLES:
        done = is_done(out / study.name)
        told = "done" if done else f"{study.minutes} minutes of a core"
        print(f"{study.name}: {study.page}, {told}", flush=True)
        if asked.list or done:
            continue
        status = carry_out(study, out / study.name, asked.workers)
        print(f"  ended with status {status}; look at {out / study.name}", flush=True)
        failed += [study.name] if status != 0 else []
    if failed:
        sys.exit(f"benchmarks.tables: not done: {', '.join(failed)}")


if __name__ == "__main__":
    main()
