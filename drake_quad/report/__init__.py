"""Figures, HTML and replay, from a finished run's files alone."""
