"""Any quadruped's file to the normal form that planner and controller work on."""
