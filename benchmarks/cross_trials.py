"""A trial of a study under another contact solver, or in another simulator."""

from contextlib import nullcontext
from typing import Any

import numpy as np

from benchmarks.study import Result, finding
from drake_quad.common import FloatArray
from drake_quad.sweep.study import Base
from drake_quad.sweep.trials import Trial

ENGINES = {
    "lagged": ("simulation.plant.discrete_contact_approximation=lagged",),
    "similar": ("simulation.plant.discrete_contact_approximation=similar",),
    "sap": ("simulation.plant.discrete_contact_approximation=sap",),
    "CENIC": (
        "simulation.plant.time_step=0.0",
        "simulation.simulator.integration_scheme=cenic",
        "simulation.simulator.accuracy=0.001",
    ),
    "MuJoCo": (),
}
VALUES = ("draw", "friction", "engine")  # of a trial
FIGURES = (
    "margin",
    "margin_at_once",
    "slip_max",
    "base_error_max",
    "clock_waited",
    "simulated_time",
)
AT_GOAL = 0.1  # [m]: farthest from the end of the plan that counts as there, as in a run
SETTLED = 0.03  # [s] from the start; before it the feet take up their load
LASTING = 0.01  # [s] that a margin has to last to count


def work(trial: Trial) -> Result:
    """Runs the trial by its engine, one of ENGINES.

    Returns:
        `outcome` (goal_reached, fell, stopped; refused), `reason`, and FIGURES, None where not
        measured: `margin` [m] is the smallest that lasts, `margin_at_once` [m] the smallest sample.
    """
    engine = dict(zip(VALUES, trial.values, strict=True))["engine"]
    overrides = [*trial.overrides, *ENGINES[engine]]
    if engine == "MuJoCo":
        return finding(trial, run_in_mujoco(trial.base, overrides))
    from benchmarks.cenic import corrected

    with corrected() if engine == "CENIC" else nullcontext():
        return finding(trial, run_in_drake(trial.base, overrides))


def run_in_drake(base: Base, overrides: list[str]) -> Result:
    """Runs a scenario as it is."""
    from drake_quad.errors import DrakeQuadError, InputError
    from drake_quad.simulation.run import simulate

    try:
        scenario = base.load(overrides)
        found = simulate(scenario, source=base.name)
    except DrakeQuadError as error:
        outcome = "refused" if isinstance(error, InputError) else "stopped"
        return {"outcome": outcome, "reason": str(error)}
    names = ("slip_max", "base_error_max", "clock_waited", "simulated_time")
    margin = found.table["margin"].to_numpy() if found.table.num_rows else np.empty(0)
    return {
        "outcome": found.outcome,
        "reason": found.reason,
        **margins(margin, scenario.simulation.log_period),
        **{name: found.summary.get(name) for name in names},
    }


def margins(values: FloatArray, period: float) -> dict[str, float | None]:
    """The smallest `margin` that lasts, and `margin_at_once`, the smallest sample.

    On slippery ground feet chatter in MuJoCo and under sap: a foot bears nothing for single samples
    between others under load.

    Args:
        values: Values over the run [m].
        period: Time between these samples [s].
    """
    at_once = float(np.min(values)) if len(values) else None
    return {
        "margin": lasting_minimum(values, round(LASTING / period) + 1),
        "margin_at_once": at_once,
    }


def lasting_minimum(values: FloatArray, samples: int) -> float | None:
    """The least value that so many samples in a row do not exceed; None of fewer."""
    if len(values) < samples:
        return None
    return float(np.lib.stride_tricks.sliding_window_view(values, samples).max(axis=1).min())


def run_in_mujoco(base: Base, overrides: list[str]) -> Result:
    """Runs a scenario's controller in MuJoCo, robot and course as they really are.

    What MuJoCo's robot does not have here is refused: sensors, pushes, payloads, delays, weak
    drives.
    """
    from benchmarks.mujoco_drive import drive
    from benchmarks.mujoco_robot import MujocoRobot
    from drake_quad.errors import DrakeQuadError, InputError
    from drake_quad.robot.loader import MakeModelPlant
    from drake_quad.simulation.prepare import prepare
    from drake_quad.systems.controller import MakeController
    from drake_quad.systems.disturbances import Disturbances

    try:
        scenario = base.load(overrides)
        p = prepare(scenario, source=base.name)
    except DrakeQuadError as error:
        outcome = "refused" if isinstance(error, InputError) else "stopped"
        return {"outcome": outcome, "reason": str(error)}
    given = p.disturbances
    real: dict[str, Any] = {"mass_factor": given.mass_factor, "com_offset": given.com_offset}
    if Disturbances(**real) != p.disturbances or scenario.estimator.kind != "truth":
        return {"outcome": "refused", "reason": "has what MuJoCo's robot does not have here"}
    control, plant = scenario.controller, MakeModelPlant(p.robot.url)
    body = MujocoRobot(
        p.robot, plant, p.world, control, p.stance, friction=scenario.simulation.friction, **real
    )
    controller = MakeController(
        robot=p.robot,
        course=p.course,
        settings=p.settings,
        mission=p.tasks,
        control=control,
        model=plant,
    )
    found = drive(controller, body, limit=2.0 * p.plan.duration + 30.0)
    outcome, _, reason = found.outcome.partition(": ")
    if outcome not in ("goal_reached", "fell", "stopped"):
        outcome, reason = "stopped", found.outcome
    if outcome == "goal_reached" and found.base_error[-1] > AT_GOAL:
        outcome = "stopped"
        reason = f"the plan is at its end, but the base is {found.base_error[-1]:.2f} m off it"
    figures: dict[str, Any] = {
        **margins(found.margin[found.times >= SETTLED], control.period),
        "base_error_max": float(found.base_error.max()),
        "clock_waited": found.waited,
        "simulated_time": float(found.times[-1]),
    }
    return {"outcome": outcome, "reason": reason, **figures}
