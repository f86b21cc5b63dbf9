"""Makes the checkout importable without installing it, and quiets hypothesis."""

import importlib
import importlib.util
import os
import sys
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


class Load(Protocol):
    """Imports a module of benchmarks/ by its name."""

    def __call__(self, name: str) -> ModuleType:
        """The module; imported when a test asks for it, as some take a while."""
        ...


@pytest.fixture
def load() -> Load:
    """See Load."""
    return lambda name: importlib.import_module(f"benchmarks.{name}")
