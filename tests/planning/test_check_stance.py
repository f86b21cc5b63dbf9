"""A robot that cannot stand as it is to begin is told so before anything is planned."""

from dataclasses import replace

import numpy as np
import pytest
from rig import flat_course, paper_robot, stance_at

from drake_quad.errors import PlanningError
from drake_quad.planning.motion_plan import Stance
from drake_quad.planning.problem import PlanSettings
from drake_quad.planning.stance_margin import check_stance


def standing(height: float) -> Stance:
    """The paper's robot with its body so high [m]."""
    return stance_at(flat_course(), replace(PlanSettings(), body_height=height))


@pytest.mark.parametrize("height", [0.5, 0.85, 1.05])
def test_a_stance_within_reach_is_no_error(height: float) -> None:
    """Whatever is planned from there."""
    check_stance(paper_robot(), standing(height))


@pytest.mark.parametrize(("height", "says"), [(0.15, "misses"), (0.3, "beyond"), (2.0, "misses")])
def test_one_out_of_reach_says_which_leg_or_joint_and_by_how_much(height: float, says: str) -> None:
    """Legs too short, too long, or a knee folded past its stop; by more the farther off."""
    with pytest.raises(PlanningError, match=says) as caught:
        check_stance(paper_robot(), standing(height))
    with pytest.raises(PlanningError) as worse:
        check_stance(paper_robot(), standing(height + 0.05 * np.sign(height - 0.8)))
    assert caught.value.data["excess"] > 0.0
    if says == "misses":
        assert caught.value.data["excess"] < worse.value.data["excess"]
