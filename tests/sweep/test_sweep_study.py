"""Studies: which are read, and what is refused in a line."""

import re
from pathlib import Path
from typing import Any

import pytest
import sweep_rig as rig

from drake_quad.errors import InputError
from drake_quad.scenario.load import load_scenario
from drake_quad.sweep.sampling import Draws
from drake_quad.sweep.study import Study
from drake_quad.sweep.study_loading import load_study_and_base, parse_study
from drake_quad.sweep.trials import make_trials

ROOT = Path(__file__).resolve().parents[2]
HEAD = "scenario: flat_walk\n"

FRICTION = "{path: simulation.friction, values: [0.4, 0.5]}"
BAD = [
    ("", "document", "empty"),
    ("scenario: [\n", "document", "not YAML"),
    ("description: x\n", "scenario", "must say which"),
    (HEAD + "trails: 3\n", "trails", "trials"),
    (HEAD + "trials: 0\n", "trials", "1 or more"),
    (HEAD + "trials: 2000000\n", "trials", "at most"),
    (HEAD + "seed: -1\n", "seed", "negative"),
    (HEAD + "sampling: halton\n", "sampling", "random or sobol"),
    (HEAD + "vary: [{path: simulation.friction}]\n", "vary[0]", "one of"),
    (
        HEAD + "vary: [{path: simulation.friction, uniform: [0, 1], values: [1]}]\n",
        "vary[0]",
        "uniform and values",
    ),
    (HEAD + "vary: [{path: simulation.friction, uniform: [1, 0]}]\n", "vary[0].uniform", "lesser"),
    (HEAD + "vary: [{path: simulation.friction, uniform: [.nan, 1]}]\n", "uniform", "finite"),
    (HEAD + "vary: [{path: simulation.friction, values: []}]\n", "vary[0].values", "1 to"),
    (HEAD + "vary: [{path: simulation.friction, values: [.inf]}]\n", "vary[0].values", "finite"),
    (HEAD + "vary: [{path: simulation.friction, values: 3}]\n", "vary[0].values", "list"),
    (HEAD + "vary: [{path: 'a=b', values: [1]}]\n", "vary[0].path", "path"),
    (HEAD + "vary: [{path: simulation.fricton, values: [1]}]\n", "vary[0]", "friction"),
    (HEAD + "vary: [{path: simulation.friction, values: [-1]}]\n", "vary[0]", "more than 0"),
    (HEAD + "vary: [{path: 'course[7].rise', values: [1]}]\n", "vary[0]", "elements"),
    (HEAD + "vary: [{name: robot, cases: {a: [x]}}]\n", "vary[0].cases.a[0]", "path=value"),
    (HEAD + "vary: [{path: x, cases: {a: []}}]\n", "vary[0].cases", "neither path"),
    (
        HEAD + "vary: [{path: simulation.friction, values: [1]}, {path: simulation.friction, "
        "values: [2]}]\n",
        "vary[1]",
        "twice",
    ),
    (
        HEAD + "vary: [{path: simulation.friction, log_uniform: [1.0e-300, 1.0e+300]}]\n",
        "vary[0].log_uniform",
        "too far apart",
    ),
    (HEAD + 'description: "\\ud800"\n', "document", "half a letter"),
    (
        HEAD + 'vary: [{name: robot, cases: {"a\\ud800": []}}]\n',
        "document",
        "half a letter",
    ),
    (HEAD + "figures: [wall_time]\n", "figures[0]", "again"),
    (
        HEAD + "vary:\n" + "".join(f"  - {{path: a.b{k}, uniform: [0, 1]}}\n" for k in range(2000)),
        "vary",
        "at most 100",
    ),
    (
        HEAD + "set: [" + ", ".join("simulation.friction=1" for _ in range(2000)) + "]\n",
        "set",
        "at most 100",
    ),
    (
        HEAD
        + "vary: [{name: a, cases: {"
        + ", ".join(f"c{k}: ['a.b{k}=1']" for k in range(2000))
        + "}}]\n",
        "vary[0]",
        "one field too many",
    ),
    (
        HEAD + "vary: [{path: simulation.friction, uniform: [0.5, 1.0], step: 5.0e-324}]\n",
        "vary[0].step",
        "too small",
    ),
    (
        HEAD + f"vary: [{{path: simulation.seed, integers: [0, {10**400}]}}]\n",
        "vary[0].integers",
        "from -",
    ),
    ("scenario: ~nosuchuser/x\n", "scenario", "no such"),
    *[
        (f"{HEAD}vary: [{one}, {other}]\n", "vary[1]", "given twice: vary[0]")
        for one, other in (
            (FRICTION, "{name: ground, cases: {ice: ['simulation.friction=0.1']}}"),
            (
                "{name: a, cases: {x: ['gait.stride=1']}}",
                "{name: b, cases: {y: ['gait.stride=2']}}",
            ),
            (FRICTION, "{path: simulation, values: [{log_period: 0.01}]}"),
            ("{path: simulation, values: [{log_period: 0.01}]}", FRICTION),
            (
                "{path: 'course[0].length', values: [7.0, 8.0]}",
                "{path: ' course[00].length', values: [9.0]}",
            ),
        )
    ],
    (
        HEAD + "vary: [{path: disturbances.sensor_delay, uniform: [0.002, 0.008], step: 1}]\n",
        "vary[0].step",
        "nothing to draw",
    ),
    *[
        (HEAD + f"trials: 3\nset: [{given}]\nvary: [{vary}]\n", "trials", "be alike")
        for given, vary in [
            ("simulation.seed=3", FRICTION),
            ('"simulation={seed: 3}"', FRICTION),
            ("", "{path: simulation.seed, values: [1, 2]}"),
            ("", "{path: simulation, values: [{seed: 1}, {seed: 2}]}"),
            ("", "{name: a, cases: {x: [simulation.seed=1]}}"),
        ]
    ],
    *[
        (HEAD + f"vary: [{{path: simulation.friction, {axis}}}]\n", "vary[0].", "has one twice")
        for axis in ("values: [0.5, 0.5, 1.0]", "values: [1, 1.0]", "linspace: [0.5, 0.5, 3]")
    ],
    (
        HEAD
        + "vary: ["
        + ", ".join(f"{{name: a{k}, cases: {{x: []}}}}" for k in range(70))
        + "]\n",
        "vary",
        "at most 32",
    ),
    (
        HEAD + "success: [{figure: slip_max, least: 0.2}, {figure: slip_max, most: 0.1}]\n",
        "success[1]",
        "no trial can keep",
    ),
    (
        HEAD + "set: [design=auto]\nvary: [{path: gait.cycle_time, values: [6.0, 12.0]}]\n",
        "vary[0]",
        "the design fills that in",
    ),
    (HEAD + "success: [{figure: margin.minimum}]\n", "success[0]", "least or most"),
    (
        HEAD + "success: [{figure: margin.minimun, least: 0.1}]\n",
        "success[0].figure",
        "margin.minimum?",
    ),
    (HEAD + "figures: [margin]\n", "figures[0]", "number of summary.json"),
    (HEAD + "maps: [[a, b]]\n", "maps[0]", "varies"),
    (HEAD + "gate: {rate: 2}\n", "gate.rate", "from 0 to 1"),
    (HEAD + "gate: {rate: 0.5, each: robot}\n", "gate.each", "name or path of what varies"),
    (HEAD + "gate: {each: simulation.friction}\n", "gate.each", "give gate.rate"),
    (HEAD + "limits: {wall_time: 0}\n", "limits.wall_time", "from"),
    ("scenario: case_studdy\n", "scenario", "case_study"),
    (f"scenario: {'x' * 5000}\n", "scenario", "too long"),
]


@pytest.mark.parametrize(("text", "field", "also"), BAD)
def test_a_bad_study_gets_one_line(tmp_path: Path, text: str, field: str, also: str) -> None:
    """It names file or scenario, field and value, and says what would be right."""
    with pytest.raises(InputError) as caught:
        load_study_and_base(rig.study_file(tmp_path, text))
    line = str(caught.value)
    assert "\n" not in line and field in line and also in line


@pytest.mark.parametrize("path", sorted((ROOT / "studies").glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_studies_load(path: Path) -> None:
    """Each can be read, its scenario too, and its first trials' scenarios are as they say.

    In order from the first, each with its own seed and the values that the table tells of it.
    """
    study, base = load_study_and_base(path)
    assert study.description
    trials = list(make_trials(study, base, first=0, last=9))
    assert [trial.index for trial in trials] == list(range(min(9, Draws(study).count)))
    for trial in trials[:3]:
        scenario = base.load(list(trial.overrides))
        assert scenario.simulation.seed == trial.seed
        assert list(trial.values) == Draws(study).values(trial.index)
        for vary, value in zip(study.vary, trial.values, strict=True):
            for field in (vary.path, *vary.also) if vary.path else ():
                assert at(scenario, field) == value, field
            assert vary.cases is None or set(vary.cases[value]) <= set(trial.overrides)


def at(scenario: Any, field: str) -> Any:
    """What the scenario has in a field, for example `course[1].rise`."""
    for name in re.findall(r"\w+", field):
        scenario = scenario[int(name)] if name.isdigit() else getattr(scenario, name)
    return scenario


def test_parse_study_fills_in_defaults() -> None:
    """What is left out has the documented default."""
    study = parse_study("scenario: flat_walk\n", source="mine.yaml")
    assert study == Study(scenario="flat_walk")
    assert load_scenario("flat_walk").simulation.friction == 0.8


def test_numbers_that_yaml_takes_for_text_vary_as_numbers(tmp_path: Path) -> None:
    """1e-1 in a list of values is 0.1; the same in quotes is refused as a friction."""
    text = HEAD + "vary: [{path: simulation.friction, values: [1e-1, 2.0e-1, 5e-1]}]\n"
    (tmp_path / "study.yaml").write_text(text)
    study, _ = load_study_and_base(tmp_path / "study.yaml")
    assert study.vary[0].values == [0.1, 0.2, 0.5]
    (tmp_path / "study.yaml").write_text(text.replace("1e-1", "'1e-1'"))
    with pytest.raises(InputError, match=r"simulation\.friction = '1e-1'.*without quotes"):
        load_study_and_base(tmp_path / "study.yaml")


def test_a_long_list_is_tried_in_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study of 10 000 values is read in seconds: its ends are tried, and some between."""
    tried: list[list[str]] = []
    monkeypatch.setattr("drake_quad.sweep.study.Base.load", lambda _, given: tried.append(given))
    path = tmp_path / "study.yaml"
    path.write_text(
        HEAD
        + "vary: [{path: simulation.friction, linspace: [0.5, 1.5, 10000]},"
        + " {path: gait.cycle_time, values: [7.0, 8.0]}]\n"
    )
    load_study_and_base(path)
    asked = [one for given in tried for one in given]
    assert len(tried) <= 301 and len(set(asked)) == len(asked)
    assert {"simulation.friction=0.5", "simulation.friction=1.5"} <= set(asked)
    assert asked[-2:] == ["gait.cycle_time=7.0", "gait.cycle_time=8.0"]
