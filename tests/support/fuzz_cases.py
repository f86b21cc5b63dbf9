"""Input that nobody should give: scenarios, studies, overrides and robots, spoilt by a seed.

A case is its number alone, so that one that is found can be had again:

    python -c "import fuzz_cases; print(fuzz_cases.make_case(123))"
"""

import copy
import json
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from fuzz_files import sample, say_less, spoil_bytes, spoil_xml
from synthetic_robot import Quadruped

from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import parse_scenario, scenario_text
from drake_quad.util.yaml_io import field_types, unwrap_optional

ROOT = Path(__file__).resolve().parents[2]
# Of cases that are robots' files alone, from number FILES on.
FILE_KINDS = (
    "sdf", "mjcf", "said", "sdf text", "mjcf text", "said text", "sdf", "mjcf", "said bytes",
    "sdf bytes", "mjcf bytes",
)  # fmt: skip
FILES = 1_000_000
# Of scenarios that are whole and a little unlike those that are shipped, from number GENTLE on.
GENTLE_KIND = "gentle"
GENTLE = 2_000_000
CHOICES = {
    ("controller", "kind"): ("whole_body", "ik"),
    ("estimator", "kind"): ("none", "ekf"),
    ("simulation", "seed"): (0, 1, 2**31),
}
KINDS = ("scenario", "override", "text", "study", "study text", "robot", "robot text", "result")

NASTY: tuple[Any, ...] = (
    0, 1, -1, 2, 3, 7, 0.5, -0.5, 1e-9, 1e9, -1e9, 1e300, 1e-300, 5e-324, -0.0, 10**30, 2**63,
    float("nan"), float("inf"), float("-inf"), True, False, None, "", "x", "1e-3", "auto", "none",
    "lagged", "sap", "tamsi", "kinematic", "physics", "ekf", "\x00", "ä\u2028", "a" * 5000,
    "package://nowhere/x.urdf", "/", ".", "..", "~", "*", "&a", "!!python/object:os.system {}", [],
    {}, [[]], [1, 2, 3], [None], {"x": 1}, {"kind": "stairs"}, [{"kind": "floor", "length": 4.0}],
)  # fmt: skip
NAMES = ("x$\\foo$", "[/x]", "<b>&", "| a |", "a name that is longer than any column is wide")
NUMBERS = (
    "0",
    "-1",
    "1e9",
    "-1e-9",
    "nan",
    "inf",
    "1e400",
    "0x10",
    "",
    "x",
    "1 2",
    "0 0 0",
    "1e-30",
)


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        number: From which all of it follows.
        kind: One of KINDS, or of FILE_KINDS.
        text: Of the file.
        overrides: Of a scenario.
        physics: Whether a scenario that can be is simulated for a moment, or moved along its plan.
    """

    number: int
    kind: str
    text: str
    overrides: tuple[str, ...] = ()
    physics: bool = False


def make_case(number: int) -> Case:
    """The case of that number."""
    rng = np.random.default_rng([20261121, number])
    if number >= GENTLE:
        return Case(number, GENTLE_KIND, change_gently(rng), physics=bool(rng.random() < 0.7))
    if number >= FILES:
        return Case(number, kind_of(number), spoil_file(kind_of(number), rng))
    kind = KINDS[number % len(KINDS)]
    physics = bool(rng.random() < 0.15)
    if kind in ("scenario", "text"):
        text = spoil_data(pick(rng, scenarios()), rng) if kind == "scenario" else ""
        text = text or spoil_text(pick(rng, scenarios()), rng)
        return Case(number, kind, text, physics=physics)
    if kind == "override":
        overrides = tuple(make_override(rng) for _ in range(int(rng.integers(1, 3))))
        return Case(number, kind, pick(rng, scenarios()), overrides, physics)
    if kind in ("study", "study text"):
        spoil = spoil_study if kind == "study" else spoil_text
        return Case(number, kind, spoil(pick(rng, studies()), rng))
    if kind in ("robot", "robot text"):
        spoil = spoil_robot if kind == "robot" else spoil_text
        return Case(number, kind, spoil(pick(rng, robots()), rng), physics=physics)
    return Case(number, kind, "")  # a result: what is spoilt is for who carries it out


def kind_of(number: int) -> str:
    """What the case of that number is."""
    if number >= GENTLE:
        return GENTLE_KIND
    kinds = KINDS if number < FILES else FILE_KINDS
    return kinds[number % len(kinds)]


def spoil_file(kind: str, rng: np.random.Generator) -> str:
    """A robot's file of a kind; bytes that are no text as surrogates."""
    form, _, how = kind.partition(" ")
    text = say_less(rng) if form == "said" else sample(form)
    if how:
        return (spoil_bytes if how == "bytes" else spoil_text)(text, rng)
    if form == "said":
        return spoil_data(text, rng) if rng.random() < 0.6 else text
    return spoil_xml(text, rng)


def pick(rng: np.random.Generator, items: Any) -> Any:
    """One of them, each as likely."""
    return items[int(rng.integers(len(items)))]


@cache
def scenarios() -> list[str]:
    """The shipped scenarios' texts."""
    return [p.read_text() for p in sorted((ROOT / "models").glob("*.scenario.yaml"))]


@cache
def studies() -> list[str]:
    """The shipped studies' texts."""
    return [p.read_text() for p in sorted((ROOT / "studies").glob("*.yaml"))]


@cache
def robots() -> list[str]:
    """The paper's quadruped's file, and a made-up one's."""
    return [(ROOT / "models" / "paper_quadruped.urdf").read_text(), Quadruped().text()]


@cache
def paths() -> list[str]:
    """The paths of all fields of a scenario; elements of lists by 0."""

    def walk(schema: Any, path: str) -> list[str]:
        schema, _ = unwrap_optional(schema)
        fields = field_types(schema)
        if fields is not None:
            return [p for n, kind in fields.items() for p in walk(kind, f"{path}.{n}".lstrip("."))]
        inner = getattr(schema, "__args__", ())
        return [path, *(walk(inner[0], f"{path}[0]") if inner else [])]

    return walk(Scenario, "")


def change_gently(rng: np.random.Generator) -> str:
    """A shipped scenario with all of its fields, a few of whose numbers are changed a bit."""
    text = scenario_text(parse_scenario(pick(rng, scenarios()), source="shipped"))
    data = yaml.safe_load(text)
    data["design"] = "given"
    for (section, name), values in CHOICES.items():
        if rng.random() < 0.3:
            data[section][name] = pick(rng, values)
    for _ in range(int(rng.integers(1, 5))):
        holder, key = place_in(data, rng)
        if type(holder[key]) in (int, float):
            number = holder[key] * rng.uniform(0.8, 1.25)
            holder[key] = round(number) if type(holder[key]) is int else number
    return str(yaml.safe_dump(data))


def make_override(rng: np.random.Generator) -> str:
    """`path=value`; now and then neither path nor value is one."""
    value = (
        pick(rng, NASTY) if rng.random() < 0.8 else float(rng.normal()) * 10 ** rng.uniform(-4, 4)
    )
    try:
        text = json.dumps(value)
    except TypeError:
        text = str(value)
    override = f"{pick(rng, paths())}={text}"
    return spoil_text(override, rng) if rng.random() < 0.2 else override


def spoil_study(text: str, rng: np.random.Generator) -> str:
    """The study with something more that varies, or with any of its data changed, or both."""
    what = rng.random()
    if what < 0.6:
        data = yaml.safe_load(text)
        way = pick(rng, ("uniform", "log_uniform", "normal", "integers", "choice", "values"))
        ends = [pick(rng, NASTY) for _ in range(2)] if rng.random() < 0.6 else [1, 2]
        vary = {"path": pick(rng, ("simulation.seed", "gait.cycle_time", *paths())), way: ends}
        for key, odds in (("step", 0.3), ("name", 0.3), ("bands", 0.2), ("also", 0.1)):
            if rng.random() < odds:
                vary[key] = pick(rng, (*NAMES, *NASTY) if key == "name" else NASTY)
        data.setdefault("vary", []).append(vary)
        text = str(yaml.safe_dump(data))
    return text if what < 0.5 else spoil_data(text, rng)


def spoil_data(text: str, rng: np.random.Generator) -> str:
    """The YAML text with some of its values, keys or elements changed."""
    data = yaml.safe_load(text)
    for _ in range(int(rng.integers(1, 4))):
        holder, key = place_in(data, rng)
        what = rng.random()
        if what < 0.6:
            old = holder[key]
            if type(old) in (int, float) and rng.random() < 0.5:
                holder[key] = old * float(rng.choice([-1, 0, 0.01, 0.5, 2, 10]))
            else:
                holder[key] = copy.deepcopy(pick(rng, NASTY))
        elif what < 0.75:
            del holder[key]
        elif isinstance(holder, list):
            holder.extend(copy.deepcopy(holder) * int(rng.integers(1, 4)))
        else:
            holder[str(pick(rng, paths())).split(".")[-1].split("[")[0]] = pick(rng, NASTY)
        if not data:
            break
    return str(yaml.safe_dump(data, allow_unicode=bool(rng.random() < 0.5)))


def place_in(data: Any, rng: np.random.Generator) -> tuple[Any, Any]:
    """A place in nested data: what holds it, and its key or index there."""
    places: list[tuple[Any, Any]] = []

    def walk(node: Any) -> None:
        items = node.items() if isinstance(node, dict) else enumerate(node)
        for key, value in items:
            places.append((node, key))
            if isinstance(value, dict | list):
                walk(value)

    walk(data)
    return pick(rng, places) if places else ({"x": 0}, "x")


def spoil_text(text: str, rng: np.random.Generator) -> str:
    """The text cut, with letters changed, or with pieces moved or twice there."""
    for _ in range(int(rng.integers(1, 5))):
        a, b = sorted(int(k) for k in rng.integers(0, len(text) + 1, size=2))
        b = min(b, a + int(10 ** rng.uniform(0, 3)))
        piece = text[a:b]
        what = rng.random()
        if what < 0.3:
            text = text[:a] + text[b:]
        elif what < 0.5:
            text = text[:b] + piece * int(rng.integers(1, 4)) + text[b:]
        elif what < 0.6:
            text = text[:a]
        elif what < 0.8:
            letters = "".join(
                pick(rng, "\x00\t\n {}[]<>&*!%@'\":,-0e.\\ä\ud7ff\u2028") for _ in range(3)
            )
            text = text[:a] + letters + text[a:]
        else:
            where = int(rng.integers(0, len(text) + 1))
            text = text[:where] + piece + text[where:]
    return text


def spoil_robot(text: str, rng: np.random.Generator) -> str:
    """The URDF with numbers, names, attributes, tags or whole elements changed."""
    for _ in range(int(rng.integers(1, 4))):
        what = rng.random()
        if what < 0.4:
            text = _replace_one(
                r'(?<==")-?[0-9.][^"]*(?=")', lambda _: pick(rng, NUMBERS), text, rng
            )
        elif what < 0.55:
            text = _replace_one(r' [a-z]+="[^"]*"', lambda _: "", text, rng)
        elif what < 0.7:
            names = re.findall(r'name="([^"]*)"', text) or ["x"]
            text = _replace_one(
                r'(?<==")[A-Za-z][^"]*(?=")', lambda _, n=names: pick(rng, n), text, rng
            )
        elif what < 0.8:
            text = _replace_one(r"<[a-z]+ [^<>]*/>", lambda _: "", text, rng)
        elif what < 0.9:
            text = _replace_one(r"<(link|joint|transmission)\b.*?</\1>", lambda _: "", text, rng)
        else:
            text = _replace_one(r"<(link|joint)\b.*?</\1>", lambda m: m[0] * 2, text, rng)
    return text


def _replace_one(pattern: str, make: Any, text: str, rng: np.random.Generator) -> str:
    found = list(re.finditer(pattern, text, re.DOTALL))
    if not found:
        return text
    match = pick(rng, found)
    return text[: match.start()] + str(make(match)) + text[match.end() :]
