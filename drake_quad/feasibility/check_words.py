"""Stairs, and numbers of treads, in the words of `check`'s answers."""

from dataclasses import fields
from fractions import Fraction
from typing import Any

from drake_quad.terrain.elements import Stairs


def treads_in_words(count: int, places: int) -> str:
    """So many places to step on, in treads.

    Args:
        count: Number of places.
        places: Number of places on a tread.
    """
    share = Fraction(count, places)
    parts = {Fraction(1, 2): "half a tread", Fraction(1, 3): "a third of a tread",
             Fraction(2, 3): "two thirds of a tread", Fraction(1): "1 tread"}  # fmt: skip
    return parts.get(share, f"{float(share):.3g} treads")


def near_words(report: dict[str, Any]) -> str:
    """Says which stairs would work, after the search for the nearest."""
    near = report["nearest"]
    if near is None:
        return "no lower rise and no deeper run was found that works"
    return f"{near['rise']:g} m on treads of {near['run']:g} m would work"


def stairs_in_words(asked: dict[str, Any]) -> str:
    """What was asked about, for people."""
    if "scenario" in asked:
        return f"the course of {asked['scenario']}"
    flight = {field.name for field in fields(Stairs)}
    return str(Stairs(**{name: value for name, value in asked.items() if name in flight}))
