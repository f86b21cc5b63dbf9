"""Statically stable stair climbing for quadrupeds, planned, simulated in Drake, measured."""

__version__ = "0.1.0"
