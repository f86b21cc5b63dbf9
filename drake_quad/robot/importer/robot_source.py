"""What a person gives as a robot: a file, a robot's name, or a `.robot.yaml` that names one."""

from dataclasses import dataclass
from pathlib import Path

from drake_quad.errors import InputError
from drake_quad.robot.importer.overrides import Overrides, is_yaml, read_overrides
from drake_quad.robot.importer.sources import Found, find_robot
from drake_quad.util.files import is_given


@dataclass(frozen=True)
class RobotSource:
    """What a person gave as a robot: its file, and its overrides.

    Attributes:
        found: The robot's own file.
        overrides: Overrides of a `.robot.yaml`; none without one.
        source: Name of the robot as given, for errors.
    """

    found: Found
    overrides: Overrides
    source: str


def find_source(model: str) -> RobotSource:
    """What `model` means: a file, a robot's name, or a `.robot.yaml` that names one.

    Raises:
        InputError: If it is not there.
    """
    found = find_robot(model)
    if not is_yaml(found.path):
        return RobotSource(found, Overrides(), model)
    overrides = read_overrides(found.path)
    own = _named_in(found.path, overrides.model)
    name = overrides.name or found.name
    return RobotSource(Found(own.path, model, name), overrides, model)


def _named_in(yaml_path: Path, inner: str) -> Found:
    """The robot's own file, which a `.robot.yaml` names as `inner`."""

    def refuse(remedy: str) -> InputError:
        return InputError(source=yaml_path.name, field="model", value=inner, remedy=remedy)

    beside = yaml_path.parent / inner
    try:
        own = find_robot(str(beside) if "://" not in inner and is_given(beside) else inner)
    except InputError as error:
        raise refuse(f"{error.remedy} (relative to {yaml_path.parent})") from None
    except OSError as error:  # a name longer than any file's
        raise refuse(f"cannot be read as a robot: {error.strerror}") from None
    if is_yaml(own.path):
        raise refuse("names another .robot.yaml; name the robot's own URDF, SDF or MJCF")
    return own
