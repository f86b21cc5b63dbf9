"""The benchmarks' trials as those of `drake_quad.sweep`, and what comes of them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drake_quad.scenario.load import load_scenario
from drake_quad.sweep.study import Base, Study, find_base
from drake_quad.sweep.trials import Trial

COMMON = ("controller.kind=whole_body", "controller.period=0.002")
GOOD = ("ok", "goal_reached")  # outcomes

Result = dict[str, Any]


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


def study_of(scenario: str, overrides: Sequence[str]) -> tuple[Study, Base]:
    """The study of a scenario, a shipped one's name or a file, with these overrides in all trials.

    Raises:
        InputError: If there is no such scenario.
    """
    study = Study(scenario=scenario, set=list(overrides))
    base = find_base(study, directory=Path())
    base.load(study.set)
    return study, base


def make_trial(
    study: Study, base: Base, index: int, values: Sequence[Any], *,
    more: Sequence[str] = (), figures: Sequence[str], seed: int = 0,
) -> Trial:  # fmt: skip
    """A trial with `values` that has `more` overrides than those of the study."""
    return Trial(
        index=index,
        seed=seed,
        values=tuple(values),
        base=base,
        overrides=(*study.set, *more),
        figures=tuple(figures),
        success=(),
        wall_time=study.limits.wall_time,
        memory=study.limits.memory,
    )


def finding(trial: Trial, found: Result) -> Result:
    """What the engine wants of a trial, of its `outcome`, `reason` and figures."""
    return {
        "outcome": found["outcome"],
        "reason": " ".join(found["reason"].split()),
        "success": found["outcome"] in GOOD,
        "figures": {name: found.get(name) for name in trial.figures},
        "scenario": None,
        "clock": {},
    }
