"""Compiles the kernels that a command will call, in processes side by side, before it calls them.

Numba compiles one kernel at a time in a process. The kernels of the control loop take half a
minute so, once after every installation; in two processes they take half of that.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any

import numpy as np
from numba import typeof, types
from numba.core.registry import cpu_target

from drake_quad.jit import kernel_directory

Signature = tuple[Any, ...]
Tell = Callable[[str], object]

_F, _I, _B = types.float64, types.int64, types.boolean
_V, _M, _T, _Q = (types.Array(_F, dimensions, "C") for dimensions in (1, 2, 3, 4))
# Arrays that nobody may write to, as plans and constants hold them.
_RV, _RM, _RT = (types.Array(_F, n, "C", readonly=True) for n in (1, 2, 3))
_BV = types.Array(_B, 1, "C")
_IV, _BM, _IM = types.Array(_I, 1, "C"), types.Array(_B, 2, "C"), types.Array(_I, 2, "C")
_FM = types.Array(_F, 2, "F")  # as Drake hands over a mass matrix


def _named(kind: Any, *parts: Any) -> Any:
    """The type of a NamedTuple whose fields have these types."""
    unlike = types.NamedTuple if len(set(parts)) > 1 else types.NamedUniTuple
    return unlike(parts, kind) if unlike is types.NamedTuple else unlike(parts[0], len(parts), kind)


def _kernels() -> dict[str, dict[str, Signature]]:
    """By group: every kernel that Python calls, and the types that it is called with.

    The kernels of a group are compiled one after the other in one process. Kernels that only other
    kernels call are compiled with these.
    """
    from drake_quad.control.kernel_state import CONSTANTS, MEASURED, ROBOT, WORK
    from drake_quad.control.tracking import Commands, Inputs
    from drake_quad.estimation.contact_from_torques import ObserverModel, TouchSettings
    from drake_quad.estimation.filter_state import MODEL
    from drake_quad.gait_design.candidates import Cycle, Staircase
    from drake_quad.gait_design.pose_kernels import RobotTables
    from drake_quad.planning.motion_plan import PlanTables
    from drake_quad.stability.support_polygon import FallLimits

    work, measured = typeof(np.zeros(1, WORK)), typeof(np.zeros(1, MEASURED))
    constants = typeof(np.zeros(1, CONSTANTS)).copy(readonly=True)
    plan = _named(PlanTables, _RM, _F, _RM, _F, _I, _I)
    model = typeof(np.zeros(1, MODEL)).copy(readonly=True)
    return {
        "feet": {
            "control.measurement._measure_one": (
                measured, _V, _V, typeof(np.zeros(1, ROBOT)), _F, _M,
            ),
            "control.tracking.compute_targets": (
                plan, _named(Inputs, _V, _V, _V, _V, _V), constants, _V, _V, work, _M,
            ),
            "control.tracking.compute_commands": (
                _V, _V, constants, work, _named(Commands, _V, _V, _V, _V, _V),
            ),
        },
        "forces": {
            "control.whole_body_qp.plan_forces": (
                _FM, _V, _B, constants, work, _V, _V,
            ),
            "control.whole_body_qp.torques_of": (_V, work, _V),
        },
        "loop": {
            "math.rotations.quaternion_rotation": (_F, _F, _F, _F),
            "control.gait_clock.advance_if_uneventful": (_V, _RM, _I, _F, _F, _V, _F),
            "stability.support_polygon.margin_of_points": (_F, _F, _M),
            "stability.support_polygon.measure_margins": (_V, _V, _V, _V, _F, _V),
            "stability.support_polygon.watch_margins": (
                _V, _I, types.UniTuple(_F, 3), _B, types.NamedUniTuple(_F, 3, FallLimits),
                types.UniTuple(_V, 3),
            ),
            "control.base_tracking.pendulum_rate": (_F,),
            "planning.recovery_step._heights": (_M, _M),
            "stability.leg_stroke._strokes": (_M, _F, _T, _M, _M, _M, _BV, _M, _V),
            # sensor_models.add_contact is left to its first call: the versions of Drake differ in
            # which of its arguments may be written to.
            "estimation.sensor_models.conclude": (_M, _F, _V),
        },
        "estimator": {
            "math.rotations.yaw_pitch_rotation": (_F, _F),
            "estimation.filter.run_filter": (
                _V, types.UniTuple(_V, 3), model, _M, types.UniTuple(_V, 5),
            ),
            "estimation.sensor_models.sense_imu": (
                _V, _I, _I, _V, _I, types.Tuple((_RM, _RM, _V, _F)), _V,
            ),
            "estimation.sensor_models.sense_joints": (
                _V, _IV, _I, types.Tuple((_RM, _RV, _F)), _V,
            ),
            "estimation.filter.write_state": (_V, _V, model.dtype, _V),
            "estimation.filter.write_deviation": (_V, _V),
        },
        "touch": {
            "estimation.contact_from_torques.update_observer": (
                _V, _M, _FM, _V, _V, _V, _F,
                _named(ObserverModel, _M, _I, _IV, _IV, _I, _V, _V, _F, _F, _F, _F),
                _named(TouchSettings, *(_F,) * 6),
            ),
        },
        "plan": {
            "math.curves.sample_body": (_RM, _F, _F),
            "robot.kinematics.pose": (_M, _V, _M, _T),
            "robot.kinematics.pose_legs": (_M, _M, _T),
            "planning.contact_plan._roll": (_F, _V, _M, _T, _BM, _M, _T),
        },
        "room": {
            "planning.clearance._middles": (_RM, _T, _T, _T),
            "math.ground_distance.profile_distance": (_T, _V, _V, _V, _V, _V, _V),
            "math.distance.points_to_boxes": (_T, _RT, _F),
            "planning.thigh_trunk._clearance": (_T, _M, _Q, _T, _T, _M, _T, _M),
            "planning.thigh_trunk._turn_all": (_T, _M, _Q),
            "math.distance.distance_between_legs": (_Q, _RM, _F),
        },
        "design": {
            "gait_design.kernels.objectives_of_slacks": (_M, _V),
            "gait_design.kernels.slacks": (
                _named(Cycle, _T, _Q, _V, _IM), _named(Staircase, _F, _F),
                _named(RobotTables, _F, _M, _M, _V, _M, _T, _T, _F), _V, _M, _V,
            ),
        },
    }  # fmt: skip


DESIGN = ("design", "plan+room")  # what `drake-quad check` and `chart` call


def kernels_for(controller: str, estimator: str, contacts: str) -> tuple[str, ...]:
    """What each process is to compile for a run.

    Args:
        controller: The scenario's `controller.kind`.
        estimator: The scenario's `estimator.kind`.
        contacts: Its `sensors.contacts`.
    """
    forces = "forces+loop+plan" if controller == "whole_body" else "loop+plan"
    feet = "feet+touch" if contacts == "joints" else "feet"
    return (feet, forces, "estimator") if estimator == "ekf" else (feet, forces)


def compile_groups(groups: Iterable[str]) -> None:
    """Compiles the kernels of these groups that are not in the cache, and keeps them there."""
    for kernel, signature in _missing(groups):
        kernel.compile(signature)


def load_kernels(parts: Iterable[str]) -> None:
    """Has this process hold the compiled kernels of these parts, before it calls the first.

    To read one from the cache takes some 20 ms, which a loop that keeps real time does not have.

    Args:
        parts: As for `precompiling`.
    """
    for kernel, signature in _signatures(group for part in parts for group in part.split("+")):
        kernel.compile(signature)


def _missing(groups: Iterable[str]) -> list[tuple[Any, Signature]]:
    """The kernels of these groups that the cache does not have, with their signatures."""
    codegen = cpu_target.target_context.codegen()
    return [
        (kernel, signature)
        for kernel, signature in _signatures(groups)
        if not kernel._cache.has(signature, codegen)
    ]


def _signatures(groups: Iterable[str]) -> Iterator[tuple[Any, Signature]]:
    """The kernels of these groups with their signatures."""
    table = _kernels()
    for group in groups:
        for path, signature in table[group].items():
            module, name = path.rsplit(".", 1)
            yield getattr(import_module(f"drake_quad.{module}"), name), signature


@contextmanager
def precompiling(parts: Iterable[str], tell: Tell | None = None) -> Iterator[Callable[[], None]]:
    """Has kernels compiled while the caller does something else.

    Whatever goes wrong with it costs time alone: a kernel that is not in the cache when it is
    called is compiled then.

    Args:
        parts: What each process compiles: groups of kernels, joined by `+`.
        tell: It is told in a line that there is something to wait for, and when it is done.

    Yields:
        A function that waits until all is compiled.
    """
    begun, processes = time.monotonic(), _begin(parts)
    if processes and tell is not None:
        tell("compiling the numeric kernels that this needs, each once: about 15 s")

    def wait() -> None:
        if not processes:
            return
        for process in processes:
            process.wait()
        processes.clear()
        if tell is not None:
            tell(f"compiled in {time.monotonic() - begun:.0f} s")

    try:
        yield wait
    finally:
        for process in processes:
            process.kill()
            process.wait()


def _begin(parts: Iterable[str]) -> list["subprocess.Popen[bytes]"]:
    """Begins a process for each part that has something to compile."""
    # Where nothing is kept, or with one processor, another process would be of no help.
    if kernel_directory() is None or (os.cpu_count() or 1) < 2:
        return []
    wanted = [part for part in parts if _missing(part.split("+"))]
    command = [sys.executable, "-P", "-m", "drake_quad.simulation.precompile"]
    processes: list[subprocess.Popen[bytes]] = []
    with suppress(OSError):
        for part in wanted:
            processes.append(
                subprocess.Popen(
                    [*command, part],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
            )
    return processes


if __name__ == "__main__":
    compile_groups(sys.argv[1].split("+"))
