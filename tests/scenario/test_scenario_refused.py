"""Claims about what is no scenario: each is refused in a line, by its path, with a remedy."""

from pathlib import Path

import pytest
from scenario_rig import leaves, refused

from drake_quad.errors import InputError
from drake_quad.scenario.config import Scenario
from drake_quad.scenario.load import load_scenario, parse_scenario, scenario_text

FLOOR = "course: [{kind: floor, length: 6.0}]\n"


NOT_SCENARIOS = [
    ("", "empty"),
    ("# only a comment\n", "empty"),
    ("- a\n- b\n", "must be a mapping"),
    ("just text", "must be a mapping"),
    ("course: [", "not YAML"),
    ("\tcourse: 1", "not YAML"),
    ("a: *nowhere", "not YAML"),
    ("a: 1\n---\nb: 2\n", "not YAML"),
    ("description: 2024-13-45", "not YAML"),
    ("? [a, b]\n: c", "not YAML"),
    ("\x01", "not YAML"),
    ("description: !!bool x", "'x' is no bool"),
    (f"description: {'9' * 5000}", "no whole number"),
    ("course: &a [*a]", "holds itself"),
    (
        "a: &a {x: 1}\nb: &b {<<: [*a, *a, *a, *a, *a, *a, *a, *a, *a, *a]}\n"
        + "".join(
            f"{to}: &{to} {{<<: [{', '.join([f'*{of}'] * 10)}]}}\n"
            for of, to in zip("bcdefghij", "cdefghijk", strict=True)
        ),
        "more than 1000000 values",
    ),
    ("a: 1\n--- 2", "found another document"),
    ("[" * 5000, "not YAML"),
    (FLOOR + "gait: {stride: 1.0, stride: 0.5}", "stride is given twice"),
    (FLOOR + FLOOR, "course is given twice"),
]


@pytest.mark.parametrize(("text", "remedy"), NOT_SCENARIOS)
def test_what_is_no_scenario_is_refused_in_a_line(text: str, remedy: str) -> None:
    """Empty, broken or ambiguous documents are one-line errors, never tracebacks."""
    assert remedy in refused(text).remedy


def test_broken_yaml_is_shown_by_line_and_column() -> None:
    """The error says where the YAML breaks."""
    assert refused("gait:\n  stride: 1\n  pitch: [\n").value == "line 4, column 1"


FLIGHT = (
    "course: [{{kind: floor, length: 3}}, {{kind: stairs, going: up, {}, count: 3}}, "
    "{{kind: floor, length: 3}}]"
)
PUSHES, MOTORS = "disturbances: {pushes:", "disturbances: {motor_strength:"
MISFITS = [
    ("gait: {dutyfactor: 0.8}", "gait.dutyfactor", "did you mean duty_factor?"),
    ("gate: {duty_factor: 0.8}", "gate", "did you mean gait?"),
    ("1: 2", "1", "no such field"),
    ("simulation: {plant: {tim_step: 1}}", "simulation.plant.tim_step", "did you mean time_step"),
    ("simulation: {simulator: {zzz: 1}}", "simulation.simulator.zzz", "integration_scheme"),
    ("robot: !other {model: x}", "robot._tag", "no such field"),
    ("gait:", "gait", "must be a mapping"),
    ("gait: 3", "gait", "must be a mapping"),
    ("mission: {kind: walk}", "mission", "must be a list"),
    ("mission: [walk]", "mission[0]", "must be a mapping"),
    ("gait: {stride: long}", "gait.stride", "must be a number"),
    ("gait: {stride: true}", "gait.stride", "must be a number"),
    ("gait: {stride: [1.0]}", "gait.stride", "must be a number"),
    ("gait: {stride: }", "gait.stride", "must be a number"),
    ("gait: {stride: .inf}", "gait.stride", "must be finite"),
    (f"gait: {{stride: 1{'0' * 400}}}", "gait.stride", "must be finite"),
    ("gait: {stride: nan}", "gait.stride", "must be a number"),
    ("simulation: {seed: 2.0}", "simulation.seed", "must be a whole number"),
    ("simulation: {seed: true}", "simulation.seed", "must be a whole number"),
    ("gait: {on_centre: 1}", "gait.on_centre", "must be true or false"),
    ("gait: {pitch: 3}", "gait.pitch", "must be text"),
    ("gait: {pitch: lvel}", "gait.pitch", "did you mean level?"),
    ("gait: {duty_factor: 1.0}", "gait.duty_factor", "[0.75, 1)"),
    ("gait: {duty_factor: 0.74}", "gait.duty_factor", "[0.75, 1)"),
    ("spin: {duty_factor: 0.5}", "spin.duty_factor", "[0.75, 1)"),
    ("gait: {cycle_time: 0}", "gait.cycle_time", "more than 0"),
    ("spin: {cycle_time: -1}", "spin.cycle_time", "more than 0"),
    ("gait: {stance_stagger: 0.54}", "gait.stance_stagger", "less than gait.stance_width"),
    ("gait: {swing_clearance: -0.01}", "gait.swing_clearance", "not be negative"),
    ("transition: {mode: shfit}", "transition.mode", "did you mean shift?"),
    ("body: {path: best}", "body.path", "optimised or uniform"),
    ("simulation: {mode: physical}", "simulation.mode", "did you mean physics?"),
    ("simulation: {friction: 0}", "simulation.friction", "more than 0"),
    ("simulation: {seed: -1}", "simulation.seed", "not be negative"),
    ("simulation: {log_period: 0.0015}", "simulation.log_period", "whole multiple"),
    ("controller: {period: 0.0005}", "controller.period", "whole multiple"),
    (
        "simulation: {plant: {discrete_contact_approximation: tamsi}}",
        "simulation.plant.discrete_contact_approximation",
        "lagged, similar or sap",
    ),
    (
        "simulation: {plant: {contact_model: hydroelastic}}",
        "simulation.plant.contact_model",
        "hydroelastic_with_fallback",
    ),
    (
        "simulation: {plant: {contact_model: points}}",
        "simulation.plant.contact_model",
        "did you mean point?",
    ),
    (
        "simulation: {simulator: {integration_scheme: rk3}}",
        "simulation.simulator.integration_scheme",
        "runge_kutta3",
    ),
    (
        "simulation: {simulator: {target_realtime_rate: 1}}",
        "simulation.simulator.target_realtime_rate",
        "simulation.realtime_rate",
    ),
    ("estimator: {landmarks: stairs}", "estimator.landmarks", "estimator.kind is ekf"),
    (
        "estimator: {kind: ekf, landmarks: stairs}\nperception: {map: seen}",
        "estimator.landmarks",
        "only a map that is told",
    ),
    ("sensors: {imu: mti_30}", "sensors.imu", "did you mean mti_300?"),
    ("start: {distance: 6.1}", "start.distance", "6 m long"),
    ("start: {distance: -0.1}", "start.distance", "not be negative"),
    ("mission: [{kind: wlak, distance: 1}]", "mission[0].kind", "did you mean walk?"),
    ("mission: [{kind: walk}]", "mission[0].distance", "must say its distance"),
    ("mission: [{kind: spin, angle_deg: 0}]", "mission[0].angle_deg", "other than 0"),
    ("mission: [{kind: stand, duration: -1}]", "mission[0].duration", "more than 0 s"),
    ("mission: [{kind: spin, distance: 1}]", "mission[0].distance", "spin has no distance"),
    ("mission: [{kind: walk, distance: 5.1}]", "mission[0].distance", "leads off the lane"),
    (
        "mission: [{kind: spin, angle_deg: 90}, {kind: walk, distance: 1}]",
        "mission[1].distance",
        "does not head along",
    ),
    (
        "mission: [{kind: walk, distance: 1}, {kind: spin, angle_deg: 180}, "
        "{kind: walk, distance: 1}]",
        "mission[2].distance",
        "does not head along",
    ),
    ("controller: {kind: ikk}", "controller.kind", "ik or whole_body; did you mean ik?"),
    ("estimator: {kind: kalman}", "estimator.kind", "truth or ekf"),
    ("perception: {map: guessed}", "perception.map", "told or seen"),
    ("perception: {camera: d415}", "perception.camera", "d435 or d455"),
    ("perception: {decimation: 5}", "perception.decimation", "from 1 to 4"),
    ("perception: {image_period: 0.05}", "perception.image_period", "from 0.1 to 10"),
    ("perception: {image_period: 0.1004}", "perception.image_period", "whole multiple"),
    ("perception: {camera_x: 3.0}", "perception.camera_x", "from -2 to 2"),
    ("perception: {look_time: 0.1}", "perception.look_time", "from 0.2 to 60"),
    ("start: {heading_deg: 5.0}", "start.heading_deg", "0 with perception.map told"),
    ("start: {heading_deg: 31.0}", "start.heading_deg", "from -30 to 30"),
    ("perception: {landing: -1.0}", "perception.landing", "more than 0"),
    (
        "perception: {map: seen}\nmission: [{kind: stand, duration: 1.0}]",
        "perception.map",
        "needs no mission",
    ),
    ("sensors: {noise: some}", "sensors.noise", "none or realistic"),
    (f"{PUSHES} [{{speed: 1}}]}}", "disturbances.pushes[0].time", "must say its time"),
    (f"{PUSHES} [{{time: -1, speed: 1}}]}}", "disturbances.pushes[0].time", "not be negative"),
    (f"{PUSHES} [{{time: 1}}]}}", "disturbances.pushes[0].speed", "speed or its force"),
    (f"{PUSHES} [{{time: 1, sped: 1}}]}}", "disturbances.pushes[0].sped", "did you mean speed?"),
    (f"{PUSHES} [{{time: 1, speed: 0}}]}}", "disturbances.pushes[0].speed", "more than 0 m/s"),
    (
        f"{PUSHES} [{{time: 1, speed: 1, force: [1, 0, 0]}}]}}",
        "disturbances.pushes[0].speed",
        "not both",
    ),
    (
        f"{PUSHES} [{{time: 1, direction_deg: 9, force: [1, 0, 0]}}]}}",
        "disturbances.pushes[0].direction_deg",
        "not both",
    ),
    (f"{PUSHES} [{{time: 1, force: [1, 0]}}]}}", "disturbances.pushes[0].force", "three numbers"),
    (f"{PUSHES} [{{time: 1, force: [0, 0, 0]}}]}}", "disturbances.pushes[0].force", "not be zero"),
    (
        f"{PUSHES} [{{time: 1, force: [1, .nan, 0]}}]}}",
        "disturbances.pushes[0].force[1]",
        "finite",
    ),
    (
        f"{PUSHES} [{{time: 1, speed: 1, point: [1]}}]}}",
        "disturbances.pushes[0].point",
        "three numbers",
    ),
    (
        f"{PUSHES} [{{time: 1, speed: 1, duration: 0}}]}}",
        "disturbances.pushes[0].duration",
        "more than 0 s",
    ),
    ("disturbances: {payload: {mass: -1}}", "disturbances.payload.mass", "from 0 to"),
    ("disturbances: {payload: {z: 9}}", "disturbances.payload.z", "from -2 to 2"),
    ("disturbances: {com_offset: {x: 9}}", "disturbances.com_offset.x", "from -2 to 2"),
    (f"{MOTORS} [{{factor: 0.5}}]}}", "disturbances.motor_strength[0].joint", "which joint"),
    (f"{MOTORS} [{{joint: a}}]}}", "disturbances.motor_strength[0].factor", "its factor"),
    (f"{MOTORS} [{{joint: a, factor: 2}}]}}", "disturbances.motor_strength[0].factor", "0 to 1"),
    (
        f"{MOTORS} [{{joint: a, factor: 1}}, {{joint: a, factor: 0}}]}}",
        "disturbances.motor_strength[1].joint",
        "given twice",
    ),
    ("disturbances: {sensor_delay: 0.0015}", "disturbances.sensor_delay", "whole multiple"),
    ("disturbances: {command_delay: 0.0001}", "disturbances.command_delay", "whole multiple"),
    ("disturbances: {command_delay: -0.001}", "disturbances.command_delay", "from 0 to 1"),
    (
        "disturbances: {sensor_delay: 0.004}\nsimulation: {plant: {time_step: 0.0}}",
        "disturbances.sensor_delay",
        "needs a plant in steps",
    ),
    ("world: {rise_error: 1}", "world.rise_error", "from -0.1 to 0.1"),
    ("world: {tread_error: -0.01}", "world.tread_error", "from 0 to 0.1"),
    ("world: {yaw_error_deg: 40}", "world.yaw_error_deg", "from -20 to 20"),
    ("world: {random: 1}", "world.random", "true or false"),
    ("simulation: {plant: {time_step: 5.0e-324}}", "simulation.plant.time_step", "at least 1e-05"),
    ("simulation: {plant: {time_step: 1.0e-9}}", "simulation.plant.time_step", "at least 1e-05"),
    ("simulation: {friction: 80}", "simulation.friction", "from 0 to 10"),
    ("simulation: {simulator: {start_time: 100}}", "simulation.simulator.start_time", "must be 0"),
    (f"{PUSHES} [{{time: 1, force: [0, 1e9, 0]}}]}}", "disturbances.pushes[0].force", "100000 N"),
    (
        f"{PUSHES} [{{time: 1, speed: 1, point: [178, 0, 0]}}]}}",
        "disturbances.pushes[0].point",
        "within 2 m",
    ),
    (f"robot: {{model: {'x' * 300}.urdf}}", "robot.model", "too long"),
    ("robot: {model: nowhere.urdf}", "robot.model", "no such file"),
    (
        "robot: {model: 'package://drake_quad_models/paper_quadrupd.urdf'}",
        "robot.model",
        "did you mean package://drake_quad_models/paper_quadruped.urdf?",
    ),
]


@pytest.mark.parametrize(("text", "field", "remedy"), MISFITS)
def test_a_misfit_is_named_by_its_path(text: str, field: str, remedy: str) -> None:
    """Unknown keys, wrong types and impossible values: exact path, value, and remedy."""
    error = refused(FLOOR + text)
    assert (error.source, error.field) == ("mine.yaml", field)
    assert remedy in error.remedy


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("description: no course at all", "course"),
        ("course: []", "course"),
        ("course: [{length: 3.0}]", "course[0].kind"),
        ("course: [{kind: floor, lenght: 3.0}]", "course[0].lenght"),
        ("course: [{kind: floor, length: 3.0, rise: 0.1}]", "course[0].rise"),
        ("course: [{kind: landing, length: 1.0, turn_deg: 90}]", "course[0].length"),
        (FLIGHT.format("rise: 0.178, run: 280"), "course[1].run"),
        (FLIGHT.format("rise: 178, run: 0.28"), "course[1].rise"),
        (
            FLIGHT.format("rises: [0.1, 3], run: 0.3").replace(", count: 3", ""),
            "course[1].rises[1]",
        ),
        (FLIGHT.format("rise: 0.1, run: 4.9").replace("count: 3", "count: 300"), "course"),
        (f"course: [{', '.join(['{kind: floor, length: 900}'] * 2)}]", "course"),
        (FLIGHT.format("rise: 0.1, run: 0.3").replace("count: 3", "count: 010"), "document"),
    ],
)
def test_a_wrong_course_is_named_by_its_path(text: str, field: str) -> None:
    """The course's own checks speak of the scenario's file."""
    error = refused(text)
    assert (error.source, error.field) == ("mine.yaml", field)


@pytest.mark.parametrize("path", [p for p, kind in leaves(Scenario).items() if kind is float])
def test_no_number_takes_text_nan_or_infinity(path: str) -> None:
    """Every number of a scenario, Drake's own too, refuses what is none, by its path."""
    for value in ("text", ".nan", "-.inf", "[1]"):
        with pytest.raises(InputError) as caught:
            load_scenario("flat_walk", [f"{path}={value}"])
        assert caught.value.field == path


def test_yaml_one_point_one_reads_exponents_as_text_and_still_loads() -> None:
    """1e-3, which YAML 1.1 takes for text, is the number that the person meant."""
    scenario = parse_scenario(FLOOR + "gait: {stride: 1e-1}", source="text")
    assert scenario.gait.stride == 0.1


@pytest.mark.parametrize("value", ["'0.5'", '"3"', "'1e-1'"])
def test_a_number_in_quotes_is_text(value: str) -> None:
    """It is refused in a line that names the field, in a file and in an override alike."""
    with pytest.raises(InputError, match=r"text: gait\.stride = '.*must be a number, without quo"):
        parse_scenario(f"{FLOOR}gait: {{stride: {value}}}", source="text")
    with pytest.raises(InputError, match=r"simulation\.friction = '.*a number, without quotes"):
        load_scenario("flat_walk", [f"simulation.friction={value}"])
    with pytest.raises(InputError, match=r"course\[0\]\.length = '.*a number, without quotes"):
        load_scenario("flat_walk", [f"course=[{{kind: floor, length: {value}}}]"])
    with pytest.raises(InputError, match=r"simulation\.seed = '.*a whole number, without quotes"):
        load_scenario("flat_walk", ["simulation.seed='3'"])


@pytest.mark.parametrize(("text", "number"), [("5e-1", 0.5), ("+.5", 0.5), (".5", 0.5), ("1e0", 1)])
def test_a_number_without_quotes_is_one_however_it_is_written(text: str, number: float) -> None:
    """In a file and in an override; where text is wanted the same is text."""
    scenario = load_scenario("flat_walk", [f"simulation.friction={text}", "description=1e5"])
    assert scenario.simulation.friction == number and scenario.description == "1e5"
    assert parse_scenario(scenario_text(scenario), source="text").description == "1e5"
    read = parse_scenario(f"{FLOOR}gait: {{stride: {text}}}\ndescription: 1e5", source="text")
    assert read.gait.stride == number and type(read.description) is str


def test_keys_with_an_underscore_hold_anchors() -> None:
    """A top-level key that begins with an underscore is no field, but may be referred to."""
    text = "_f: &f {kind: floor, length: 6.0}\ncourse: [*f, *f]\n"
    course = parse_scenario(text, source="text").course
    assert course[0] == course[1] and course[0] is not course[1]


def test_a_continuous_plant_has_no_step_to_be_a_multiple_of() -> None:
    """With time_step 0 any period is as good as another."""
    text = FLOOR + "simulation: {plant: {time_step: 0.0}, log_period: 0.0033}"
    assert parse_scenario(text, source="text").simulation.log_period == 0.0033


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("case_stdy", "did you mean case_study?"),
        ("nothing_like_it", "shipped are blind_errors, case_study"),
        ("dir/flat_walk.yaml", "no such file"),
        ("\0", "cannot be read"),
        ("x" * 5000, "cannot be read"),
    ],
)
def test_a_missing_scenario_suggests_the_nearest(name: str, remedy: str) -> None:
    """Neither file nor shipped name: one line that says what there is."""
    with pytest.raises(InputError) as caught:
        load_scenario(name)
    assert remedy in caught.value.remedy and caught.value.source == name


def test_a_directory_and_a_binary_file_are_refused(tmp_path: Path) -> None:
    """A directory is no scenario; nor are bytes that are no text."""
    with pytest.raises(InputError, match="is a directory"):
        load_scenario(tmp_path)
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(InputError, match="not a text file"):
        load_scenario(tmp_path / "binary.yaml")


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        ("course: [{kind: spiral, radius: 1.0}]", "course[0].kind", ("no such kind", "slope")),
        ("course: [{radius: 1.0, kind: stair}]", "course[0].kind", ("did you mean stairs?",)),
        (FLOOR + "mission: [{kind: jump, height: 1}]", "mission[0].kind", ("walk or spin",)),
        ("course: [{kind: floor, radius: 1.0}]", "course[0].radius", ("no such field",)),
    ],
)
def test_an_unknown_kind_is_told_before_its_fields(
    text: str, field: str, words: tuple[str, ...]
) -> None:
    """Else the fields of a kind that there is not would be called unknown."""
    error = refused(text)
    assert error.field == field and all(word in error.remedy for word in words)


TROT = """
gait: {pattern: trot, duty_factor: 0.6}
body: {balance: dynamic}
controller: {kind: whole_body, catch_pushes: false}
"""


@pytest.mark.parametrize(
    ("override", "field"),
    [
        ("body.balance=static", "body.balance"),
        ("body.path=uniform", "body.path"),
        ("controller.kind=ik", "controller.kind"),
        ("controller.catch_pushes=true", "controller.catch_pushes"),
        ("controller.margin_demanded=0.01", "controller.margin_demanded"),
        ("gait.switch_wait=0.1", "gait.switch_wait"),
        ("gait.treads=3", "gait.treads"),
        ("perception.map=seen", "perception.map"),
        ("design=auto", "design"),
        ("gait.duty_factor=0.5", "gait.duty_factor"),
        ("gait.pattern=wave", "gait.duty_factor"),
        ("gait.pattern=pace", "gait.pattern"),
    ],
)
def test_a_trot_is_refused_with_what_it_does_not_work_with(override: str, field: str) -> None:
    """One line with the field, its value and what would be right."""
    parse_scenario(FLOOR + TROT, source="mine.yaml")
    error = refused(FLOOR + TROT, (override,))
    assert error.field == field
