"""How a format's table says which attributes and elements there are."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Names:
    """The names that an element knows.

    Attributes:
        attributes: Of its own.
        once: Of elements in it that are there once at most.
        many: Of elements in it that may be there again and again.
        idle: Attributes and elements that change nothing of a robot; so nobody is asked whether he
            meant one of them.
    """

    attributes: frozenset[str]
    once: frozenset[str]
    many: frozenset[str]
    idle: frozenset[str]


# By an element's tag, or by `parent/tag` where a tag is another thing in another element. What is
# idle, unknown or not in the table is not looked at, with all that is in it.
Table = Mapping[str, Names]


def names(attributes: str = "", *, once: str = "", many: str = "", idle: str = "") -> Names:
    """The names of an element, each a string of words."""
    return Names(*(frozenset(text.split()) for text in (attributes, once, many, idle)))
