"""Many runs of a scenario: studies, the processes that carry them out, rates and their report."""
