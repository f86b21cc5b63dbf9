"""Floor 1: a robot read from its file: legs, feet, limits, kinematics."""
