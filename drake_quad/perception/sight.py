"""What a robot saw from where it stood, and what came of it; and what it saw later on its way."""

from dataclasses import dataclass, field, replace

import numpy as np

from drake_quad.common import FloatArray, read_only
from drake_quad.perception.level_beyond import Level
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_map import StairMap


@dataclass(frozen=True, eq=False)
class Sight:
    """What the robot saw as it stood at its start; arrays cannot be written to.

    Attributes:
        belief: The stairs that the last image showed; None if it showed none.
        stamp: Time of that image [s]; -inf if none had arrived.
        images: How many images were looked at.
        depth: That image: distances along the optical axis [m], (height, width); 0 where none.
        level: What it showed beyond the last nosing; None if it showed no flight up.
        map: The map made of the belief; None if there is none.
        refused: Why the robot stays where it is; empty if it climbs.
    """

    belief: StairBelief | None
    stamp: float
    images: int
    depth: FloatArray
    level: Level | None = None
    map: StairMap | None = None
    refused: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth", read_only(self.depth))


@dataclass(frozen=True, eq=False)
class MapRevision:
    """A further look, or what feet have found, and the map that came of it.

    Arrays cannot be written to.

    Attributes:
        number: Its number: 0 of the look from the start, then one more each.
        stamp: Time of the image, or of the last touchdown [s].
        belief: The stairs that it showed; None if it showed none.
        level: What it showed beyond the last nosing; None if it showed no flight up.
        map: The map since then; that of before where nothing came of it.
        reason: Why nothing came of it; empty if something did.
        depth: The image [m], (height, width); 0 where there is none.
        looked: Whether it is a look; else it has what feet have found, and no image.
        stood_on: How many of the treads feet have told the height of, of one that is no look.
    """

    number: int
    stamp: float
    belief: StairBelief | None
    level: Level | None
    map: StairMap
    reason: str = ""
    depth: FloatArray = field(default_factory=lambda: np.zeros((1, 1)), repr=False)
    looked: bool = True
    stood_on: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth", read_only(self.depth))

    def __deepcopy__(self, memo: object) -> "MapRevision":
        """It never changes, so that Drake may copy a Context without copying it."""
        return self


def with_reason(
    revisions: tuple[MapRevision, ...], planned_on: int, reason: str
) -> tuple[MapRevision, ...]:
    """The revisions, with why nothing came of the last one where nothing was planned on it.

    Args:
        revisions: The revisions of a run that has ended.
        planned_on: Number of the revision that was planned on last.
        reason: Why the run ended.
    """
    last = revisions[-1]
    if last.number <= planned_on or last.reason:
        return revisions
    return (*revisions[:-1], replace(last, reason=reason))
