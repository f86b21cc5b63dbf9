"""What a study's values must be: checked once, after reading, by their paths."""

import difflib
import math
from typing import Any

from drake_quad.errors import InputError
from drake_quad.scenario_override import parse_override
from drake_quad.summary_keys import FIGURES, WALL_CLOCK
from drake_quad.sweep.draws import GRID, Draws, axis_values, way_of
from drake_quad.sweep.study_check_vary import Fail, check_override, check_vary
from drake_quad.sweep.study_config import Study

MOST_TRIALS = 1_000_000
MOST_AXES = 32  # numpy's arrays have up to 64
MOST_VARIED = 100  # fields of the scenario that differ between trials
SEED = ("simulation", "seed")

Steps = tuple[str | int, ...]


def check_study(study: Study, *, source: str) -> None:
    """Raises `InputError` at the first value that no study can have.

    Args:
        study: As read; its types are right.
        source: What the error names as the holder of the field, the file.
    """

    def fail(field: str, value: Any, remedy: str) -> InputError:
        return InputError(source=source, field=field, value=value, remedy=remedy)

    if not study.scenario:
        raise fail("scenario", "", "must say which scenario: a shipped one's name, or a file")
    for path, words in (("sampling", ("random", "sobol")), ("draws", ("independent", "common"))):
        if getattr(study, path) not in words:
            raise fail(path, getattr(study, path), f"must be {' or '.join(words)}")
    if study.seed < 0:
        raise fail("seed", study.seed, "must not be negative")
    if len(study.vary) > MOST_VARIED or len(study.set) > MOST_VARIED:
        name = "vary" if len(study.vary) > MOST_VARIED else "set"
        remedy = f"at most {MOST_VARIED} can be given"
        raise fail(name, f"{len(getattr(study, name))} elements", remedy)
    for k, text in enumerate(study.set):
        check_override(text, f"set[{k}]", fail)
    for k, vary in enumerate(study.vary):
        check_vary(vary, f"vary[{k}]", fail)
    _check_names(study, fail)
    _check_counts(study, fail)
    _check_figures(study, fail)
    for name, least, most in (
        ("wall_time", 0.1, 1e6),
        ("memory", 0.5, 1024.0),
        ("retries", 0, 100),
        ("recycle", 1, 100_000),
    ):
        value = getattr(study.limits, name)
        if not least <= value <= most:
            raise fail(f"limits.{name}", value, f"must be from {least:g} to {most:g}")
    rate = study.gate.rate
    if rate is not None and not 0.0 <= rate <= 1.0:
        raise fail("gate.rate", rate, "must be from 0 to 1")
    each, names = study.gate.each, study.by_name()
    if each is not None and rate is None:
        raise fail("gate.each", each, "has no rate to ask for: give gate.rate, too")
    if each is not None and each not in names:
        known = ", ".join(sorted(names)) or "nothing here"
        raise fail("gate.each", each, f"must be the name or path of what varies: {known}")


def _check_names(study: Study, fail: Fail) -> None:
    """Nothing is varied twice, nor what it is part of, and maps name what varies."""
    titles: set[str] = set()
    seen: dict[Steps, int] = {}
    for k, vary in enumerate(study.vary):
        if vary.title in titles:
            raise fail(f"vary[{k}]", vary.title, "is given twice")
        titles.add(vary.title)
        own = [path for path in (vary.path, *vary.also) if path]
        if len({_steps_of(path) for path in own}) != len(own):
            raise fail(f"vary[{k}].also", vary.also, "names a path twice")
        cases = (vary.cases or {}).values()
        told = [*own, *(text.partition("=")[0] for overrides in cases for text in overrides)]
        mine: dict[Steps, int] = {}
        for path in told:
            steps = _steps_of(path)
            for before, j in seen.items() if steps not in mine else ():
                if all(a == b for a, b in zip(steps, before, strict=False)):
                    remedy = f"is given twice: vary[{j}] sets that or a part of it as well"
                    raise fail(f"vary[{k}]", path.strip(), remedy)
            mine[steps] = k
            if len(seen) + len(mine) > MOST_VARIED:
                remedy = f"is one field too many: at most {MOST_VARIED} can vary"
                raise fail(f"vary[{k}]", path.strip(), remedy)
        seen |= mine
    known = set(study.by_name())
    for k, pair in enumerate(study.maps):
        if len(pair) != 2 or pair[0] == pair[1] or not set(pair) <= known:
            remedy = f"must be two of {', '.join(sorted(known)) or 'what varies'}"
            raise fail(f"maps[{k}]", pair, remedy)


def _steps_of(path: str) -> Steps:
    return parse_override(f"{path}=0").steps


def _check_counts(study: Study, fail: Fail) -> None:
    """Trials are neither none nor too many, nor all the same."""
    if study.trials < 1:
        raise fail("trials", study.trials, "must be 1 or more")
    grid = [vary for vary in study.vary if way_of(vary) in GRID]
    if len(grid) > MOST_AXES:
        raise fail("vary", f"{len(grid)} axes", f"a grid has at most {MOST_AXES}")
    if study.trials > 1 and len(grid) == len(study.vary) and _seeds(study):
        remedy = "would be alike: simulation.seed is given, and nothing is drawn; give 1"
        raise fail("trials", study.trials, remedy)
    cells = math.prod(len(v.values or v.cases or "x") for v in study.vary)
    cells *= math.prod(int(v.linspace[2]) for v in study.vary if v.linspace)
    if cells * study.trials > MOST_TRIALS:
        remedy = f"makes {cells * study.trials} trials; at most {MOST_TRIALS}"
        raise fail("trials", study.trials, remedy)
    if study.sampling == "sobol" and len(Draws(study).drawn) > 1000:
        raise fail("sampling", study.sampling, "takes at most 1000 draws")


def _seeds(study: Study) -> bool:
    """Whether an override, or a value of the grid, has the seed of its trials."""
    told = [*study.set, *(o for v in study.vary for case in (v.cases or {}).values() for o in case)]
    given = [(one.steps, one.value) for one in map(parse_override, told)]
    for vary in study.vary:
        steps = [_steps_of(path) for path in (vary.path, *vary.also) if path]
        given += [(own, value) for own in steps for value in axis_values(vary)[:1]]
    return any(
        steps == SEED or (steps == SEED[:1] and isinstance(value, dict) and SEED[1] in value)
        for steps, value in given
    )


def _check_figures(study: Study, fail: Fail) -> None:
    """Figures are named, once each, and are the same whenever a trial is run."""
    for k, bound in enumerate(study.success):
        if not bound.figure:
            raise fail(f"success[{k}].figure", "", "must name a figure of summary.json")
        if bound.least is None and bound.most is None:
            raise fail(f"success[{k}]", bound.figure, "must say least or most")
        own = [other for other in study.success[: k + 1] if other.figure == bound.figure]
        least = max((one.least for one in own if one.least is not None), default=-math.inf)
        most = min((one.most for one in own if one.most is not None), default=math.inf)
        if least > most:
            remedy = f"no trial can keep least {least:g} and most {most:g}"
            raise fail(f"success[{k}]", bound.figure, remedy)
    named = [(f"success[{k}].figure", bound.figure) for k, bound in enumerate(study.success)]
    named += [(f"figures[{k}]", figure) for k, figure in enumerate(study.figures)]
    for field, figure in named:
        if figure in WALL_CLOCK:
            raise fail(field, figure, "must be a figure that a trial has again when run again")
        if figure not in FIGURES:
            near = difflib.get_close_matches(figure, FIGURES, n=1, cutoff=0.4)
            remedy = "must be a number of summary.json" + (f": {near[0]}?" if near else "")
            raise fail(field, figure, f"{remedy} (docs/log_format.md lists them)")
    if len(set(study.figures)) != len(study.figures):
        raise fail("figures", study.figures, "names one twice")
