"""Continuous-time certificates: what holds of a plan at every time, not at samples."""
