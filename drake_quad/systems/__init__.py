"""Floor 2: one LeafSystem a file, thin shells around floors 0 and 1."""
