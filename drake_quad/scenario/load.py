"""Loads and saves scenarios: shipped ones, files, overrides."""

import difflib
import re
import typing
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from pydrake.common.yaml import yaml_dump, yaml_dump_typed, yaml_load_typed

from drake_quad.errors import InputError, check_kind
from drake_quad.robot.importer.overrides import is_yaml
from drake_quad.robot.importer.sources import is_known, is_name
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.validate import check_scenario
from drake_quad.util.files import MOST_YAML, is_given, read_given_text, user_path, write_whole
from drake_quad.util.yaml_io import (
    conform,
    field_types,
    parse_value,
    parse_yaml,
    unknown_key_remedy,
    unwrap_optional,
)

_STEP = re.compile(r"([A-Za-z_]\w*)((?:\[\d{1,6}\])*)")


class Override(NamedTuple):
    """One override, taken apart."""

    text: str
    path: str
    steps: tuple[str | int, ...]  # names and indices from the document down
    value: Any

    def covers(self, field: str) -> bool:
        """Whether `field` is the overridden one, or lies within it."""
        return field == self.path or field.startswith((f"{self.path}.", f"{self.path}["))


def parse_override(text: str) -> Override:
    """Takes `path=value` apart; the value is read as YAML.

    Raises:
        InputError: No `=`, not a path, or not YAML.
    """
    path, equals, value = text.partition("=")
    path = path.strip()
    matches = [_STEP.fullmatch(part) for part in path.split(".")]
    if not equals or not all(matches):
        raise InputError(
            source="override",
            field=path,
            value=text,
            remedy="must be path=value, such as gait.duty_factor=0.8 or course[1].rise=0.2",
        )
    steps: list[str | int] = []
    for match in matches:
        assert match is not None
        steps.append(match[1])
        steps.extend(int(index) for index in re.findall(r"\d+", match[2]))
    try:
        parsed = parse_value(value)
    except (yaml.YAMLError, ValueError, RecursionError) as problem:
        why = getattr(problem, "problem", None)
        remedy = "the value is not YAML" + (f": {why}" if why else "")
        raise InputError(source="override", field=path, value=value, remedy=remedy) from None
    return Override(text=text, path=path, steps=tuple(steps), value=parsed)


def apply_override(data: dict[str, Any], override: Override) -> None:
    """Writes the override's value into a document, making the mappings on the way to it.

    Raises:
        InputError: If there is no such field, or no such element of a list.
    """
    schema: Any = Scenario
    target: Any = data
    walked = ""
    for k, step in enumerate(override.steps):
        last = k == len(override.steps) - 1
        schema, _ = unwrap_optional(schema)
        if isinstance(step, int):
            if typing.get_origin(schema) is not list:
                raise _error(override, f"{walked} is not a list")
            if not isinstance(target, list) or step >= len(target):
                length = len(target) if isinstance(target, list) else 0
                raise _error(override, f"{walked} has {length} elements, counted from 0")
            (schema,) = typing.get_args(schema)
            walked = f"{walked}[{step}]"
            empty: Any = {}
        else:
            fields = field_types(schema)
            if fields is None:
                raise _error(override, f"{walked} has no fields")
            if step not in fields:
                raise _error(override, unknown_key_remedy(step, fields))
            if not isinstance(target, dict):
                raise _error(override, f"{walked} is not a mapping")
            schema = fields[step]
            walked = f"{walked}.{step}".lstrip(".")
            empty = [] if typing.get_origin(unwrap_optional(schema)[0]) is list else {}
        if last:
            target[step] = override.value
        elif isinstance(target, dict):
            target = target.setdefault(step, empty)
        else:
            target = target[step]


def _error(override: Override, remedy: str) -> InputError:
    """The error of an override that has no place to go."""
    return InputError(source="override", field=override.path, value=override.value, remedy=remedy)


# What a design fills in, by section: a file that has one of the sections has a gait of its own.
DESIGNED: dict[str, frozenset[str]] = {
    "gait": frozenset({
        "duty_factor", "cycle_time", "switch_wait", "stride", "treads", "lag", "places_per_tread",
        "body_ahead", "tread_phase_up", "tread_phase_down", "body_shift_up", "body_shift_down",
        "lift_down", "shank_room", "max_ahead", "stance_length", "stance_width", "stance_stagger",
        "workspace_length", "workspace_width", "swing_clearance", "body_height", "pitch",
        "pitch_share",
    }),
    "spin": frozenset({"cycle_time", "workspace_length", "workspace_width"}),
    "transition": frozenset({"max_shift", "swing_time", "shift_time"}),
    "body": frozenset({"margin_desired", "zmp_margin"}),
    "controller": frozenset({
        "kind", "period", "kp", "kd", "base_stiffness", "base_damping", "base_rotation_stiffness",
        "base_rotation_damping", "least_force", "unload_time", "foothold_time", "touchdown_press",
        "landing_speed", "lift_off_margin", "pressure_margin", "push_speed",
    }),
}  # fmt: skip


def has_own_gait(data: dict[str, Any]) -> bool:
    """Whether a scenario's document, as it stands in its file, says anything of the gait."""
    return not DESIGNED.keys().isdisjoint(data)


def check_designed(overrides: Sequence[Override]) -> None:
    """Sees that no override of a scenario with `design: auto` is of what the design fills in.

    Raises:
        InputError: One is, and would be lost.
    """
    for override in overrides:
        section, *names = override.steps
        fields = DESIGNED.get(str(section), frozenset())
        said = names[:1] or (override.value if isinstance(override.value, dict) else ())
        for name in said:
            if name in fields:
                raise InputError(
                    source=f"override {override.text}",
                    field=f"{section}.{name}",
                    value=override.value,
                    remedy="the design fills that in; leave it out, or say design=given too and "
                    "give the whole gait, such as that in the scenario.yaml that a run leaves",
                )


SUFFIX = ".scenario.yaml"
MOST_HEAD = 4096  # letters of a file within which a robot's root element begins
_ROBOT = re.compile(r"<(robot|sdf|mujoco)\b")
_ROBOT_YAML = re.compile(r"\A\s*(#.*\n\s*)*model\s*:")
MODELS = "package://drake_quad_models/"


def load_scenario(
    name_or_path: str | Path, overrides: Sequence[str] = (), *, here: Path | None = None
) -> Scenario:
    """Loads and checks a scenario.

    Args:
        name_or_path: A shipped scenario's name, for example `case_study`, or a YAML file.
        overrides: `path=value` each, for example `gait.duty_factor=0.8` or `course[1].rise=0.2`.
        here: Directory for relative paths in overrides, as for `parse_scenario`.

    Raises:
        InputError: No such scenario, or anything in it that cannot be used: one line that names
            the file, the field's path, its value, and what would be right.
    """
    remedy = "must be a shipped scenario's name or a file"
    check_kind(name_or_path, (str, Path), "scenario", remedy)
    name = str(name_or_path)
    path = _models() / f"{name}{SUFFIX}" if name in _shipped() else user_path(name)
    try:
        text = read_given_text(path, most=MOST_YAML)
    except (OSError, ValueError) as problem:
        raise _unreadable(name, problem) from None
    if _ROBOT.search(text[:MOST_HEAD]) or (is_yaml(path) and _ROBOT_YAML.search(text)):
        raise _is_robot(name)
    source = path.name if name in _shipped() else name
    return parse_scenario(text, source=source, base=path.parent, overrides=overrides, here=here)


def parse_scenario(
    text: str,
    *,
    source: str,
    base: Path | None = None,
    overrides: Sequence[str] = (),
    here: Path | None = None,
) -> Scenario:
    """Loads and checks a scenario from its YAML text, for example from `scenario_text`.

    Args:
        text: The document.
        source: What errors name as its origin.
        base: Directory from which the robot's file is looked up; the working directory if none.
        overrides: Overrides as for `load_scenario`.
        here: Directory from which a robot's file that they name is looked up; the working directory
            if none.

    Raises:
        InputError: As for `load_scenario`.
    """
    data = parse_yaml(text, source=source)
    parsed = [parse_override(override) for override in overrides]
    own_gait = has_own_gait(data)  # of the file: to set a field is not to say what a gait is
    for override in parsed:
        apply_override(data, override)
    if "robot" in data and "design" not in data and not own_gait:
        data["design"] = "auto"
    return _checked(data, parsed, source=source, base=base, here=here)


def checked_copy(
    scenario: Scenario, overrides: Sequence[str] = (), *, source: str = "scenario"
) -> Scenario:
    """A scenario that was made or changed in Python, checked as a file is, and copied.

    Args:
        scenario: The scenario; what is done with it later does not change the copy.
        overrides: Overrides as for `load_scenario`.
        source: What errors name as its origin.

    Raises:
        InputError: As for `load_scenario`; also of an attribute that no scenario has.
    """
    data = _plain(scenario, Scenario)
    parsed = [parse_override(override) for override in overrides]
    for override in parsed:
        apply_override(data, override)
    return _checked(data, parsed, source=source, base=None, here=None)


def _plain(value: Any, schema: Any) -> Any:
    """A scenario, or a part of one, as plain data, with all that somebody has set in it."""
    schema, _ = unwrap_optional(schema)
    fields = field_types(schema)
    if fields is not None and isinstance(value, schema):
        names = [*fields, *(name for name in getattr(value, "__dict__", ()) if name not in fields)]
        return {
            name: _plain(getattr(value, name), fields.get(name))
            for name in names if hasattr(value, name)
        }  # fmt: skip
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        item = typing.get_args(schema)[0] if typing.get_origin(schema) is list else None
        return [_plain(one, item) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    return str(value) if isinstance(value, (str, Path)) else value


def _checked(
    data: dict[str, Any],
    parsed: Sequence[Override],
    *,
    source: str,
    base: Path | None,
    here: Path | None,
) -> Scenario:
    """The scenario of plain data, to which the overrides have been applied.

    Raises:
        InputError: As for `load_scenario`.
    """
    if data.get("design") == "auto":
        check_designed(parsed)
    own_model = any(override.covers("robot.model") for override in parsed)
    try:
        plain = conform(data, Scenario, path="", source=source)
        scenario: Scenario = yaml_load_typed(schema=Scenario, data=yaml_dump(plain) or "{}")
        check_scenario(scenario, source=source)
        where = (here or Path.cwd()) if own_model or base is None else base
        scenario.robot.model = _located(scenario.robot.model, base=where, source=source)
    except InputError as error:
        raise _blamed(error, parsed) from None
    return scenario


def scenario_text(scenario: Scenario) -> str:
    """The scenario as a YAML document, all fields written: loading it gives an equal one."""
    return str(yaml_dump_typed(scenario))


def save_scenario(scenario: Scenario, path: str | Path) -> None:
    """Writes the scenario in full, defaults filled in, to a YAML file.

    Raises:
        InputError: If the file cannot be written, or something in the scenario cannot be.
    """
    remedy = "must be a Scenario, such as load_scenario returns"
    check_kind(scenario, (Scenario,), "scenario", remedy)
    text = scenario_text(checked_copy(scenario))
    write_whole(user_path(path), lambda to: to.write_text(text, encoding="utf-8"), option="path")


def shipped_scenarios() -> list[tuple[str, str]]:
    """Name and description of every scenario that ships with the package, by name."""
    return [(name, load_scenario(name).description) for name in _shipped()]


def _models() -> Path:
    """The directory of the shipped robots and scenarios."""
    return Path(str(resources.files("drake_quad_models")))


def _shipped() -> list[str]:
    """Names of the shipped scenarios."""
    return sorted(path.name.removesuffix(SUFFIX) for path in _models().glob(f"*{SUFFIX}"))


def _is_robot(name: str) -> InputError:
    """The error for a robot that was given as a scenario."""
    remedy = (
        f"is a robot; ask about it by `drake-quad check {name}`, or override the robot of a "
        f"scenario: --set robot.model={name}"
    )
    return InputError(source=name, field="scenario", value=name, remedy=remedy)


def _unreadable(name: str, problem: Exception) -> InputError:
    """The error for a scenario that cannot be read, with the nearest shipped name."""
    if isinstance(problem, FileNotFoundError) and is_known(name):
        return _is_robot(name)
    if isinstance(problem, FileNotFoundError):
        near = difflib.get_close_matches(Path(name).name.removesuffix(SUFFIX), _shipped(), n=1)
        hint = f"did you mean {near[0]}?" if near else f"shipped are {', '.join(_shipped())}"
        remedy = f"no such file and no shipped scenario; {hint}"
    elif isinstance(problem, IsADirectoryError):
        remedy = "is a directory; give the YAML file in it"
    elif isinstance(problem, UnicodeDecodeError):
        remedy = "not a text file; give a scenario in YAML"
    else:
        reason = problem.strerror if isinstance(problem, OSError) else str(problem)
        remedy = f"cannot be read: {reason}"
    return InputError(source=name, field="scenario", value=name, remedy=remedy)


def _located(model: str, *, base: Path, source: str) -> str:
    """The robot's file as a shipped URL or an absolute path, if it is there.

    Other packages' URLs, and robots' names, are left to the robot's loader.
    """
    if is_name(model) or ("://" in model and not model.startswith(MODELS)):
        return model
    shipped = model.startswith(MODELS)
    path = _models() / model.removeprefix(MODELS) if shipped else base / user_path(model)
    try:
        there = is_given(path)
    except OSError as problem:  # a name too long, a folder that may not be looked into
        remedy = f"cannot be read: {problem.strerror}"
        raise InputError(source=source, field="robot.model", value=model, remedy=remedy) from None
    if not there:
        robots = sorted(
            p.name for p in _models().iterdir() if p.suffix in (".urdf", ".sdf", ".xml")
        )
        robots = [MODELS + name for name in robots if name != "package.xml"]
        near = difflib.get_close_matches(model, robots, n=1) or robots[:1]
        hint = f"; did you mean {near[0]}?" if near else ""
        remedy = f"no such file{hint}"
        raise InputError(source=source, field="robot.model", value=model, remedy=remedy)
    return model if shipped else str(path.resolve())


def _blamed(error: InputError, overrides: Sequence[Override]) -> InputError:
    """The error, with the override as its source where one wrote the offending field."""
    for override in reversed(overrides):  # a later one overrides those before
        if override.covers(error.field):
            return InputError(
                source=f"override {override.text}",
                field=error.field,
                value=error.value,
                remedy=error.remedy,
            )
    return error
