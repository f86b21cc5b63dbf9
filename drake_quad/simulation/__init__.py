"""A scenario prepared, wired into a Diagram, and run."""
