"""Compiles the numeric kernels of the control loop.

The loop's mathematics is a few hundred scalar operations a tick, which cost far less than the
interpreter that would carry them out. `compiled` keeps them plain Python to read and to test.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

from drake_quad.kernel_cache import KernelCache

P = ParamSpec("P")
R = TypeVar("R")
FloatArray = NDArray[np.float64]


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


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Makes `function` a part of each kernel that calls it; alone it is compiled for no later use.

    Args:
        function: See `compiled`; a few lines.
    """
    return cast(Callable[P, R], numba.njit(error_model="numpy", inline="always")(function))


# Kernels copy arrays by these. Numba's own `a[:] = b` first compiles the text of the error that it
# would raise for shapes that differ, which takes longer than most kernels do.


@inlined
def copy_vector(target: FloatArray, source: FloatArray) -> None:
    """Copies (n,) values of `source` into `target`, which has n; neither shape is looked at."""
    for i in range(target.shape[0]):
        target[i] = source[i]


@inlined
def copy_matrix(target: FloatArray, source: FloatArray) -> None:
    """Copies (n, m) values of `source` into `target`, which has (n, m); see `copy_vector`."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = source[i, j]


@inlined
def copy_stack(target: FloatArray, source: FloatArray) -> None:
    """Copies (k, n, m) values of `source` into `target`, of the same; see `copy_vector`."""
    for k in range(target.shape[0]):
        for i in range(target.shape[1]):
            for j in range(target.shape[2]):
                target[k, i, j] = source[k, i, j]
