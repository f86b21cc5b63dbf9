"""Can this robot climb these stairs? The answer, charts of it, and what a robot's file says."""
