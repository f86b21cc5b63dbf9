"""What a result depends on: the sources, and the commit that they are of."""

import hashlib
import json
import platform
import subprocess
from functools import cache
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Any

import drake_quad
from drake_quad.robot.robot_digest import robot_digest
from drake_quad.sweep.draws import extremes
from drake_quad.sweep.study import Base, as_plain, overrides_of
from drake_quad.sweep.study_config import Study

PACKAGE = Path(drake_quad.__file__).parent
# Rooms and modules that tell of runs, and have no part in one.
TELLING = ("report", "cli", "check", "chart", "inspect", "plan")
WORKING = ("work.py", "study.py", "draws.py", "trials.py", "designs.py")  # of this room


def sources_digest() -> str:
    """Of all files that a trial depends on: trials of two digests are not of one study."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        room = parts[0].removesuffix(".py").split("_")[0]
        if room in TELLING or (room == "sweep" and parts[-1] not in WORKING):
            continue
        digest.update("/".join(parts).encode() + b"\0" + path.read_bytes())
    models = Path(str(resources.files("drake_quad_models")))
    for path in sorted(models.iterdir()):
        if path.is_file() and path.suffix in (".urdf", ".xml", ".yaml"):
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def own_sources() -> str:
    """The digest as this process first saw it, about when it imported them."""
    return sources_digest()


def study_digest(study: Study, base: Base) -> str:
    """Of the study and its scenario, the robots included."""
    told = {"study": as_plain(study), "scenario": base.text or base.name}
    digest = hashlib.sha256(json.dumps(told, sort_keys=True).encode())
    digest.update(" ".join(robots_of(study, base)).encode())
    return digest.hexdigest()[:16]


def robots_of(study: Study, base: Base) -> list[str]:
    """The digests of all robots that a checked study has."""
    models = {base.load(study.set).robot.model}
    for vary in study.vary:
        for value in extremes(vary):
            own = overrides_of(vary, value)
            if any(text.lstrip().startswith("robot") for text in own):
                models.add(base.load([*study.set, *own]).robot.model)
    return sorted({robot_digest(model) for model in models})


@cache
def versions() -> dict[str, str]:
    """Of the libraries that a result depends on."""
    names = ("drake_quad", "drake", "numpy", "scipy", "piqp", "daqp", "numba")
    return {**{name: version(name) for name in names}, "python": platform.python_version()}


@cache
def own_versions() -> str:
    """A digest of them."""
    return hashlib.sha256(json.dumps(versions()).encode()).hexdigest()[:8]


def commit(*more: Path) -> str:
    """The commit of the sources and its date; empty if they are of none.

    Args:
        more: What else of the repository is looked at for changes since the commit.
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
    changed = git("status", "--porcelain", "--", ".", *map(str, more))
    return name + (" with changes that are not committed" if name and changed else "")


def describe(study: Study, base: Base) -> dict[str, Any]:
    """What the journal holds of its study: a sweep goes on only where all of it is the same."""
    return {
        "study": study_digest(study, base),
        "sources": sources_digest(),
        "versions": versions(),
    }
