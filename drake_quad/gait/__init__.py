"""Floor 0: the paper's mathematics and what goes beyond it. Numpy only."""
