"""The paper again: its figures, Table I, and its statements beside what we compute.

    python scripts/reproduce_paper.py [--out docs/paper]

writes Figs. 1 to 12, and one that is not in the paper, as PNG, and README.md, the page that
holds them.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import matplotlib
from paper.findings_run import run_findings
from paper.findings_spin import spin_findings
from paper.findings_wave import wave_findings
from paper.margins import beta_rows
from paper.page import FIGURES, page
from paper.study import OUT_OF_PHASE, plan_case_study, sample_study

PAGES = Path(__file__).resolve().parents[1] / "docs" / "paper"


def reproduce(out: Path) -> None:
    """Writes everything into the directory `out`."""
    out.mkdir(parents=True, exist_ok=True)

    # The case study, planned with the paper's own gait; and once more on level ground whose
    # length is no whole number of strides.
    study = plan_case_study()
    samples = sample_study(study)
    out_of_phase = sample_study(plan_case_study(OUT_OF_PHASE))

    # Every number on the page is computed here.
    findings = (*wave_findings(), *spin_findings(), *run_findings(study, samples, out_of_phase))
    (out / "README.md").write_text(page(findings, beta_rows()), encoding="utf-8")

    # The figures look the same whatever style the user has set.
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        for figure in FIGURES:
            figure.draw(study, samples).savefig(out / figure.file, metadata={"Software": None})


def main(arguments: Sequence[str] | None = None) -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=PAGES, help="directory to write into")
    reproduce(parser.parse_args(arguments).out)


if __name__ == "__main__":
    main()
