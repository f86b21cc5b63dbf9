"""What measures speed and accuracy, with the peers beside it; run with `python -m benchmarks.x`."""
