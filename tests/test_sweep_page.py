"""What people see of a sweep: report.html and the section of a Markdown page."""

import re
from pathlib import Path

import sweep_rig as rig

from drake_quad.sweep.page import grade, write_report, write_section
from drake_quad.sweep.replays import make_replays

TEXT = (
    rig.PLUMBING.replace("trials: 4", "trials: 20")
    + "  - {path: controller.kind, choice: [ik, whole_body]}\n"
    + "maps: [[simulation.friction, gait.cycle_time]]\ngate: {rate: 0.9}\n"
)


def test_the_report_says_what_the_sweep_found(tmp_path: Path) -> None:
    """Rate, gate, each band's counts, causes, worst trials with commands; nothing from outside."""
    told = rig.sweep_made_up(tmp_path, tmp_path / "a", TEXT)
    study, _ = rig.made(tmp_path, TEXT)
    write_report(study, told, tmp_path / "a")
    page = (tmp_path / "a" / "report.html").read_text()
    rate = told["rate"]
    assert f"{rate['good']} of {rate['trials']} succeeded" in page and rate["text"] in page
    assert 0 < rate["good"] < 36 and "missed" in page and 'header class="bad"' in page
    for bands in told["bands"].values():
        assert sum(band["trials"] for band in bands) == 40
        assert all(f"{b['good']}/{b['trials']}" in page for b in bands if b["trials"])
    cells = told["maps"][0]
    assert sum(map(sum, cells["trials"])) == 40 and sum(map(sum, cells["good"])) == rate["good"]
    assert all(cause["cause"] in page for cause in told["causes"])
    assert page.count("drake-quad run flat_walk") == len(told["worst"])
    assert not re.search(r'(src|href)="(?!#)', page)
    write_report(study, told, tmp_path / "a")
    assert (tmp_path / "a" / "report.html").read_text() == page


def test_cases_are_named(tmp_path: Path) -> None:
    """A picture has a panel for each thing that varies, and no more; cases are told by their names.

    Long names stood on each other side by side, and the last row was filled up with empty panels.
    """
    cases = "".join(
        f"      A robot of some maker on stairs number {k}: [gait.cycle_time={7.0 + k}]\n"
        for k in range(9)
    )
    text = rig.PLUMBING + f"  - name: robot and course\n    cases:\n{cases}gate: {{rate: 0.5}}\n"
    text = text.replace("  - {path: gait.cycle_time, values: [7.0, 8.0]}\n", "")
    told = rig.sweep_made_up(tmp_path, tmp_path / "a", text)
    study, _ = rig.made(tmp_path, text)
    write_report(study, told, tmp_path / "a")
    page = (tmp_path / "a" / "report.html").read_text()
    assert page.count('<g id="axes_') == len(told["bands"]) == 2
    worst = page[page.index('id="worst"') :]
    for row in told["worst"]:
        assert row["cell"].startswith("A robot of some maker")
        assert f"<td>{row['cell']}</td>" in worst


def test_a_sweep_without_a_gate_is_good_if_all_is() -> None:
    """The head's colour: of a whole sweep without a gate, or with one, and of none that ran."""

    def of(good: int, gate: float | None = None, complete: bool = True) -> str:
        passed = None if gate is None else good / 4 >= gate
        told = {"rate": {"good": good, "trials": 4}, "gate": gate, "passed": passed}
        return grade({**told, "complete": complete, "kinematic": False})

    assert [of(4), of(3), of(0)] == ["good", "warn", "bad"]
    assert [of(3, 0.7), of(3, 0.8)] == ["good", "bad"]
    assert of(4, complete=False) == of(4, 0.9, complete=False) == "warn"


def test_replays_of_the_worst_are_linked(tmp_path: Path) -> None:
    """They are runs of those very trials; what is there is not made again."""
    told = rig.sweep_made_up(tmp_path, tmp_path / "a")
    study, base = rig.made(tmp_path)
    made = make_replays(study, base, told, tmp_path / "a", 1)
    assert made == [told["worst"][0]["index"]]
    assert make_replays(study, base, told, tmp_path / "a", 1) == []
    write_report(study, told, tmp_path / "a")
    link = f"trials/{made[0]:06d}/report.html"
    assert f'href="{link}"' in (tmp_path / "a" / "report.html").read_text()
    scenario = (tmp_path / "a" / link).with_name("scenario.yaml").read_text()
    seed = re.search(r"simulation\.seed=(\d+)", told["worst"][0]["command"])
    assert seed is not None and f"seed: {seed[1]}" in scenario


def test_a_section_leaves_the_rest_of_the_page(tmp_path: Path) -> None:
    """Written twice it is there once, in its place; all else stays as it was."""
    page = tmp_path / "page.md"
    told = rig.sweep_made_up(tmp_path, tmp_path / "a")
    write_section(page, told, "drake-quad sweep one", "one")
    write_section(page, told, "drake-quad sweep two", "two")
    page.write_text(page.read_text() + "A person's words.\n")
    before = page.read_text()
    write_section(page, told, "drake-quad sweep uno", "one")
    assert page.read_text() == before.replace("sweep one", "sweep uno")
    assert told["rate"]["text"] in before and told["commit"] in before
