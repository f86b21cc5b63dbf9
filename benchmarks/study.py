"""What the studies share: records that survive an interrupt, exact bounds, and their page.

A study is a list of trials, each a dictionary that JSON can hold. Its records are a file of JSON
lines: first what the study is and of which sources, then a line for every trial that is done.
"""

import hashlib
import json
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from benchmarks.common import provenance
from drake_quad.errors import InputError
from drake_quad.scenario import load_scenario
from drake_quad.whole_files import write_whole

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ("drake_quad", "models", "benchmarks")  # what is looked at for changes since the commit
COMMON = ("controller.kind=whole_body", "controller.period=0.002")
CONFIDENCE = 0.95
OK = ("ok", "goal_reached")

TITLE = """\
# Robustness

How much the robot takes that its controller is not told of. Each section is written by the command
that it names, and holds figures of that command alone.
"""
SECTIONS = ("pushes", "blind stairs", "disturbances")  # in the page's order

Trial = dict[str, Any]
Result = dict[str, Any]


def sources_digest() -> str:
    """Of all files that a result depends on: trials of two digests are not of one study."""
    files = [*(ROOT / "drake_quad").rglob("*.py"), *(ROOT / "models").iterdir()]
    files += (ROOT / "benchmarks").glob("*_trials.py")
    digest = hashlib.sha256()
    for path in sorted(files):
        if path.is_file() and path.parent.name != "report":
            digest.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def commit() -> str:
    """The commit and its date, in words; says so where the sources are not the commit's."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True)
        return done.stdout.strip() if done.returncode == 0 else ""

    name = git("show", "-s", "--format=%h of %cs", "HEAD")
    if not name:
        return "sources without a commit"
    changed = git("status", "--porcelain", "--", *SOURCES)
    return f"commit {name}" + (" with changes that are not committed" if changed else "")


def with_common(scenario: str, overrides: Sequence[str]) -> tuple[str, ...]:
    """`overrides` after those of COMMON that `scenario` does not have of itself."""
    controller = load_scenario(scenario).controller
    own = {"controller.kind": controller.kind, "controller.period": controller.period}
    missing = []
    for override in COMMON:
        name, _, value = override.partition("=")
        if str(own[name]) != value:
            missing.append(override)
    return (*missing, *overrides)


def bounds(good: int, trials: int) -> tuple[float, float]:
    """Clopper and Pearson's exact bounds (Biometrika 1934) of a rate, at 95 %, two-sided."""
    if trials == 0:
        return 0.0, 1.0
    interval = binomtest(good, trials).proportion_ci(confidence_level=CONFIDENCE, method="exact")
    return float(interval.low), float(interval.high)


def rate_text(good: int, trials: int) -> str:
    """A rate with its bounds, for example `97.5 % (94.6 to 99.1 %)`."""
    if trials == 0:
        return "-"
    low, high = (100.0 * bound for bound in bounds(good, trials))
    return f"{100.0 * good / trials:.1f} % ({low:.1f} to {high:.1f} %)"


@dataclass
class Records:
    """The file of a study's trials, whole after every line.

    Attributes:
        path: Of the JSON lines.
        study: What the study is: records of any other are refused.
        done: The results so far, by the trial's number.
    """

    path: Path
    study: dict[str, Any]
    done: dict[int, Result] = field(default_factory=dict)

    def open(self, *, resume: bool) -> None:
        """Begins the file, or goes on with it.

        Raises:
            InputError: There is a file and `resume` is not asked for, or it is another study's.
        """
        if self.path.exists():
            if not resume:
                raise self._error("is there: go on with it by --resume, or give another file")
            self._read()
        # Written anew: the last line may be half of one.
        lines = [json.dumps(self.study), *(json.dumps(result) for result in self.done.values())]
        write_whole(self.path, lambda path: path.write_text("\n".join(lines) + "\n", "utf-8"))

    def add(self, trial: Trial, result: Result) -> None:
        """Appends what came of a trial."""
        whole = {**trial, **result}
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(whole) + "\n")
        self.done[trial["number"]] = whole

    def in_order(self) -> list[Result]:
        """The results so far, in the order of their numbers."""
        return [self.done[number] for number in sorted(self.done)]

    def _read(self) -> None:
        read = []
        for line in self.path.read_text(encoding="utf-8").splitlines():
            try:
                read.append(json.loads(line))
            except ValueError:
                break
        if not read or read[0] != json.loads(json.dumps(self.study)):
            raise self._error("holds another study, or one of other sources: begin a new file")
        self.done = {result["number"]: result for result in read[1:]}

    def _error(self, remedy: str) -> InputError:
        return InputError(source="--lines", field="file", value=str(self.path), remedy=remedy)


def describe(command: Sequence[str]) -> str:
    """The lines under a section's title: how it was made, of what."""
    return f"```\n{' '.join(command)}\n```\n\n{commit()}; {provenance()}.\n"


def write_section(out: Path, name: str, text: str) -> None:
    """Writes the section `name` of the page `out`; the other sections and all else stay."""
    page = out.read_text(encoding="utf-8") if out.exists() else TITLE
    for section in SECTIONS:
        if _marks(section)[0] not in page:
            page = page.rstrip("\n") + "\n\n" + "\n".join(_marks(section)) + "\n"
    begin, end = _marks(name)
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    page = pattern.sub(lambda _: f"{begin}\n{text.strip()}\n{end}", page, count=1)
    write_whole(out, lambda path: path.write_text(page, encoding="utf-8"))


def _marks(section: str) -> tuple[str, str]:
    return f"<!-- begin {section} -->", f"<!-- end {section} -->"
