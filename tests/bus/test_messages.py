"""The messages: what is sent is what comes, and what is spoilt is found."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bus_rig import COMMAND, STATE
from hypothesis import given, strategies as st

from drake_quad.bus.messages import (
    COMMAND_FINGERPRINT,
    STATE_FINGERPRINT,
    CommandMessage,
    decode_command,
    decode_state,
    encode_command,
    encode_state,
)

DEFINITIONS = Path(__file__).parents[2] / "drake_quad" / "bus" / "quad_bus.lcm"


def test_a_message_comes_as_it_was_sent() -> None:
    """Every field of both messages is the same to the bit at the other end."""
    for sent, come in (
        (STATE, decode_state(encode_state(STATE), 5)),
        (COMMAND, decode_command(encode_command(COMMAND), 5)),
    ):
        assert come.fault == "" and come.time_ns == 5
        for name in type(sent).__slots__:
            assert np.array_equal(getattr(sent, name), getattr(come.message, name)), name


@given(st.integers(8, len(encode_state(STATE)) - 1), st.integers(1, 255))
def test_one_wrong_byte_is_found(place: int, turned: int) -> None:
    """Whichever byte behind the fingerprint is changed in whatever way, the CRC shows it."""
    data = bytearray(encode_state(STATE))
    data[place] ^= turned
    assert "CRC" in decode_state(bytes(data), 0).fault


def test_what_is_no_such_message_is_no_message() -> None:
    """Bytes cut short, of the other type, or none at all give a fault and no message."""
    for data in (b"", encode_state(STATE)[:-1], encode_command(COMMAND)):
        come = decode_state(data, 0)
        assert come.message is None and "another type" in come.fault


def test_a_value_that_is_no_number_is_a_fault() -> None:
    """A NaN that was sent with a right CRC is told of."""
    position = np.zeros(12)
    position[4] = np.nan
    sent = CommandMessage(1, 2, 3, 0, 0, position, *(np.zeros(12) for _ in range(4)))
    assert "not a number" in decode_command(encode_command(sent), 0).fault


def test_lcm_gen_reads_the_same(tmp_path: Path) -> None:
    """What LCM's own compiler makes of quad_bus.lcm reads our bytes, fingerprints and all."""
    compiler = Path(sys.executable).with_name("lcm-gen")
    if not compiler.exists():
        found = shutil.which("lcm-gen")
        if found is None:
            pytest.skip("lcm-gen comes with the package lcm")
        compiler = Path(found)
    subprocess.run([compiler, "-p", "--ppath", tmp_path, DEFINITIONS], check=True)
    script = f"""
import sys; sys.path.insert(0, {str(tmp_path)!r})
from drake_quad_lcm import quad_command_t, quad_state_t
s = quad_state_t.decode(bytes.fromhex({encode_state(STATE).hex()!r}))
c = quad_command_t.decode(bytes.fromhex({encode_command(COMMAND).hex()!r}))
print(s.sequence, s.foot_force[3] == {float(STATE.foot_force[3])!r})
print(c.mode, c.damping[11] == {float(COMMAND.damping[11])!r})
print(s.encode()[:8].hex(), c.encode()[:8].hex())
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    state, command, fingerprints = done.stdout.splitlines()
    assert (state, command) == ("8 True", "3 True")
    assert fingerprints == f"{STATE_FINGERPRINT} {COMMAND_FINGERPRINT}"
