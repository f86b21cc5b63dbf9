"""Claims about overrides: they are as if written in the file, and are blamed themselves."""

import pytest
from scenario_rig import refused

from drake_quad.errors import InputError
from drake_quad.scenario.load import load_scenario, parse_scenario

FLOOR = "course: [{kind: floor, length: 6.0}]\n"


def test_overrides_reach_any_field() -> None:
    """Fields, list elements and Drake's own structs can be overridden; the rest stays."""
    scenario = load_scenario(
        "case_study",
        ["gait.duty_factor=0.8", "course[1].rise=0.2", "simulation.plant.time_step=5e-4"],
    )
    assert scenario.gait.duty_factor == 0.8
    assert scenario.course[1].rise == 0.2 and scenario.course[3].rise == 0.13
    assert scenario.simulation.plant.time_step == 5e-4
    assert scenario.simulation.plant.contact_model == "point"


def test_an_override_is_as_if_written_in_the_file() -> None:
    """Overriding to a value and writing the value give the same scenario."""
    a = parse_scenario(FLOOR, source="a", overrides=["gait.stride=0.5", "simulation.seed=3"])
    b = parse_scenario(FLOOR + "gait: {stride: 0.5}\nsimulation: {seed: 3}\n", source="b")
    assert a == b


def test_a_later_override_wins() -> None:
    """Of two overrides of one field the second counts."""
    scenario = load_scenario("case_study", ["gait.stride=0.5", "gait.stride=0.7"])
    assert scenario.gait.stride == 0.7


BAD_OVERRIDES = [
    ("gait.duty_facto=0.8", "gait.duty_facto", "did you mean duty_factor?"),
    ("gate.duty_factor=0.8", "gate.duty_factor", "did you mean gait?"),
    ("simulation.plant.timestep=1", "simulation.plant.timestep", "did you mean time_step?"),
    ("course[9].rise=0.1", "course[9].rise", "course has 5 elements"),
    ("course[5].rise=0.1", "course[5].rise", "course has 5 elements"),
    ("course.rise=0.1", "course.rise", "course has no fields"),
    ("gait[0]=1", "gait[0]", "gait is not a list"),
    ("gait.duty_factor.x=1", "gait.duty_factor.x", "no fields"),
    ("gait.duty_factor", "gait.duty_factor", "must be path=value"),
    ("=1", "", "must be path=value"),
    ("gait.stride=[1", "gait.stride", "not YAML"),
    ("simulation.seed=!!int ''", "simulation.seed", "no whole number"),
    ("gait.stride=!!float ''", "gait.stride", "no number"),
    ("description=!!timestamp x", "description", "no date"),
    ("gait.stride=!!bool x", "gait.stride", "no bool"),
    ("gait={stride: 0.4, stride: 0.5}", "gait", "stride is given twice"),
    ("simulation.seed=012", "simulation.seed", "base 8 or 60"),
    ("course[1].count=1:30", "course[1].count", "base 8 or 60"),
    (f"course[{'9' * 5000}].rise=0.1", f"course[{'9' * 5000}].rise", "must be path=value"),
    ("gait.stride=fast", "gait.stride", "must be a number"),
    ("gait.stride=", "gait.stride", "must be a number"),
    ("gait.stride=.nan", "gait.stride", "must be finite"),
    ("gait.duty_factor=0.7", "gait.duty_factor", "[0.75, 1)"),
    ("course[1].rise=-0.1", "course[1].rise", "negative rise"),
    ("course[1]={kind: floor}", "course[1].length", "must say its length"),
    ("robot.model=nowhere.urdf", "robot.model", "no such file"),
]


def test_an_override_of_one_place_leaves_those_alike_alone() -> None:
    """An alias (*up) is the same again, and not the same thing."""
    flight = "{kind: stairs, going: up, rises: [0.15, 0.15], run: 0.4}"
    floor = "{kind: floor, length: 3.0}"
    text = f"course: [{floor}, &up {flight}, {floor}, *up, {floor}]"
    overrides = ["course[1].rises[0]=0.1", "course[3].run=0.5"]
    scenario = parse_scenario(text, source="mine.yaml", overrides=overrides)
    assert [scenario.course[k].rises for k in (1, 3)] == [[0.1, 0.15], [0.15, 0.15]]
    assert [scenario.course[k].run for k in (1, 3)] == [0.4, 0.5]


@pytest.mark.parametrize(("override", "field", "remedy"), BAD_OVERRIDES)
def test_a_bad_override_is_blamed_itself(override: str, field: str, remedy: str) -> None:
    """The error names the override, not the file, and says what would be right."""
    with pytest.raises(InputError) as caught:
        load_scenario("case_study", [override])
    assert caught.value.source.startswith("override")
    assert caught.value.field == field
    assert remedy in caught.value.remedy


def test_what_an_override_spoils_elsewhere_is_said_of_the_file() -> None:
    """A new time step that no longer divides the file's own period: the period is to change."""
    with pytest.raises(InputError) as caught:
        load_scenario("case_study", ["simulation.plant.time_step=0.003"])
    assert caught.value.source == "case_study.scenario.yaml"
    assert caught.value.field == "controller.period" and "0.003 s" in caught.value.remedy


def test_an_override_into_what_is_no_mapping_is_refused() -> None:
    """Where the file has a number for a mapping there is nothing to override in."""
    error = refused(FLOOR + "gait: 3", ("gait.stride=0.5",))
    assert error.remedy == "gait is not a mapping"


def test_of_two_overrides_of_a_field_the_later_is_blamed() -> None:
    """It is the one that holds, so the line names it and not the one before."""
    with pytest.raises(InputError) as caught:
        load_scenario("flat_walk", ["gait.duty_factor=0.8", "gait.duty_factor=1.4"])
    assert caught.value.source == "override gait.duty_factor=1.4"
