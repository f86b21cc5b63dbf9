"""Whether a scenario's gait is to be designed, and what nobody else may then say."""

from collections.abc import Sequence
from typing import Any

from drake_quad.errors import InputError
from drake_quad.scenario_override import Override

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
        "lift_off_margin", "pressure_margin", "push_speed",
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
