"""Floor 2: one ClockedSystem (a LeafSystem) a file, thin shells around floors 0 and 1."""
