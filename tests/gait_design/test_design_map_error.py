"""Designs for maps that may be wrong: shanks keep more room from the stairs."""

from collections.abc import Iterator

import pytest
from design_rig import MODEL, shape
from rig import paper_robot

from drake_quad.feasibility.flight import make_stairs_scenario
from drake_quad.gait_design import designer
from drake_quad.gait_design.candidates import Staircase
from drake_quad.gait_design.choose_gait import Design, choose_gaits
from drake_quad.gait_design.designed import Designed
from drake_quad.gait_design.designer import design_scenario
from drake_quad.gait_design.objective import LEANING, targets_for
from drake_quad.scenario.config import Scenario
from drake_quad.terrain.elements import Stairs

ERROR = 0.03  # [m]


def asked(map_error: float) -> Scenario:
    scenario = make_stairs_scenario(paper_robot(), Stairs(0.178, 0.28, 3), model=MODEL)
    scenario.gait.map_error_place = map_error
    return scenario


def test_shanks_keep_room_for_what_the_map_may_be_off() -> None:
    """What the plan leaves is near what is wanted, with an error and without; nothing else is."""
    robot = paper_robot()
    usual, careful = targets_for(robot), targets_for(robot, ERROR)
    others = [n for n in vars(usual) if n != "legs"]
    assert careful.legs == pytest.approx(usual.legs + LEANING * ERROR)
    assert [getattr(careful, n) for n in others] == [getattr(usual, n) for n in others]
    for error, wanted in ((0.0, usual), (ERROR, careful)):
        designed = design_scenario(asked(error), robot=robot)
        assert designed.scenario.gait.shank_room == pytest.approx(wanted.legs, abs=1e-4)
        assert 0.8 * wanted.legs < designed.clearance.weighted < 1.5 * wanted.legs


def test_stairs_without_so_much_room_are_climbed_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where no gait has the room, the answer is that for a map without errors, and no "no"."""
    errors: list[float] = []

    def gaits(*given: object, map_error: float) -> Iterator[Design]:
        errors.append(map_error)
        if map_error == 0.0:
            yield from choose_gaits(*given)  # type: ignore[arg-type]

    def shape_of(designed: Designed) -> dict[str, object]:
        gait = vars(designed.scenario.gait)
        return {name: value for name, value in gait.items() if name != "map_error_place"}

    monkeypatch.setattr(designer, "choose_gaits", gaits)
    found = design_scenario(asked(ERROR), robot=paper_robot())
    assert errors[0] == ERROR and errors[-1] == 0.0
    assert shape_of(found) == shape_of(design_scenario(asked(0.0), robot=paper_robot()))


def test_room_is_worth_more_than_pace_where_the_map_may_be_wrong() -> None:
    """Gaits come by their room alone, and the first not before the others are looked at.

    Those with two places to a tread are for who could plan none of these well: they follow, alike.
    """
    flights = [Staircase(0.15, 0.3), Staircase(-0.15, 0.3)]
    gaits = list(choose_gaits(paper_robot(), shape(), flights, map_error=ERROR))
    places = [d.gait.pattern.per_tread for d in gaits]
    assert places == sorted(places) and set(places) == {1, 2}
    for per_tread in (1, 2):
        scores = [d.score for d in gaits if d.gait.pattern.per_tread == per_tread]
        assert len(scores) > 1 and scores == sorted(scores, reverse=True)
