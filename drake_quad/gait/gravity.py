"""How heavy things are."""

GRAVITY = 9.81  # [m/s^2], as in Drake's plants
