"""Any quadruped's file made into the URDF in normal form that `load_robot` reads."""
