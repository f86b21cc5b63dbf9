"""What cleaning a robot's file gives, and what the three formats have in common."""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_quad.errors import InputError
from drake_quad.robot.importing.locate import resolve
from drake_quad.robot.importing.mesh_files import hull_as_obj
from drake_quad.robot.importing.records import DROPPED, REPAIRED, Note
from drake_quad.robot.importing.xml_numbers import floats

# Of Drake's tags for a drive: what is taken if there is none, and the most that any drive has.
DRIVE_NUMBERS = (("rotor_inertia", 0.0, 1e3), ("gear_ratio", 1.0, 1e4))  # [kg m²], none


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
        source: The file, for errors.
        drives: By joint; of SDF by model and joint, `model::joint`.
        reference: Angles of a standing pose by joint [rad], where the file has one.
        notes: What was done.
        files: Every other file that was read.
        shapeless: Links of which a collision mesh is missing.
        included: Every file that was included, as often as it was.
        massless: Links that have no mass whatever Drake reads, `model::link`.
        frictional: Links whose collision shapes state a friction of Drake's kind.
    """

    root: ET.Element
    beside: Path
    scratch: Path
    source: str
    drives: dict[str, Drive] = field(default_factory=dict)
    reference: dict[str, float] = field(default_factory=dict)
    notes: list[Note] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    shapeless: set[str] = field(default_factory=set)
    included: list[Path] = field(default_factory=list)
    massless: set[str] = field(default_factory=set)
    frictional: set[str] = field(default_factory=set)

    def refuse(self, field: str, value: Any, remedy: str) -> InputError:
        """The error that names the file, a field of it, its value and what would be right."""
        return InputError(source=self.source, field=field, value=value, remedy=remedy)

    def strictly(self, text: str | None, field: str) -> list[float]:
        """The numbers in an attribute that Drake is not to see; none for none.

        Raises:
            InputError: If anything in it is no number.
        """
        found = floats(text)
        if not found and (text or "").strip():
            raise self.refuse(field, text, "must be a number")
        return found

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

    def mesh_of(self, link: str, kind: str, uri: str) -> Path | None:
        """The file of a link's mesh, or None with a note.

        Args:
            link: Its name.
            kind: `visual`, or `collision`: of that the convex hull, as a file that Drake takes.
            uri: As the robot's file names the mesh.
        """
        what = f"{kind} of link {link}"
        found = self.locate_mesh(uri, what)
        if kind == "visual":
            return found
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

    def drive_number(self, text: str | None, field: str, otherwise: float, most: float) -> float:
        """A rotor's inertia or a gear's ratio; `otherwise` if the file gives none.

        Raises:
            InputError: If it is no number, or one that no drive has; a ratio of 0 is none.
        """
        found = (self.strictly(text, field) or [otherwise])[0]
        least = 0.0 if otherwise == 0.0 else 1.0 / most
        if not least <= found <= most:
            raise self.refuse(field, text, f"must be a number from {least:g} to {most:g}")
        return found
