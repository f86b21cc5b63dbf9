"""Which files of the package are entered between `rise` in a scenario's YAML and a joint command.

python scripts/files_on_the_way.py                        counts and lists them
python scripts/files_on_the_way.py --page docs/design.md  writes the count and the drawing anew

A short climb is loaded, planned, wired and simulated for a few updates of the controller under a
profiler. A file counts as entered if one of its functions is called, or is compiled into a kernel
that is. The drawing shows the files of STAGES, which hand the rise on, or what follows from it;
the script fails if one of these is no longer entered.
"""

import argparse
import re
import sys
import tempfile
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from numba.core.dispatcher import Dispatcher
from pydrake.systems.analysis import Simulator

import drake_quad
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepare import prepare

PACKAGE = f"{Path(drake_quad.__file__).parent}/"
SCENARIO = """
course:
  - {kind: floor, length: 3.0}
  - {kind: stairs, going: up, rise: 0.15, run: 0.45, count: 2}
  - {kind: floor, length: 3.0}
controller: {kind: whole_body, period: 0.002}
"""
UPDATES = 0.012  # [s] that are simulated: a few updates of the controller, and one of the planner

# What happens between, and is not on the way: the robot's file is read; the real course,
# disturbances, the simulated plant, monitors and logs are made; compiled kernels are looked for.
ASIDE = {
    "robot_of", "is_name", "MakeModelPlant", "world_of", "disturbances_of", "check_stance",
    "AddSimulatedPlant", "AddMonitors", "logs_of", "AddLoggers", "load_overload",
}  # fmt: skip
# In the loop, the systems that turn the course into joint commands. Others measure, log and wait.
LOOP = {"transition_planner.py", "tracking_controller.py"}

# What is drawn: stage by stage a file, and what becomes of the rise in it.
STAGES: tuple[tuple[str, tuple[tuple[str, str], ...]], ...] = (
    (
        "From YAML to the course",
        (
            ("scenario/load.py", "reads the file"),
            ("util/yaml_io.py", "parses, checks types"),
            ("scenario/config.py", "Scenario.course"),
            ("scenario/validate.py", "checks values"),
            ("scenario/build.py", "asks for the course"),
            ("terrain/elements.py", "Element.rise, its bounds"),
            ("terrain/course.py", "lays boxes and lanes"),
            ("terrain/lane.py", "step profile, nosings"),
        ),
    ),
    (
        "From the course to a plan",
        (
            ("simulation/prepare.py", "plans the mission"),
            ("planning/mission.py", "task after task"),
            ("planning/task.py", "one walk"),
            ("planning/walk_footsteps.py", "which foot, when"),
            ("planning/foothold_grid.py", "places on the treads"),
            ("planning/step_builder.py", "lays the steps"),
            ("gait/swing_clearance.py", "apex over the nosings"),
            ("gait/swing.py", "quintic swing"),
            ("planning/body_reference.py", "height over the treads"),
            ("planning/body_path.py", "path of the body"),
            ("planning/motion_plan.py", "MotionPlan"),
        ),
    ),
    (
        "From the plan to a joint command",
        (
            ("systems/controller.py", "wires the controller"),
            ("systems/transition_planner.py", "sends the MotionPlan"),
            ("systems/tracking_controller.py", "one update of the controller"),
            ("control/tracking.py", "inverse kinematics"),
            ("control/base_tracking.py", "target of the base"),
            ("control/foot_targets.py", "targets of the feet"),
            ("robot/kinematics.py", "solve_leg"),
            ("control/whole_body_qp.py", "forces, torques"),
        ),
    ),
)


class Trace:
    """The files that are entered, in order, and those of them on the way to a joint command."""

    def __init__(self) -> None:
        """Nothing has been entered."""
        self.entered: dict[str, None] = {}
        self.on_the_way: dict[str, None] = {}
        self.looping = False
        self._seen: set[tuple[CodeType, bool]] = set()

    def __call__(self, frame: FrameType, event: str, _argument: Any) -> None:
        """Called by the interpreter, see sys.setprofile."""
        code = frame.f_code
        if event != "call" or (code, True) in self._seen:  # nothing new: most calls by far
            return
        if code.co_filename.startswith(PACKAGE):
            self._enter(code, frame.f_globals, self._is_on_the_way(frame))

    def _enter(self, code: CodeType, names: dict[str, Any], counts: bool) -> None:
        if (code, counts) in self._seen or code.co_name == "<module>":
            return
        self._seen.add((code, counts))
        file = code.co_filename.removeprefix(PACKAGE)
        self.entered.setdefault(file)
        if counts:
            self.on_the_way.setdefault(file)
        for name in code.co_names:  # a kernel calls other kernels where no profiler sees it
            kernel = names.get(name)
            if isinstance(kernel, Dispatcher):
                function = kernel.py_func
                self._enter(function.__code__, function.__globals__, counts)

    def _is_on_the_way(self, frame: FrameType | None) -> bool:
        looping = self.looping
        while frame is not None:
            code = frame.f_code
            if code.co_filename.startswith(PACKAGE):
                if code.co_name in ASIDE:
                    return False
                looping = looping and Path(code.co_filename).name not in LOOP
            frame = frame.f_back
        return not looping


def trace() -> Trace:
    """Loads, plans, wires and runs the short climb under the profiler."""
    found = Trace()
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory) / "climb.yaml"
        file.write_text(SCENARIO, encoding="utf-8")
        sys.setprofile(found)
        try:
            climb = stair_climb_of(prepare(load_scenario(file)))
            simulator = Simulator(climb.diagram)
            found.looping = True
            simulator.AdvanceTo(UPDATES)
        finally:
            sys.setprofile(None)
    missing = [f for _, files in STAGES for f, _ in files if f not in found.on_the_way]
    if missing:
        raise SystemExit(f"drawn, but not entered: {', '.join(missing)}")
    return found


def sentence(found: Trace) -> str:
    """What design.md says of the count."""
    drawn = sum(len(files) for _, files in STAGES)
    return (
        f"The drawing shows the {drawn} files that hand the rise on, or what follows from it. "
        f"With the files that these call, {len(found.on_the_way)} files are entered on the way. "
        f"With all else that happens until the first joint command (the robot's file is read, "
        f"the simulated world is made, monitors measure) it is {len(found.entered)}."
    )


WIDTH, ROW, TOP, GAP = 310, 46, 44, 16


def drawing() -> str:
    """The files of STAGES as SVG: a column a stage, an arrow from each file to the next."""
    rows = max(len(files) for _, files in STAGES)
    width, height = len(STAGES) * (WIDTH + GAP) + GAP, TOP + rows * ROW + 12
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" role="img">',
        "<title>The way from rise in YAML to a joint command, file by file</title>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z" fill="#57606a"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    arrow = 'stroke="#57606a" fill="none" stroke-width="1.3" marker-end="url(#tip)"'
    for column, (title, files) in enumerate(STAGES):
        x = GAP + column * (WIDTH + GAP)
        parts.append(
            f'<text x="{x}" y="26" font-size="15" font-weight="bold" fill="#24292f">{title}</text>'
        )
        for row, (file, note) in enumerate(files):
            y = TOP + row * ROW
            parts += [
                f'<rect x="{x}" y="{y}" width="{WIDTH}" height="34" rx="4" fill="#eef3f8" '
                'stroke="#8c9bab"/>',
                f'<text x="{x + 8}" y="{y + 15}" font-size="12.5" font-family="monospace" '
                f'fill="#0b3d66">{file}</text>',
                f'<text x="{x + 8}" y="{y + 29}" font-size="11.5" fill="#57606a">{note}</text>',
            ]
            if row + 1 < len(files):
                parts.append(f'<path d="M{x + 30} {y + 34}V{y + ROW - 1}" {arrow}/>')
        if column + 1 < len(STAGES):
            y, middle = TOP + (len(files) - 1) * ROW + 17, x + WIDTH + GAP // 2
            parts.append(f'<path d="M{x + WIDTH} {y}H{middle}V{TOP + 17}H{x + WIDTH + GAP - 1}" '
                         f"{arrow}/>")  # fmt: skip
    return "\n".join([*parts, "</svg>"]) + "\n"


def write_page(page: Path, found: Trace) -> None:
    """Writes the sentence between the page's markers, and the drawing beside the page."""
    text = page.read_text(encoding="utf-8")
    new, count = re.subn(
        r"(<!-- begin files -->\n).*?(<!-- end files -->)",
        lambda m: f"{m[1]}{sentence(found)}\n{m[2]}", text, flags=re.DOTALL,
    )  # fmt: skip
    if not count:
        raise SystemExit(f"{page} has no '<!-- begin files -->'")
    page.write_text(new, encoding="utf-8")
    (page.parent / "images" / "files_on_the_way.svg").write_text(drawing(), encoding="utf-8")


def main() -> None:
    """Traces, and prints or writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--page", type=Path, help="page of docs/ whose count is written anew")
    page = parser.parse_args().page
    found = trace()
    if page is None:
        print("\n".join(found.on_the_way))
        print(sentence(found))
    else:
        write_page(page, found)


if __name__ == "__main__":
    main()
