"""A run of three seconds for the tests of its replays."""

import dataclasses
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from report_run import make_log, short_scenario, wave_begins, write_run

from drake_quad.runs.reader import RecordedRun, load_run
from drake_quad.runs.run_log import RunLog


@cache
def short_log() -> dict[str, Any]:
    """Of a walk: the columns, from before the first foot lifts."""
    return make_log(short_scenario(), seconds=3.0, start=wave_begins() - 1.5)


def short_run(directory: Path) -> RecordedRun:
    """The run, its files written into `directory`."""
    return load_run(write_run(directory, log=short_log()))


def glitched(run: RecordedRun, sample: int) -> RecordedRun:
    """The run, but in one sample the margin is negative."""
    margin = np.array(run.log.number("margin"))
    margin[sample] = -0.05
    return dataclasses.replace(run, log=RunLog({**run.log.columns, "margin": margin}))
