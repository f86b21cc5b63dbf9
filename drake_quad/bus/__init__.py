"""The controller as a process of its own on a robot's bus, and a simulated robot's side of it."""
