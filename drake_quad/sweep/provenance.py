"""What a result depends on: the sources with their commit, libraries, and robots."""

import hashlib
import json
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

from drake_quad.robot.digest import robot_digest
from drake_quad.sweep.sampling import support_of
from drake_quad.sweep.study import Base, Study
from drake_quad.sweep.study_loading import as_plain, overrides_of
from drake_quad.util.versions import PACKAGE, digest_of_sources, versions

# Packages and modules that present runs, and have no part in one.
PRESENTING = ("report", "cli", "feasibility", "api", "__main__")
# Modules of this package on which what comes of a trial depends.
WORKING = ("sampling.py", "study.py", "study_checks.py", "study_loading.py", "trials.py")
# Fields of a study, and of what varies in it, that no trial depends on. A name is the title of a
# column, which the table gets anew from the study; a case's name is the mapping's key, and stays.
UNREAD_OF_STUDY = ("description", "maps", "gate")
UNREAD_OF_VARY = ("name", "bands")


def sources_digest() -> str:
    """A digest of all files that a trial depends on: two digests make two studies."""

    def left_out(parts: tuple[str, ...]) -> bool:
        package = parts[0].removesuffix(".py")
        return package in PRESENTING or (package == "sweep" and parts[-1] not in WORKING)

    return digest_of_sources(left_out)


@cache
def own_sources() -> str:
    """The digest as this process first saw it, about when it imported them."""
    return sources_digest()


def study_digest(study: Study, base: Base) -> str:
    """A digest of all that decides a study's trials: its fields, its scenario and its robots."""
    identity = {"study": fields_of_trials(as_plain(study)), "scenario": base.text or base.name}
    # Unsorted: the order of `cases` is that of the grid, and by it a trial's index has its case.
    digest = hashlib.sha256(json.dumps(identity).encode())
    digest.update(" ".join(robots_of(study, base)).encode())
    return digest.hexdigest()[:16]


def fields_of_trials(plain: dict[str, Any]) -> dict[str, Any]:
    """The fields of a study, as plain data, on which what comes of its trials depends.

    The others say how trials are presented and judged as a whole, and how processes are kept: a
    sweep may go on after they were changed.
    """
    kept = {name: value for name, value in plain.items() if name not in UNREAD_OF_STUDY}
    kept["vary"] = [
        {name: value for name, value in vary.items() if name not in UNREAD_OF_VARY}
        for vary in plain["vary"]
    ]
    # The result of a trial that ends by itself depends on none of the limits. But wall_time and
    # memory decide which trials do: with others a timeout of the journal might have been a success,
    # and the table would follow two rules. `retries` and `recycle` answer what happens to processes
    # from outside and how their memory grows, which no two sweeps have alike.
    kept["limits"] = {name: plain["limits"][name] for name in ("wall_time", "memory")}
    return kept


def robots_of(study: Study, base: Base) -> list[str]:
    """The digests of all robots of a checked study."""
    models = {base.load(study.set).robot.model}
    for vary in study.vary:
        for value in support_of(vary):
            own = overrides_of(vary, value)
            if any(text.lstrip().startswith("robot") for text in own):
                models.add(base.load([*study.set, *own]).robot.model)
    return sorted({robot_digest(model) for model in models})


@cache
def own_versions() -> str:
    """A digest of `versions`."""
    return hashlib.sha256(json.dumps(versions()).encode()).hexdigest()[:8]


def commit(*more: Path) -> str:
    """The commit of the sources and its date; empty if they are in no repository.

    Args:
        more: Further files to look at for changes since the commit.
    """

    def git(*words: str) -> str:
        command = ["git", "-C", str(PACKAGE), *words]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except OSError:
            return ""
        return done.stdout.strip() if done.returncode == 0 else ""

    if not git("ls-files", "__init__.py"):  # installed, perhaps amid somebody else's repository
        return ""
    name = git("show", "-s", "--format=%h of %cs", "HEAD")
    # One by one: a file in no repository, or in another, is no reason to pass over the rest.
    places = [".", *(str(path.resolve()) for path in more)]
    changed = any(git("status", "--porcelain", "--", place) for place in places)
    return name + (" with changes that are not committed" if name and changed else "")


def describe(study: Study, base: Base) -> dict[str, Any]:
    """What the journal holds of its study: a sweep goes on only where all of it is the same."""
    return {
        "study": study_digest(study, base),
        "sources": sources_digest(),
        "versions": versions(),
    }
