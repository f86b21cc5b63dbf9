"""Statically stable stair climbing for quadrupeds, planned, simulated in Drake, measured."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("drake_quad")  # pyproject.toml says it, and nobody else
except PackageNotFoundError:  # a checkout on the path that was never installed
    __version__ = "0+unknown"
