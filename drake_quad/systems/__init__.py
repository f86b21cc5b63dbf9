"""One LeafSystem a file, thin shells around the mathematics, and the controller as a Diagram."""
