"""Kernels copy arrays without Numba's own assignment, which takes seconds to compile."""

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import drake_quad
from drake_quad.common import FloatArray
from drake_quad.jit import copy_matrix, copy_stack, copy_vector, jit

PACKAGE = Path(drake_quad.__file__).parent


def array_assignments(source: str) -> Iterator[str]:
    """The assignments to slices, of anything but a constant, in a module's kernels."""
    for function in ast.walk(ast.parse(source)):
        if not isinstance(function, ast.FunctionDef):
            continue
        if "jit" not in map(ast.unparse, function.decorator_list):
            continue
        for node in ast.walk(function):
            if not isinstance(node, ast.Assign | ast.AugAssign):
                continue
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            parts = [p for t in targets for p in (t.elts if isinstance(t, ast.Tuple) else [t])]
            sliced = [p for p in parts if isinstance(p, ast.Subscript) and has_slice(p.slice)]
            value = ast.unparse(node.value)
            constant = isinstance(node.value, ast.Constant) or value.isupper() or value == "np.inf"
            if sliced and not constant:
                yield ast.unparse(node)


def has_slice(index: ast.expr) -> bool:
    """Whether an index is a slice, or has one."""
    parts = index.elts if isinstance(index, ast.Tuple) else [index]
    return any(isinstance(part, ast.Slice) for part in parts)


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: path.stem)
def test_no_kernel_assigns_an_array_to_a_slice(path: Path) -> None:
    """The loop's kernels took half as long again to compile while some did."""
    text = path.read_text(encoding="utf-8")
    assert "@jit" not in text or not list(array_assignments(text))


def test_such_an_assignment_is_found() -> None:
    """The rule above can be broken: by a slice, in a row, and by adding to one."""
    for line in ("a[:] = b", "a[2:4] += b", "x, a[0, :] = (1.0, b)"):
        assert list(array_assignments(f"@jit\ndef f(a, b):\n    {line}\n")) == [line]
    assert not list(array_assignments("@jit\ndef f(a, b):\n    a[1:] = 0.0\n"))


@jit
def _copy_all(v: FloatArray, m: FloatArray, s: FloatArray, to: FloatArray) -> None:
    copy_vector(to[0, 0, 1:], v)
    copy_matrix(to[1], m)
    copy_stack(to[2:], s)


def test_copies_are_equal_and_touch_nothing_else() -> None:
    """In a kernel and as plain Python, into parts of an array as well."""
    rng = np.random.default_rng(5)
    v, m, s = rng.normal(size=2), rng.normal(size=(4, 3)), rng.normal(size=(2, 4, 3))
    found = np.zeros((4, 4, 3))
    _copy_all(v, m, s, found)
    wanted = np.zeros((4, 4, 3))
    wanted[0, 0, 1:], wanted[1], wanted[2:] = v, m, s
    assert np.array_equal(found, wanted)
