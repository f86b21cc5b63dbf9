"""When a robot counts as fallen: for the monitor that says so, and for who plans."""

FALLEN_TILT = 0.7  # [rad] of the trunk, 40 degrees, whatever it meant to do
# For so long [s] the trunk is tilted or down before that is a fall. A foot that strikes a tread
# shakes it, and takes the load off the others for a hundredth of a second: going down stairs rear
# feet alone bear then, and the trunk is not far above those.
FALL_TIME = 0.1
