"""How fast for how much margin: the case study planned with many gaits, and the best of them.

    python scripts/speed_versus_margin.py [--margin feasible] [--physics 3] [--out docs/images]

A gait is a duty factor, a cycle time and a wait at the diagonal switches, walking and spinning
alike. Its speed is that of the walks, their transitions included; its margin the least of the whole
mission. A gait that another beats in both is left out of the front. Writes
speed_versus_margin.svg and .json.
"""

import argparse
import json
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import track

from drake_quad.errors import DrakeQuadError
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.prepare import prepare
from drake_quad.simulation.run import simulate
from drake_quad.stability.margin_kinds import HULL, KINDS

NAME = "speed_versus_margin"
DUTY = (0.75, 0.77, 0.79, 0.81, 0.83, 0.85, 0.87, 0.89, 0.91)
CYCLE = (2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 7.0, 8.0, 10.0, 12.0)  # [s]
WAIT = (0.0, 0.25, 0.5)  # [s]
QUICK: tuple[tuple[float, ...], ...] = ((0.80, 0.88), (5.0, 8.0), (0.0,))
LEAST = -0.02  # [m] of margin that is drawn
MOST = 0.25  # [m] of margin that the body's path is asked for: more than there is to be had
# Swings and waits of transitions are as long against the cycle as the case study's.
SWING, SHIFT = 1.2 / 8.0, 1.3 / 8.0
KNOWN = {
    "case_study": "shipped case study",
    "paper_physics": "Table I with waits",
    "paper": "the paper's, kinematic",
}
STYLE = {"svg.fonttype": "none", "svg.hashsalt": NAME, "font.size": 9}
Row = dict[str, Any]


def overrides(gait: Row, kind: str) -> list[str]:
    """The scenario's fields of a gait."""
    cycle = gait["cycle_time"]
    return [
        *(f"{part}.{name}={gait[name]}" for part in ("gait", "spin")
          for name in ("duty_factor", "cycle_time")),
        f"gait.switch_wait={gait['switch_wait']}",
        f"transition.swing_time={SWING * cycle:.4g}",
        f"transition.shift_time={SHIFT * cycle:.4g}",
        f"body.margin_desired={MOST}",
        f"gait.margin={kind}",
    ]  # fmt: skip


def plan(scenario: str, fields: Sequence[str]) -> Row:
    """Speed [m/s] and least margin [m] of a plan; a reason instead if there is none."""
    try:
        p = prepare(load_scenario(scenario, fields))
    except DrakeQuadError as error:
        return {"reason": str(error)}
    walks = [(t, q) for t, q in zip(p.tasks, p.plan.plans, strict=True) if t.kind == "walk"]
    bodies = [q.body.samples(np.array([0.0, q.duration]))[:, 0, :2] for _, q in walks]
    way = sum(float(((end - start) ** 2).sum() ** 0.5) for start, end in bodies)
    margins = [q.margin for q in p.plan.plans if q.margin == q.margin]
    return {"speed": way / sum(q.duration for _, q in walks), "margin": min(margins)}


def front(rows: Sequence[Row]) -> list[Row]:
    """Those that none is both quicker than and safer than, by speed."""
    best: list[Row] = []
    for row in sorted(rows, key=lambda r: (-r["speed"], -r["margin"])):
        if not best or row["margin"] > best[-1]["margin"]:
            best.append(row)
    return best[::-1]


def spread(rows: Sequence[Row], count: int) -> list[Row]:
    """So many of the rows, evenly from the slower end to the quicker."""
    step = len(rows) / max(count, 1)
    return [rows[int((k + 0.5) * step)] for k in range(min(count, len(rows)))]


def apart(rows: Sequence[Row], speed: float) -> list[Row]:
    """Those rows, from the quickest on, whose labels do not lie over one another."""
    kept: list[Row] = []
    for row in sorted(rows, key=lambda r: -r["speed"]):
        if not kept or kept[-1]["speed"] - row["speed"] >= speed:
            kept.append(row)
    return kept


def measure(row: Row, kind: str) -> Row:
    """A gait's run in physics: how it ended, and its least measured margin of that kind."""
    summary = simulate(load_scenario("case_study", overrides(row, kind))).summary
    name = "margin" if kind == HULL else f"margin_{kind}"
    return {
        "outcome": summary["outcome"],
        "reason": summary["reason"],
        "measured": summary[name]["minimum"],
        "time_under_three_feet": summary["time_under_three_feet"],
    }


def draw(rows: Sequence[Row], best: Sequence[Row], known: Sequence[Row], kind: str) -> Figure:
    """All plans light, the front bold, shipped gaits named, measured margins beside."""
    figure = Figure(figsize=(7.2, 4.4), layout="constrained")
    axis = figure.add_subplot()
    style = {"color": "#9AA5AE", "s": 12, "lw": 0, "label": "planned gaits"}
    shown = [r for r in rows if r["margin"] > LEAST]
    axis.scatter([r["margin"] for r in shown], [r["speed"] for r in shown], **style)
    axis.plot(
        [r["margin"] for r in best], [r["speed"] for r in best], "o-", color="#0068A8", ms=4.5,
        lw=1.8, label="not beaten in both",
    )  # fmt: skip
    for k, row in enumerate(known):
        at = (row["margin"], row["speed"])
        axis.plot(*at, "D", color="#B8480A", ms=6)
        away, side = (((-12, -22), "right"), ((8, -14), "left"), ((0, 10), "left"))[k]
        axis.annotate(row["name"], at, xytext=away, textcoords="offset points", color="#B8480A",
                      ha=side, bbox={"fc": "white", "ec": "none", "pad": 1.0})  # fmt: skip
    seen = [r for r in best if r.get("measured") is not None]
    for row in seen:
        axis.plot([row["margin"], row["measured"]], [row["speed"]] * 2, color="#009E73", lw=1.0)
    if seen:
        found = ([r["measured"] for r in seen], [r["speed"] for r in seen])
        axis.plot(*found, "s", color="#009E73", ms=6, label="measured in physics")
    for row in apart(best, 0.03):
        wait = f", waits {row['switch_wait']:g} s" if row["switch_wait"] else ""
        text = f"β {row['duty_factor']:g}, T {row['cycle_time']:g} s{wait}"
        at = (row["margin"], row["speed"])
        axis.annotate(text, at, xytext=(7, 4), textcoords="offset points", fontsize=7.5)
    axis.set_xlabel(f"least planned margin ({kind}) [m]")
    axis.set_ylabel("mean speed of the walks [m/s]")
    axis.set_title("The case study: how fast for how much margin", loc="left", fontsize=10)
    axis.margins(x=0.06)
    axis.set_ylim(bottom=0.0)
    axis.set_xlim(right=1.55 * max(r["margin"] for r in best))  # for the labels
    axis.axvline(0.0, color="#B0B8BF", lw=0.8)
    axis.grid(color="#E3E7EA", lw=0.6)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(frameon=False, loc="upper right")
    return figure


def study(kind: str, grid: Sequence[Sequence[float]], physics: int, console: Console) -> Row:
    """Plans all gaits of a grid, and runs some of the best."""
    gaits = list(product(*grid))
    rows = []
    for beta, cycle, wait in track(gaits, "planning", console=console):
        gait: Row = {"duty_factor": beta, "cycle_time": cycle, "switch_wait": wait}
        rows.append({**gait, **plan("case_study", overrides(gait, kind))})
    best = front([r for r in rows if "speed" in r and r["margin"] > 0.0])
    for row in track(spread(best, physics), "in physics", console=console, disable=not physics):
        row.update(measure(row, kind))
    known = [{"name": t, **plan(s, [f"gait.margin={kind}"])} for s, t in KNOWN.items()]
    return {"margin": kind, "gaits": rows, "front": best, "shipped": known}


def main(arguments: Sequence[str] | None = None) -> None:
    """Plans, runs and draws."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--margin", choices=KINDS, default=HULL, help="over what it is measured")
    parser.add_argument("--physics", type=int, default=0, metavar="K", help="of the best, to run")
    parser.add_argument("--quick", action="store_true", help="a few gaits only")
    parser.add_argument("--out", type=Path, default=Path("docs/images"), help="directory")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    grid = QUICK if options.quick else (DUTY, CYCLE, WAIT)
    found = study(options.margin, grid, options.physics, Console(stderr=True))
    stem = NAME if options.margin == HULL else f"{NAME}_{options.margin}"
    text = json.dumps(found, indent=1) + "\n"
    (options.out / f"{stem}.json").write_text(text, encoding="utf-8")
    planned = [r for r in found["gaits"] if "speed" in r]
    with matplotlib.rc_context(STYLE):
        figure = draw(planned, found["front"], found["shipped"], options.margin)
        figure.savefig(options.out / f"{stem}.svg", metadata={"Date": None})
    for row in found["front"]:
        seen = f", measured {row['measured']:.3f} m, {row['outcome']}" if "outcome" in row else ""
        print(
            f"{row['speed']:.3f} m/s, {row['margin']:.3f} m planned{seen}: "
            f"β {row['duty_factor']:g}, T {row['cycle_time']:g} s, waits {row['switch_wait']:g} s"
        )


if __name__ == "__main__":
    main()
