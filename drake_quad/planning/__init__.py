"""Floor 1: robot, course and task to a frozen MotionPlan."""
