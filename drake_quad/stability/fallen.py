"""When a robot counts as fallen: one number for the monitor that says so, and for who plans."""

FALLEN_TILT = 0.7  # [rad] of the trunk, 40 degrees, whatever it meant to do
