"""A run's data: its log, its figures, its files."""
