"""The study of certificates runs, and what it says of the paper's transitions holds."""

from benchmarks import certificates as study


def test_paper_transitions_in_four_steps_are_certified() -> None:
    """With the body shifting by at most 0.1 m: 0.10 m to the wave gait, 0.045 m to the spin."""
    rows = {(r["transition"], r["masses"]): r for r in study.certify_transitions()}
    for name, asked in (("wave", 0.10), ("spin", 0.045)):
        row = rows[name, "none in the legs"]
        assert row["steps"] == 4 and row["margin"] >= asked and row["checked"]
        assert rows[name, "all"]["margin"] < row["margin"]


def test_no_certificate_of_a_few_random_plans_is_false() -> None:
    """No sample is below what is claimed, and every certificate is accepted; a few times here."""
    told = study.study_falsehood(2, 5, rate=200.0)
    assert told["plans"] == 2 and told["certified"] >= 1
    assert told["false"] == 0
    assert "certified, but not accepted by the checker" not in told
    assert "refused, no sample at fault" not in told


def test_no_changed_certificate_is_accepted() -> None:
    """Nor one that is untrue, with its hash made right."""
    told = study.study_tampering(6, 5, scenario="spin_both_ways")
    assert told["changed"] == 6 and told["accepted"] == 0
    assert told["accepted with its hash made right, and untrue"] == 0
