"""Floor 1: the mathematics of the controllers, as compiled functions of floats and arrays."""
