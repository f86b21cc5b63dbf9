"""Floor 4: figures, HTML and replay, from a finished run's files alone."""
