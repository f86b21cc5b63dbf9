"""Answers of `check` that are remembered, so that the same question is answered at once.

To choose a gait takes a minute, and who likes the answer asks again, to save the scenario. An
answer is remembered with all that it depends on: the question, the robot's files, the sources of
this package, and the versions of the libraries. It is plain values and a scenario's text, in the
user's cache directory; nothing of it is executed. Only flights that are climbed are remembered.
"""

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.robot.digest import robot_digest
from drake_quad.util.files import cache_directory, plain_of, private_directory, write_whole
from drake_quad.util.versions import digest_of_sources, versions

MOST_ANSWERS = 200  # a file has some 10 kB; the oldest go


@dataclass(frozen=True)
class Answer:
    """An answer that was given before.

    Attributes:
        report: What `feasibility_report` made of it.
        scenario: The designed scenario's YAML.
        when: When it was found, such as `2026-11-30 14:05`.
    """

    report: dict[str, Any]
    scenario: str
    when: str


def answer_key(question: Mapping[str, Any], model: str) -> str:
    """A digest of all that an answer depends on.

    Args:
        question: What is asked, as plain values.
        model: The robot's name or file.
    """
    robot = [model, str(Path(model).absolute()), robot_digest(model)]
    identity = [dict(question), robot, digest_of_sources(), versions()]
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:32]


def recall(key: str) -> Answer | None:
    """The answer to a question that was asked before; None if none is remembered, or whole."""
    folder = _folder()
    if folder is None:
        return None
    try:
        kept = plain_of((folder / f"{key}.json").read_bytes())
    except OSError:
        return None
    if kept is None or kept.get("key") != key:
        return None
    report, scenario, when = (kept.get(name) for name in ("report", "scenario", "when"))
    if not (isinstance(report, dict) and isinstance(scenario, str) and isinstance(when, str)):
        return None
    return Answer(report, scenario, when)


def remember(key: str, report: Mapping[str, Any], scenario: str) -> None:
    """Remembers an answer, if there is a directory that no other user can write to, and room."""
    folder = _folder()
    if folder is None:
        return
    when = f"{datetime.now():%Y-%m-%d %H:%M}"
    kept = {"key": key, "when": when, "report": dict(report), "scenario": scenario}
    text = json.dumps(kept) + "\n"
    with suppress(OSError, InputError):
        # By another name first: who reads at the same time finds a whole file, or none.
        write_whole(folder / f"{key}.json", lambda to: to.write_text(text, encoding="utf-8"))
        files = sorted(folder.glob("*.json"), key=lambda path: path.stat().st_mtime)
        for path in files[:-MOST_ANSWERS]:
            path.unlink(missing_ok=True)


def _folder() -> Path | None:
    """Where answers are; None if another user could write there."""
    folder = cache_directory() / "answers"
    return folder if private_directory(folder) else None
