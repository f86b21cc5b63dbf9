"""The curve of speed against margin: what is on it, and that it can be made."""

import importlib.util
import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, strategies as st

ROOT = Path(__file__).resolve().parents[2]


def _script() -> ModuleType:
    path = ROOT / "scripts" / "speed_versus_margin.py"
    spec = importlib.util.spec_from_file_location("speed_versus_margin", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SCRIPT = _script()
POINTS = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=1, max_size=30)


@given(POINTS)
def test_front_holds_just_the_gaits_that_none_beats(points: list[tuple[int, int]]) -> None:
    """Each other gait is no quicker and no safer than one of the front; none of those is."""
    rows = [{"speed": float(s), "margin": float(m)} for s, m in points]
    best = SCRIPT.front(rows)
    for row in rows:
        assert any(b["speed"] >= row["speed"] and b["margin"] >= row["margin"] for b in best)
    assert np.all(np.diff([b["speed"] for b in best]) > 0.0)
    assert np.all(np.diff([b["margin"] for b in best]) < 0.0)


def test_quick_run_writes_curve_and_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every gait of the small grid has a speed and a margin, the slowest no less than others."""
    SCRIPT.main(["--quick", "--out", str(tmp_path)])
    found = json.loads((tmp_path / "speed_versus_margin.json").read_text(encoding="utf-8"))
    assert len(found["gaits"]) == 4 and all(g["speed"] > 0.0 for g in found["gaits"])
    by_gait = {(g["duty_factor"], g["cycle_time"]): g for g in found["gaits"]}
    assert by_gait[0.88, 8.0]["margin"] > by_gait[0.80, 5.0]["margin"]
    assert by_gait[0.88, 8.0]["speed"] < by_gait[0.88, 5.0]["speed"]
    assert "case study" in (tmp_path / "speed_versus_margin.svg").read_text(encoding="utf-8")
    assert capsys.readouterr().out.count("m/s") == len(found["front"])


def test_gait_that_has_no_plan_says_why() -> None:
    """And does not end the study."""
    row = SCRIPT.plan("case_study", ["gait.body_height=1.4"])
    assert "speed" not in row and "reach" in row["reason"]
