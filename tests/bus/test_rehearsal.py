"""What a controller on a bus calls in its walk, it has called before: its loop has 2 ms a tick."""

import os
import subprocess
import sys
from pathlib import Path

SCRIPT = """
import gc, sys
from dataclasses import replace

import numpy as np
from bus_rig import PERIOD_NS, QUICK, Puppet, short_walk
from numba.core.dispatcher import Dispatcher

from drake_quad.bus.bus_controller import BusController
from drake_quad.bus.postures import sit_to_stand
from drake_quad.bus.real_time import ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.control.ports import GaitPhase, Mode


def loaded():
    kernels = [one for one in gc.get_objects() if isinstance(one, Dispatcher)]
    return {(one.py_func.__qualname__, str(s)) for one in kernels for s in one.signatures}


prepared, clock = short_walk("joints", QUICK), ManualClock()
controller = BusController(prepared, prepared.scenario.controller)
puppet = Puppet(sit_to_stand(prepared.robot, prepared.stance)[-1], LoopbackBus(clock.now_ns), clock)
before, modules = loaded(), set(sys.modules)
effort, swung, modes = controller.bearing, False, set()
for tick in range(1200):
    clock.sleep_until(clock.now_ns() + PERIOD_NS)
    state = replace(puppet.state(), effort=effort)
    if tick >= 1000:
        state.specific_force[1] += 20.0
    controller.take(state)
    wanted = controller.wanted()
    puppet.q, effort = wanted.q, wanted.torque
    clocked = controller.known()["clock"]
    swung |= clocked[GaitPhase.SWING_LEG] > 0
    modes.add(Mode(int(clocked[GaitPhase.MODE])))
assert swung and Mode.CATCH in modes, (swung, modes)
late = sorted(loaded() - before) + sorted(set(sys.modules) - modules)
print("\\n".join(map(str, late)))
"""


def test_nothing_is_loaded_in_a_walk() -> None:
    """In a fresh process a lift-off and a push load no kernel and import no module.

    Each costs some 20 ms when it is called for the first time. A Go2's drives damped at the first
    tick of its walk, ten times of ten, for it took 120 to 190 ms.
    """
    support = str(Path(__file__).parents[1] / "support")
    paths = os.pathsep.join([support, os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True, text=True, env={**os.environ, "PYTHONPATH": paths},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.split() == []
