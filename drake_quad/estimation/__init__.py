"""The robot's state from its own sensors: noise models and the filter, numpy and numba alone."""
