"""Compiles the numeric kernels of the control loop.

The loop's mathematics is a few hundred scalar operations a tick, which cost far less than the
interpreter that would carry them out. `compiled` keeps them plain Python to read and to test.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

from drake_quad.kernel_cache import KernelCache

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compiles `function` at its first call and keeps the result on disk for later processes.

    Args:
        function: Its arguments are floats and float64 arrays alone. There is no fast-math: the
            same inputs give the same result to the bit.
    """
    # A wrapper for callers in C takes a tenth of the time to compile, and there is no such caller.
    kernel = numba.njit(error_model="numpy", no_cfunc_wrapper=True)(function)
    if function.__module__.startswith("drake_quad."):  # of others the sources are not looked at
        kernel._cache = KernelCache(function)
    return cast(Callable[P, R], kernel)
