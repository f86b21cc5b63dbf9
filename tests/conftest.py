"""Makes the checkout importable without installing it, and quiets hypothesis."""

import gc
import importlib
import importlib.util
import os
import sys
from collections.abc import Generator
from pathlib import Path
from types import ModuleType
from typing import Protocol

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]

# The suite begins a hundred processes, each of which would compile every module of the checkout
# anew where the environment asks for no bytecode.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

if importlib.util.find_spec("drake_quad") is None:
    sys.path.insert(0, str(ROOT))

if importlib.util.find_spec("drake_quad_models") is None:
    _spec = importlib.util.spec_from_file_location(
        "drake_quad_models",
        ROOT / "models" / "__init__.py",
        submodule_search_locations=[str(ROOT / "models")],
    )
    assert _spec is not None and _spec.loader is not None
    _module = importlib.util.module_from_spec(_spec)
    sys.modules["drake_quad_models"] = _module
    _spec.loader.exec_module(_module)

# A shared machine is no stopwatch: no example fails for being slow. The same commit gives the same
# verdict twice; DRAKE_QUAD_SEARCH=1 looks for new counterexamples instead.
search = bool(os.environ.get("DRAKE_QUAD_SEARCH"))
settings.register_profile("drake_quad", deadline=None, derandomize=not search)
settings.load_profile("drake_quad")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keeps the collector from modules and tests: nearly half a million objects, all to stay.

    It then looks less often at what tests make and keep for one another: a twentieth of their time.
    """
    gc.disable()
    result = yield
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)
    gc.enable()
    return result


# The longest test begins first, or it would be the last to end; it compiles the control loop's
# kernels meanwhile, of which these need none, so that no two processes compile the same.
LONGEST = "test_the_case_study_in_full_keeps_all_that_is_asked_of_it"
WITHOUT_KERNELS = ("test_sweep_crew", "test_sweep_harm", "test_sweep_dask")


@pytest.hookimpl(tryfirst=True)  # before `-m` deselects
def pytest_itemcollected(item: pytest.Item) -> None:
    """Whoever leaves out what is slow leaves out what is long, too."""
    if item.get_closest_marker("long"):
        item.add_marker("slow")


@pytest.hookimpl(trylast=True)  # after `-m` has deselected
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Puts tests in such an order: of n processes each begins with an nth of them."""
    if not hasattr(config, "workerinput"):
        return
    first = [item for item in items if item.name == LONGEST]
    without = [item for item in items if item.path.stem in WITHOUT_KERNELS]
    rest = [item for item in items if item not in first and item not in without]
    share = len(items) // int(config.workerinput["workercount"]) - len(first)
    items[:] = [*first, *rest[:share], *without, *rest[share:]]


class Load(Protocol):
    """Imports a module of benchmarks/ by its name."""

    def __call__(self, name: str) -> ModuleType:
        """The module; imported when a test asks for it, as some take a while."""
        ...


@pytest.fixture
def load() -> Load:
    """See Load."""
    return lambda name: importlib.import_module(f"benchmarks.{name}")


@pytest.fixture
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The directory of a test's own cache: it has the kernels that are compiled, and no robot."""
    from drake_quad.util.files import CACHE_VARIABLE, cache_directory

    kernels, own = cache_directory() / "kernels", tmp_path_factory.mktemp("cache")
    kernels.mkdir(mode=0o700, parents=True, exist_ok=True)
    (own / "kernels").symlink_to(kernels)
    monkeypatch.setenv(CACHE_VARIABLE, str(own))
    return own
