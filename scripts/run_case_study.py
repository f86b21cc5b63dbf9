"""Simulates the shipped case study from Python and prints what it measured.

python scripts/run_case_study.py
"""

from pathlib import Path

from drake_quad.report.page import write_report
from drake_quad.runs.result import write_files
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.run import simulate


def main() -> None:
    """Runs, writes the files, makes the report."""
    # Any field of the scenario can be overridden by its path.
    scenario = load_scenario("case_study", ["gait.pitch=slope"])
    result = simulate(
        scenario, progress=lambda t, total: print(f"\r{t:5.1f} of {total:.0f} s", end="")
    )
    directory = Path("runs/case_study_slope")
    write_files(result, scenario, directory)
    print(f"\n{result.outcome}: {result.reason}")
    print(f"smallest margin {result.summary['margin']['minimum']:.3f} m")
    print(f"look at {write_report(directory)}")


if __name__ == "__main__":
    main()
