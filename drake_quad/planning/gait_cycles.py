"""The steps of whole cycles, one after the other: of a wave gait, and of a trot."""

from collections.abc import Callable

from drake_quad.common import FloatArray
from drake_quad.gait.schedule import trot_intervals, wave_schedule
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.robot.legs import Leg

NextPlace = Callable[[Leg, int], FloatArray]  # of a leg, at the end of its swing in a cycle


def add_wave_cycles(
    builder: StepBuilder, settings: PlanSettings, cycles: int, next_place: NextPlace
) -> list[float]:
    """Adds the steps of a wave gait from the builder's time on.

    Args:
        builder: Collects the steps.
        settings: The gait's.
        cycles: How many cycles.
        next_place: Where a leg's swing ends (2,) in W, by the leg and the cycle.

    Returns:
        When each half of a cycle begins, and the last one ends [s].
    """
    begin = builder.time
    table = wave_schedule(duty_factor=settings.duty_factor, cycle_time=settings.cycle_time)
    half_cycle = 0.5 * table.cycle_time + settings.switch_wait
    late, halves = 0.0, [begin]  # [s] by which longer swings have put the gait off
    for cycle in range(cycles):
        for beat, (leg, lift_off, _) in enumerate(table.swing_intervals()):
            to = next_place(leg, cycle)
            # The second and the fourth leg are those diagonal to the leg that has just landed.
            waited = (2 * cycle + (beat + 1) // 2) * settings.switch_wait
            at = begin + cycle * table.cycle_time + lift_off + waited + late
            lasts = builder.lasts(leg, to, table.swing_time)
            builder.step(leg, to, lasts, lift_off=at)
            late += lasts - table.swing_time
            if beat % 2 == 1:
                halves.append(begin + half_cycle * len(halves) + late)
    return halves


def add_trot_cycles(
    builder: StepBuilder, settings: PlanSettings, cycles: int, next_place: NextPlace
) -> list[float]:
    """Adds the steps of a trot, as `add_wave_cycles` does those of a wave gait.

    Both legs of a pair swing for as long as the one that takes longer.
    """
    begin, cycle_time = builder.time, settings.cycle_time
    intervals = trot_intervals(duty_factor=settings.duty_factor, cycle_time=cycle_time)
    late, halves = 0.0, [begin]
    for cycle in range(cycles):
        for legs, lift_off, touchdown in intervals:
            at = begin + cycle * cycle_time + lift_off + late
            least = touchdown - lift_off
            places = [(leg, next_place(leg, cycle)) for leg in legs]
            lasts = max(builder.lasts(leg, to, least) for leg, to in places)
            for leg, to in places:
                builder.step(leg, to, lasts, lift_off=at)
            late += lasts - least
            halves.append(begin + 0.5 * cycle_time * len(halves) + late)
    return halves
