"""A row of the gaits' speeds hides nothing of what touched."""

import pytest

from benchmarks.gait_speed import _cell


@pytest.mark.parametrize(
    ("touched", "force", "told"),
    [
        (0, 0.0, "0.100 m/s, 30 mm; goal_reached, 29 mm"),
        (3, 0.0, "0.100 m/s, 30 mm; goal_reached, 29 mm, 3 samples with contacts"),
        (0, 56.4, "0.100 m/s, 30 mm; goal_reached, 29 mm, a swing foot touches with 56 N"),
    ],
)
def test_contacts_are_told(touched: int, force: float, told: str) -> None:
    """Of other parts than feet, and of feet that should be in the air."""
    ran = {"outcome": "goal_reached", "margin": 0.029, "touched": touched, "swing_force": force}
    row = {"speed": 0.1, "margin": 0.03, "certified": True, "physics": ran}
    assert _cell(row) == told
    told = told.replace("30 mm", "30 mm, not certified")
    assert _cell({**row, "certified": False}) == told
