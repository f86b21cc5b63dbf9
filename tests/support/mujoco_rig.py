"""The controller's Diagram in MuJoCo, for tests; they are skipped where MuJoCo is not installed."""

import pytest

mujoco = pytest.importorskip("mujoco", reason="drives the controller in MuJoCo: pip install mujoco")

from benchmarks import mujoco_runs  # noqa: E402
from benchmarks.mujoco_drive import Drive, drive  # noqa: E402  (it needs mujoco)
from benchmarks.mujoco_model import GRAVITY, STEP  # noqa: E402
from benchmarks.mujoco_robot import MujocoRobot  # noqa: E402

__all__ = ["GRAVITY", "STEP", "Drive", "MujocoRobot", "drive", "mujoco", "mujoco_runs"]
