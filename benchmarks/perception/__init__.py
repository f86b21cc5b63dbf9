"""Benchmarks of what is seen."""
