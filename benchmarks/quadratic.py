"""The body path's quadratic programs, recorded as planning sets them up, and their other solvers.

minimise 1/2 xᵀ P x + cᵀ x   subject to   A x = b,   h_lower <= G x,   x_lower <= x <= x_upper
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import piqp
from pydrake.solvers import ClarabelSolver, MathematicalProgram, OsqpSolver, SolverOptions
from scipy import sparse

from drake_quad.common import FloatArray

_Solver = piqp.SparseSolver  # ours, before any recording is put in its place
OSQP_TOLERANCE = 1e-5  # ours; Drake's default is far from the optimum
OSQP_ITERATIONS = 4000


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """One program, as given to the solver, with what ours found and took.

    Attributes:
        P: (n, n) Hessian.
        c: (n,).
        A: (e, n) equalities.
        b: (e,).
        G: (m, n) inequalities.
        h_lower: (m,).
        x_lower: (n,), -inf where there is no bound.
        x_upper: (n,), inf where there is none.
        x: (n,) our solution.
        seconds: Our time, set-up and solution [s].
    """

    P: sparse.csc_matrix
    c: FloatArray
    A: sparse.csc_matrix
    b: FloatArray
    G: sparse.csc_matrix
    h_lower: FloatArray
    x_lower: FloatArray
    x_upper: FloatArray
    x: FloatArray
    seconds: float

    def cost(self, x: FloatArray) -> float:
        """The objective at `x`."""
        return float(0.5 * x @ (self.P @ x) + self.c @ x)

    def violation(self, x: FloatArray) -> float:
        """The largest violation of any constraint at `x`."""
        return float(
            max(
                np.max(np.abs(self.A @ x - self.b), initial=0.0),
                np.max(self.h_lower - self.G @ x, initial=0.0),
                np.max(self.x_lower - x, initial=0.0),
                np.max(x - self.x_upper, initial=0.0),
            )
        )


class Recorder:
    """Stands in for `piqp.SparseSolver`: solves with it, and keeps the program in `recorded`."""

    recorded: ClassVar[list[QuadraticProgram]] = []

    def __init__(self) -> None:
        self._solver = _Solver()
        self.settings = self._solver.settings
        self._arguments: tuple[Any, ...] = ()
        self._seconds = 0.0

    @property
    def result(self) -> Any:
        """The solver's result."""
        return self._solver.result

    def setup(self, *arguments: Any) -> None:
        """P, c, A, b, G, h_lower, h_upper, x_lower, x_upper."""
        begun = time.perf_counter()
        self._solver.setup(*arguments)
        self._seconds = time.perf_counter() - begun
        self._arguments = arguments

    def solve(self) -> Any:
        """Solves, and records."""
        begun = time.perf_counter()
        status = self._solver.solve()
        self._seconds += time.perf_counter() - begun
        P, c, A, b, G, h_lower, _, x_lower, x_upper = self._arguments
        x = np.array(self._solver.result.x)
        self.recorded.append(
            QuadraticProgram(P, c, A, b, G, h_lower, x_lower, x_upper, x, self._seconds)
        )
        return status


def compare(programs: Sequence[QuadraticProgram], *, repeats: int = 3) -> list[dict[str, Any]]:
    """One row a solver, over all programs together: time, optimum and violation.

    The times are of set-up and solution; what translates a program into Drake's terms is left out.
    """
    rows = [_row("piqp (ours)", programs, [(p.x, p.seconds) for p in programs])]
    for name, solve, times in (
        ("Clarabel (Drake)", _solve_clarabel, repeats),
        (f"OSQP (Drake, {OSQP_TOLERANCE:g})", _solve_osqp, 1),
    ):
        found = []
        for p in programs:
            x, program = variables(p)
            answers = [solve(program) for _ in range(times)]
            result = answers[0][0]
            values = result.GetSolution(x) if result.is_success() else np.full(len(x), np.nan)
            found.append((values, float(np.median([seconds for _, seconds in answers]))))
        rows.append(_row(name, programs, found))
    fastest = rows[0]["time [ms]"]
    return [{**row, "time / ours": round(row["time [ms]"] / fastest, 2)} for row in rows]


def variables(p: QuadraticProgram) -> tuple[Any, MathematicalProgram]:
    """The program in Drake's terms, and its decision variables."""
    program = MathematicalProgram()
    x = program.NewContinuousVariables(len(p.c))
    program.AddQuadraticCost(p.P.toarray(), p.c, x, is_convex=True)
    program.AddLinearEqualityConstraint(p.A, p.b, x)
    program.AddLinearConstraint(p.G, p.h_lower, np.full(len(p.h_lower), np.inf), x)
    program.AddBoundingBoxConstraint(p.x_lower, p.x_upper, x)
    return x, program


def _solve_clarabel(program: MathematicalProgram) -> tuple[Any, float]:
    return _timed(lambda: ClarabelSolver().Solve(program))


def _solve_osqp(program: MathematicalProgram) -> tuple[Any, float]:
    options = SolverOptions()
    for name, value in (("eps_abs", OSQP_TOLERANCE), ("eps_rel", OSQP_TOLERANCE)):
        options.SetOption(OsqpSolver().solver_id(), name, value)
    options.SetOption(OsqpSolver().solver_id(), "max_iter", OSQP_ITERATIONS)
    return _timed(lambda: OsqpSolver().Solve(program, None, options))


def _timed(call: Callable[[], Any]) -> tuple[Any, float]:
    begun = time.perf_counter()
    return call(), time.perf_counter() - begun


def _row(
    name: str,
    programs: Sequence[QuadraticProgram],
    found: Sequence[tuple[FloatArray, float]],
) -> dict[str, Any]:
    pairs = [
        (p, answer)
        for p, answer in zip(programs, found, strict=True)
        if np.all(np.isfinite(answer[0]))
    ]
    excess = [(p.cost(x) - p.cost(p.x)) / max(1.0, abs(p.cost(p.x))) for p, (x, _) in pairs]
    return {
        "solver": name,
        "programs": len(programs),
        "solved": len(pairs),
        "time [ms]": round(1e3 * sum(seconds for _, seconds in found), 2),
        "cost above ours, relative": f"{max(excess, key=abs):.1e}" if excess else "-",
        "largest violation": f"{max(p.violation(x) for p, (x, _) in pairs):.1e}" if pairs else "-",
    }
