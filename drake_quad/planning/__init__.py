"""Robot, course and task to a frozen MotionPlan."""
