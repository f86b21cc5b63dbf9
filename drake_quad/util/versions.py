"""The versions of the libraries that a result depends on."""

import platform
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec

MODULES = {"pycollada": "collada"}  # where they are not called as what is installed


@cache
def versions() -> dict[str, str]:
    """The versions of the libraries that a result depends on."""
    names = ["drake_quad", "drake", "numpy", "scipy", "piqp", "daqp", "numba"]
    # Collision shapes are read from meshes where these are there, and are others where not.
    names += [name for name in ("trimesh", "pycollada") if find_spec(MODULES.get(name, name))]
    return {**{name: version(name) for name in names}, "python": platform.python_version()}
