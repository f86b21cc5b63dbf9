"""Compiles numeric kernels with numba, and keeps them on disk for later processes.

The loop's mathematics is a few hundred scalar operations a tick, which cost far less than the
interpreter that would carry them out. `jit` keeps them plain Python to read and to test.
"""

import hashlib
import os
import pickle
import platform
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from drake_quad.common import FloatArray
from drake_quad.util.files import cache_directory, private_directory

PACKAGE = Path(__file__).parent
# Packages that have kernels, or constants that kernels use; and modules at the top that have some.
KERNEL_PACKAGES = (
    "math",
    "robot",
    "estimation",
    "terrain",
    "perception",
    "stability",
    "gait",
    "planning",
    "control",
    "gait_design",
)
KERNEL_MODULES = ("common.py", "jit.py")
STATES_KEPT = 8  # directories of other sources or versions that are left in place
DIGEST_SIZE = hashlib.sha256().digest_size


class KernelCache(NullCache):
    """The cache of one kernel: a file for each signature and processor.

    Numba's own cache writes beside the sources, looks at a kernel's own file alone (and would go
    on using an older version of a kernel that it calls), and fails where a file is damaged or the
    disk is full. Here the directory's name is a digest of all sources that bear on a kernel and of
    the versions that made it, every file begins with the digest of what follows, and whatever is
    wrong with a file means that the kernel is compiled again.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        """Takes the function's name; looks at no file yet.

        Args:
            function: The kernel as it is written in Python.
        """
        self._name = f"{function.__module__}.{function.__qualname__}"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled kernel for a signature, or None."""
        data = _read(self._path(sig, target_context.codegen()))
        if data is None:
            return None
        target_context.refresh()
        try:
            return CompileResult._rebuild(target_context, *pickle.loads(data))
        except Exception:  # whatever it is, compiling is the way out
            return None

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Keeps a compiled kernel, if there is a place for it."""
        path = self._path(sig, cres.codegen)
        if path is not None and not cres.library.has_dynamic_globals:
            _write(path, dumps(cres._reduce()))

    def has(self, sig: Any, codegen: Any) -> bool:
        """Whether there is a file for a signature, sound or not."""
        path = self._path(sig, codegen)
        return path is not None and path.is_file()

    def _path(self, sig: Any, codegen: Any) -> Path | None:
        folder = kernel_directory()
        if folder is None:
            return None
        # What the processor can do is part of the key: a home directory may be on many machines.
        key = repr((sig, codegen.magic_tuple())).encode()
        return folder / f"{self._name}-{hashlib.sha256(key).hexdigest()[:16]}"


@cache
def kernel_directory() -> Path | None:
    """The directory of kernels made from these sources by these versions.

    Returns:
        None where there is no directory that can be written to, and by this user alone. Then every
        process compiles for itself.
    """
    root = cache_directory() / "kernels"
    folder = root / _state()
    if not private_directory(root) or not private_directory(folder):
        return None
    _drop_old(root, folder)
    return folder


def _state() -> str:
    """A digest of the sources that bear on kernels, and of the versions that compile them."""
    versions = (numba.__version__, np.__version__, platform.python_version())
    digest = hashlib.sha256(" ".join(versions).encode())
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        if parts[0] in KERNEL_PACKAGES or parts[-1] in KERNEL_MODULES:
            digest.update("/".join(parts).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def _drop_old(root: Path, now: Path) -> None:
    """Removes the directories that were made first, so that the cache does not grow for ever."""
    with suppress(OSError):
        others = [folder for folder in root.iterdir() if folder != now]
        others.sort(key=lambda folder: folder.stat().st_mtime)
        for folder in others[:-STATES_KEPT]:
            shutil.rmtree(folder, ignore_errors=True)


def _read(path: Path | None) -> bytes | None:
    """What a file holds after its digest; None if it is not there, damaged, or not this user's."""
    if path is None:
        return None
    try:
        with path.open("rb") as file:
            if os.fstat(file.fileno()).st_uid != os.getuid():
                return None
            content = file.read()
    except OSError:
        return None
    digest, data = content[:DIGEST_SIZE], content[DIGEST_SIZE:]
    return data if hashlib.sha256(data).digest() == digest else None


def _write(path: Path, data: bytes) -> None:
    """Writes a file whole or not at all; a full disk costs the next process its time, no more."""
    with suppress(OSError):
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".making_")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(hashlib.sha256(data).digest() + data)
            Path(name).replace(path)
        except OSError:
            Path(name).unlink(missing_ok=True)


P = ParamSpec("P")
R = TypeVar("R")


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compiles `function` at its first call and keeps the result on disk for later processes.

    Args:
        function: Function of floats, arrays, records and tuples of these. There is no fast-math:
            the same inputs give the same result to the bit.
    """
    # A wrapper for callers in C takes a tenth of the time to compile, and there is no such caller.
    kernel = numba.njit(error_model="numpy", no_cfunc_wrapper=True)(function)
    if function.__module__.startswith("drake_quad."):  # of others the sources are not looked at
        kernel._cache = KernelCache(function)
    return cast(Callable[P, R], kernel)


def jit_released(function: Callable[P, R]) -> Callable[P, R]:
    """Compiles `function` as `jit` does; while it runs, other threads may run Python.

    For kernels that take milliseconds alone: whoever gives the interpreter away has to wait for it
    again.

    Args:
        function: Function as for `jit`.
    """
    kernel = numba.njit(error_model="numpy", no_cfunc_wrapper=True, nogil=True)(function)
    kernel._cache = KernelCache(function)
    return cast(Callable[P, R], kernel)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Makes `function` a part of each kernel that calls it; alone it is compiled for no later use.

    Args:
        function: Function as for `jit`, a few lines long.
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
