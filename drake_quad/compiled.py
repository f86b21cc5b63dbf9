"""Compiles the numeric kernels of the control loop.

The loop's mathematics is a few hundred scalar operations a tick, which cost far less than the
interpreter that would carry them out. `compiled` keeps them plain Python to read and to test.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import ParamSpec, TypeVar, cast

import numba

KERNEL_ROOMS = ("gait", "robot", "control", "estimation")  # kernels, and constants they use
P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compiles `function` at its first call and keeps the result on disk for later processes.

    Args:
        function: Of floats and float64 arrays alone. No fast-math: the same inputs give the same
            result to the bit.
    """
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = _cache_directory()
    try:
        return cast(Callable[P, R], numba.njit(cache=True, error_model="numpy")(function))
    finally:
        numba.config.CACHE_DIR = before


@cache
def _cache_directory() -> str:
    """Where the compiled code is kept: a place of its own for every state of the sources.

    Numba's own cache looks at a kernel's file alone, and would go on using what a kernel that it
    calls in another file was before that was changed.
    """
    package = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        if b"@compiled" in text or path.parent.name in KERNEL_ROOMS:
            digest.update(text)
    home = package / "__pycache__"
    try:
        home.mkdir(exist_ok=True)
        writable = os.access(home, os.W_OK)
    except OSError:
        writable = False
    if not writable:  # installed for all users
        home = Path(tempfile.gettempdir()) / f"drake_quad-{os.getuid()}"
    return str(home / f"kernels-{digest.hexdigest()[:16]}")
