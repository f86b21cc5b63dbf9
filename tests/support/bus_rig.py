"""A short walk, and a robot without physics, for the tests of the bus."""

from dataclasses import replace
from functools import cache

import numpy as np

from drake_quad.bus.control_loop import ControlLoop
from drake_quad.bus.drive_limits import Drives
from drake_quad.bus.messages import (
    DRIVES_FOLLOW,
    CommandMessage,
    StateMessage,
    encode_state,
)
from drake_quad.bus.postures import sit_to_stand
from drake_quad.bus.processes import FIELDS
from drake_quad.bus.real_time import NS, ManualClock
from drake_quad.bus.robot_bus import LoopbackBus
from drake_quad.bus.safety import SafetyMode
from drake_quad.common import GRAVITY, FloatArray
from drake_quad.scenario.load import parse_scenario
from drake_quad.simulation.prepare import PreparedScenario, prepare

PERIOD_NS = NS // 500
# A message of either kind, its numbers those of a generator: for what carries them.
RNG = np.random.default_rng(3)
STATE = StateMessage(
    7, 8, 9, 1, RNG.normal(size=12), RNG.normal(size=12), RNG.normal(size=12), RNG.normal(size=3),
    RNG.normal(size=3), RNG.normal(size=4),
)  # fmt: skip
COMMAND = CommandMessage(5, 6, 7, 3, 2, *(RNG.normal(size=12) for _ in range(5)))
SHORT_WALK = """
description: A short level walk
course:
  - {kind: floor, length: 4.0, width: 2.0}
start: {distance: 1.0}
mission:
  - {kind: stand, duration: 0.2}
  - {kind: walk, distance: 0.3}
"""


QUICK = ("gait.cycle_time=4.0", "transition.shift_time=0.8", "transition.swing_time=0.6")


@cache
def short_walk(contacts: str = "feet", overrides: tuple[str, ...] = ()) -> PreparedScenario:
    """The short walk, planned once for all tests of a process: none of them changes it.

    Args:
        contacts: The scenario's `sensors.contacts`.
        overrides: What else differs; QUICK makes it in half of the time.
    """
    given = [*FIELDS, f"sensors.contacts={contacts}", *overrides]
    return prepare(parse_scenario(SHORT_WALK, source="short_walk.yaml", overrides=given))


class Pacing:
    """A walker that moves the joints to and fro a little, and ends after a second."""

    def __init__(self, stance: FloatArray) -> None:
        self.ended, self.fault, self._stance, self._ticks = "", "", stance, 0
        self.bearing = np.full(12, 20.0)

    def take(self, state: StateMessage) -> None:
        """A tick of its own."""
        self._ticks += 1
        if self._ticks >= 500:
            self.ended = "goal_reached"

    def wanted(self) -> Drives:
        """Angles around those of standing."""
        sway = 0.1 * np.sin(2.0 * np.pi * self._ticks / 250.0)
        return Drives(self._stance + sway, np.zeros(12), np.full(12, 5.0), 2000.0, 80.0)


class Puppet:
    """A robot whose joints are at once where they are wanted, its clock that of the test."""

    def __init__(self, q: FloatArray, bus: LoopbackBus, clock: ManualClock) -> None:
        self.q, self.bus, self.clock = np.array(q), bus, clock
        self.sequence, self.session = 0, 11
        self.up, self.drives = np.array([0.0, 0.0, 1.0]), DRIVES_FOLLOW
        self.commands: list[CommandMessage] = []

    def state(self) -> StateMessage:
        """What it senses now; another message each time."""
        self.sequence += 1
        shake = 1e-3 * np.sin(self.sequence)  # sensors never show the same
        return StateMessage(
            self.session, self.sequence, self.clock.now_ns(), self.drives, self.q.copy(),
            np.zeros(12), np.zeros(12), np.full(3, shake), GRAVITY * self.up + shake,
            np.full(4, 150.0),
        )  # fmt: skip

    def send(self, state: StateMessage | None = None) -> None:
        """Sends a state, its own unless given."""
        self.bus.state_bytes.append(encode_state(state or self.state()))

    def obey(self) -> None:
        """Goes where the commands that came want it."""
        for one in self.bus.receive_commands():
            assert one.message is not None and not one.fault
            self.commands.append(one.message)
            if one.message.mode != SafetyMode.DAMPING:
                self.q = one.message.position.copy()


class PuppetShow:
    """A control loop and a puppet, tick by tick, with time of the test's own."""

    def __init__(self, prepared: PreparedScenario, *, silent: bool = False) -> None:
        self.clock = ManualClock()
        self.bus = LoopbackBus(self.clock.now_ns)
        postures = sit_to_stand(prepared.robot, prepared.stance)
        self.puppet = Puppet(postures[0] - 0.01, self.bus, self.clock)
        # Its commands come back to the puppet alone: a controller hears others' commands.
        self.others: list[bytes] = []
        self.loop = ControlLoop(
            prepared, _OneEnd(self), self.clock, controller=Pacing(postures[-1]), silent=silent
        )
        self.loop.limits = replace(self.loop.limits, fold_time=0.4, rise_time=0.6)

    def tick(self, *, send: bool = True) -> None:
        """A tick of both sides; without `send` of a robot that says nothing."""
        if send:
            self.puppet.send()
        self.loop.tick()
        self.puppet.obey()
        self.clock.sleep_until(self.clock.now_ns() + PERIOD_NS)


class _OneEnd(LoopbackBus):
    """The controller's end of the show's bus: of commands it hears only others'."""

    def __init__(self, show: PuppetShow) -> None:
        super().__init__(show.clock.now_ns)
        self._show = show
        self.state_bytes, self.command_bytes = show.bus.state_bytes, show.bus.command_bytes

    def receive_commands(self):  # type: ignore[no-untyped-def]
        from drake_quad.bus.messages import decode_command

        heard = [decode_command(data, self._now_ns()) for data in self._show.others]
        self._show.others.clear()
        return heard
