"""What a scenario's controller senses as YAML fills it, and what is measured beside it.

Plain dataclasses with unpostponed annotations, as those of `config.py`.
"""

from dataclasses import dataclass

from drake_quad.estimation.imu_units import IMUS
from drake_quad.stability.margin_kinds import KINDS
from drake_quad.util.schema import choice, not_negative, number, within


@dataclass
class EstimatorConfig:
    """Where the controller has the robot's state from."""

    kind: str = choice(
        "truth",
        ("truth", "ekf"),
        "`truth`: the controller has the simulated state itself; `ekf`: what it estimates from its "
        "sensors",
    )
    landmarks: str = choice(
        "none",
        ("none", "stairs"),
        "What corrects the drift of place and heading: `none`; `stairs`, with `kind: ekf`, the "
        "map's flights, which the robot sees ahead with its depth camera (`perception`) as it "
        "walks ([how](estimation.md#stairs-as-landmarks))",
    )
    foot_give: float = number(
        0.0,
        "m",
        "How much foot and ground give under load, as `ekf` knows it: a foot rolls as one whose "
        "radius is smaller by that. Unknown, 4 mm of 22 mm are 1 % of the way",
        not_negative(),
        within(0.0, 0.02),
    )


@dataclass
class SensorsConfig:
    """The sensors that an estimator reads, and those that tell which feet bear."""

    noise: str = choice(
        "realistic",
        ("none", "realistic"),
        "Noise of the sensors: that of real units, drawn by the seed",
    )
    imu: str = choice(
        "mti_300",
        tuple(IMUS),
        "The IMU, whose errors are drawn, and by whose data sheet the estimator goes: `mti_300`, "
        "an industrial one; `adis_16495`, one of tactical grade; `bmi_088`, a cheap MEMS unit",
    )
    contacts: str = choice(
        "feet",
        ("feet", "joints"),
        "What tells the controller which feet bear: `feet`, sensors in them, without error; "
        "`joints`, the drives' torques, by a momentum observer, for robots whose feet have no "
        "sensors or unreliable ones ([how](bus.md#feet-felt-by-the-joints))",
    )
    ground_normal: str = choice(
        "map",
        ("map", "feet"),
        "What tells the controller how the ground under a foot is tilted: `map`; `feet`, sensors "
        "in them that feel where on its ball a foot is pressed, without error, and the map where a "
        "foot is in the air. No robot's bus has them ([contact](contact.md))",
    )
    touch_load: float = number(
        0.01,
        "of the weight",
        "With `contacts: joints`: load that has to be felt on a foot before it counts as bearing; "
        "with less than a quarter of it a foot has lifted. On a bus what the joints' friction may "
        "feign, as the robot's file states it, is added to it",
        within(0.005, 0.2),
    )
    torque_noise: float = number(
        0.005,
        "of the limit",
        "With `contacts: joints` and realistic noise: standard deviation of each measured torque, "
        "a share of its joint's torque limit",
        within(0.0, 0.2),
    )


@dataclass
class MonitorConfig:
    """What is measured beside the static margin over the hull of the feet."""

    margins: str = choice(
        "friction",
        KINDS,
        "What is measured beside the margin over the feet's hull, at 10 Hz: `hull`, nothing; "
        "`friction`, the region that friction leaves, capture point and push budget; `feasible`, "
        "the joints' torque limits too ([margins](margins.md))",
    )
