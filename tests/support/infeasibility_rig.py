"""What the tests of proofs of infeasibility share: a proof, and the independent checker."""

import copy
import importlib
import sys
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from rig import paper_robot

from drake_quad.infeasibility.boxes import ClimbClass
from drake_quad.infeasibility.proof import InfeasibilityProof, proof_record, prove_infeasible

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
HIGH, RUN, COUNT = 1.2, 0.28, 4  # [m] a rise as high as the legs of the paper's robot


@cache
def checker() -> ModuleType:
    """scripts/check_no.py as a module."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        return importlib.import_module("check_no")
    finally:
        sys.path.remove(str(SCRIPTS))


@cache
def proof() -> InfeasibilityProof:
    """The proof that the paper's robot climbs no steps of HIGH."""
    found = prove_infeasible(paper_robot(), ClimbClass(HIGH, RUN, COUNT))
    assert found is not None
    return found


@cache
def _record() -> dict[str, Any]:
    return proof_record(proof(), paper_robot())


def record() -> dict[str, Any]:
    """A copy of that proof's record."""
    return copy.deepcopy(_record())


def refusal(changed: dict[str, Any], *, hashed: bool = True) -> str | None:
    """Why the checker refuses a record; None if it accepts it.

    Args:
        changed: The record.
        hashed: Whether its hash is looked at.
    """
    check = checker().check if hashed else checker().check_content
    try:
        check(changed)
    except (checker().RefusedError, KeyError, TypeError, ValueError, IndexError) as error:
        return f"{type(error).__name__}: {error}"
    except (AttributeError, OverflowError) as error:
        return f"{type(error).__name__}: {error}"
    return None
