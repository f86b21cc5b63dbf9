"""Studies: what is refused and how, and that a trial is of study and index alone."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sweep_rig as rig
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from drake_quad.errors import InputError
from drake_quad.scenario import load_scenario
from drake_quad.sweep.bands import bands_of
from drake_quad.sweep.draws import Draws, axis_values, draw
from drake_quad.sweep.study import load_study, parse_study, value_text
from drake_quad.sweep.study_config import Study, Vary
from drake_quad.sweep.trials import make_trials, repeat

ROOT = Path(__file__).resolve().parents[1]
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
        load_study(rig.study_file(tmp_path, text))
    line = str(caught.value)
    assert "\n" not in line and field in line and also in line


@pytest.mark.parametrize("path", sorted((ROOT / "studies").glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_studies_load(path: Path) -> None:
    """Each can be read, its scenario too, and its first trials' scenarios are as they say.

    In order from the first, each with its own seed and the values that the table tells of it.
    """
    study, base = load_study(path)
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


def study_of(*varies: Vary, **fields: Any) -> Study:
    return Study(scenario="flat_walk", vary=list(varies), **fields)


ONE = Vary(path="a", uniform=[2.0, 4.0])
WAYS = [
    ONE,
    Vary(path="b", log_uniform=[0.1, 10.0]),
    Vary(path="c", normal=[1.0, 0.5]),
    Vary(path="d", integers=[3, 5]),
    Vary(path="e", choice=["x", "y"]),
    Vary(path="f", uniform=[0.0, 0.01], step=0.002),
]


@pytest.mark.parametrize("sampling", ["random", "sobol"])
@settings(max_examples=20)
@given(seed=st.integers(0, 2**40), index=st.integers(0, 255))
def test_a_trial_is_of_study_and_index_alone(sampling: str, seed: int, index: int) -> None:
    """Whoever asks for it, whenever, after what others: its values and its seed are the same."""
    one = Draws(study_of(*WAYS, trials=256, seed=seed, sampling=sampling))
    other = Draws(study_of(*WAYS, trials=256, seed=seed, sampling=sampling))
    for k in (3, 200, 0):
        other.values(k)
        other.seed(k)
    assert one.values(index) == other.values(index) and one.seed(index) == other.seed(index)


@pytest.mark.parametrize("sampling", ["random", "sobol"])
def test_draws_have_their_distributions(sampling: str) -> None:
    """Kolmogorov and Smirnov find nothing; whole steps, both ends of integers, all of a choice."""
    draws = Draws(study_of(*WAYS, trials=1024, sampling=sampling))
    columns = list(zip(*(draws.values(k) for k in range(1024)), strict=True))
    laws = [stats.uniform(2.0, 2.0), stats.loguniform(0.1, 10.0), stats.norm(1.0, 0.5)]
    for column, law in zip(columns, laws, strict=False):
        assert stats.kstest(column, law.cdf).pvalue > 0.01
    assert set(columns[3]) == {3, 4, 5} and set(columns[4]) == {"x", "y"}
    assert set(columns[5]) == {0.0, 0.002, 0.004, 0.006, 0.008, 0.01}
    assert len({draws.seed(k) for k in range(1024)}) > 1020


@pytest.mark.parametrize(
    ("ends", "step", "all_of"),
    [
        ([0.0, 0.011], 0.004, [0.0, 0.004, 0.008]),
        (
            [0.75, 0.99],
            0.02,
            [0.76, 0.78, 0.8, 0.82, 0.84, 0.86, 0.88, 0.9, 0.92, 0.94, 0.96, 0.98],
        ),
        ([0.1, 0.3], 0.1, [0.1, 0.2, 0.3]),
        ([-0.003, 0.003], 0.001, [-0.003, -0.002, -0.001, 0.0, 0.001, 0.002, 0.003]),
    ],
)
def test_stepped_draws_stay_within_their_ends(
    ends: list[float], step: float, all_of: list[float]
) -> None:
    """They are whole multiples of the step, all that are within, and no others."""
    vary = Vary(path="a", uniform=ends, step=step)
    drawn = {draw(vary, float(u)) for u in np.linspace(0.0, 1.0, 1001, endpoint=False)}
    assert sorted(drawn) == all_of


def test_sobol_fills_the_space_more_evenly() -> None:
    """The mean of 256 draws is nearer to its limit than chance has it."""
    draws = Draws(study_of(ONE, trials=256, sampling="sobol"))
    assert abs(np.mean([draws.values(k)[0] for k in range(256)]) - 3.0) < 1e-3


@pytest.mark.parametrize("cells", [1, 2, 4, 8])
@pytest.mark.parametrize("common", ["independent", "common"])
def test_sobol_fills_the_space_in_every_cell(cells: int, common: str) -> None:
    """Of a cell's 64 draws one lies in each 64th of each coordinate, whatever the other cells have.

    Dealt out of one sequence, two cells would have half of the space each: every second point of it
    lies in the same half.
    """
    axis = Vary(path="g", values=list(range(cells)))
    many = [Vary(path=f"u{k}", uniform=[0.0, 1.0]) for k in range(4)]
    draws = Draws(study_of(axis, *many, trials=64, sampling="sobol", draws=common))
    rows = np.array([draws.values(k) for k in range(draws.count)])
    of_cells = [rows[rows[:, 0] == cell, 1:] for cell in range(cells)]
    for own in of_cells:
        strata = np.sort((64.0 * own).astype(int), axis=0)
        np.testing.assert_array_equal(strata, np.tile(np.arange(64)[:, None], 4))
    apart = common == "independent"
    assert all(np.any(own != of_cells[0]) == apart for own in of_cells[1:])


def test_the_first_trials_cover_the_grid() -> None:
    """All cells come before any comes again; common draws are those of every cell."""
    axes = (Vary(path="g", values=[1, 2, 3]), Vary(path="h", linspace=[0.0, 1.0, 2]))
    for common in ("independent", "common"):
        draws = Draws(study_of(*axes, ONE, trials=4, draws=common))
        assert draws.cells == 6 and draws.count == 24
        rows = [draws.values(k) for k in range(24)]
        for start in range(0, 24, 6):
            block = rows[start : start + 6]
            assert len({(row[0], row[1]) for row in block}) == 6
            assert len({row[2] for row in block}) == (1 if common == "common" else 6)
            assert len({draws.seed(start + k) for k in range(6)}) == len({r[2] for r in block})
    assert axis_values(axes[1]) == [0.0, 1.0]


def test_a_trial_has_the_scenario_that_its_values_say(tmp_path: Path) -> None:
    """To the last digit; the study's own overrides and the seed too; the command says the same."""
    study, base = rig.made(tmp_path)
    for trial in make_trials(study, base, first=0, last=8):
        scenario = base.load(list(trial.overrides))
        assert (scenario.simulation.friction, scenario.gait.cycle_time) == trial.values
        assert scenario.simulation.mode == "kinematic"
        assert scenario.simulation.seed == trial.seed
        assert f"simulation.friction={trial.values[0]!r}" in repeat(trial)


@given(st.one_of(st.floats(allow_nan=False, allow_infinity=False), st.integers(), st.booleans(),
                 st.text(max_size=8), st.lists(st.floats(0.01, 1), max_size=3)))  # fmt: skip
def test_a_value_survives_its_text(value: Any) -> None:
    """An override's text gives the very value again, words that YAML takes for others included."""
    from drake_quad.scenario_override import parse_override

    read = parse_override(f"a={value_text(value)}").value
    if isinstance(value, float) and isinstance(read, str):  # YAML 1.1 and 1e-05: conform reads it
        read = float(read)
    assert read == value


def test_a_studys_own_seed_is_kept(tmp_path: Path) -> None:
    """Where the study sets the seed, or varies it, the trials have that."""
    text = rig.PLUMBING.replace("set:", "set:\n  - simulation.seed=7")
    assert all("simulation.seed=7" in t.overrides and t.overrides.count("simulation.seed=7") == 1
               and not t.overrides[-1].startswith("simulation.seed") for t in
               rig.trials_of(tmp_path, text))  # fmt: skip


def test_parse_study_fills_in_defaults() -> None:
    """What is left out has the documented default."""
    study = parse_study("scenario: flat_walk\n", source="mine.yaml")
    assert study == Study(scenario="flat_walk")
    assert load_scenario("flat_walk").simulation.friction == 0.8


def test_draws_that_a_step_makes_all_alike_are_one_band() -> None:
    """As the numbers of an older study, whose step was wider than its range."""
    vary = Vary(path="simulation.friction", uniform=[0.8, 0.9], step=1.0)
    (band,) = bands_of(vary, [1.0] * 4, [True, True, False, True])
    assert (band.low, band.high, band.rate.good, band.rate.trials) == (1.0, 1.0, 3, 4)


def test_a_long_list_is_tried_in_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study of 10 000 values is read in seconds: its ends are tried, and some between."""
    tried: list[list[str]] = []
    monkeypatch.setattr("drake_quad.sweep.base.Base.load", lambda _, given: tried.append(given))
    path = tmp_path / "study.yaml"
    path.write_text(
        HEAD
        + "vary: [{path: simulation.friction, linspace: [0.5, 1.5, 10000]},"
        + " {path: gait.cycle_time, values: [7.0, 8.0]}]\n"
    )
    load_study(path)
    asked = [one for given in tried for one in given]
    assert len(tried) <= 301 and len(set(asked)) == len(asked)
    assert {"simulation.friction=0.5", "simulation.friction=1.5"} <= set(asked)
    assert asked[-2:] == ["gait.cycle_time=7.0", "gait.cycle_time=8.0"]
