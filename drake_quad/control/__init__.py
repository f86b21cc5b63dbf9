"""The mathematics of the controllers, as compiled functions of floats and arrays."""
