"""Hand-made sweeps for the tests of comparisons: trials that came out so, without running any."""

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from drake_quad.sweep.compare import Swept, swept
from drake_quad.sweep.study import Study, Vary
from drake_quad.sweep.study_loading import as_plain

Success = list[bool] | dict[int, bool]
CELLS = 35
# A scenario of which no run reads its seed.
STILL = (
    "estimator: {kind: truth}\nsensors: {contacts: feet}\nperception: {map: told}\n"
    "world: {random: false, tread_error: 0.0}"
)


def study_of(*, cells: int = 1, trials: int = 1000, **fields: Any) -> Study:
    grid = Vary(path="world.rise_error", linspace=[0.0, 0.01, cells])
    return Study(scenario="flat_walk", vary=[grid], trials=trials, **fields)


def swept_of(success: Success, study: Study, scenario: str = "") -> Swept:
    """Trials of a scenario that came out so; seeds follow the study's."""
    done = success if isinstance(success, dict) else dict(enumerate(success))
    seeds = [1000 * study.seed + index for index in done]
    columns = {
        "index": list(done),
        "seed": seeds,
        "success": list(done.values()),
        "outcome": ["goal_reached" if good else "fell" for good in done.values()],
        "reason": [""] * len(done),
        "overrides": [[*study.set, f"simulation.seed={seed}"] for seed in seeds],
        "scenario": [scenario] * len(done),
    }
    return swept(pa.table(columns), json.loads(json.dumps(as_plain(study))))


def files_of(
    directory: Path, success: Success, study: Study, digest: str = "", scenario: str = ""
) -> Path:
    """The same as the files that a sweep leaves and a comparison reads."""
    directory.mkdir()
    side = swept_of(success, study, scenario)
    pq.write_table(side.table, directory / "trials.parquet")
    found = {"study": digest, "commit": "", "complete": True}
    (directory / "sweep.json").write_text(json.dumps(found))
    (directory / "study.json").write_text(json.dumps({"definition": side.definition}))
    return directory
