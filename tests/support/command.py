"""Runs the drake-quad command for the tests."""

import json
import os
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

COMMAND = [sys.executable, "-m", "drake_quad"]
LONGEST = 120  # [s] that a command may take


@cache
def _server() -> subprocess.Popen[str]:
    """One for this process, which ends with it: its stdin is closed then."""
    script = Path(__file__).with_name("command_server.py")
    return subprocess.Popen([sys.executable, script], stdin=subprocess.PIPE,
                            stdout=subprocess.PIPE, text=True)  # fmt: skip


def drake_quad(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own, as COMMAND runs it, without its seconds of imports."""
    server = _server()
    assert server.stdin is not None and server.stdout is not None
    with tempfile.TemporaryDirectory() as folder:
        streams = {name: Path(folder) / name for name in ("stdout", "stderr")}
        request = {
            "arguments": arguments,
            "environment": dict(os.environ),
            "cwd": str(cwd),
            "seconds": LONGEST,
            **{name: str(path) for name, path in streams.items()},
        }
        server.stdin.write(json.dumps(request) + "\n")
        server.stdin.flush()
        told = server.stdout.readline()
        assert told, "the process that carries out commands has ended"
        stdout, stderr = (path.read_text() for path in streams.values())
    return subprocess.CompletedProcess([*COMMAND, *arguments], int(told), stdout, stderr)


def drake_quad_afresh(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """The same from a new interpreter, whose imports and environment are its own."""
    return subprocess.run(
        [*COMMAND, *arguments], cwd=cwd, capture_output=True, text=True, timeout=LONGEST,
        check=False,
    )  # fmt: skip


def refused(done: subprocess.CompletedProcess[str]) -> str:
    """The one line on stderr of a command that ended with status 2, without a traceback."""
    assert done.returncode == 2, done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert "Traceback" not in done.stderr
    return lines[0]
