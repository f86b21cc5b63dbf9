"""Footsteps of a transition: from where the feet stand to where a gait wants them."""

from typing import Any

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import PlanningError
from drake_quad.gait.transition import TransitionStep, plan_transition
from drake_quad.planning.motion_plan import Segment
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.step_builder import StepBuilder
from drake_quad.robot.legs import Leg


def plan_transition_footsteps(
    builder: StepBuilder,
    goal: FloatArray,
    settings: PlanSettings,
    *,
    body: FloatArray,
    name: str,
    gait: str = "",
) -> Segment | None:
    """Adds the fewest stable steps from where the builder's feet stand to `goal`.

    Args:
        builder: Collects the steps.
        goal: Where the feet are to stand, (4, 2) [m] in W.
        settings: Mode, times and limits of transitions.
        body: The body's pose (5,) in W.
        name: The segment's name.
        gait: `wave` or `spin`, if it leads to that gait, for which the settings may have an order
            in which the legs are lifted.

    Returns:
        The segment, or None if the feet stand there already.

    Raises:
        PlanningError: If there is none, or not in that order.
    """
    c, s = np.cos(body[4]), np.sin(body[4])
    R_WB = np.array([[c, -s], [s, c]])

    def to_body(p: FloatArray) -> FloatArray:
        return np.asarray((p - body[:2]) @ R_WB)

    def to_world(p: FloatArray) -> FloatArray:
        return np.asarray(p @ R_WB.T + body[:2])

    orders: dict[str, tuple[Leg, ...]] = {"wave": settings.wave_order, "spin": settings.spin_order}
    order = orders.get(gait, ())
    try:
        transition = plan_transition(
            to_body(builder.feet[:, :2]),
            to_body(goal),
            mode="still" if settings.body_still else "shift",
            max_shift=settings.max_shift,
            # With a stagger the feet's places are not those of the paper's boxes.
            workspace=settings.workspace if settings.stance_stagger == 0.0 else None,
            order=order,
        )
    except PlanningError as error:
        if not order:
            raise
        remedy = f"take another transition.{gait}_order, or [] for the best there is"
        raise PlanningError(f"{error.reason}; {remedy}", **error.data) from None
    if not transition.steps:
        return None
    start = builder.time
    steps = [take_step(builder, s, to_world(s.p_to), settings) for s in transition.steps]
    return Segment(name, "transition", start, builder.time, {"steps": steps})


def take_step(
    builder: StepBuilder, step: TransitionStep, to: FloatArray, settings: PlanSettings
) -> dict[str, Any]:
    """Adds one step of a transition, to the place `to` (2,) in W; returns what reports say of it.

    The margin is the search's, with massless legs; the body's path finds its own.
    """
    builder.wait(settings.shift_time)
    p_from, lift_off = builder.feet[step.leg.row, :2].tolist(), builder.time
    builder.step(step.leg, to, settings.swing_time, lift_off=lift_off)
    return {
        "leg": int(step.leg),
        "margin": float(step.margin),
        "start": lift_off,
        "end": builder.time,
        "from": p_from,
        "to": to.tolist(),
    }
