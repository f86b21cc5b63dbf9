"""The paper's mathematics and what goes beyond it: schedules, swings, transitions."""
