"""What a sweep's results are of: robots, sources, libraries, seeds; and what is compared."""

import re
import subprocess
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
import sweep_rig as rig

from drake_quad.errors import InputError
from drake_quad.scenario.load import parse_scenario
from drake_quad.sweep import provenance, run as sweep_module
from drake_quad.sweep.compare import compare_sweeps
from drake_quad.sweep.provenance import commit, robots_of, study_digest
from drake_quad.sweep.results import trials_table
from drake_quad.sweep.run import SourcesChangedError
from drake_quad.sweep.study_loading import parse_study
from drake_quad.sweep.trials import Trial, lost, make_trials
from drake_quad.util import versions as versions_module
from drake_quad.util.versions import MODELS


def test_the_digest_of_the_sources_names_what_is_there() -> None:
    """Each module of a sweep that a trial is drawn or carried out by counts, and is there."""
    package = versions_module.PACKAGE
    for name in provenance.PRESENTING:
        assert (package / name).is_dir() or (package / f"{name}.py").is_file(), name
    for name in provenance.WORKING:
        assert (package / "sweep" / name).is_file(), name
    # A trial's own module imports no others of its package.
    imported = {
        module.rpartition(".")[2] + ".py"
        for name in provenance.WORKING
        for module in re.findall(
            r"^from (drake_quad\.sweep\.\w+)", (package / "sweep" / name).read_text(), re.MULTILINE
        )
    }
    assert imported <= {*provenance.WORKING}


def test_every_robot_of_a_study_counts(tmp_path: Path) -> None:
    """A study is another one if any robot's file is: of a grid's, or behind a `.robot.yaml`."""
    urdf = resources.files("drake_quad_models") / "paper_quadruped.urdf"
    for name in ("a", "b"):
        (tmp_path / f"{name}.urdf").write_text(urdf.read_text())
    (tmp_path / "c.robot.yaml").write_text("model: b.urdf\n")
    models = ", ".join(str(tmp_path / name) for name in ("a.urdf", "c.robot.yaml"))
    text = rig.PLUMBING + f"  - {{path: robot.model, values: [{models}]}}\n"
    digests = []
    for length in ("", "<!-- the same in other words -->"):
        (tmp_path / "b.urdf").write_text(urdf.read_text() + length)
        study, base = rig.made(tmp_path, text)
        digests.append(study_digest(study, base))
        assert len(robots_of(study, base)) == (2 if length else 1)  # by what is in their files
    assert digests[0] != digests[1]


GRID = rig.PLUMBING + "  - {name: way, cases: {often: [simulation.log_period=0.1], plain: []}}\n"
UNREAD = (  # what no trial depends on
    ("Nothing but plumbing", "Nothing but plumbing!"),
    ("trials: 4", "trials: 4\ngate: {rate: 0.9}"),
    ("trials: 4", "trials: 4\nmaps: [[simulation.friction, way]]"),
    ("trials: 4", "trials: 4\nlimits: {retries: 7, recycle: 3}"),
    ("uniform", "bands: 2, name: slipperiness, uniform"),
    ("name: way", "name: by the way"),
)
READ = (  # what one of them may depend on
    ("trials: 4", "trials: 4\nlimits: {wall_time: 1799.0}"),
    ("trials: 4", "trials: 4\nlimits: {memory: 3.5}"),
    ("trials: 4", "trials: 4\nfigures: [slip_max]"),
    ("trials: 4", "trials: 4\nsuccess: [{figure: margin.minimum, least: 0.1}]"),
    ("trials: 4", "trials: 4\nseed: 1"),
    ("trials: 4", "trials: 4\nsampling: sobol"),
    ("trials: 4", "trials: 4\ndraws: common"),
    ("1.25]", "1.25], step: 0.01"),
    ("duration: 0.4", "duration: 0.5"),
    (
        "{often: [simulation.log_period=0.1], plain: []}",
        "{plain: [], often: [simulation.log_period=0.1]}",
    ),
)


@pytest.mark.parametrize("change", UNREAD, ids=lambda change: change[1])
def test_a_sweep_goes_on_with_what_no_trial_depends_on_changed(
    tmp_path: Path, change: tuple[str, str]
) -> None:
    """The trials that are done stay, and are told as the study now says."""
    assert change[0] in GRID
    rig.sweep_made_up(tmp_path, tmp_path / "out", GRID, limit=5)
    again: list[int] = []
    changed = GRID.replace(*change)
    told = rig.sweep_made_up(
        tmp_path, tmp_path / "out", changed, resume=True, note=lambda k, *_: again.append(k)
    )
    assert again == list(range(5, 16)) and told["complete"]
    assert list(told["bands"]) == [vary.title for vary in rig.made(tmp_path, changed)[0].vary]


@pytest.mark.parametrize("change", READ, ids=lambda change: change[1])
def test_a_sweep_does_not_go_on_with_other_trials(tmp_path: Path, change: tuple[str, str]) -> None:
    """What was done would not be what the study now asks for: the order of cases counts, too."""
    assert change[0] in GRID
    rig.sweep_made_up(tmp_path, tmp_path / "out", GRID, limit=2)
    with pytest.raises(InputError, match="another study"):
        rig.sweep_made_up(tmp_path, tmp_path / "out", GRID.replace(*change), resume=True)


def test_a_trial_of_another_robot_or_of_other_libraries_stops_the_sweep(tmp_path: Path) -> None:
    """As on a cluster whose machines are not alike; what was done before is kept."""
    for name in ("sources", "versions", "robot"):

        def other(trial: Trial, name: str = name) -> dict[str, Any]:
            return {**rig.made_up(trial), name: "another" if trial.index == 2 else None}

        out = tmp_path / name
        with pytest.raises(SourcesChangedError, match=name.rstrip("s")):
            rig.sweep_made_up(tmp_path, out, work=other)
        assert len((out / "journal.jsonl").read_text().splitlines()) == 1 + 2
        assert not (out / "trials.parquet").exists()


def test_a_robot_that_a_machine_lacks_is_no_finding(tmp_path: Path) -> None:
    """A trial that is refused for want of it stops the sweep, unless it is refused here as well."""

    def lacking(trial: Trial) -> dict[str, Any]:
        if trial.index < 2:
            return rig.made_up(trial)
        return rig.result(trial, "refused", "robot.model: not installed")

    with pytest.raises(SourcesChangedError, match=r"trial 2 .*not installed"):
        rig.sweep_made_up(tmp_path, tmp_path / "out", work=lacking)
    assert len((tmp_path / "out" / "journal.jsonl").read_text().splitlines()) == 1 + 2
    assert not (tmp_path / "out" / "trials.parquet").exists()


def test_findings_name_the_commit_at_which_the_sweep_began(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is committed while it runs; with what else they are of: models, and the study."""
    asked: list[tuple[Path, ...]] = []
    done: list[int] = []

    def commit(*more: Path) -> str:
        asked.append(more)
        return f"after {len(done)} trials"

    monkeypatch.setattr(sweep_module, "commit", commit)
    study = tmp_path / "study.yaml"
    told = rig.sweep_made_up(
        tmp_path, tmp_path / "out", files=[study], note=lambda index, *_: done.append(index)
    )
    assert told["commit"] == "after 0 trials" and len(done) == 8
    assert asked == [(MODELS, study)]


def test_a_change_anywhere_that_counts_is_told_with_the_commit(tmp_path: Path) -> None:
    """Also where another of the places is in no repository."""
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init", "-q"], ["add", "."], ["commit", "-q", "--allow-empty", "-m", "x"]):
        subprocess.run([*git, *words], check=True)
    own = tmp_path / "package"
    own.mkdir()
    (own / "__init__.py").touch()
    (tmp_path / "study.yaml").write_text("a")
    subprocess.run([*git, "add", "."], check=True)
    subprocess.run([*git, "commit", "-q", "-m", "y"], check=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(provenance, "PACKAGE", own)
        places = (Path("/nowhere/at/all"), tmp_path / "study.yaml")
        assert "not committed" not in commit(*places) and commit(*places)
        (tmp_path / "study.yaml").write_text("b")
        assert "not committed" in commit(*places) and "not committed" not in commit(places[0])


def test_what_reads_meshes_is_among_the_versions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it is installed: collision shapes are others where it is not."""
    told = []
    for there in (False, True):
        monkeypatch.setattr(versions_module, "find_spec", lambda _, there=there: there)
        monkeypatch.setattr(versions_module, "version", lambda name: name)
        told.append(versions_module.versions.__wrapped__())
    assert told[1].keys() - told[0].keys() == {"trimesh", "pycollada"}
    assert told[0].keys() < told[1].keys()


def test_what_no_machine_can_load_is_a_finding(tmp_path: Path) -> None:
    """Two values that each can be and together cannot: refused, whoever is asked."""

    def loaded(trial: Trial) -> dict[str, Any]:
        try:
            trial.base.load(list(trial.overrides))
        except InputError as error:
            return rig.result(trial, "refused", str(error))
        return rig.result(trial)

    text = rig.PLUMBING + "  - {path: controller.period, values: [0.005, 0.004]}\n"
    text += "  - {path: simulation.plant.time_step, values: [0.001, 0.0025]}\n"
    told = rig.sweep_made_up(tmp_path, tmp_path / "o", text, work=loaded)
    assert told["complete"] and told["rate"]["trials"] - told["rate"]["good"] == 8


def test_the_table_has_the_seed_that_a_run_had(tmp_path: Path) -> None:
    """Drawn, or the study's own, in whatever way it says so; and lost trials' scenarios too."""
    for text, seed in (
        (rig.PLUMBING, None),
        (rig.PLUMBING.replace("set:\n", "set:\n  - simulation.seed=7\n"), 7),
        (rig.PLUMBING.replace("set:\n", "set:\n  - 'simulation={seed: 8}'\n"), 8),
        (rig.PLUMBING + "  - {path: simulation.seed, integers: [9, 10]}\n", None),
    ):
        study, base = rig.made(tmp_path, text)
        for trial in make_trials(study, base, first=0, last=4):
            assert base.load(list(trial.overrides)).simulation.seed == trial.seed
            assert seed in (None, trial.seed)
    study, base = rig.made(tmp_path)
    gone = {k: lost(t, "crashed", "x") for k, t in enumerate(rig.trials_of(tmp_path))}
    table = trials_table(study, base, gone)
    for text, seed in zip(table["scenario"].to_pylist(), table["seed"].to_pylist(), strict=True):
        assert parse_scenario(text, source="table").simulation.seed == seed


def test_numbers_beyond_a_tables_are_written_in_full(tmp_path: Path) -> None:
    """Every digit is there, and the table can be written."""
    text = rig.PLUMBING.replace("[7.0, 8.0]", f"[7, 8, {2**53 + 1}]")
    study, base = parse_study(text, source="x"), rig.made(tmp_path)[1]
    done = {k: rig.result(t) for k, t in enumerate(make_trials(study, base, first=0, last=3))}
    told = trials_table(study, base, done)["vary.gait.cycle_time"].to_pylist()
    assert told == ["7", "8", str(2**53 + 1)]


def test_the_verdict_is_of_the_trials_that_both_have(tmp_path: Path) -> None:
    """A sweep that lost trials is worse, however badly the other's further trials went."""

    def first_well(trial: Trial) -> dict[str, Any]:
        return rig.result(trial, "goal_reached" if trial.index < 16 else "fell", "")

    def lost_some(trial: Trial) -> dict[str, Any]:
        return rig.result(trial, "fell" if trial.index % 2 else "goal_reached", "")

    text = rig.PLUMBING.replace("trials: 4", "trials: 30")
    rig.sweep_made_up(tmp_path, tmp_path / "before", text, work=first_well)
    rig.sweep_made_up(tmp_path, tmp_path / "after", text, work=lost_some, limit=16)
    told = compare_sweeps(tmp_path / "before", tmp_path / "after").as_dict()
    assert told["before"]["rate"]["rate"] < told["after"]["rate"]["rate"]
    assert len(told["paired"]["lost"]) == 8 and not told["paired"]["won"]
    assert told["verdict"] == "worse" and told["p"] < 0.01
    assert told["before"]["complete"] and not told["after"]["complete"]
