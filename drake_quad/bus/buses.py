"""Which buses there are, and how one end of a bus is opened; a third bus is a file of its own."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from drake_quad.bus.joint_map import SAME, JointMap
from drake_quad.bus.lcm_bus import LOOPBACK, LcmBus, lcm_url
from drake_quad.bus.robot_bus import RobotBus
from drake_quad.errors import InputError

BUSES = ("lcm", "unitree")
OWN = "or a bus of your own as FILE.py:CLASS or MODULE:CLASS"


@dataclass(frozen=True, kw_only=True)
class BusEnd:
    """What one end of a bus is opened with.

    Attributes:
        now_ns: The receiver's clock [ns].
        robot: Whether it is the robot's end, which hears commands; a controller's end hears states,
            and, where the bus allows it, the commands of other controllers.
        interface: The machine's network interface; `lo` stays within the machine.
        domain: Number that keeps users of one network apart.
        joints: Order, zeros and senses of the joints in the robot's own file. Messages have those
            of the normal form.
    """

    now_ns: Callable[[], int]
    robot: bool
    interface: str = LOOPBACK
    domain: int = 1
    joints: JointMap = SAME


MakeBus = Callable[[BusEnd], RobotBus]


def find_bus(name: str) -> MakeBus:
    """The maker of a bus by its name.

    Args:
        name: One of BUSES; or `FILE.py:CLASS` or `MODULE:CLASS`, a class (or function) that is
            called with a BusEnd and makes a RobotBus. Its file or module is then executed.

    Raises:
        InputError: There is no such bus, file, module or class.
    """
    if name in BUSES:
        return _make_lcm if name == "lcm" else _make_unitree

    def fail(remedy: str) -> InputError:
        return InputError(source="--bus", field="bus", value=name, remedy=remedy)

    home, colon, own = name.rpartition(":")
    if not (colon and home and own):
        raise fail(f"give {' or '.join(BUSES)}, {OWN}")
    try:
        module = _run_file(Path(home)) if home.endswith(".py") else import_module(home)
    except FileNotFoundError:
        raise fail(f"{home} is not there; give a file that is") from None
    except Exception as problem:  # whatever a person's file does as it is executed
        said = (str(problem).splitlines() or [""])[0]
        raise fail(f"{home} cannot be imported ({type(problem).__name__}: {said})") from None
    make = getattr(module, own, None)
    if not callable(make):
        raise fail(f"{home} has no class {own}")
    found: MakeBus = make
    return found


def _run_file(path: Path) -> ModuleType:
    """The module of a file; it is executed once in a process."""
    name = f"drake_quad_own_bus_{path.stem}"
    if name in sys.modules:
        return sys.modules[name]
    spec = spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # the file's name ends in .py
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.modules[name] = module
    return module


def _make_lcm(end: BusEnd) -> RobotBus:
    url = lcm_url(end.interface, end.domain)
    return LcmBus(url, end.now_ns, hears_states=not end.robot, hears_commands=True)


def _make_unitree(end: BusEnd) -> RobotBus:
    from drake_quad.bus.unitree_bus import UnitreeBus

    return UnitreeBus(end.interface, end.domain, end.now_ns, robot=end.robot, joints=end.joints)
