"""Simulates the shipped case study from Python and prints what it measured.

python scripts/run_case_study.py
"""

import drake_quad as dq


def main() -> None:
    """Runs, writes the files, makes the report."""
    # Any field of the scenario can be overridden by its path.
    scenario = dq.load_scenario("case_study", ["gait.pitch=slope"])
    result = dq.simulate(
        scenario, progress=lambda t, total: print(f"\r{t:5.1f} of {total:.0f} s", end="")
    )
    directory = result.save("runs/case_study_slope")
    print(f"\n{result.outcome}: {result.reason}")
    print(f"smallest margin {result.summary['margin']['minimum']:.3f} m")
    print(f"look at {dq.write_report(directory)}")


if __name__ == "__main__":
    main()
