"""What a study draws: a trial is of study and index alone, and is run as it was drawn."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sweep_rig as rig
from hypothesis import given, settings, strategies as st
from scipy import stats

from drake_quad.sweep.findings import bins_of
from drake_quad.sweep.sampling import Draws, axis_values, draw
from drake_quad.sweep.study import Study, Vary
from drake_quad.sweep.study_loading import value_text
from drake_quad.sweep.trials import make_trials, repeat


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
    from drake_quad.scenario.load import parse_override

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


def test_draws_that_a_step_makes_all_alike_are_one_band() -> None:
    """As the numbers of an older study, whose step was wider than its range."""
    vary = Vary(path="simulation.friction", uniform=[0.8, 0.9], step=1.0)
    (band,) = bins_of(vary, [1.0] * 4, [True, True, False, True])
    assert (band.low, band.high, band.rate.good, band.rate.trials) == (1.0, 1.0, 3, 4)
