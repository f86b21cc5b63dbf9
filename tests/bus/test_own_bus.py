"""A bus of a person's own: one file with one class, which both sides are told."""

import re
from pathlib import Path

import numpy as np
import pytest
from bus_rig import COMMAND, STATE

from drake_quad.bus.buses import BusEnd, find_bus
from drake_quad.bus.processes import BusChoice, check_choice
from drake_quad.errors import InputError

PAGE = Path(__file__).parents[2] / "docs" / "bus.md"


def example(directory: Path) -> Path:
    """The page's example, in a file."""
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    path = directory / "my_bus.py"
    path.write_text(code)
    return path


def test_messages_go_over_the_bus_of_the_page(tmp_path: Path) -> None:
    """A state and a command come out at the other end as they went in, and nowhere else."""
    make = find_bus(f"{example(tmp_path)}:UdpBus")
    robot, controller = (
        make(BusEnd(now_ns=lambda: 5, robot=side, domain=77)) for side in (True, False)
    )
    try:
        robot.publish_state(STATE)
        controller.publish_command(COMMAND)
        (state,), (command,) = controller.receive_states(), robot.receive_commands()
        assert not controller.receive_commands() and not robot.receive_states()
    finally:
        robot.close()
        controller.close()
    assert state.message is not None and command.message is not None
    assert state.time_ns == 5 and state.message.sequence == STATE.sequence
    assert np.array_equal(state.message.position, STATE.position)
    assert np.array_equal(command.message.effort, COMMAND.effort)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("ros", "give lcm or unitree, or a bus of your own"),
        ("no_such_bus.py:Bus", "no_such_bus.py is not there"),
        ("no_such_package.bus:Bus", "cannot be imported (ModuleNotFoundError"),
        ("{here}:TcpBus", "has no class TcpBus"),
        ("{here}:", "give lcm or unitree, or a bus of your own"),
        ("{broken}:Bus", "cannot be imported (ZeroDivisionError: division by zero)"),
    ],
)
def test_what_is_no_bus_is_one_line(name: str, why: str, tmp_path: Path) -> None:
    """Option, value and what would be right, whatever the file does as it is executed."""
    broken = tmp_path / "broken_bus.py"
    broken.write_text("1 / 0\n")
    choice = BusChoice(bus=name.format(here=example(tmp_path), broken=broken))
    with pytest.raises(InputError) as error:
        check_choice(choice, named=False, ready=True)
    assert error.value.field == "bus" and why in str(error.value) and "\n" not in str(error.value)


def test_nobody_is_commanded_over_an_unknown_bus_unasked(tmp_path: Path) -> None:
    """Where it leads is not known, so that a person has to say that a robot may move."""
    choice = BusChoice(bus=f"{example(tmp_path)}:UdpBus")
    with pytest.raises(InputError, match="--i-am-ready"):
        check_choice(choice, named=True, ready=False)
    check_choice(choice, named=False, ready=True)
