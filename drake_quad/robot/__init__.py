"""A robot read from its file: legs, feet, limits, kinematics."""
