"""What tests of the paper share: the case study by its gait, and all that is found of it."""

from functools import cache

from paper.finding import Finding
from paper.findings_run import run_findings
from paper.findings_spin import spin_findings
from paper.findings_wave import wave_findings
from paper.study import OUT_OF_PHASE, CaseStudy, Samples, plan_case_study, sample_study


@cache
def study_of_the_paper() -> CaseStudy:
    """The paper's case study, planned by the scenario `paper`."""
    return plan_case_study()


@cache
def samples_of_it() -> Samples:
    """The same, sampled."""
    return sample_study(study_of_the_paper())


@cache
def samples_out_of_phase() -> Samples:
    """The same on level ground whose length is no whole number of strides."""
    return sample_study(plan_case_study(OUT_OF_PHASE))


@cache
def all_findings() -> dict[str, Finding]:
    """Every statement that the page examines, by its key."""
    runs = run_findings(study_of_the_paper(), samples_of_it(), samples_out_of_phase())
    every = (*wave_findings(), *spin_findings(), *runs)
    assert len({finding.key for finding in every}) == len(every)
    return {finding.key: finding for finding in every}
