"""The sources, and the versions of the libraries, that a result depends on."""

import hashlib
import platform
from collections.abc import Callable
from functools import cache
from importlib import resources
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import drake_quad

PACKAGE = Path(drake_quad.__file__).parent
MODELS = Path(str(resources.files("drake_quad_models")))  # shipped robots and scenarios
MODULES = {"pycollada": "collada"}  # where they are not called as what is installed


@cache
def versions() -> dict[str, str]:
    """The versions of the libraries that a result depends on."""
    names = ["drake_quad", "drake", "numpy", "scipy", "piqp", "daqp", "numba"]
    # Collision shapes are read from meshes where these are there, and are others where not.
    names += [name for name in ("trimesh", "pycollada") if find_spec(MODULES.get(name, name))]
    return {**{name: version(name) for name in names}, "python": platform.python_version()}


def digest_of_sources(left_out: Callable[[tuple[str, ...]], bool] = lambda _: False) -> str:
    """A digest of this package's sources, and of the shipped robots and scenarios.

    Args:
        left_out: Whether a source does not count, by the parts of its path in the package.
    """
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        if not left_out(parts):
            digest.update("/".join(parts).encode() + b"\0" + path.read_bytes())
    for path in sorted(MODELS.iterdir()):
        if path.is_file() and path.suffix in (".urdf", ".xml", ".yaml"):
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]
