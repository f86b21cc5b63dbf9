"""Transitions: from any stance to any other, one leg at a time, in the fewest stable steps.

The paper makes its two transitions (Figs. 3 and 7) in five steps, the body being still. Here any
start and goal are planned for, with the body still or shifting before each lift.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import permutations
from math import dist, inf

import numpy as np
from numpy.typing import ArrayLike

from drake_quad.common import FloatArray, read_only
from drake_quad.errors import PlanningError
from drake_quad.gait.transition_detour import best_detour, plan_sequence
from drake_quad.gait.transition_search import (
    ROUNDING,
    LiftRules,
    Places,
    Plan,
    apply_lift,
    apply_lift_to_goal,
    best_direct,
    sequences,
)
from drake_quad.gait.workspace import Workspace
from drake_quad.robot.legs import LEGS, Leg
from drake_quad.stability.support_polygon import Point, stability_margin


@dataclass(frozen=True, eq=False)
class TransitionStep:
    """One leg is lifted from where it stands and put down elsewhere.

    Args:
        leg: The leg.
        p_from: (2,) where it stands [m].
        p_to: (2,) where it goes [m].
        margin: The static stability margin meanwhile [m].
        shift: (2,) where the body is meanwhile, from where it began [m].
    """

    leg: Leg
    p_from: FloatArray
    p_to: FloatArray
    margin: float
    shift: FloatArray


@dataclass(frozen=True, eq=False)
class Transition:
    """A transition, in the body frame as it begins.

    Args:
        steps: The steps, in order.
        margin_min: The least margin [m], of the steps and of the final stance.
        start: (4, 2), the feet as they stand [m].
        goal: (4, 2), the feet in the end [m]: a leg that is not moved stays where it stood.
    """

    steps: tuple[TransitionStep, ...]
    margin_min: float
    start: FloatArray
    goal: FloatArray

    @property
    def order(self) -> tuple[Leg, ...]:
        """The legs in the order in which they are lifted."""
        return tuple(step.leg for step in self.steps)


def plan_transition(
    start: ArrayLike,
    goal: ArrayLike,
    *,
    mode: str = "still",
    com: ArrayLike = (0.0, 0.0),
    max_shift: float = 0.1,
    workspace: Workspace | None = None,
    goal_com: ArrayLike | None = None,
    max_steps: int = 6,
    tol: float = 0.005,
    margin_required: float = 0.0,
    order: Sequence[Leg] = (),
) -> Transition:
    """Returns the transition of the fewest steps and, of those, the largest least margin.

    Ties are decided by the next smallest margins, then by the order of legs. A given `order` is
    kept instead, by way of the places in between with the largest least margin.

    Args:
        start: (4, 2) the feet as they stand, in the body frame as the transition begins [m].
        goal: (4, 2) the feet as they are to stand, in the same frame.
        mode: `still` keeps the body where it is; `shift` lets it move before each lift.
        com: (2,) the projected centre of mass as the transition begins, in the same frame.
        max_shift: How far from there it may go in all, along x and along y [m].
        workspace: The legs' boxes, which move with the body. In mode `shift` they limit the
            shifts (not beyond what the start and the goal themselves need), in both modes the
            places in between.
        goal_com: (2,) where the centre of mass is to be in the end; `com` if None.
        max_steps: The most steps to look for.
        tol: A leg this close to its goal is not moved [m].
        margin_required: The least margin that every step must have [m]. Plans with places in
            between are only looked for at margins of at least 0.
        order: The legs in the order in which they are to be lifted, for example the paper's
            2-3-4-1-3: the last lift of a leg takes it to its goal, one before it to a place in
            between, straight ahead of where it stands or behind it if that is as good. Empty: the
            order is searched for.

    Raises:
        PlanningError: No transition is stable; its data holds the best `margin` found [m].
        ValueError: An argument has the wrong shape or an unknown word.
    """
    rules, rows = _lift_rules(
        start, goal, mode=mode, com=com, max_shift=max_shift, workspace=workspace,
        goal_com=goal_com, tol=tol,
    )  # fmt: skip
    if order and rows:
        return _in_order(rules, rows, order, margin_required)
    best, found = -inf, "sequence of steps"
    for count in range(len(rows), max_steps + 1):
        if count == len(rows):
            plan: Plan | None = best_direct(rules, rows)
        else:
            plan = best_detour(rules, rows, count, margin_required)
        if plan is None:
            continue
        transition = _transition(rules, plan)
        if transition.margin_min >= margin_required - ROUNDING:
            return transition
        if plan.reaches(margin_required):
            best, found = transition.margin_min, "final stance"
            break
        best = max(best, transition.margin_min)
    raise PlanningError(
        f"no transition with a stability margin of {margin_required:.3f} m in at most "
        f"{max_steps} steps (body: {mode}): the best {found} found has {best:.3f} m",
        margin=best,
    )


def _in_order(
    rules: LiftRules, rows: frozenset[int], order: Sequence[Leg], required: float
) -> Transition:
    """Returns the transition that lifts legs in a given order; see `plan_transition`.

    Raises:
        PlanningError: The order leaves a leg where it is that has to move, or is not stable.
    """
    name = "-".join(str(int(leg)) for leg in order)
    left = sorted(row + 1 for row in rows - {leg.row for leg in order})
    if left:
        legs = " and ".join(map(str, left))
        raise PlanningError(f"the transition {name} does not lift leg {legs}, which has to move")
    # A leg that stands at its goal already and is not needed elsewhere stays there.
    sequence = tuple(leg.row for leg in order if leg.row in rows or order.count(leg) > 1)
    if len(sequence) == len(set(sequence)):
        plan: Plan | None = apply_lift_to_goal(rules, sequence)
    else:
        # As the paper draws it, feet go straight ahead or back where they can.
        plan = plan_sequence(rules, sequence, max(required, 0.0), straight=True)
    if plan is None:
        raise PlanningError(
            f"the transition {name} is not stable, whatever the places in between: "
            f"none gives every step a stability margin of {required:.3f} m"
        )
    transition = _transition(rules, plan)
    if transition.margin_min < required - ROUNDING:
        raise PlanningError(
            f"the transition {name} has a stability margin of {transition.margin_min:.3f} m, "
            f"{required:.3f} m is asked for",
            margin=transition.margin_min,
        )
    return transition


def enumerate_transitions(
    start: ArrayLike,
    goal: ArrayLike,
    *,
    steps: int,
    mode: str = "still",
    com: ArrayLike = (0.0, 0.0),
    max_shift: float = 0.1,
    workspace: Workspace | None = None,
) -> tuple[Transition, ...]:
    """Returns a transition for each sequence of `steps` lifts, the best first.

    With one step for each leg to be moved these are all orders, stable or not: a proof by
    exhaustion. With more, each sequence for which stable places in between were found.
    Arguments as of `plan_transition`.
    """
    rules, rows = _lift_rules(
        start, goal, mode=mode, com=com, max_shift=max_shift, workspace=workspace, tol=0.0
    )
    if steps == len(rows):
        plans = [apply_lift_to_goal(rules, order) for order in permutations(sorted(rows))]
    else:
        found = (plan_sequence(rules, order, 0.0) for order in sequences(rows, steps))
        plans = [plan for plan in found if plan is not None]
    plans.sort(key=lambda plan: plan.key, reverse=True)
    return tuple(_transition(rules, plan) for plan in plans)


def follow_transition(
    start: ArrayLike,
    moves: Iterable[tuple[Leg, ArrayLike]],
    *,
    com: ArrayLike = (0.0, 0.0),
) -> Transition:
    """Returns given moves (leg, place) with their margins, the body being still."""
    feet = _places(start)
    rules = LiftRules(_point(com), 0.0, feet, feet, (0.0, 0.0), None)
    return _transition(rules, apply_lift(rules, [(leg.row, _point(place)) for leg, place in moves]))


def _lift_rules(
    start: ArrayLike,
    goal: ArrayLike,
    *,
    mode: str,
    com: ArrayLike,
    max_shift: float,
    workspace: Workspace | None,
    goal_com: ArrayLike | None = None,
    tol: float,
) -> tuple[LiftRules, frozenset[int]]:
    """Returns the rules of the lifts, and the rows of the legs that have to move."""
    if mode not in ("still", "shift"):
        raise ValueError(f"mode = {mode!r}: must be 'still' or 'shift'")
    if mode == "shift" and not max_shift >= 0.0:
        raise ValueError(f"max_shift = {max_shift}: must not be negative")
    feet, goals, begin = _places(start), _places(goal), _point(com)
    end = begin if goal_com is None else _point(goal_com)
    rules = LiftRules(
        com=begin,
        max_shift=max_shift if mode == "shift" else 0.0,
        start=feet,
        goal=goals,
        goal_shift=(end[0] - begin[0], end[1] - begin[1]),
        workspace=workspace,
    )
    return rules, frozenset(k for k in range(4) if dist(feet[k], goals[k]) > tol)


def _transition(rules: LiftRules, plan: Plan) -> Transition:
    """Returns a plan as a transition."""
    feet = np.array(rules.start)
    for row, _, p_to, _ in plan.lifts:
        feet[row] = p_to
    end = np.add(rules.com, rules.goal_shift)
    margins = [lift.margin for *_, lift in plan.lifts]
    return Transition(
        steps=tuple(
            TransitionStep(
                leg=LEGS[row],
                p_from=read_only(np.array(p_from)),
                p_to=read_only(np.array(p_to)),
                margin=lift.margin,
                shift=read_only(np.array(lift.shift)),
            )
            for row, p_from, p_to, lift in plan.lifts
        ),
        margin_min=min([*margins, stability_margin(end, feet)]),
        start=read_only(np.array(rules.start)),
        goal=read_only(feet),
    )


def _point(value: ArrayLike) -> Point:
    """Returns a point as plain floats."""
    x, y = np.asarray(value, dtype=np.float64).tolist()
    return x, y


def _places(feet: ArrayLike) -> Places:
    """Returns (4, 2) feet as plain floats."""
    array = np.asarray(feet, dtype=np.float64)
    if array.shape != (4, 2):
        raise ValueError(f"feet have shape {array.shape}: must be (4, 2), one row a leg")
    a, b, c, d = ((x, y) for x, y in array.tolist())
    return a, b, c, d
