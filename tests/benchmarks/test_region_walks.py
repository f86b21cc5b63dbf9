"""The weak robot of the walks over a slope is the shipped one but for what is said."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import region_walks
from benchmarks.region_walks import MODEL, weakened
from drake_quad.robot.loader import load_robot


def test_left_hips_and_knees_are_weaker(tmp_path: Path) -> None:
    """Half the torque there, all of it elsewhere, and nothing else is another."""
    urdf = MODEL.read_text(encoding="utf-8")
    weak = tmp_path / "weak.urdf"
    weak.write_text(weakened(urdf, 0.5), encoding="utf-8")
    before, after = load_robot(str(MODEL)), load_robot(str(weak))
    expected = np.array(before.effort).reshape(4, 3)
    expected[[0, 2], 1:] *= 0.5
    np.testing.assert_array_equal(np.reshape(after.effort, (4, 3)), expected)
    assert weakened(urdf, 1.0) == urdf
    assert after.mass == before.mass


def test_the_table_has_what_was_asked_of_each_walk(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The margin of the kind that is named, planned and measured."""

    def walk(model: str, kept: str) -> dict[str, object]:
        base = 0.1 if "weak" in model else 0.2
        kinds = enumerate(("margin", "margin_friction", "margin_feasible"))
        figures = {k + end: {"minimum": base + i / 100 + more}
                   for i, k in kinds for end, more in (("_planned", 0.001), ("", 0.0))}  # fmt: skip
        return {**figures, "outcome": f"kept {kept}"}

    monkeypatch.setattr(region_walks, "walk", walk)
    assert region_walks.main([]) == 0
    rows = [row for row in capsys.readouterr().out.splitlines() if row.startswith("| ")][2:]
    assert "| shipped | `friction` | friction | 0.211 m | 0.210 m | kept friction |" in rows
    assert "| weak | `hull` | feasible | 0.121 m | 0.120 m | kept hull |" in rows
    assert len(rows) == 5
