"""Which gait climbs given stairs with a given robot, or which limit is in the way."""
