"""Compiled kernels are kept where nobody else can write, and used only if they are sound."""

import errno
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import platformdirs
import pytest

from drake_quad import jit as kernel_cache
from drake_quad.jit import KernelCache, kernel_directory
from drake_quad.util import files as places


def triple(x: float) -> float:
    """The kernel of these tests."""
    return 3.0 * x


def make_kernel() -> Any:
    """The kernel in a dispatcher of its own, as a process has that begins."""
    kernel = numba.njit(no_cfunc_wrapper=True)(triple)
    kernel._cache = KernelCache(triple)
    return kernel


def hits(kernel: Any) -> int:
    """How many signatures came from the cache."""
    return sum(kernel.stats.cache_hits.values())


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The directory of all caches."""
    monkeypatch.setenv("DRAKE_QUAD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(kernel_cache, "kernel_directory", kernel_directory.__wrapped__)
    return tmp_path / "cache"


def kept(root: Path) -> list[Path]:
    """The files in the cache."""
    return [path for path in (root / "kernels").rglob("*") if path.is_file()]


def test_a_second_process_loads_what_the_first_compiled(root: Path) -> None:
    """One file is kept, for one signature, and the kernel from it gives the same."""
    assert make_kernel()(2.0) == 6.0
    assert len(kept(root)) == 1
    again = make_kernel()
    assert again(2.0) == 6.0 and hits(again) == 1


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "half": lambda content: content[: len(content) // 2],
    "one bit": lambda content: content[:5000] + bytes([content[5000] ^ 1]) + content[5001:],
    "foreign": lambda content: b"import os" * 1000,
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE.keys())
def test_a_damaged_file_is_compiled_anew(root: Path, damage: Callable[[bytes], bytes]) -> None:
    """The result is right, nothing was loaded, and the file is sound again."""
    make_kernel()(2.0)
    (path,) = kept(root)
    path.write_bytes(damage(path.read_bytes()))
    again = make_kernel()
    assert again(2.0) == 6.0 and hits(again) == 0
    third = make_kernel()
    assert third(2.0) == 6.0 and hits(third) == 1


def test_a_sound_file_that_is_no_kernel_is_compiled_anew(root: Path) -> None:
    """The digest alone makes no kernel."""
    make_kernel()(2.0)
    (path,) = kept(root)
    kernel_cache._write(path, b"whatever")
    again = make_kernel()
    assert again(2.0) == 6.0 and hits(again) == 0


def test_a_full_disk_costs_time_alone(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel works, and no half of a file is left."""
    fdopen = os.fdopen

    class Full:
        """A file on a full disk."""

        def __init__(self, handle: int, mode: str) -> None:
            self._file = fdopen(handle, mode)

        def __enter__(self) -> "Full":
            return self

        def __exit__(self, *_: object) -> None:
            self._file.close()

        def write(self, data: bytes) -> None:
            self._file.write(data[:100])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fdopen", Full)
    assert make_kernel()(2.0) == 6.0
    assert kept(root) == []


def test_without_a_directory_every_process_compiles(root: Path) -> None:
    """A cache that cannot be made, as on a read-only disk, is no error."""
    root.write_text("a file where the directory should be")
    assert kernel_cache.kernel_directory() is None
    assert make_kernel()(2.0) == 6.0


def test_other_sources_and_versions_have_other_directories(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What another numba compiled is never loaded."""
    first = kernel_cache.kernel_directory()
    assert first == kernel_cache.kernel_directory()
    monkeypatch.setattr(numba, "__version__", "0.0.1")
    assert kernel_cache.kernel_directory() not in (first, None)


def test_the_cache_does_not_grow_for_ever(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Directories of older sources go, the oldest first."""
    for k in range(20):
        monkeypatch.setattr(numba, "__version__", f"0.0.{k}")
        folder = kernel_cache.kernel_directory()
        assert folder is not None and folder.is_dir()
        os.utime(folder, (k, k))
    assert len(list((root / "kernels").iterdir())) == kernel_cache.STATES_KEPT + 1


def test_a_new_directory_is_this_users_alone(tmp_path: Path) -> None:
    """It is made so that nobody else can read or write."""
    assert places.private_directory(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o770, 0o702])
def test_a_directory_that_others_can_write_to_is_not_trusted(tmp_path: Path, mode: int) -> None:
    """What lies there may be anybody's, and would be executed."""
    folder = tmp_path / "cache"
    folder.mkdir()
    folder.chmod(mode)
    assert not places.private_directory(folder)


def test_a_directory_that_others_can_replace_is_not_trusted(tmp_path: Path) -> None:
    """Whoever can write to the folder above can put another in its place, unless it is sticky."""
    above = tmp_path / "above"
    above.mkdir()
    above.chmod(0o777)
    assert not places.private_directory(above / "cache")
    above.chmod(0o1777)
    assert places.private_directory(above / "cache")


def test_a_directory_of_another_user_is_not_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever owns it may change it."""
    folder = tmp_path / "cache"
    folder.mkdir(mode=0o700)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert not places.private_directory(folder)


@pytest.mark.parametrize("home", ["~/.cache/drake_quad", "/dev/null/.cache/drake_quad"])
def test_a_user_without_a_home_has_a_cache(monkeypatch: pytest.MonkeyPatch, home: str) -> None:
    """It lies among temporary files, in a directory named after the user."""
    monkeypatch.delenv("DRAKE_QUAD_CACHE", raising=False)
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda _: home)
    assert places.cache_directory().parent == Path(tempfile.gettempdir())
