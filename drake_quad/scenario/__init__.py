"""Scenarios: from YAML to checked values, and from these to settings."""
