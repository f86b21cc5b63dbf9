"""What cleaning a robot's file gives, and what the three formats have in common."""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

from drake_quad.robot.importing.locate import resolve
from drake_quad.robot.importing.mesh_files import hull_as_obj
from drake_quad.robot.importing.records import DROPPED, REPAIRED, Note


@dataclass
class Drive:
    """What a file says of a joint's drive: torque limit [Nm], rotor inertia [kg m²], gear ratio."""

    effort: float = math.inf
    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0


@dataclass
class Cleaned:
    """A file that Drake's parser takes, and what had to be taken out of it.

    Attributes:
        root: The tree, changed in place by those who clean.
        beside: Folder of the original, from which its relative paths go.
        scratch: Folder for converted meshes.
        drives: By joint.
        reference: Angles of a standing pose by joint [rad], where the file has one.
        notes: What was done.
        files: Every other file that was read.
        shapeless: Links of which a collision mesh is missing.
    """

    root: ET.Element
    beside: Path
    scratch: Path
    drives: dict[str, Drive] = field(default_factory=dict)
    reference: dict[str, float] = field(default_factory=dict)
    notes: list[Note] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    shapeless: set[str] = field(default_factory=set)

    def note(self, kind: str, text: str) -> None:
        """Notes something once."""
        note = Note(kind, text)
        if note not in self.notes:
            self.notes.append(note)

    def locate_mesh(self, uri: str, what: str) -> Path | None:
        """The mesh's file; None, with a note, if it is not there."""
        found = resolve(uri, beside=self.beside)
        if found is None:
            self.note(DROPPED, f"{what}: mesh {Path(uri).name} is not there")
        elif found not in self.files:
            self.files.append(found)
        return found

    def collision_mesh(self, uri: str, link: str) -> Path | None:
        """The convex hull of a link's mesh, as a file that Drake takes, or None with a note."""
        what = f"collision of link {link}"
        found = self.locate_mesh(uri, what)
        hull = hull_as_obj(found, self.scratch) if found else None
        if found and hull is None:
            self.note(DROPPED, f"{what}: mesh {found.name} cannot be read")
        if hull is None:
            self.shapeless.add(link)
        return hull

    def order_limits(self, joint: str, lower: float, upper: float) -> tuple[float, float]:
        """The limits in order, with a note if they were not."""
        if lower <= upper:
            return lower, upper
        self.note(REPAIRED, f"{joint}: limits {lower:g} and {upper:g} were reversed; swapped")
        return upper, lower
