"""Refuses names in a robot's file that are nearly names of its format.

Drake's parser passes over attributes and elements that it does not know, and another robot comes of
it: a joint whose `rnage` is given has no range. Names that are like no other are let pass, for
people extend these formats.
"""

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator
from functools import lru_cache

from drake_quad.errors import InputError
from drake_quad.robot.importer.format_names import MJCF, SDF, URDF, Names, Table
from drake_quad.robot.importer.xml_io import COLON

TABLES: dict[str, Table] = {"robot": URDF, "sdf": SDF, "mujoco": MJCF, "mujocoinclude": MJCF}
SHORTEST = 3  # letters of a name that another may be nearly: of two letters too many are alike
LONG = 8  # letters of a name in which two may be wrong, and not one alone


def check_spelling(root: ET.Element, source: str, *, inside: str = "") -> None:
    """Looks at the names of all that makes the robot in a file.

    Args:
        root: Root of the file as it was read, prefixes with COLON.
        source: The file, for errors.
        inside: If it is included, the tag of the element that takes what the root holds.

    Raises:
        InputError: For the first that is nearly another, which is not given.
    """
    table = TABLES.get(root.tag, {})
    ahead = [(root, inside or root.tag, root.get("name", ""))]
    while ahead:
        element, key, called = ahead.pop()
        known = table.get(key)
        if known is None:
            continue
        own = () if inside and element is root else _attributes(element, known)
        for field, value, remedy in (*own, *_children(element, known)):
            place = f"{called}: " if called else ""
            raise InputError(source=source, field=place + field, value=value, remedy=remedy)
        for child in reversed(element):
            tag = _plain(child.tag)
            if tag not in known.once and tag not in known.many:
                continue
            named = child.get("class" if tag == "default" else "name") or child.get("joint")
            path = f"{key}/{tag}"
            ahead.append((child, path if path in table else tag, named or called))


Complaints = Iterator[tuple[str, str, str]]  # field, value and remedy of each


def _attributes(element: ET.Element, known: Names) -> Complaints:
    """An element's attributes that are nearly others."""
    given = {_plain(name): value for name, value in element.attrib.items()}
    for name, value in given.items():
        meant = _meant(name, known.attributes, known.idle, given)
        if meant:
            tag = _plain(element.tag)
            remedy = f"<{tag}> has no such attribute; did you mean {' or '.join(meant)}?"
            yield f"{tag}.{name}", value, remedy


def _children(element: ET.Element, known: Names) -> Complaints:
    """The elements in one that are nearly others."""
    given = {_plain(child.tag) for child in element} - known.many
    for child in element:
        tag = _plain(child.tag)
        meant = _meant(tag, known.once | known.many, known.idle, given)
        if meant:
            texts = [f"{_plain(key)}={value}" for key, value in child.attrib.items()]
            text = child.get("name") or (child.text or "").strip() or " ".join(texts)
            near = " or ".join(f"<{one}>" for one in meant)
            remedy = f"<{_plain(element.tag)}> holds no such element; did you mean {near}?"
            yield f"<{tag}>", text, remedy


def _plain(name: str) -> str:
    """A name as it is in the file."""
    return name.replace(COLON, ":")


def _meant(
    name: str, known: frozenset[str], idle: frozenset[str], given: Collection[str]
) -> list[str]:
    """What somebody meant who wrote a name: the known ones that it is nearly, if not given."""
    if name in known or name in idle:
        return []
    return [one for one in _nearest(name, known | idle) if one in known and one not in given]


@lru_cache(maxsize=4096)
def _nearest(name: str, known: frozenset[str]) -> tuple[str, ...]:
    """The known names of which the fewest letters are wrong in one; none if too many are."""
    found: dict[int, list[str]] = {}
    for one in sorted(known):
        most = 2 if len(one) >= LONG else 1
        if len(one) < SHORTEST or abs(len(one) - len(name)) > most:
            continue
        wrong = _wrong_letters(name.lower(), one.lower())
        if wrong <= most:
            found.setdefault(wrong, []).append(one)
    return tuple(found[min(found)]) if found else ()


def _wrong_letters(name: str, right: str) -> int:
    """How many letters are missing, too many, others, or swapped with the next."""
    before: list[int] = []
    last = list(range(len(right) + 1))
    for i, letter in enumerate(name, start=1):
        row = [i]
        for j, other in enumerate(right, start=1):
            row.append(min(last[j] + 1, row[-1] + 1, last[j - 1] + (letter != other)))
            if i > 1 and j > 1 and letter == right[j - 2] and name[i - 2] == other:
                row[j] = min(row[j], before[j - 2] + 1)
        before, last = last, row
    return last[-1]
