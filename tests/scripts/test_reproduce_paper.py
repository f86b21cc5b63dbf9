"""The page on the paper: its script writes all of it, and what is committed is up to date."""

import importlib.util
import re
import time
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from paper.finding import Finding
from paper.page import FIGURES
from paper_findings_rig import all_findings

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs" / "paper"


@pytest.fixture(scope="module")
def findings() -> dict[str, Finding]:
    return all_findings()


def run_script(out: Path) -> None:
    """Has the script write the page there."""
    spec = importlib.util.spec_from_file_location("script", ROOT / "scripts" / "reproduce_paper.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.main(["--out", str(out)])


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The page that the script writes; its figures are made, but not drawn, which takes longest."""
    out = tmp_path_factory.mktemp("paper") / "new"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda _, path, **__: Path(path).touch())
        run_script(out)
    assert {path.name for path in out.iterdir()} == {"README.md", *(f.file for f in FIGURES)}
    return (out / "README.md").read_text(encoding="utf-8")


@pytest.mark.long
def test_script_is_quick_and_its_figures_are_not_blank(tmp_path: Path) -> None:
    """The script writes the page, all figures and one of the paper's words, in 30 s of a core.

    Each figure has ink in all of its quarters, and the colours of at least two legs or lines.
    """
    out, begin = tmp_path / "new", time.process_time()
    run_script(out)
    assert time.process_time() - begin < 30.0
    assert [figure.number for figure in FIGURES] == [*range(1, 13), 13]
    assert {path.name for path in out.iterdir()} == {"README.md", *(f.file for f in FIGURES)}
    for figure in FIGURES:
        image = imread(out / figure.file)[..., :3]
        height, width = (size // 2 for size in image.shape[:2])
        for rows in (slice(None, height), slice(height, None)):
            for columns in (slice(None, width), slice(width, None)):
                ink = image[rows, columns].min(axis=-1) < 0.9
                assert np.mean(ink) > 0.01, figure.file
        saturated = image[np.ptp(image, axis=-1) > 0.4]
        assert len(np.unique(np.round(saturated * 8).astype(int), axis=0)) >= 2, figure.file


def test_committed_page_is_up_to_date(page: str) -> None:
    """docs/paper holds what the script writes: else run `python scripts/reproduce_paper.py`."""
    committed = (PAGES / "README.md").read_text(encoding="utf-8")
    assert committed == page, (
        "stale: run `python scripts/reproduce_paper.py` and look at the change"
    )
    assert {f.file for f in FIGURES} == {path.name for path in PAGES.glob("*.png")}


def test_page_holds_every_statement_with_its_figures(
    page: str, findings: dict[str, Finding]
) -> None:
    """Each statement is one row with what we find and a verdict; all links on the page resolve."""
    text = page
    rows = [line for line in text.splitlines() if line.endswith("** |")]
    assert len(rows) == len(findings)
    for finding, row in zip(findings.values(), rows, strict=True):
        assert finding.statement in row
        assert finding.found in row
        assert row.endswith(f"| **{finding.verdict}** |")
        assert finding.figures
    assert set(re.findall(r"\(#(.*?)\)", text)) <= set(re.findall(r'id="(.*?)"', text))
    images = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert images == [figure.file for figure in FIGURES]
    assert "{" not in text
    assert "nan" not in text
    assert not re.search(r"-0\.0+\b(?!\d)", text)
