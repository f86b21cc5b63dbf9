"""A loop that was kept from running answers what waits for it without a pause for the drives."""

import numpy as np
import pytest
from bus_rig import PERIOD_NS, PuppetShow, short_walk

from drake_quad.bus.control_loop import AT_ONCE
from drake_quad.bus.safety import SafetyMode

STALL = 30  # periods
MS = PERIOD_NS // 2


def test_after_a_stall_drives_hear_a_command_for_every_few_states() -> None:
    """All are answered, in their order, a command after every AT_ONCE; then it is up to date.

    The loop's figures have the age of the state that a command answers, not of the newest.
    """
    show = PuppetShow(short_walk())
    while show.loop.mode != SafetyMode.WALKING:
        show.tick()
    for _ in range(10):
        show.tick()
    puppet, before = show.puppet, len(show.puppet.commands)
    walked = show.loop.controller._ticks  # type: ignore[attr-defined]
    first = puppet.sequence
    for _ in range(STALL):
        puppet.send()
        show.clock.sleep_until(show.clock.now_ns() + PERIOD_NS)
    ticks = -(-STALL // AT_ONCE)
    for _ in range(ticks):
        show.loop.tick()
        show.clock.sleep_until(show.clock.now_ns() + MS)
    puppet.obey()
    assert show.loop.mode == SafetyMode.WALKING
    answered = [one.state_sequence for one in puppet.commands[before:]]
    assert answered == [*range(first + AT_ONCE, first + STALL, AT_ONCE), first + STALL]
    assert show.loop.controller._ticks == walked + STALL  # type: ignore[attr-defined]
    steps = np.diff([one.position for one in puppet.commands[before - 1 :]], axis=0)
    assert np.abs(steps).max() <= 0.05
    age = show.loop.times.figures()["state_age_ms"]["max"]
    assert age == pytest.approx(ticks - 1.0)  # of the last, which had come with the first
    show.tick()
    assert puppet.commands[-1].state_sequence == puppet.sequence


def test_a_bus_quicker_than_the_controller_leaves_no_state_waiting() -> None:
    """With six states in each period a command answers the newest of them, tick after tick."""
    show = PuppetShow(short_walk())
    while show.loop.mode != SafetyMode.WALKING:
        show.tick()
    puppet = show.puppet
    for _ in range(60):
        for _ in range(6):
            show.clock.sleep_until(show.clock.now_ns() + PERIOD_NS // 6)
            puppet.send()
        show.loop.tick()
        puppet.obey()
        assert puppet.commands[-1].state_sequence == puppet.sequence
